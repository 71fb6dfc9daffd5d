"""A mask in pieces that a printer takes, each turned as it prints best.

Cut       by a plane; eyelets and pads that it would cut stay whole, on the side of their middle, so that no hole is
          halved and the pieces find their place by themselves
Pieces    halves along the midline where they are asked for; then whatever fits the printer's box in no direction is cut
          across its longest side, until all fits
Direction of 26 directions up, the one with least area that hangs over by more than 45 degrees, clear of the bed

Letters: f triangles; millimetres; the printer's axes are x, y on the bed and z up.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np
from jaxtyping import Float
from scipy.spatial import ConvexHull

from capture_plan.mask.record import Hole, Label, MaskSettings, Mesh, level_frame
from capture_plan.mask.solid import as_mesh, manifold3d, placed
from capture_plan.mesh.geometry import pieces, triangle_cross

STEEP = np.cos(np.radians(45.0))
BED_MM = 0.6  # what hangs as near to the bed lies on it
PLAY_MM = 0.15  # between the pieces where an eyelet reaches into the other one
NEAR_CUT_MM = 14.0  # further from a plane it cuts no eyelet and no pad
CRUMB_MM3 = 60.0  # what a cut leaves that is smaller is left out
FAR = 1e3
STEP_MM = 1e-4
SUPPORT_PER_MM = 2.0  # mm2 of overhang that a mm of height weighs: a lower piece prints sooner and stands firmer


@dataclass(frozen=True, eq=False)
class Part:
    """A piece of the mask in the head's frame, and the motion onto the bed of the printer: z up, from 0.

    `overhang_mm2` hangs over by more than 45 degrees; `largest_mm2` of it in one place, at `largest_at` of the head."""

    mesh: Mesh
    turn: Float[np.ndarray, "3 3"]
    shift: Float[np.ndarray, " 3"]
    overhang_mm2: float
    largest_mm2: float
    largest_at: Float[np.ndarray, " 3"]

    @cached_property
    def printed(self) -> Mesh:
        """The piece as it stands on the bed."""
        return welded(Mesh(self.mesh.vertices @ self.turn.T + self.shift, self.mesh.triangles))

    @property
    def size_mm(self) -> tuple[float, float, float]:
        """Width, depth and height on the bed."""
        x, y, z = np.ptp(self.printed.vertices, axis=0).tolist()
        return x, y, z

    @property
    def up(self) -> Float[np.ndarray, " 3"]:
        """The head's direction that points up when it is printed."""
        return self.turn[2]


def welded(mesh: Mesh) -> Mesh:
    """The mesh with coordinates of `STEP_MM`, without the edges that are shorter: a file of float32 has none that fall
    together."""
    vertices, of = np.unique(np.round(mesh.vertices / STEP_MM), axis=0, return_inverse=True)
    triangles = of.reshape(-1)[mesh.triangles]
    a, b, c = triangles.T
    return Mesh(vertices * STEP_MM, triangles[(a != b) & (b != c) & (c != a)])


def parts_of(
    mask: Any, holes: tuple[Hole, ...], labels: tuple[Label, ...], midline: float, settings: MaskSettings
) -> tuple[Part, ...]:
    """The pieces, each of which fits the printer's box."""
    whole = _cut(mask, holes, labels, 0, midline) if settings.halves else [mask]
    done: list[Part] = []
    while whole:
        piece = whole.pop(0)
        part = _turned(as_mesh(piece), settings.volume_mm)
        if part is not None:
            done.append(part)
            continue
        low, high = np.reshape(piece.bounding_box(), (2, 3))
        axis = int(np.argmax(high - low))
        whole = [*_cut(piece, holes, labels, axis, float(low[axis] + high[axis]) / 2), *whole]
    return tuple(done)


def _cut(mask: Any, holes: tuple[Hole, ...], labels: tuple[Label, ...], axis: int, at: float) -> list[Any]:
    """Both sides of the plane where a coordinate is `at`: first the greater one."""
    m3 = manifold3d()
    size, corner = np.full(3, 2 * FAR), np.full(3, -FAR)
    corner[axis] = at
    side = m3.Manifold.cube(size.tolist()).translate(corner.tolist())
    bodies: list[tuple[float, Callable[[float], Any]]] = [
        *((float(hole.dot.position[axis]) - at, partial(_around_hole, m3, hole)) for hole in holes),
        *((float(label.place[axis]) - at, partial(_around_label, m3, label)) for label in labels),
    ]
    bodies = [(away, body) for away, body in bodies if abs(away) < NEAR_CUT_MM]

    def sides(grown: float) -> Any:
        own = side
        for _, body in (one for one in bodies if one[0] < 0):
            own -= body(PLAY_MM - grown)
        for _, body in (one for one in bodies if one[0] >= 0):
            own += body(grown)
        return own

    return [_without_crumbs(mask ^ sides(0.0)), _without_crumbs(mask - sides(PLAY_MM))]


def _without_crumbs(piece: Any) -> Any:
    some = [one for one in piece.decompose() if one.volume() > CRUMB_MM3]
    return manifold3d().Manifold.compose(some)


def _around_hole(m3: Any, hole: Hole, grown: float) -> Any:
    r = hole.around_mm + grown
    return (
        m3.Manifold.cylinder(14.0, r, r, 48)
        .translate((0, 0, -6.0))
        .transform(placed(level_frame(hole.axis), hole.dot.position))
    )


def _around_label(m3: Any, label: Label, grown: float) -> Any:
    size = (label.size_mm[0] + 2 * grown + 0.6, label.size_mm[1] + 2 * grown + 0.6, 14.0)
    return m3.Manifold.cube(size, True).transform(placed(label.frame, label.place))


def _turned(mesh: Mesh, volume: tuple[float, float, float]) -> Part | None:
    """The piece on the bed with the least overhang; None where it fits in no direction."""
    cross = triangle_cross(mesh.vertices, mesh.triangles)
    area = np.linalg.norm(cross, axis=1) / 2
    normal, middle = cross / np.maximum(2 * area, 1e-12)[:, None], mesh.vertices[mesh.triangles].mean(axis=1)
    corners = mesh.vertices[ConvexHull(mesh.vertices).vertices]
    best, found = np.inf, None
    for up in _directions():
        turn = _fitting(corners, up, volume)
        if turn is None:
            continue
        height = corners @ up
        hangs = (normal @ up < -STEEP) & (middle @ up > height.min() + BED_MM)
        price = float(area[hangs].sum()) + SUPPORT_PER_MM * float(np.ptp(height))
        if price < best:
            best, found = price, (turn, hangs)
    if found is None:
        return None
    turn, hangs = found
    placed_at = mesh.vertices @ turn.T
    shift = np.array([*(-(placed_at.max(axis=0) + placed_at.min(axis=0))[:2] / 2), -placed_at[:, 2].min()])
    if not hangs.any():
        return Part(mesh, turn, shift, 0.0, 0.0, middle[0])
    patch = pieces(mesh.triangles[hangs], len(mesh.vertices))[mesh.triangles[hangs][:, 0]]
    sizes = np.bincount(patch, area[hangs])
    largest = patch == sizes.argmax()
    at = np.average(middle[hangs][largest], axis=0, weights=area[hangs][largest])
    return Part(mesh, turn, shift, float(area[hangs].sum()), float(sizes.max()), at)


def _directions() -> Float[np.ndarray, "d 3"]:
    """All directions of a cube's corners, edges and sides."""
    steps = np.linspace(-1, 1, 3)
    grid = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1).reshape(-1, 3)
    grid = grid[np.abs(grid).max(axis=1) == 1]
    return grid / np.linalg.norm(grid, axis=1, keepdims=True)


def _fitting(
    vertices: Float[np.ndarray, "v 3"], up: Float[np.ndarray, " 3"], volume: tuple[float, float, float]
) -> Float[np.ndarray, "3 3"] | None:
    """A rotation that takes `up` to z and the piece into the box; None without one."""
    flat = level_frame(up)
    if np.ptp(vertices @ up) > volume[2]:
        return None
    for angle in np.radians([0, 90, 45, 135, 22.5, 67.5]):
        c, s = np.cos(angle), np.sin(angle)
        turn = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) @ flat
        if (np.ptp(vertices @ turn[:2].T, axis=0) <= volume[:2]).all():
            return turn
    return None
