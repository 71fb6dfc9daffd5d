"""What each blendshape of a rig is: an expression of the face, or something that is planned apart and why.

Data    what moves, from geometry (`motion_kinds.py`) on the skin; the place of the face from its reading where that is
        sure; what moves no skin by what it moves instead
Apart   is listed in the audit, the plan, the sheets and the page, and takes no part in landmarks, expressions,
        importance and minutes
"""

from functools import lru_cache

import numpy as np
from jaxtyping import Float
from msgspec import Struct

from capture_plan.rig.face.reading import face_reading
from capture_plan.rig.findings import NOISE_MM, STILL_MM
from capture_plan.rig.motion_kinds import FACE_REACH, MotionKind, Sphere, motion_kinds
from capture_plan.rig.pairs import blendshape_pairs
from capture_plan.rig.record import Rig

REMEMBERED = 8  # rigs of a session
NAMED = 4  # parts of a sum that are called by their names
HEADINGS: dict[MotionKind, str] = {
    "head movement": "Head movements",
    "not of the face": "Not of the face",
    "calls others": "Mixes of others",
    "moves nothing": "Move nothing",
}
TODO: dict[MotionKind, str] = {
    "head movement": "film them with the head's own markers if the character needs them, the face relaxed",
    "not of the face": "capture or animate them without the face's markers",
    "calls others": "their parts are scanned; mix these",
    "moves nothing": "export them again, or delete them from the rig",
}


class Kind(Struct, frozen=True, forbid_unknown_fields=True):
    """What blendshape `name` is, and `why`, in words that end a sentence on it: 'turns the whole head by 31 degrees'."""

    name: str
    kind: MotionKind
    why: str


@lru_cache(maxsize=REMEMBERED)
def expression_kinds(rig: Rig) -> tuple[Kind, ...]:
    """The kind of every blendshape, in the rig's order."""
    index = {name: k for k, name in enumerate(rig.names)}
    halves = tuple((index[a], index[b]) for a, b in blendshape_pairs(rig))
    skin = rig.triangles[rig.skin[rig.triangles].all(axis=1)]
    found = motion_kinds(rig.neutral, skin, rig.deltas, face=face_sphere(rig), halves=halves)
    return tuple(_kind(rig, k, kind, found.shares[k]) for k, kind in enumerate(found.kinds))


def set_apart(kinds: tuple[Kind, ...]) -> tuple[Kind, ...]:
    """Those that are no expression of the face to scan."""
    return tuple(kind for kind in kinds if kind.kind != "face")


def apart_lines(apart: tuple[Kind, ...]) -> tuple[tuple[str, str, str], ...]:
    """(heading, names, what to do) for every kind that is planned apart, for pages and sheets."""
    lines = []
    for kind, heading in HEADINGS.items():
        names = [one.name for one in apart if one.kind == kind]
        if names:
            lines.append((heading, ", ".join(names), TODO[kind]))
    return tuple(lines)


def face_sphere(rig: Rig) -> Sphere | None:
    """Where the face is, from its eyes and mouth; None where either is in doubt."""
    reading = face_reading(rig)
    left, right, mouth = reading.eyes.left, reading.eyes.right, reading.mouth.at
    if left is None or right is None or mouth is None or not (reading.eyes.sure and reading.mouth.sure):
        return None
    eyes = np.array([left, right])
    pupils = float(np.linalg.norm(eyes[0] - eyes[1]))
    return Sphere((eyes.mean(axis=0) + np.array(mouth)) / 2, FACE_REACH * pupils)


def _kind(rig: Rig, k: int, kind: MotionKind, share: Float[np.ndarray, " k"]) -> Kind:
    name, moved = rig.names[k], rig.displacement[k]
    on_skin, off_skin = float(moved[rig.skin].max()), float(np.where(rig.skin, 0, moved).max())
    if max(on_skin, off_skin) < STILL_MM:
        return Kind(name, "moves nothing", "moves nothing: its shape is the neutral")
    if on_skin < NOISE_MM:  # less than a marker's noise is for the audit to say
        what = f"moves {part_words(rig, k)} by up to {off_skin:.1f} mm and not the skin"
        return Kind(name, "not of the face", what) if off_skin >= NOISE_MM else Kind(name, "face", "")
    why = {
        "head movement": f"moves the whole head as one, by up to {on_skin:.0f} mm",
        "not of the face": f"moves what lies off the face, by up to {on_skin:.1f} mm",
        "calls others": f"is {_sum_words(rig, share)}, which are planned themselves",
    }
    return Kind(name, kind, why[kind]) if kind in why else Kind(name, "face", "")


def part_words(rig: Rig, k: int) -> str:
    """What blendshape k moves most off the skin, in words."""
    moved = np.where(rig.skin, 0, rig.displacement[k])
    return f"'{rig.part_names[rig.parts[moved.argmax()]]}'" if len(rig.part_names) > 1 else "what is no skin"


def _sum_words(rig: Rig, share: Float[np.ndarray, " k"]) -> str:
    """'1.00 smile + 0.50 squint'."""
    parts = [i for i in np.abs(share).argsort(kind="stable")[::-1] if share[i] > 0]
    total = " + ".join(f"{share[i]:.2f} {rig.names[i]}" for i in parts[:NAMED])
    return total + (f" + {len(parts) - NAMED} more" if len(parts) > NAMED else "")
