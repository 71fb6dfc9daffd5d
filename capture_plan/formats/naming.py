"""Names of blendshapes as files have them: distinguished where they are equal, and what a note says of them.

Nothing is dropped in silence: whoever renames, leaves out or sets to zero says so in the sentences made here.
"""

from collections.abc import Iterable, Mapping, Sequence

BASIS = ("basis", "base", "neutral", "default", "basic", "rest", "reference")  # what exporters call the neutral itself
LISTED = 5  # names in a note


def one_line(name: object) -> str:
    """A name as one line of text that can be shown."""
    return "".join(c if c.isprintable() else " " for c in str(name))


def listed(names: Iterable[str]) -> str:
    """The first few of the names, and how many more there are."""
    found = list(names)
    return ", ".join(found[:LISTED]) + (f" and {len(found) - LISTED} more" if len(found) > LISTED else "")


def sentences(*said: str) -> str:
    """Sentences of a note, those that say nothing left out and none said twice."""
    return "; ".join(dict.fromkeys(filter(None, said)))


def numbered(names: Sequence[str]) -> tuple[tuple[str, ...], str]:
    """The names with equal ones distinguished ("smile", "smile 2", ...), and the sentence that says so."""
    taken, found, new, next_of = set(names), {}, [], {}
    for name in names:
        unique, number = name, next_of.get(name, 2)
        while unique in found or (unique != name and unique in taken):
            unique, number = f"{name} {number}", number + 1
        found[unique], next_of[name] = None, number
        new += [unique] if unique != name else []
    return tuple(found), f"blendshapes of equal names are distinguished by a number: {listed(new)}" if new else ""


def fitting(names: Sequence[str], k: int, owner: str) -> tuple[tuple[str, ...] | None, str]:
    """The file's names of the `k` blendshapes of `owner`, None where they do not fit; and a sentence where they differ.

    One name more than there are blendshapes may be that of the neutral, which is left out.
    """
    basis = [i for i, name in enumerate(names) if name.strip().lower() in BASIS]
    if len(names) == k + 1 and basis:
        retained = (*names[: basis[0]], *names[basis[0] + 1 :])
        return retained, f"the name '{names[basis[0]]}' of {owner} is that of its neutral and was left out"
    if len(names) == k:
        return tuple(names), ""
    message = f"{len(names)} name{'s' * (len(names) != 1)} for {k} blendshape{'s' * (k != 1)}"
    return None, f"{owner} has {message}, so its names were not used: export one name for each" if k or names else ""


def left_on(weights: Mapping[str, float]) -> str:
    """A sentence about weights that the file leaves on, in parts of the full blendshape."""
    on = [f"{name} at {100 * weight:.3g} %" for name, weight in weights.items() if abs(weight) > 5e-4]
    return f"the file leaves weights on that are 0 in the neutral here: {listed(on)}" if on else ""
