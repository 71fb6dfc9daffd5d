"""What to correct where a rig was understood wrongly, by what the person stated when the plan was made.

Stated  the options that the plan keeps of the command that made it: --up, --facing, --unit-mm, --skin, --names
Better  options and values for which the face makes sense, where they are known: a stated option that differs is wrong,
        and is to be left out or changed; one that agrees is not mentioned
As long as it is known how the head should lie and it does not lie so, every failing question that rests on the axes
(left and right, eyes and mouth too) has that one correction.
"""

from collections.abc import Sequence

from capture_plan.face.sense import Sense
from capture_plan.plan.claims import CHANGED
from capture_plan.plan.record import RigReference
from capture_plan.rig import Rig

PICTURE = "`capture-plan audit RIG -o audit.png`"
AXES, ON_AXES = ("--up", "--facing"), ("axes", "sides", "regions")


def corrections(given: RigReference, rig: Rig, senses: Sequence[Sense]) -> list[str]:
    """What to correct, for each question; nothing where it holds."""
    lies = next((sense for sense in senses if sense.about == "axes" and sense.better and not sense.holds), None)
    messages = [lies if lies and sense.about in ON_AXES else sense for sense in senses]
    return ["" if sense.holds else correction(given, rig, one) for sense, one in zip(senses, messages, strict=True)]


def correction(given: RigReference, rig: Rig, sense: Sense) -> str:
    """What to correct where a question fails."""
    if sense.better:
        return _known(given, rig, dict(sense.better))
    if sense.about == "axes":
        return f"look at {PICTURE}: if the head does not stand in it and face you, {_again(given, AXES)}"
    if sense.about == "sides":
        return (
            f"exchange left and right in these names (`capture-plan audit RIG` lists them), or {say_names(given)}; if "
            f"{PICTURE} shows the head from behind, leave the names and {_again(given, ('--facing',))}"
        )
    if sense.about == "size":
        return f"{_taken(given, rig)}: {_again(given, ('--unit-mm',))}"
    if sense.about == "regions":
        return (
            f"eyes or mouth were taken for something else: look at {PICTURE} for where they were found, and "
            f"{_again(given, (*AXES, '--skin'))}"
        )
    return CHANGED


def say_names(given: RigReference) -> str:
    """Where to say what blendshapes are: in the name map of this plan, if it has one."""
    if given.names:
        return f"correct what {given.names} (--names of this plan) says of them"
    return "say in a file for --names what they are"


def stated(given: RigReference) -> dict[str, str]:
    """Options that the person gave when the plan was made, and their values as they are typed."""
    values = {"--up": given.up, "--facing": given.facing, "--skin": given.skin, "--names": given.names}
    values["--unit-mm"] = None if given.unit_mm is None else f"{given.unit_mm:g}"
    return {option: value for option, value in values.items() if value is not None}


def _known(given: RigReference, rig: Rig, better: dict[str, str]) -> str:
    """The correction where the right values are known."""
    wrong = {option: value for option, value in stated(given).items() if better.get(option, value) != value}
    if wrong:
        right = {option: better[option] for option in wrong}
        return f"this plan was made with {_typed(wrong)}: plan again without {_it(wrong)}, or with {_typed(right)}"
    taken = _taken(given, rig) if "--unit-mm" in better else f"it was read with {rig.up} up and {rig.facing} forward"
    return f"{taken}: plan again with {_typed(better)}"


def _again(given: RigReference, options: tuple[str, ...]) -> str:
    """'plan again with ...', or without what was stated, where nobody knows the right values."""
    mine = {option: value for option, value in stated(given).items() if option in options}
    if mine:
        return f"plan again without {_typed(mine)}, with which this plan was made, or with {_others(mine)}"
    return f"plan again with {' or '.join([', '.join(options[:-1]), options[-1]] if options[1:] else options)}"


def _taken(given: RigReference, rig: Rig) -> str:
    whose = "stated" if given.unit_mm is not None else "taken"
    return f"one unit of the file was {whose} as {rig.unit_mm:g} mm"


def _typed(options: dict[str, str]) -> str:
    return " ".join(f"{option} {value}" for option, value in options.items())


def _it(options: dict[str, str]) -> str:
    return "it" if len(options) == 1 else "them"


def _others(options: dict[str, str]) -> str:
    return "another value" if len(options) == 1 else "other values"
