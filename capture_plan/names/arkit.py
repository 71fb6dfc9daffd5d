"""What a blendshape's name tells: ARKit's name for it, and the side of the face.

Names are hints. They say things to people and break ties; which blendshapes are partners, geometry decides.

    arkit_name("L_eyeBlink")                 'eyeBlinkLeft'
    arkit_name("CTRL_expressions_eyeBlinkL") 'eyeBlinkLeft'
    side_of("mouthSmile_L"), side_of("jawLeft"), side_of("eyeLookLeftL")   'left', None, 'left'
    side_of("mouthSmile_viewerLeft")       'right': who looks at a face has its right side on the left
"""

import re
import tomllib
from functools import cache
from importlib.resources import files
from typing import Literal

Side = Literal["left", "right"]

WORD = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|[0-9]+")
SIDE_WORDS: dict[str, Side] = {
    "l": "left", "lf": "left", "lt": "left", "lft": "left", "left": "left",
    "r": "right", "rt": "right", "rgt": "right", "right": "right",
    "links": "left", "gauche": "left", "izquierda": "left", "izquierdo": "left", "izq": "left",
    "sinistra": "left", "sinistro": "left", "esquerda": "left", "esquerdo": "left", "esq": "left",
    "rechts": "right", "droite": "right", "droit": "right", "derecha": "right", "derecho": "right",
    "destra": "right", "destro": "right", "direita": "right", "direito": "right",
    "sx": "left", "dx": "right", "izda": "left", "izdo": "left", "dcha": "right", "dcho": "right",
    "vanster": "left", "hoger": "right", "venstre": "left", "lewe": "left", "lewy": "left", "lewa": "left",
    "prawe": "right", "prawy": "right", "prawa": "right", "vasen": "left", "oikea": "right",
}  # fmt: skip
QUADRANTS: dict[str, Side] = {"ul": "left", "dl": "left", "ur": "right", "dr": "right"}  # of the lips: mouthFunnelUL
MOVES_SIDEWAYS = re.compile(
    "look|gaze|turn|tilt|lean|shift|move|slide|swing|side(ways)?|jaw|mouth|lips|tongue|head|chin|neck"
)
UNIT = re.compile(
    r"(?:.*[:|/.])?(?:(?!(?:au|facs|l|r|left|right)[^a-z])[a-z]+[^a-z0-9]+)*"  # before the unit: mesh.face_AU12
    r"(?:(?P<before>l|r|left|right)[^a-z0-9]+)?(?:au|facs)[ _.-]*0*(?P<number>[1-9]\d?)"
    r"(?:[ _.-]*(?P<side>l|r|lf|rt|left|right|b|both))?(?:\.\d+)?",
    re.IGNORECASE,
)
INTENSITY = re.compile(r"AU\d\d_[rc]")  # OpenFace: r for regressed, c for classified, neither a side
SOUND = re.compile("viseme|phoneme|phon|vis|v")  # viseme_R is the sound
DIRECTIONS = ("jawLeft", "jawRight", "mouthLeft", "mouthRight")  # where something moves, no side of the face
ONLOOKER = re.compile(
    r"(viewer|observer|onlooker|audience|screen|image|camera|picture)s?[ _.-]*(left|right|l(?![a-z])|r(?![a-z]))",
    re.IGNORECASE,
)
FACE_WORD = re.compile("brow|eye|lid|cheek|nose|jaw|mouth|lips?|tongue|chin")


def side_of(name: str) -> Side | None:
    """The subject's side that a name tells; None where it has none or only says where something moves to."""
    known = arkit_name(name)
    if known and known not in _table():
        return "left" if known.endswith("Left") else "right"
    words = _words(name)
    if len(words) < 2 or SOUND.fullmatch(words[0]):
        return None
    sides = SIDE_WORDS | QUADRANTS
    for place in (len(words) - 1, 0, *range(1, len(words) - 1)):
        if words[place] in sides and not _is_direction(words, place):
            return sides[words[place]]
    return None


def subjects_own(name: str) -> str:
    """The name with sides as the subject has them, where it tells those of who looks on: viewerLeft is Right."""
    return ONLOOKER.sub(lambda match: "_Right" if match[2].lower().startswith("l") else "_Left", name)


def base_name(arkit: str) -> str:
    """ARKit's name without the side of the face: 'eyeBlink', but 'jawLeft', which says where the jaw moves."""
    return arkit if arkit in DIRECTIONS else arkit.removesuffix("Left").removesuffix("Right")


def arkit_name(name: str) -> str | None:
    """ARKit's own spelling of a name, with Left or Right where it has a side; None where it is not one of the 52.

    Some rigs split browInnerUp and cheekPuff: their halves are told as 'browInnerUpLeft', 'cheekPuffRight'.
    """
    known = _spellings()
    words = _words(name)
    while words and words[-1].isdigit():  # jawOpen.001
        words.pop()
    for start in range(len(words)):
        if found := known.get("".join(words[start:])):
            return found
        if FACE_WORD.fullmatch(words[start]) or words[start] in SIDE_WORDS:
            return None  # a longer name that only ends like one of the 52: jawOpen_mouthSmileLeft
    return None


@cache
def _table() -> dict[str, dict[str, str]]:
    return tomllib.loads(files("capture_plan.names").joinpath("data", "arkit.toml").read_text(encoding="utf-8"))


@cache
def _spellings() -> dict[str, str]:
    """Every accepted spelling in small letters without separators, and what ARKit calls it."""
    known: dict[str, str] = {}
    for base, entry in _table().items():
        if entry["sides"] != "both":
            known[base.lower()] = base
        if entry["sides"] != "direction":
            for word, side in SIDE_WORDS.items():
                known[base.lower() + word] = known[word + base.lower()] = base + side.capitalize()
    return known


def _words(name: str) -> list[str]:
    """Words of a name in small letters, split at separators, capitals and digits."""
    return [word.lower() for word in WORD.findall(subjects_own(name))]


def _is_direction(words: list[str], place: int) -> bool:
    """Whether 'left' at this place says where something moves: at the end, after what moves (jawLeft, eyeLookLeftL)."""
    if words[place] not in ("left", "right") or place == 0:
        return False
    rest = words[place + 1 :]
    return bool(MOVES_SIDEWAYS.fullmatch(words[place - 1])) and all(
        word in SIDE_WORDS or word.isdigit() for word in rest
    )
