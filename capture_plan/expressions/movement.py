"""A movement in words, from geometry alone: where, which way, how far.

Data     d[k, v] deltas, millimetres; regions of the face with their sides, the subject's own
Where    of the regions that move nearly as far as anything does, the one with the most of sum_v |d|^2; both sides where
         the weaker has at least half of the stronger. A chin that goes along as a whole is the jaw. Where none of
         these has a name, the upper or the lower face
Which    the mean of d over the region's vertices that move at least half as far as its most moved one; an axis is named
         where it has at least half of the largest component; sideways is outwards or inwards where there are two sides,
         unless both go to one side. Lids do not turn eyes outwards: they go apart. A brow whose inner end goes up
         and whose outer end down, or the reverse, is told by its ends: neither is seen in their mean
Lips     where they part, and by FURTHER than a lower lip, chin or jaw is told to go down, that is told too
How far  the largest |d| in the region
Together what several blendshapes move at one place is told once, as the sum of their deltas moves it
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from capture_plan.anatomy.regions import FaceRegions, face_regions
from capture_plan.expressions.active_sets import STILL_MM
from capture_plan.expressions.compatibility import driven
from capture_plan.expressions.lips import lips_apart
from capture_plan.once import once
from capture_plan.rig import Rig

NAMELESS = ("scalp", "neck")  # what is left over on heads that are built unlike ours
NEARLY = 0.8  # of the largest movement: what moves less may have more of the skin, and is not what one sees
JAW = ("lower lip", "chin", "jaw")
WHOLLY = 0.7  # of the largest movement goes half of a chin with its bone: 0.76 to 0.97, under a pulled lip to 0.5
LIDS = ("upper eyelid", "lower eyelid")
PAIRED = {"mouth corner", "upper eyelid", "lower eyelid", "brow", "cheek", "temple", "ear"}
OPPOSED = (("up", "down"), ("forward", "back"), ("outwards", "inwards"), ("to your left", "to your right"))
SIDE = {1: "left", -1: "right"}
PARTED_MM = 3.0  # a picture shows lips as open
FURTHER = 1.25  # times: the upper lip goes up as well
UNSEEN_MM = 0.1  # nobody sees that, and no picture shows it: it is not told beside what is seen
ENDS = 0.4  # of the end that goes further: the other goes the opposite way as clearly


@dataclass(frozen=True)
class _Movement:
    """`side` is 1 left, -1 right, 0 both or the middle; `ways` are words; `far` in millimetres. What `tilts` goes up at
    one end and down at the other."""

    region: str
    side: int
    ways: tuple[str, ...]
    far: float
    tilts: bool = False

    def __str__(self) -> str:
        far = f"{self.far:.0f}" if self.far >= 1 else f"{self.far:.1f}" if self.far >= UNSEEN_MM else "less than 0.1"
        if self.region not in PAIRED:
            place = f"your {self.region}" if self.side == 0 else f"the {SIDE[self.side]} side of your {self.region}"
        else:
            place = f"your {SIDE[self.side]} {self.region}" if self.side else f"both {self.region}s"
        return f"{place} {_and(self.ways)} by {far} mm"


def movements(rig: Rig, names: tuple[str, ...]) -> tuple[str, ...]:
    """'both brows up by 6 mm' for every place that blendshapes move; mirrored halves are told as one."""
    found = [net for group in _places(rig, names) if (net := _net(rig, group)) is not None]
    messages: list[_Movement] = []
    for movement in found:
        other = next((m for m in messages if _halves(m, movement)), None)
        if other is None:
            messages.append(movement)
        else:
            far = max(movement.far, other.far)
            messages[messages.index(other)] = replace(movement, side=0, far=far)
    opens = max((m.far for m in messages if m.region in (*JAW, "lower face") and "down" in m.ways), default=0.0)
    gap = lips_apart(rig, names) if messages else None
    parted = (f"your lips apart by {gap:.0f} mm",) if gap is not None and gap >= max(PARTED_MM, FURTHER * opens) else ()
    seen = [movement for movement in messages if movement.far >= UNSEEN_MM] or messages
    return (*(str(movement) for movement in seen), *parted)


def against(rig: Rig, name: str, names: tuple[str, ...]) -> bool:
    """Whether one of `names` moves the place of blendshape `name` the other way."""
    mine = _movement(rig, regions_of(rig), name)
    others = [_movement(rig, regions_of(rig), other) for other in names if other != name]
    return mine is not None and any(
        other is not None and _one_place(mine, other) and _opposed(mine, other) for other in others
    )


def goes_against(rig: Rig, name: str, way: str) -> bool:
    """Whether blendshape `name` moves what it moves most the other way than `way`: up, down, forward, back."""
    movement = _movement(rig, regions_of(rig), name)
    return movement is not None and any(
        way in two and not ({*two} - {way}).isdisjoint(movement.ways) for two in OPPOSED
    )


def _way(movement: _Movement, two: tuple[str, str]) -> int:
    """1 or -1 for the first or second of two opposed ways; 0 where a movement has neither."""
    return (two[0] in movement.ways) - (two[1] in movement.ways)


def _one_place(a: _Movement, b: _Movement) -> bool:
    """Whether two movements are seen at one place: of left and right each is its own; a lip that goes up is one with
    the jaw that takes it down.
    """
    jaw = "jaw" in (a.region, b.region) and {a.region, b.region} <= {"jaw", *JAW} and _opposed(a, b)
    return (a.region == b.region or jaw) and (a.side == b.side or a.side * b.side == 0)


def _opposed(a: _Movement, b: _Movement) -> bool:
    """Whether two movements go opposite ways, or one tilts what the other moves as a whole: seen is their sum."""
    return a.tilts != b.tilts or any(_way(a, two) * _way(b, two) < 0 for two in OPPOSED)


def _places(rig: Rig, names: tuple[str, ...]) -> list[list[tuple[str, _Movement]]]:
    """The blendshapes that move the skin with their movements, in groups that are seen at one place."""
    groups: list[list[tuple[str, _Movement]]] = []
    for name in names:
        movement = _movement(rig, regions_of(rig), name)
        if movement is None:
            continue
        near = [group for group in groups if any(_one_place(movement, other) for _, other in group)]
        merged = [*(one for group in near for one in group), (name, movement)]
        at = min((groups.index(group) for group in near), default=len(groups))
        groups = [group for group in groups if group not in near]
        groups.insert(at, merged)
    return groups


def _net(rig: Rig, group: list[tuple[str, _Movement]]) -> _Movement | None:
    """How blendshapes that are seen at one place move it together; None where their sum leaves it still."""
    first, movement = max(group, key=lambda one: one[1].far)
    if len(group) == 1:
        return movement
    regions = regions_of(rig)
    names = tuple(dict.fromkeys(each for name, _ in group for each in (name, *_bases(rig, name))))
    deltas = rig.deltas[rig.rows(names)].sum(axis=0)
    region = movement.region
    _, here = _place(rig, regions, *_moved(rig, first))
    length = np.where(rig.skin, np.linalg.norm(deltas, axis=1), 0)
    return _at(regions, region, here, length, deltas) if length[here].max() > STILL_MM else None


@once
def regions_of(rig: Rig) -> FaceRegions:
    """The regions of a rig, found once: every sentence asks for them."""
    return face_regions(rig)


def _halves(a: _Movement, b: _Movement) -> bool:
    """Whether two movements are one on both sides; eyelids that go to either side are two looks, never one."""
    looks = a.region in LIDS and {"outwards", "inwards"} & set(a.ways)
    return a.region == b.region and a.ways == b.ways and a.side * b.side == -1 and not looks


def _movement(rig: Rig, regions: FaceRegions, name: str) -> _Movement | None:
    length, deltas = _moved(rig, name)
    if length.max() <= STILL_MM or not regions.known:
        return None
    region, here = _place(rig, regions, length, deltas)
    return _at(regions, region, here, length, deltas)


def _moved(rig: Rig, name: str) -> tuple[Float[np.ndarray, " v"], Float[np.ndarray, "v 3"]]:
    """How far the skin goes under a blendshape and what is held besides, and its deltas."""
    deltas = rig.deltas[rig.rows((name, *_bases(rig, name)))].sum(axis=0)
    return np.where(rig.skin, np.linalg.norm(deltas, axis=1), 0), deltas


def _at(
    regions: FaceRegions,
    region: str,
    here: Bool[np.ndarray, " v"],
    length: Float[np.ndarray, " v"],
    deltas: Float[np.ndarray, "v 3"],
) -> _Movement:
    """The movement of a place whose vertices are `here`."""
    left, _, right = (float((length[here & (regions.side == side)] ** 2).sum()) for side in (1, 0, -1))
    side = 0 if min(left, right) >= max(left, right) / 2 else int(np.sign(left - right))
    if side:
        here = here & (regions.side == side)
    far = length[here].max()
    moved = here & (length >= far / 2)
    two = side == 0 and region in PAIRED
    outwards = deltas[moved, 0] * regions.side[moved] if side or two else deltas[moved, 0]
    one_way = two and abs(deltas[moved, 0].mean()) > abs(outwards.mean())
    mean = np.array([deltas[moved, 0].mean() if one_way else outwards.mean(), *deltas[moved, 1:].mean(axis=0)])
    ways = _ways(mean, (bool(side) or two) and not one_way)
    if region in LIDS and side == 0:
        ways = tuple({"outwards": "apart", "inwards": "together"}.get(way, way) for way in ways)
    ends = _by_ends(regions, moved, deltas) if region == "brow" else ()
    return _Movement(region, side, ends or ways, float(far), bool(ends))


def _by_ends(regions: FaceRegions, moved: Bool[np.ndarray, " v"], deltas: Float[np.ndarray, "v 3"]) -> tuple[str, ...]:
    """Which way the inner and the outer ends of brows go, where these ways are opposite; nothing where not."""
    aside, up = regions.aside[moved], deltas[moved, 1]
    middle = (aside.min() + aside.max()) / 2
    if not (aside < middle).any() or not (aside > middle).any():
        return ()
    inner, outer = float(up[aside < middle].mean()), float(up[aside > middle].mean())
    if inner * outer >= 0 or min(abs(inner), abs(outer)) < ENDS * max(abs(inner), abs(outer)):
        return ()
    words = ("up", "down") if inner > 0 else ("down", "up")
    return (f"{words[0]} at the inner end", f"{words[1]} at the outer end")


def _bases(rig: Rig, name: str) -> tuple[str, ...]:
    """What is held besides: a corrective moves nothing by itself."""
    return tuple(base for of, base in _drivers(rig) if of == name)


@once
def _drivers(rig: Rig) -> tuple[tuple[str, str], ...]:
    return driven(rig, rig.names)


def _place(
    rig: Rig, regions: FaceRegions, length: Float[np.ndarray, " v"], deltas: Float[np.ndarray, "v 3"]
) -> tuple[str, Bool[np.ndarray, " v"]]:
    """The name of the place that a movement is seen at, and its vertices."""
    each = [(regions.of_vertex == r) & rig.skin for r in range(len(regions.names))]
    named = [
        (float((length[at] ** 2).sum()), name, at)
        for name, at in zip(regions.names, each, strict=True)
        if name not in NAMELESS and at.any() and length[at].max() >= NEARLY * length.max()
    ]
    chin = each[regions.names.index("chin")]
    lifted = deltas[chin, 1].sum() > length[chin].sum() / 2  # by the lip: a jaw at rest goes no further up
    if chin.any() and float(np.median(length[chin])) >= WHOLLY * length.max() and not lifted:
        return "jaw", np.isin(regions.of_vertex, [regions.names.index(name) for name in JAW]) & rig.skin
    if named:
        _, name, at = max(named, key=lambda place: place[0])
        return name, at
    eyes, mouth = (regions.anchors.eye_left + regions.anchors.eye_right) / 2, regions.anchors.mouth
    lower = rig.neutral[:, 1] < (eyes[1] + mouth[1]) / 2
    below = bool(lower[length.argmax()])
    return ("lower face" if below else "upper face"), rig.skin & (lower if below else ~lower)


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
