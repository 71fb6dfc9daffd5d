"""Unit and axes of a rig whose file does not say them, or says them wrongly, from its shape and motion.

Data     m[v]     how far a vertex moves at most, d[k, v] deltas, n[v] outward normals, a[v] areas
Sides    the axis along which the neutral is its own mirror image
Facing   F = sum a m n / sum a m + e - c         what moves most looks forward; the eyes e lie before the middle c
Up       U = N [+ (e - p) + (c - p) - J]         in brackets for a whole rig only: p = sum a m v / sum a m
         N = sum a n                             the cut neck looks down (a closed surface has N = 0)
         J = sum a |d|^2 d / sum a |d|^3         the largest motion of a whole rig is the jaw's, downward
Choice   of the 24 right-handed pairs of signed axes the one with the largest weighted sum of F . facing and U . up
Unit     the usual one that puts the pupils 54 to 74 mm apart, or else makes the moving face as wide as a human's

An axis is written as its sign and letter: "+y", "-z". The subject's left is up x facing.
"""

import re
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from scipy.spatial import KDTree

from capture_plan.errors import RigError
from capture_plan.mesh import pieces, vertex_areas, vertex_normals
from capture_plan.rig.formats.raw import UNITS_MM, RawRig
from capture_plan.rig.record import Found, Rig
from capture_plan.rig.skin import is_ball

AXES = ("+x", "-x", "+y", "-y", "+z", "-z")
METRIC_MM = (1.0, 10.0, 1000.0, 100.0)
PUPILS_MM = (54.0, 74.0)  # adults
PUPILS_TYPICAL_MM = 63.0
FACE_MM = (60.0, 300.0)  # breadth of what moves, twice its reach from the middle: one lip to a whole head with its neck
FACE_TYPICAL_MM = 135.0  # three human rigs: 132, 137, 140
HUMAN_SPREAD = (0.3, 1.5)  # pupils over that breadth: human 0.45 to 0.48, more when little moves; a fox 0.22
MOVES = 0.1  # share of the largest displacement
WHOLE_RIG = 8  # so many blendshapes include a jaw
EYES, NECK, UP, SIDES, UPRIGHT = 3.0, 4.0, 0.3, 1.0, 0.1  # weights: eight converted rigs found right in 24 poses each
EYE = re.compile(
    r"sclera|iris|cornea|pupil|eye(?!.?(lash|brow|lid|occl|blend|wet|shadow|socket|tear|lac))", re.IGNORECASE
)
BLINK = re.compile(r"blink|eyes?.?clos", re.IGNORECASE)
LIDS = 0.7  # share of the largest displacement in a blink: the lids alone
COMPACT = 0.45  # least over largest extent of an eyeball, or of the half that shows


@dataclass(frozen=True)
class Frame:
    """Unit and axes of a file, how each was found, and a sentence about it where a person should know one."""

    unit_mm: float
    up: str
    facing: str
    unit_found: Found
    up_found: Found
    facing_found: Found
    note: str = ""


def find_frame(raw: RawRig, *, unit_mm: float | None, up: str | None, facing: str | None) -> Frame:
    """Unit and axes of `raw`: what is given here, else what its format says where that can be, else what is found."""
    best = detect_axes(raw, up, facing)
    notes = []
    if not (up or facing) and (raw.up, raw.facing) == best:
        found: tuple[Found, Found] = ("format", "format")
    else:
        found = ("given" if up else "detected", "given" if facing else "detected")
        if raw.up and not (up or facing):
            notes.append(
                f"the format says {raw.up} up and facing {raw.facing}, this head has {best[0]} up and faces {best[1]}"
            )
    unit, unit_found, note = find_unit(raw, axes_matrix(*best), unit_mm)
    return Frame(unit, *best, unit_found, *found, "; ".join([*notes, note] if note else notes))


def check_given(unit_mm: float | None, up: str | None, facing: str | None) -> None:
    """RigError unless what a person gave can be."""
    for what, axis in (("up", up), ("facing", facing)):
        if axis is not None and axis not in AXES:
            raise RigError(f"{what} is '{axis}', expected one of {', '.join(AXES)}")
    if up and facing and up[1] == facing[1]:
        raise RigError(f"up is {up} and facing is {facing}: choose two different axes")
    if unit_mm is not None and not (np.isfinite(unit_mm) and unit_mm > 0):
        raise RigError(f"the unit is {unit_mm} mm, expected a length above 0, such as 10 for centimetres")


def vector(axis: str) -> Float[np.ndarray, " 3"]:
    """+y -> (0, 1, 0)."""
    return np.where(np.arange(3) == "xyz".index(axis[1]), -1.0 if axis[0] == "-" else 1.0, 0.0)


def axes_matrix(up: str, facing: str) -> Float[np.ndarray, "3 3"]:
    """Rotation from the file's axes to ours: its rows are the subject's left, up and facing in the file."""
    return np.stack([np.cross(vector(up), vector(facing)), vector(up), vector(facing)])


def detect_axes(raw: RawRig, up: str | None, facing: str | None) -> tuple[str, str]:
    """The (up, facing) that shape and motion speak for, of those that agree with what is given."""
    sides = side_axis(raw.neutral)
    F, U = evidence(raw, sides)

    def score(pair: tuple[str, str]) -> float:
        R = axes_matrix(*pair)
        return float(F @ R[2] + UP * U @ R[1] + SIDES * abs(R[0, sides]) + UPRIGHT * (pair[0][0] == "+"))

    pairs = [(u, f) for u in AXES for f in AXES if u[1] != f[1] and up in (None, u) and facing in (None, f)]
    return max(pairs, key=score)


def evidence(raw: RawRig, sides: int) -> tuple[Float[np.ndarray, " 3"], Float[np.ndarray, " 3"]]:
    """F and U of the module's docstring, without units."""
    v, a = raw.neutral, vertex_areas(raw.neutral, raw.triangles)
    length = np.linalg.norm(raw.deltas, axis=2)
    m = a * length.max(axis=0)
    if not m.any():
        raise RigError(
            f"{raw.name}: no blendshape moves a triangle that has an area: export the face mesh with its faces"
        )
    n = vertex_normals(v, raw.triangles)
    n = n * np.sign(np.einsum("v,vx,vx->", a, v - v.mean(axis=0), n))  # outward, whichever way the triangles wind
    size, c, p = np.sqrt(a.sum()), a @ v / a.sum(), m @ v / m.sum()
    F, U = m @ n / m.sum(), NECK * (a @ n) / a.sum()
    eyes = find_eyes(raw, sides)
    if eyes is not None:
        F = F + EYES * (eyes.mean(axis=0) - c) / size
    if len(raw.names) >= WHOLE_RIG:
        U = U + (c - p if eyes is None else c - 2 * p + eyes.mean(axis=0)) / size
        U = U - np.einsum("v,kv,kvx->x", a, length**2, raw.deltas) / np.einsum("v,kv->", a, length**3)
    return F, U


def side_axis(v: Float[np.ndarray, "v 3"]) -> int:
    """The axis along which the points come nearest to their own mirror image."""
    tree, sample = KDTree(v), v[:: max(1, len(v) // 2000)]
    mirrored = []
    for axis in range(3):
        middles = ((v[:, axis].min() + v[:, axis].max()) / 2, v[:, axis].mean())
        flip = np.where(np.arange(3) == axis, -1.0, 1.0)
        images = [sample * flip + 2 * middle * (flip < 0) for middle in middles]
        mirrored.append(min(np.median(tree.query(image)[0]) for image in images))
    return int(np.argmin(mirrored))


def find_unit(raw: RawRig, R: Float[np.ndarray, "3 3"], given: float | None) -> tuple[float, Found, str]:
    """Millimetres in one unit of the file, how that was found, and a note; rows of `R` are left, up, facing."""
    if given is not None:
        return given, "given", ""
    side = int(np.argmax(np.abs(R[0])))
    moving = np.linalg.norm(raw.deltas, axis=2).max(axis=0)
    middle = (raw.neutral[:, side].min() + raw.neutral[:, side].max()) / 2
    breadth = 2 * float(np.abs(raw.neutral[moving > MOVES * moving.max(), side] - middle).max())
    breadth = breadth or float(np.ptp(raw.neutral, axis=0).max())
    if breadth == 0:
        raise RigError(f"{raw.name}: all vertices lie in one place: export the neutral again")
    eyes = find_eyes(raw, side)
    pupils = 0.0 if eyes is None else float(abs(eyes[0, side] - eyes[1, side]))
    human = breadth > 0 and HUMAN_SPREAD[0] < pupils / breadth < HUMAN_SPREAD[1]
    note = ""
    if raw.unit_mm:
        if FACE_MM[0] <= breadth * raw.unit_mm <= FACE_MM[1]:
            return raw.unit_mm, "format", ""
        note = (
            f"one unit is {raw.unit_mm:g} mm by the file, which makes its face {breadth * raw.unit_mm:,.0f} mm wide; "
        )
    for unit in UNITS_MM.values() if human else ():
        if PUPILS_MM[0] <= pupils * unit <= PUPILS_MM[1]:
            return unit, "detected", note and f"{note}taken as {unit:g} mm"
    for unit in METRIC_MM:
        if not human and FACE_MM[0] <= breadth * unit <= FACE_MM[1]:
            size = f"one unit was taken as {unit:g} mm, which makes the moving face {breadth * unit:.0f} mm wide"
            return unit, "detected", f"{note}not of human proportions or without eyes: {size}"
    unit = PUPILS_TYPICAL_MM / pupils if human else FACE_TYPICAL_MM / breadth
    return unit, "detected", f"{note}fits no usual unit: scaled to the size of a human face, one unit is {unit:.4g} mm"


def find_eyes(raw: RawRig | Rig, side: int) -> Float[np.ndarray, "2 3"] | None:
    """Centres of both eyes in the file's axes, sides along axis `side`: from names, balls, or what a blink moves."""
    v = raw.neutral
    named = np.isin(raw.parts, [i for i, name in enumerate(raw.part_names) if EYE.search(name)])
    if (eyes := two_centres(v, named, side)) is not None:
        return eyes
    if (eyes := two_centres(v, balls(raw, side), side)) is not None:
        return eyes
    blinks = [delta for name, delta in zip(raw.names, raw.deltas, strict=True) if BLINK.search(name)]
    moved = np.linalg.norm(blinks, axis=2).max(axis=0) if blinks else np.zeros(len(v))
    return two_centres(v, moved > LIDS * moved.max(), side)


def two_centres(
    v: Float[np.ndarray, "v 3"], chosen: Bool[np.ndarray, " v"], side: int
) -> Float[np.ndarray, "2 3"] | None:
    """Middles of the chosen points on either side, when there are some on both and they mirror each other."""
    middle = (v[:, side].min() + v[:, side].max()) / 2
    halves = [v[chosen & (v[:, side] > middle)], v[chosen & (v[:, side] < middle)]]
    if min(map(len, halves)) < 3:
        return None
    a, b = ((half.min(axis=0) + half.max(axis=0)) / 2 for half in halves)
    apart = a[side] - b[side]
    mirror = np.where(np.arange(3) == side, 2 * middle - b, b)
    return np.stack([a, b]) if np.linalg.norm(a - mirror) < 0.25 * apart else None


def balls(raw: RawRig | Rig, side: int) -> Bool[np.ndarray, " v"]:
    """Vertices of the largest two loose pieces that are round and lie clear of the middle."""
    v, piece = raw.neutral, pieces(raw.triangles, len(raw.neutral))
    middle = (v[:, side].min() + v[:, side].max()) / 2
    numbers, count = np.unique(piece, return_counts=True)
    found = []
    for number in numbers[count >= 12]:
        points = v[piece == number]
        extent = np.ptp(points, axis=0)
        clear = points[:, side].min() > middle or points[:, side].max() < middle
        if clear and extent.min() > COMPACT * extent.max() and is_ball(points):
            found.append((float(np.prod(extent)), int(number)))
    return np.isin(piece, [number for _, number in sorted(found)[-2:]])
