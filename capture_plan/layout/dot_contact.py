"""Which dots come too near to each other when the face moves: two that touch are one to a tracker, and peel off.

Data   p[m]  where dot m stands in a pose of the rig, millimetres; D the diameter of a dot, G the least gap
Met    a pair with |p[a] - p[b]| < D + G, straight through the air: lips and lids meet that lie far apart along the skin
"""

from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np
from msgspec import Struct

from capture_plan.layout.record import Landmark
from capture_plan.rig import Rig

GAP_MM = 1.0  # skin between two dots: less is no rim that a camera of 0.3 mm a pixel tells from a dot of double width
NEUTRAL = "neutral"
Poses = Mapping[str, Mapping[str, float]]  # weights by blendshape, of poses by name
NO_POSES: Poses = MappingProxyType({})


class Meeting(Struct, frozen=True, forbid_unknown_fields=True):
    """Two dots that come nearer than a dot's diameter and `GAP_MM` in a pose; `apart_mm` is from middle to middle."""

    pose: str
    dots: tuple[str, str]
    apart_mm: float


def meetings(rig: Rig, markers: Sequence[Landmark], poses: Poses, dot_mm: float) -> tuple[Meeting, ...]:
    """All of the neutral, then of every pose in its order, the nearest first."""
    at = np.array([m.vertex for m in markers], dtype=int)
    found: list[Meeting] = []
    for name, weights in {NEUTRAL: {}, **poses}.items():
        w = np.array([weights.get(each, 0.0) for each in rig.names])
        p = rig.neutral[at] + np.tensordot(w, rig.deltas[:, at], 1)
        a, b = np.triu_indices(len(at), 1)
        apart = np.round(np.linalg.norm(p[a] - p[b], axis=1), 2)
        near = np.flatnonzero(apart < dot_mm + GAP_MM)
        nearest = near[np.argsort(apart[near], kind="stable")]
        dots = [(markers[int(i)].name, markers[int(j)].name) for i, j in zip(a[nearest], b[nearest], strict=True)]
        found += [Meeting(name, two, float(far)) for two, far in zip(dots, apart[nearest], strict=True)]
    return tuple(found)


def meeting_words(found: Sequence[Meeting], dot_mm: float, shots: Mapping[str, str]) -> str:
    """'Dots of 3 mm come near each other: shot 18 (E11) M24 and M32 2.5 mm (they overlap). …'; empty where none do.
    `shots` has the words for an expression by its name."""
    messages = [
        f"{shots.get(one.pose, one.pose)} {' and '.join(one.dots)} {one.apart_mm:.1f} mm{_how(one, dot_mm)}"
        for one in found
    ]
    if not messages:
        return ""
    return (
        f"Dots of {dot_mm:g} mm come near each other, from middle to middle: {', '.join(messages)}. "
        "Use smaller dots there, or move one of the two"
    )


def _how(one: Meeting, dot_mm: float) -> str:
    return " (they overlap)" if one.apart_mm < dot_mm else ""
