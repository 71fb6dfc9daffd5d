"""Words for left and right that are too short or too common to stand alone, but are sides beside each other.

clignement_G beside clignement_D is the left one; blink_d alone, or viseme_g beside viseme_d, has no side.
"""

from collections.abc import Collection

from capture_plan.names.tokens import split_words

PAIRS = (  # left, right
    *(("g", "d"), ("ga", "dr"), ("li", "re"), ("sn", "dx"), ("sin", "des"), ("sin", "dex")),
    *(("izq", "der"), ("esq", "dir"), ("sol", "sag"), ("bal", "jobb"), ("port", "starboard"), ("л", "п")),
)


def with_sides(names: Collection[str]) -> dict[str, str]:
    """Names whose partner with the other word of a pair is there too, spelled with Left or Right at their end."""
    words = {name: split_words(name) for name in names}
    there = set(words.values())
    found: dict[str, str] = {}
    for name, own in words.items():
        for at in range(len(own) if len(own) > 1 else 0):
            for left, right in PAIRS:
                other = {left: right, right: left}.get(own[at])
                if other and (*own[:at], other, *own[at + 1 :]) in there:
                    side = "Left" if own[at] == left else "Right"
                    found.setdefault(name, " ".join((*own[:at], *own[at + 1 :], side)))
    return found
