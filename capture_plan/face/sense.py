"""Whether a reading makes sense: what moves, and where, asked again without the reading itself.

Every question is asked of the rig as it was read (+y up, facing +z, the subject's left +x) and answered by motion and
shape alone, so that a head that was read lying, upside down, from behind or mirrored contradicts itself, whoever said
how it lies. A question without evidence is not asked. `sense_size.py` asks for the size.

Data     C[k] centre and D[k] direction of what blendshape k moves (`channels.py`); kinds by the names
Above    C of blinks above C of the mouth, brows above both, the nose above the mouth: within UPRIGHT of straight up
Jaw      D of its opening points down, and never forward; where names contradict each other about sides, of what a
         person says or what moves most besides being called so
Skin     of what moves most, more looks forward than up, down or back
Sides    the face mirrors itself across x; what is called left moves +x
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float
from scipy.spatial import KDTree

from capture_plan.face.axes import axes_matrix, decide, vector
from capture_plan.face.channels import Channels
from capture_plan.face.of_rig import rig_channels, rig_shape
from capture_plan.face.reading import face_reading
from capture_plan.face.votes import BROWS, EYES, MOUTH, all_votes, names_agree
from capture_plan.mesh import vertex_areas, vertex_normals
from capture_plan.mesh.mirror import mirror_plane
from capture_plan.names.movements import Movement, movements_of
from capture_plan.once import once
from capture_plan.rig import Rig

UPRIGHT = 0.6  # cosine: 53 degrees; eyes over mouth of a fox's snout 0.9, of human heads above 0.95
JAW_DOWN, JAW_FORWARD = -0.3, 0.4  # of a direction of length 1: four human jaws open (-0.6 to -0.8, -0.6 to -0.8)
LOOKS = 0.25  # least part of a normal along a way for the skin to look that way
MOST = 0.3  # share of the largest displacement: what moves most
FRONT_SHARE = 0.5  # of the markers or the skin: human heads and a fox have 0.69 to 0.85, one that lies 0.16
ONE_SIDED = 0.3  # of the face's size: centres nearer to the middle have no side
CROOKED, CROOKED_MM = 1.5, 0.5  # times as far from the mirror image across x as across the best axis, and no less
RIM_MM = 2.0  # farther than that from every mirror image a face has no sides that could be told by it
CONTRADICTED = 2  # questions about how the head lies that a reading may not fail and still be believed
WAYS = {
    "forward": np.array([0.0, 0.0, 1.0]),
    "back": np.array([0.0, 0.0, -1.0]),
    "up": np.array([0.0, 1.0, 0.0]),
    "down": np.array([0.0, -1.0, 0.0]),
}
Topic = Literal["axes", "sides", "size", "regions", "plan"]


@dataclass(frozen=True)
class Sense:
    """One question put to a reading: `what` should hold, whether it does, what was `found`.

    `about` is what to correct where it does not hold: how the head lies, left and right, the unit, what was taken for
    eyes and mouth, or the plan itself. `better` are options and values that would make it hold, where they are known.
    """

    what: str
    holds: bool
    found: str
    about: Topic
    better: tuple[tuple[str, str], ...] = ()


def pose_senses(rig: Rig) -> tuple[Sense, ...]:
    """Every question about how the head lies that this rig has evidence for."""
    channels, kinds = rig_channels(rig), kinds_of(rig)
    named = (*(_above(channels, kinds) if names_agree(channels) else ()), *_jaw(channels, kinds, _opening(rig)))
    shown = (*_points_above(rig), *looks_forward(rig, moving_most(rig), "moving skin"), *_mirrored(rig))
    return (*_voted(rig), *named, *shown)


@once
def contradicted(rig: Rig) -> tuple[str, ...]:
    """What speaks against how the head was read to lie, in words: none where all but one question hold."""
    wrong = [sense.found for sense in pose_senses(rig) if not sense.holds]
    return tuple(wrong) if len(wrong) >= CONTRADICTED else ()


def kinds_of(rig: Rig) -> tuple[Movement | None, ...]:
    """What every blendshape is by its name or by what the user's own map says of it."""
    mine = dict(rig.meanings)
    return movements_of(tuple(mine.get(name, name) for name in rig.names))


def rows_of(channels: Channels, kinds: tuple[Movement | None, ...], wanted: tuple[str, ...]) -> list[int]:
    """Blendshapes of the face whose kind is one of these."""
    return [k for k, kind in enumerate(kinds) if kind and kind.kind in wanted and channels.weight[k] > 0]


def moving_most(rig: Rig) -> Bool[np.ndarray, " v"]:
    """Skin that moves at least MOST of the largest displacement of the face."""
    facial = rig_channels(rig).facial
    length = np.where(rig.skin, rig.displacement[facial].max(axis=0), 0)
    return length >= MOST * length.max()


def looks_forward(rig: Rig, which: Bool[np.ndarray, " v"], words: str) -> list[Sense]:
    """Whether most of some vertices look forward, and more than up, down or back."""
    if not which.any():
        return []
    normals = outward(rig)[which]
    share = {way: float((normals @ axis > LOOKS).mean()) for way, axis in WAYS.items()}
    most = max(share, key=lambda way: share[way])
    looks, seen = ("look", "are") if words.endswith("s") else ("looks", "is")
    found = f"{share['forward']:.0%} of {words} {looks} forward" + (f", {share[most]:.0%} {most}" * (most != "forward"))
    holds = share["forward"] >= FRONT_SHARE and most == "forward"
    return [Sense(f"most of {words} {seen} seen from the front", holds, found, "axes")]


def outward(rig: Rig) -> Float[np.ndarray, "v 3"]:
    """Normals of the neutral, away from its middle on the whole, whichever way the triangles wind."""
    skin = rig.triangles[rig.skin[rig.triangles].all(axis=1)]
    n, a = vertex_normals(rig.neutral, skin), vertex_areas(rig.neutral, skin)
    away = rig.neutral - a @ rig.neutral / max(float(a.sum()), 1e-12)
    return n * (1.0 if np.einsum("v,vx,vx->", a, n, away) >= 0 else -1.0)


def _voted(rig: Rig) -> Iterator[Sense]:
    """All signs together, asked again in the rig's axes, speak for up and forward as they were read."""
    shape = rig_shape(rig)
    votes = all_votes(shape, int(np.argmax(shape.mirror)))
    said = decide(votes, shape.mirror, stated=None, speaking=int(shape.channels.facial.sum()))
    right = (said.up, said.facing) == ("+y", "+z")
    if not (right or said.sure):
        return
    up, facing = (_axis_in_file(rig, axis) for axis in (said.up, said.facing))
    strongest = ", ".join(sign.name for sign in sorted(said.signs, key=lambda sign: -sign.weight)[:3])
    found = f"all signs together speak for {up} up and {facing} forward in the file ({strongest})"
    better = (("--up", up), ("--facing", facing))
    yield Sense("all signs of the face together agree with how it lies", right, found, "axes", better)


def _axis_in_file(rig: Rig, axis: str) -> str:
    """The signed axis of the file that is nearest to one of the rig's."""
    along = np.reshape(rig.turn, (3, 3)).T @ vector(axis)
    if np.allclose(rig.turn, np.eye(3).ravel()):  # a rig made by hand tells its axes by name
        along = axes_matrix(rig.up, rig.facing).T @ vector(axis)
    index = int(np.argmax(np.abs(along)))
    return ("-" if along[index] < 0 else "+") + "xyz"[index]


def _above(channels: Channels, kinds: tuple[Movement | None, ...]) -> Iterator[Sense]:
    """What is named for the eyes, brows and nose lies above what is named for the mouth."""
    nose = ("nose",)
    for upper, lower, high, low in (
        (EYES, MOUTH, "what moves the eyes lies", "what moves the mouth"),
        (BROWS, EYES, "what moves the brows lies", "what moves the eyes"),
        (nose, MOUTH, "what moves the nose lies", "what moves the mouth"),
    ):
        places = [channels.centre[rows] for wanted in (upper, lower) if (rows := rows_of(channels, kinds, wanted))]
        if len(places) == 2:
            yield _is_above(places[0].mean(axis=0), places[1].mean(axis=0), high, low)


def _points_above(rig: Rig) -> Iterator[Sense]:
    """The eyes lie above the mouth, and the nose does, as they were found."""
    read = face_reading(rig)
    if read.mouth.at is None:
        return
    mouth = np.array(read.mouth.at)
    if read.eyes.left and read.eyes.right:
        yield _is_above(np.mean([read.eyes.left, read.eyes.right], axis=0), mouth, "the eyes lie", "the mouth")
    if read.nose.at:
        height = float(read.nose.at[1] - mouth[1])
        way = "above" if height > 0 else "below"
        found = f"the tip of the nose lies {abs(height):.0f} mm {way} the mouth"
        yield Sense("the mouth lies below the nose", height > 0, found, "axes")


def _is_above(upper: Float[np.ndarray, " 3"], lower: Float[np.ndarray, " 3"], high: str, low: str) -> Sense:
    apart = upper - lower
    holds = apart[1] > UPRIGHT * np.linalg.norm(apart)
    ways = {"above": apart[1], "below": -apart[1], "before": apart[2], "behind": -apart[2], "beside": abs(apart[0])}
    way = max(ways, key=lambda word: ways[word])
    return Sense(f"{high} above {low}", bool(holds), f"{high} {ways[way]:.0f} mm {way} {low}", "axes")


def _opening(rig: Rig) -> frozenset[int]:
    """Blendshapes that may be believed to open the jaw: all that are called so where names agree with each other; else
    what the person's own map says, and what moves more skin than any other, as a jaw does."""
    channels = rig_channels(rig)
    if names_agree(channels):
        return frozenset(range(len(rig.names)))
    mine = {name for name, _ in rig.meanings}
    squared = np.where(channels.facial, (rig.displacement**2 * rig.skin).sum(axis=1), 0)
    return frozenset([int(squared.argmax()), *(k for k, name in enumerate(rig.names) if name in mine)])


def _jaw(channels: Channels, kinds: tuple[Movement | None, ...], believed: frozenset[int]) -> Iterator[Sense]:
    """The jaw opens downwards and never forward."""
    rows = [k for k in rows_of(channels, kinds, ("jaw open",)) if k in believed]
    rows = rows or [k for k in rows_of(channels, kinds, ("mouth open",)) if k in believed]
    if not rows:
        return
    D = channels.direction[rows].mean(axis=0)
    length = float(np.linalg.norm(D))
    if length == 0:
        return
    _, y, z = D / length
    yield Sense(
        "the jaw opens downwards",
        bool(y < JAW_DOWN and z < JAW_FORWARD),
        f"the jaw opens {abs(y):.0%} {'down' if y < 0 else 'up'} and {abs(z):.0%} {'back' if z < 0 else 'forward'}",
        "axes",
    )


def _mirrored(rig: Rig) -> Iterator[Sense]:
    """The face is its own mirror image across x rather than across y or z."""
    off = [mirror_mm(rig.neutral[rig.skin], axis) for axis in range(3)]
    if min(off) > RIM_MM:
        return
    holds = off[0] <= CROOKED * min(off) + CROOKED_MM
    found = f"left and right are {off[0]:.1f} mm from each other's mirror image (median)"
    found += "" if holds else f", across another axis it is {min(off):.1f} mm"
    yield Sense("left and right of the face mirror each other", holds, found, "axes")


def mirror_mm(points: Float[np.ndarray, "v 3"], axis: int) -> float:
    """Median distance from the mirror image across an axis, through its middle."""
    flip = np.where(np.arange(3) == axis, -1.0, 1.0)
    middle = (points[:, axis].min() + points[:, axis].max()) / 2
    some = points[:: max(1, len(points) // 2000)]
    return float(np.median(KDTree(points).query(some * flip + 2 * middle * (flip < 0))[0]))


def side_senses(rig: Rig) -> tuple[Sense, ...]:
    """Most of what is called left moves the subject's left."""
    channels, kinds = rig_channels(rig), kinds_of(rig)
    x = channels.centre[:, 0] - mirror_plane(rig.neutral[rig.skin])
    message = {
        rig.names[k]: bool((x[k] > 0) == (kind.side == "left"))
        for k, kind in enumerate(kinds)
        if kind and kind.side and channels.weight[k] > 0 and abs(x[k]) > ONE_SIDED * channels.rho
    }
    if not message:
        return ()
    wrong = [name for name, right in message.items() if not right]
    found = f"{len(message) - len(wrong)} of {len(message)} blendshapes with a side in their name move that side"
    found += f" (not {', '.join(wrong[:3])}{' ...' * (len(wrong) > 3)})" if wrong else ""
    holds = 2 * len(wrong) < len(message)
    return (Sense("what is called left moves the subject's left", holds, found, "sides"),)
