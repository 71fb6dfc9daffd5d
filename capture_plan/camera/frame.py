"""Which convention a camera file was written in: the one in which the face stands upright inside the pictures.

Data        cameras as the format of their file defines them, and a head in millimetres, +y up, facing +z
Convention  what the file may mean otherwise
            unit      of its lengths
            axes      of a camera: y down and z forward (OpenCV), or y up and z backward (OpenGL)
            pose      (R, C): inverted (R', -R C); rotation inverted (R', C); centre for translation (R, -R C);
                      translation for centre (R, -R' C)
            mirrored  left-handed, y up and z forward (Unity, DirectX):  R becomes diag(1, -1, 1) R diag(-1, 1, 1)
            world     which axis is up, and along which the face looks
Holds       a camera stands outside the head and has more than `SHOWN` of it in its picture, the face at most `ROLL`
            degrees from upright, and at least `LEAST_FILL` of the picture's height wide
Score       (cameras that hold + those of them in front of the face) / 2c - `PRICE` x (parts meant otherwise)
The highest score is taken. Of other readings that put cameras elsewhere, and of which as many hold, one is as likely
that means no more parts otherwise and has the head at most twice as far from the middle of the pictures, or one part
more and no farther; against what the format says, one part and far nearer. Then nothing is taken: the person is asked.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, replace
from itertools import product
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Bool, Float

from capture_plan.camera.calibration import UNITS, Calibration
from capture_plan.camera.camera import Camera
from capture_plan.camera.fields import OPENGL
from capture_plan.errors import RigError
from capture_plan.prose import in_series

SHOWN, ROLL, LEAST_FILL = 0.05, 60.0, 0.02
USUAL_FILL = 0.7  # of the picture's height: what a unit is judged by where nothing else tells it
PRICE, LEAST_SCORE = 0.1, 0.4
AIM = 0.05  # of the picture's height, or of a distance in it: less apart two readings are aimed as well
LEVEL = 0.2  # of the head's up that lies in the picture: a camera that looks straight down has no roll
APART_MM, APART_DEGREES = 5.0, 1.0  # two readings that differ by less are one
MOST_POINTS = 300  # of the head
AS_STATED = "as stated"
POSES = (AS_STATED, "inverted", "rotation inverted", "centre for translation", "translation for centre")
AXES = (AS_STATED, "OpenGL", "OpenGL before")  # before: where a reader has turned them already
FORWARD = {"+x": (1, 0, 0), "-x": (-1, 0, 0), "+y": (0, 1, 0), "-y": (0, -1, 0), "+z": (0, 0, 1), "-z": (0, 0, -1)}
HEAD_WORLD = "+y up, facing +z"
WORLDS = tuple(
    f"{up} up, facing {facing}"
    for up, ways in (
        ("+y", ("+z", "-z", "+x", "-x")),
        ("+z", ("-y", "+y", "+x", "-x")),
        ("-y", ("-z", "+z")),
    )
    for facing in ways
)
MIRROR_WORLD, MIRROR_CAMERA = np.diag([-1.0, 1.0, 1.0]), np.diag([1.0, -1.0, 1.0])


@dataclass(frozen=True)
class Convention:
    """What the numbers of a camera file mean; `AS_STATED` is what its format says."""

    unit: str = "millimetres"
    axes: str = AS_STATED
    pose: str = AS_STATED
    mirrored: bool = False
    world: str = HEAD_WORLD

    def of(self, camera: Camera, stated_mm: float) -> Camera:
        """A camera as this convention has it; its numbers were read as the format says, in units of `stated_mm`."""
        R, C = self.poses(camera.rotation[None], camera.position[None], stated_mm)
        return replace(camera, rotation=R[0], position=C[0])

    def poses(
        self, R: Float[np.ndarray, "c 3 3"], C: Float[np.ndarray, "c 3"], stated_mm: float
    ) -> tuple[Float[np.ndarray, "c 3 3"], Float[np.ndarray, "c 3"]]:
        """World-to-camera rotations and places (millimetres) in the head's frame, of those that were read."""
        C = C / stated_mm * UNITS[self.unit]
        if self.axes == "OpenGL before":
            R = OPENGL @ R
        back = R.transpose(0, 2, 1)
        if self.pose in ("inverted", "centre for translation"):
            C = -np.einsum("cij,cj->ci", R, C)
        if self.pose == "translation for centre":
            C = -np.einsum("cij,cj->ci", back, C)
        if self.pose in ("inverted", "rotation inverted"):
            R = back
        if self.axes == "OpenGL":
            R = OPENGL @ R
        if self.mirrored:
            R, C = MIRROR_CAMERA @ R @ MIRROR_WORLD, C @ MIRROR_WORLD
        W = to_head(self.world)
        return R @ W.T, C @ W.T

    def otherwise(self, unit: str | None) -> int:
        """How many parts are meant otherwise than the format says, whose unit is given where it has one."""
        other_unit = unit is not None and self.unit != unit
        turned = (self.axes != AS_STATED) + (self.pose != AS_STATED) + 2 * self.mirrored
        return other_unit + turned + (self.world != HEAD_WORLD)

    def words(self, unit: str | None) -> str:
        """What is meant otherwise than the format says, as a person sets it: 'unit = "metres", pose = "inverted"'."""
        said = [] if self.unit == unit else [f'unit = "{self.unit}"']
        said += [
            f'{part.name} = "{getattr(self, part.name)}"'
            for part in fields(self)
            if part.name in ("axes", "pose", "world") and getattr(self, part.name) != part.default
        ]
        return ", ".join(said + (["mirrored = true"] if self.mirrored else [])) or "nothing"


@dataclass(frozen=True, eq=False)
class Found:
    """Cameras in the head's frame, the convention that they were read in, and what is to be said of it.

    `others`: conventions in which as many cameras would have the head upright in their pictures, elsewhere.
    """

    cameras: tuple[Camera, ...]
    convention: Convention
    others: tuple[Convention, ...]
    said: str


@dataclass(frozen=True)
class Standing:
    """How a camera stands to a head: distance (mm), whether before the face, share of the head in its picture, roll
    (degrees) of the face in it, its height and its distance from the middle in parts of the picture's height."""

    away: float
    outside: bool
    before: bool
    share: float
    roll: float
    fill: float
    off: float

    @property
    def holds(self) -> bool:
        """Whether the head stands upright in the picture, and the camera outside it."""
        return bool(self.outside and self.share > SHOWN and abs(self.roll) <= ROLL and self.fill >= LEAST_FILL)


def to_head(world: str) -> Float[np.ndarray, "3 3"]:
    """Rotation from a world of these axes ('+z up, facing -y') to the head's: +y up, facing +z."""
    up, facing = (np.array(FORWARD[word], dtype=float) for word in (world[:2], world[-2:]))
    return np.stack([np.cross(up, facing), up, facing])


def standing(camera: Camera, head: Float[np.ndarray, "v 3"]) -> Standing:
    """How a camera stands to the vertices of a head."""
    middle = head.mean(axis=0)
    radius = float(np.linalg.norm(head - middle, axis=1).mean())
    way = camera.position - middle
    away = float(np.linalg.norm(way))
    depth = float((middle - camera.position) @ camera.rotation[2])
    up = camera.rotation @ [0.0, 1.0, 0.0]
    level = np.hypot(up[0], up[1]) > LEVEL
    fill = 2 * radius * camera.intrinsics[1, 1] / depth / camera.size_px[1] if depth > 0 else 0.0
    with np.errstate(all="ignore"):
        share = float(camera.in_image(head).mean())
        at = camera.project(middle[None])[0] - (np.array(camera.size_px) - 1) / 2
    roll = float(np.degrees(np.arctan2(up[0], -up[1]))) if level else 0.0
    off = float(np.nan_to_num(np.linalg.norm(at) / camera.size_px[1], nan=1.0))
    return Standing(away, away > radius, bool(way[2] > 0), share, roll, fill, off)


def might_hold(
    R: Float[np.ndarray, "c 3 3"],
    C: Float[np.ndarray, "c 3"],
    lenses: Float[np.ndarray, "c 3"],
    head: Float[np.ndarray, "v 3"],
) -> Bool[np.ndarray, " c"]:
    """Where cameras of these lenses (`reach`) can have the head upright in their pictures, from these places: false
    only where `standing` does not hold."""
    middle = head.mean(axis=0)
    radius = np.linalg.norm(head - middle, axis=1)
    x, y, depth = np.einsum("cij,cj->ci", R, middle - C).T
    focal, height, widest = lenses.T
    up = R[:, :, 1]
    upright = (np.abs(np.arctan2(up[:, 0], -up[:, 1])) <= np.radians(ROLL)) | (np.hypot(up[:, 0], up[:, 1]) <= LEVEL)
    angle = np.arctan2(np.hypot(x, y), depth)
    away = np.hypot(np.hypot(x, y), depth)
    wide = np.arcsin(np.minimum(radius.max() / np.maximum(away, 1e-9), 1))
    large = 2 * radius.mean() * focal >= LEAST_FILL * height * depth
    return (depth > 0) & upright & large & (angle - wide <= widest) & (away > radius.mean())


def reach(camera: Camera) -> tuple[float, float, float]:
    """Focal length and height in pixels, and the widest angle (radians) between the optical axis and a corner."""
    width, height = camera.size_px
    corners = np.array([[x, y] for x in (-0.5, width - 0.5) for y in (-0.5, height - 0.5)])
    ahead = camera.rays(corners) @ camera.rotation[2]
    return camera.intrinsics[1, 1], height, float(np.arccos(ahead.min())) if np.isfinite(ahead).all() else np.pi


def sampled(head: Float[np.ndarray, "v 3"]) -> Float[np.ndarray, "p 3"]:
    """Some of the vertices of a head, evenly by their numbers."""
    return head[:: max(len(head) // MOST_POINTS, 1)]


def conventions(unit: str | None, given: dict[str, object]) -> Iterator[Convention]:
    """Every convention that agrees with what a person has `given`, the format's own first."""
    units = ([unit] if unit else []) + [name for name in UNITS if name != unit]
    for world, mirrored, axes, pose, name in product(WORLDS, (False, True), AXES, POSES, units):
        one = Convention(name, axes, pose, mirrored, world)
        if pose == AS_STATED and axes == "OpenGL before":
            continue  # is "OpenGL"
        if all(getattr(one, key) == value for key, value in given.items()):
            yield one


@runtime_checkable
class Alignment(Protocol):
    """What tells where the head is in the world of a calibration (`align.py`)."""

    def turned(self, R: Float[np.ndarray, "c 3 3"], C: Float[np.ndarray, "c 3"], mm: float, mirrored: bool) -> "Stood":
        """Cameras of a world, whose unit is so many millimetres, in the head's frame."""
        ...


Stood = tuple[Float[np.ndarray, "c 3 3"], Float[np.ndarray, "c 3"]]  # world-to-camera rotations and places (mm)


def find_frame(
    read: Calibration,
    head: Float[np.ndarray, "v 3"],
    what: str,
    given: dict[str, object] | None = None,
    alignment: Alignment | None = None,
) -> Found:
    """The cameras of a calibration in the frame of a head whose vertices (millimetres, +y up, facing +z) are given.

    `what` opens the lines of errors; `given` are parts of `Convention` that a person states. With an `alignment` the
    world is as that says, and units, axes and poses are judged by where it puts the cameras.

    Raises:
        RigError: no convention has the head upright in half of the pictures, or two do, and put cameras elsewhere.
    """
    given, points = given or {}, sampled(head)
    stated_mm, c = UNITS[read.unit or "millimetres"], len(read.cameras)
    R, C = (np.stack([getattr(camera, part) for camera in read.cameras]) for part in ("rotation", "position"))
    lenses, tried = np.array([reach(camera) for camera in read.cameras]), []
    for one in conventions(read.unit, given):
        poses = one.poses(R, C, stated_mm)
        if alignment:
            poses = alignment.turned(*poses, UNITS[one.unit], one.mirrored)
        if 2 * might_hold(*poses, lenses, points).sum() < c:
            continue
        stood = zip(read.cameras, *poses, strict=True)
        cameras = tuple(replace(camera, rotation=turn, position=place) for camera, turn, place in stood)
        held = [stand for camera in cameras if (stand := standing(camera, points)).holds]
        if 2 * len(held) >= c:
            tried.append(Reading.of(one, one.otherwise(read.unit), cameras, held))
    tried = [each for each in tried if each.score >= LEAST_SCORE]
    if not tried:
        if alignment:
            raise RigError(
                f"{what}: {read.format}, aligned as [align] says: no camera has the head upright in its picture: the "
                "places are measured in the calibration's own frame and unit; correct them, or unit, axes or pose"
            )
        raise RigError(f"{what}: {_misread(read, points, given)}")
    best, *rest = sorted(tried, key=lambda each: (round(each.score, 6), -each.oddness), reverse=True)
    others = [each for each in rest if each.votes >= best.votes and _apart(best.cameras, each.cameras)]
    if doubtful := [each for each in others if _doubtful(best, each)]:
        choices = "; or ".join(each.convention.words(read.unit) for each in (best, *doubtful[:2]))
        raise RigError(
            f"{what}: several readings have the head upright in the pictures ({choices}): say which, in a TOML file "
            'with [calibration], file = "..." and these lines'
        )
    said = _said(read, best, points, [each.convention.unit for each in others if _but_unit(best, each)])
    return Found(best.cameras, best.convention, tuple(each.convention for each in others), said)


class Reading(NamedTuple):
    """A convention in which cameras have the head in their pictures.

    `held` cameras have, `votes` with those of them before the face counted again; `price`: parts meant otherwise than
    the format says; `off`: mean distance of the head from the picture's middle, in parts of its height; `oddness`: how
    far from usual that and the head's size are.
    """

    convention: Convention
    cameras: tuple[Camera, ...]
    held: int
    votes: int
    price: int
    off: float
    oddness: float

    @classmethod
    def of(cls, convention: Convention, price: int, cameras: tuple[Camera, ...], held: list[Standing]) -> "Reading":
        """The reading of cameras, those of them that hold standing so to the head."""
        off = float(np.mean([stand.off for stand in held]))
        size = float(np.mean([abs(np.log(stand.fill / USUAL_FILL)) for stand in held]))
        votes = len(held) + sum(stand.before for stand in held)
        return cls(convention, cameras, len(held), votes, price, off, size + off)

    @property
    def score(self) -> float:
        """What the readings are compared by; see the module."""
        return self.votes / (2 * len(self.cameras)) - PRICE * self.price


def _but_unit(best: Reading, other: Reading) -> bool:
    return replace(other.convention, unit=best.convention.unit) == best.convention


def _doubtful(best: Reading, other: Reading) -> bool:
    """Whether another reading is as likely: see the module."""
    if _but_unit(best, other) or other.price > best.price + 1:
        return False
    if best.price == 0:
        return other.price == 1 and len(best.cameras) > 1 and other.off + AIM < best.off / 2
    return other.off <= (2 if other.price <= best.price else 1 + AIM) * best.off


def _said(read: Calibration, best: Reading, points: Float[np.ndarray, "p 3"], units: list[str]) -> str:
    """What was read and how sure that is, in one line."""
    how, unit = best.convention.words(read.unit), best.convention.unit
    line = f"{read.format}, " + ("read as its format says" if how == "nothing" else f"read with {how}")
    line += f", not {read.unit}" if read.unit and unit != read.unit else ""
    nearest = min(standing(camera, points).away for camera in best.cameras)
    line += f": {best.held} of {len(best.cameras)} cameras have the head upright in their pictures, the nearest "
    line += f"{nearest:,.0f} mm from its middle"
    if units and unit != read.unit:
        line += f"; {in_series(sorted(set(units)))} would show it too: measure that distance, and state the unit"
    return line


def _apart(some: Sequence[Camera], others: Sequence[Camera]) -> bool:
    """Whether any camera stands or looks elsewhere in another reading."""
    moved = max(float(np.linalg.norm(a.position - b.position)) for a, b in zip(some, others, strict=True))
    turned = max(float(np.abs(a.rotation - b.rotation).max()) for a, b in zip(some, others, strict=True))
    return moved > APART_MM or turned > np.radians(APART_DEGREES)


def looked_at(cameras: Sequence[Camera]) -> Float[np.ndarray, "3"] | None:
    """The point nearest to the optical axes of cameras, millimetres; None where these are all but parallel."""
    R, C = (np.stack([getattr(camera, part) for camera in cameras]) for part in ("rotation", "position"))
    return meeting(R[:, 2], C)


def meeting(ways: Float[np.ndarray, "c 3"], places: Float[np.ndarray, "c 3"]) -> Float[np.ndarray, "3"] | None:
    """The point nearest to lines through `places` C along unit `ways` f; None where these are all but parallel.

    Sum over them of (I - f f') (X - C) = 0.
    """
    across = np.eye(3) - ways[:, :, None] * ways[:, None]
    normal, right = across.sum(axis=0), np.einsum("cxy,cy->x", across, places)
    return np.linalg.solve(normal, right) if np.linalg.cond(normal) < 1e3 else None


def _misread(read: Calibration, points: Float[np.ndarray, "p 3"], given: dict[str, object]) -> str:
    """Why no reading has the head in the pictures, and what would mend it."""
    stated = replace(Convention(unit=read.unit or "millimetres"), **given)
    cameras = [stated.of(camera, UNITS[read.unit or "millimetres"]) for camera in read.cameras]
    stand, middle = standing(cameras[0], points), points.mean(axis=0)
    said = f"{read.format}: no reading of it has the head upright in the pictures: "
    said += f"as {'you state' if given else 'it stands'}, camera '{cameras[0].name}' stands {stand.away:,.4g} mm from "
    said += "the middle of the face and "
    said += "looks past it" if stand.share <= SHOWN else f"has it turned by {abs(stand.roll):.0f} degrees"
    if (meet := looked_at(cameras)) is not None:
        said += f"; its cameras look at ({_words(meet)}) mm, the head's middle is ({_words(middle)})"
    return (
        f"{said}: write the calibration in the head's frame (millimetres, +y up, the face looks along +z), or move its "
        "origin there"
    )


def _words(point: Float[np.ndarray, "3"]) -> str:
    return ", ".join(f"{x:.4g}" for x in point)
