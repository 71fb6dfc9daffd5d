"""Letters on paper: which font has them, and what is written where no font has: the meaning, never an empty box.

A line is split into runs, each in the first face that has its letters: Roboto, then the fonts of Japanese, Chinese and
Korean names. A name in a script that none of them has, such as Thai or Arabic, is written as what it means; where
nobody knows that, as "(name in Thai script, No. 12)", its place in the rig.

    runs("blink まばたき")            ("sans", "blink "), ("japanese", "まばたき")
    Labels(rig.names)("ยิ้ม: 12 mm")    "smile: 12 mm"
"""

import unicodedata
from collections import Counter
from collections.abc import Sequence
from functools import cache
from importlib.resources import files
from itertools import groupby

from fontTools.ttLib import TTFont

from capture_plan.names.movements import movement_of, movements_of, said_of

SANS = "sans"
FONTS = {  # the first one is the face of the house
    SANS: "Roboto-Regular.ttf",
    "japanese": "NotoSansJP-Regular.ttf",
    "chinese": "NotoSansSC-Regular.ttf",
    "korean": "NotoSansKR-Regular.ttf",
}
INVISIBLE = frozenset(("Cc", "Cf", "Zl", "Zp", "Zs"))  # categories of signs that show nothing


def font_path(file: str) -> str:
    """Where a font of the house lies."""
    return str(files("capture_plan.sheets").joinpath("fonts", file))


def font_runs(text: str) -> list[tuple[str, str]]:
    """(face, letters) from left to right; letters that no face has are in the house's own."""
    if text.isascii():
        return [(SANS, text)] if text else []
    faces = ((face_with(letter) or SANS, letter) for letter in text)
    return [(face, "".join(letter for _, letter in some)) for face, some in groupby(faces, lambda one: one[0])]


def face_with(letter: str) -> str | None:
    """The first face that has a letter; None where none has."""
    return next((face for face in FONTS if ord(letter) in _letters(face)), None)


def with_known_glyphs(text: str) -> str:
    """One line of letters that some face has; what none has is told by its meaning or its script."""
    if text.isascii() and text.isprintable():
        return text
    plain = "".join(letter if letter.isprintable() else " " for letter in unicodedata.normalize("NFC", text))
    if all(face_with(letter) for letter in plain):
        return plain
    message = groupby(_with_marks(plain), lambda one: one[1])
    return "".join("".join(letter for letter, _ in some) if known else _in_words(list(some)) for known, some in message)


class Labels:
    """What is written for the names of one rig: each name that cannot be printed by its meaning and its number."""

    def __init__(self, names: Sequence[str] = ()) -> None:
        odd = [k for k, name in enumerate(names) if not _is_printable(name)]
        message = movements_of(names) if odd else ()
        words = {k: said_of(found) if (found := message[k]) else None for k in odd}
        often = Counter(words.values())
        self._labels = {
            names[k]: (said if often[said] == 1 else f"{said} (No. {k + 1})")
            if (said := words[k])
            else f"(name in {script_of(names[k])} script, No. {k + 1})"
            for k in sorted(odd, key=lambda k: -len(names[k]))
        }

    def __call__(self, text: str) -> str:
        """`text` with every name of the rig, and whatever else no face has, written so that it can be printed."""
        if _is_printable(text):
            return with_known_glyphs(text)
        for name, label in self._labels.items():
            text = text.replace(name, label)
        return with_known_glyphs(text)


def script_of(text: str) -> str:
    """The script of the first letter that no face has, in English: 'Thai', 'Arabic'."""
    for letter in text:
        name = unicodedata.name(letter, "")
        if not face_with(letter) and name and unicodedata.category(letter).startswith("L"):
            return "Chinese" if name.startswith("CJK") else name.split()[0].capitalize()
    return "an unknown"


def _is_printable(text: str) -> bool:
    return text.isascii() or all(
        face_with(letter) or not letter.isprintable() for letter in unicodedata.normalize("NFC", text)
    )


def _with_marks(text: str) -> list[tuple[str, bool]]:
    """Every letter and whether it can be printed; a mark or a space between letters that cannot goes with them."""
    known = [bool(face_with(letter)) for letter in text]
    for at in range(1, len(text) - 1):
        if text[at] == " " and not known[at - 1] and not known[at + 1]:
            known[at] = False
    return list(zip(text, known, strict=True))


def _in_words(some: list[tuple[str, bool]]) -> str:
    """What is written for letters that no face has."""
    run = "".join(letter for letter, _ in some)
    if (found := movement_of(run)) is not None:
        return said_of(found)
    if all(unicodedata.category(letter) in INVISIBLE for letter in run):
        return ""
    script = script_of(run)
    if script == "Chinese":
        return "".join(f"(U+{ord(letter):X})" for letter in run)
    return "(sign)" if script == "an unknown" else f"({script} script)"


@cache
def _letters(face: str) -> frozenset[int]:
    """The letters of a face, as numbers."""
    return frozenset(TTFont(font_path(FONTS[face]), lazy=True).getBestCmap() or ())
