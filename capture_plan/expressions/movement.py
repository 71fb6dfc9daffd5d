"""A movement in words, from geometry alone: where, which way, how far.

Data     d[k, v] deltas, millimetres; regions of the face with their sides, the subject's own
Where    the region and side with the most of sum_v |d|^2; both sides where the weaker has at least half of the stronger
Which    the mean of d over the region's vertices that move at least half as far as its most moved one; an axis is named
         where it has at least half of the largest component; sideways is outwards or inwards where there are two sides
How far  the largest |d| in the region
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from capture_plan.expressions.active import STILL_MM
from capture_plan.rig import Rig
from capture_plan.rig.anchors import REMEMBERED
from capture_plan.rig.regions import FaceRegions, face_regions

NAMELESS = ("scalp", "neck")  # what is left over on heads that are built unlike ours: the picture says it better
PAIRED = {"mouth corner", "upper eyelid", "lower eyelid", "brow", "cheek", "temple", "ear"}
SIDE = {1: "left", -1: "right"}


@dataclass(frozen=True)
class Movement:
    """`side` is 1 left, -1 right, 0 both or the middle; `ways` are words; `far` in millimetres."""

    region: str
    side: int
    ways: tuple[str, ...]
    far: float

    def __str__(self) -> str:
        far = f"{self.far:.0f}" if self.far >= 1 else f"{self.far:.1f}"
        if self.region not in PAIRED:
            place = f"your {self.region}" if self.side == 0 else f"the {SIDE[self.side]} side of your {self.region}"
        else:
            place = f"your {SIDE[self.side]} {self.region}" if self.side else f"both {self.region}s"
        return f"{place} {_and(self.ways)} by {far} mm"


def movements(rig: Rig, names: tuple[str, ...]) -> tuple[str, ...]:
    """'both brows up by 6 mm' for every blendshape whose place has a name; mirrored halves are told as one."""
    regions = regions_of(rig)
    found = [movement for name in names if (movement := _movement(rig, regions, name)) is not None]
    told: list[Movement] = []
    for movement in found:
        other = next((m for m in told if _halves(m, movement)), None)
        if other is None:
            told.append(movement)
        else:
            far = max(movement.far, other.far)
            told[told.index(other)] = Movement(movement.region, 0, movement.ways, far)
    return tuple(str(movement) for movement in told)


@lru_cache(maxsize=REMEMBERED)
def regions_of(rig: Rig) -> FaceRegions:
    """The regions of a rig, found once: every sentence asks for them."""
    return face_regions(rig)


def _halves(a: Movement, b: Movement) -> bool:
    return a.region == b.region and a.ways == b.ways and a.side * b.side == -1


def _movement(rig: Rig, regions: FaceRegions, name: str) -> Movement | None:
    deltas = rig.deltas[rig.names.index(name)]
    length = np.where(rig.skin, np.linalg.norm(deltas, axis=1), 0)
    if length.max() <= STILL_MM or not regions.known:
        return None
    energy = np.array([[_energy(length, regions, r, side) for side in (1, 0, -1)] for r in range(len(regions.names))])
    region = int(energy.sum(axis=1).argmax())
    left, _, right = energy[region]
    side = 0 if min(left, right) >= max(left, right) / 2 else int(np.sign(left - right))
    here = regions.of_vertex == region
    if side:
        here &= regions.side == side
    if regions.names[region] in NAMELESS:
        return None
    far = length[here].max()
    moved = here & (length >= far / 2)
    two = side == 0 and regions.names[region] in PAIRED
    outwards = deltas[moved, 0] * regions.side[moved] if side or two else deltas[moved, 0]
    mean = np.array([outwards.mean(), *deltas[moved, 1:].mean(axis=0)])
    return Movement(regions.names[region], side, _ways(mean, bool(side) or two), float(far))


def _energy(length: np.ndarray, regions: FaceRegions, region: int, side: int) -> float:
    return float((length[(regions.of_vertex == region) & (regions.side == side)] ** 2).sum())


def _ways(mean: np.ndarray, sided: bool) -> tuple[str, ...]:
    words = (
        ("outwards", "inwards") if sided else ("to your left", "to your right"),
        ("up", "down"),
        ("forward", "back"),
    )
    named = np.abs(mean) >= np.abs(mean).max() / 2
    return tuple(words[axis][int(mean[axis] < 0)] for axis in (1, 0, 2) if named[axis])


def _and(words: tuple[str, ...]) -> str:
    return " and ".join(words)
