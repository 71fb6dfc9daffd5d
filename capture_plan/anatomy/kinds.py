"""What each blendshape of a rig is: an expression of the face, or something that is planned apart and why.

Data    what moves, from geometry (`motion_kinds.py`) on the skin; the place of the face from its reading where that is
        sure; what moves no skin by what it moves instead
Apart   is listed in the audit, the plan, the sheets and the page, and takes no part in landmarks, expressions,
        importance and minutes
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Float
from msgspec import Struct

from capture_plan.anatomy.blendshape_pairs import blendshape_pairs
from capture_plan.anatomy.delta_relations import SAME, STILL_MM
from capture_plan.anatomy.motion_kinds import FACE_EXTENT, MotionKind, motion_kinds
from capture_plan.anatomy.whole_head import Sphere
from capture_plan.face.flying import flying
from capture_plan.face.misexported import misexported
from capture_plan.face.moving import NOISE_MM
from capture_plan.face.reading import face_reading
from capture_plan.names.movements import movements_of
from capture_plan.once import once
from capture_plan.rig import Rig

NAMED = 4  # parts of a sum that are called by their names
HEADINGS: dict[MotionKind, str] = {
    "head movement": "Head movements",
    "not of the face": "Not of the face",
    "calls others": "Mixes of others",
    "moves nothing": "Move nothing",
    "exported wrongly": "Exported wrongly",
}
TODO: dict[MotionKind, str] = {
    "head movement": "film them with the head's own markers if the character needs them, the face relaxed",
    "not of the face": "capture or animate them without the face's markers",
    "calls others": "their parts are scanned; mix these",
    "moves nothing": "export them again, or delete them from the rig",
    "exported wrongly": "export them again as the audit says",
}


SAYS: dict[str, MotionKind] = {
    "head turn": "head movement",
    "body": "not of the face",
    "hair or clothes": "not of the face",
    "hide or shrink": "not of the face",
    "teeth": "not of the face",
    "pupil": "not of the face",
}
PLAINLY = 0.75  # confidence of a name
DRAGGED = 0.3  # of the largest motion: the scalp under a hat that is hidden; lids under an eye that turns have 0.2


class Kind(Struct, frozen=True, forbid_unknown_fields=True):
    """What blendshape `name` is, and `why` as the rest of a sentence: 'moves the whole head as one'."""

    name: str
    kind: MotionKind
    why: str


@once
def expression_kinds(rig: Rig) -> tuple[Kind, ...]:
    """The kind of every blendshape, in the rig's order."""
    kinds = {one.name: Kind(one.name, "exported wrongly", one.why) for one in misexported(rig)}
    rows = [k for k, name in enumerate(rig.names) if name not in kinds]
    if rows:
        right = replace(rig, names=tuple(rig.names[k] for k in rows), deltas=rig.deltas[rows]) if kinds else rig
        kinds |= {one.name: one for one in _kinds(right)}
    return tuple(kinds[name] for name in rig.names)


def _kinds(rig: Rig) -> list[Kind]:
    """The kinds of blendshapes that were exported as they should be."""
    index = {name: k for k, name in enumerate(rig.names)}
    halves = tuple((index[a], index[b]) for a, b in blendshape_pairs(rig))
    skin = rig.triangles[rig.skin[rig.triangles].all(axis=1)]
    said, seen = _called(rig), rig.displacement[:, rig.skin].max(axis=1) >= NOISE_MM
    planned = seen & ~flying(rig.neutral, rig.triangles, rig.deltas)
    face = face_sphere(rig)
    found = motion_kinds(rig.neutral, skin, rig.deltas, face=face, halves=halves, called=said, planned=planned)
    return [_kind(rig, k, kind, said[k], found.shares[k]) for k, kind in enumerate(found.kinds)]


def _called(rig: Rig) -> tuple[MotionKind | None, ...]:
    """What the names say of what moves, where they say it plainly."""
    message = movements_of([dict(rig.meanings).get(name, name) for name in rig.names])
    return tuple(SAYS.get(one.kind) if one is not None and one.confidence >= PLAINLY else None for one in message)


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
    return Sphere((eyes.mean(axis=0) + np.array(mouth)) / 2, FACE_EXTENT * pupils)


def _kind(rig: Rig, k: int, kind: MotionKind, said: MotionKind | None, share: Float[np.ndarray, " k"]) -> Kind:
    name, moved = rig.names[k], rig.displacement[k]
    on_skin, off_skin = float(moved[rig.skin].max()), float(np.where(rig.skin, 0, moved).max())
    if max(on_skin, off_skin) < STILL_MM:
        return Kind(name, "moves nothing", "moves nothing: its shape is the neutral")
    dragged = DRAGGED * off_skin if said == "not of the face" else NOISE_MM
    if on_skin < max(dragged, NOISE_MM) and off_skin >= NOISE_MM:
        skin = f"by {on_skin:.1f} mm" if on_skin >= NOISE_MM else "not"
        return Kind(name, "not of the face", f"moves {part_words(rig, k)} by up to {off_skin:.1f} mm, the skin {skin}")
    why = {
        "head movement": f"moves the whole head as one, by up to {on_skin:.0f} mm",
        "not of the face": f"moves what lies off the face, by up to {on_skin:.1f} mm",
        "calls others": f"is {_sum_words(rig, share)}, which are planned themselves",
    }
    if kind not in why or on_skin < NOISE_MM:  # less than a marker's noise is for the audit to say
        return Kind(name, "face", "")
    return Kind(name, kind, why[kind])


def part_words(rig: Rig, k: int) -> str:
    """What blendshape k moves most off the skin, in words."""
    moved = np.where(rig.skin, 0, rig.displacement[k])
    return f"'{rig.part_names[rig.parts[moved.argmax()]]}'" if len(rig.part_names) > 1 else "what is no skin"


def _sum_words(rig: Rig, share: Float[np.ndarray, " k"]) -> str:
    """'1.00 smile + 0.50 squint'; a part that is there twice goes by the one that is planned, the first."""
    parts = [i for i in np.abs(share).argsort(kind="stable")[::-1] if share[i] > 0]
    planned = [_first_alike(rig, int(i)) for i in parts[:NAMED]]
    total = " + ".join(f"{share[i] * times:.2f} {rig.names[j]}" for i, (j, times) in zip(parts, planned, strict=False))
    return total + (f" + {len(parts) - NAMED} more" if len(parts) > NAMED else "")


def _first_alike(rig: Rig, k: int) -> tuple[int, float]:
    """The first blendshape that moves the skin as k does, and how many times of it k is."""
    d = rig.deltas[: k + 1][:, rig.skin].reshape(k + 1, -1).astype(float)
    length = np.linalg.norm(d, axis=1)
    cosine = d @ d[k] / np.maximum(length * length[k], np.finfo(float).tiny)
    first = int(np.flatnonzero(cosine >= 1 - SAME)[0]) if length[k] else k
    return first, float(length[k] / length[first]) if length[k] else 1.0
