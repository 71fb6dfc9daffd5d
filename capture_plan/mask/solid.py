"""The mask as one closed solid: a field on a grid, its zero surface, and what is cut out of it exactly.

Inside    h(x)   height of x over its nearest point of the skin, g(x) the gap there
          A = min(h - g, hats)                    height over the inside of the mask; a hat is the space under a hole
          A = min(A, r - distance to {A >= r})    a ball of radius r rolls along the inside, in the plastic: no ridge
                                                  that points into a crease is sharper
Field     c(x)   distance inside the cover
          F = min(A, wall - A, c + FLANK (h - g - wall/2))               the shell; flanks lean outward, so that no ray
                                                                         through the wall meets an edge too early
          F = max(F, min(A, cone to a flat top)) for every eyelet, the same with a flat box for every pad
Surface   F = 0 by marching cubes, made a manifold and simplified within `SIMPLER_MM`
Cut out   holes and letters as exact solids: their axes and floors are as exact as they were designed

No wall is thinner than the ball: A has no slope above 1, so that from A = 0 to A = wall it is as far as `wall`; and a
ray from the inside, along the normal, runs first through the ball that touches it there, whole in the plastic as
2 r < wall.

Letters: n points of the skin, x grid points; millimetres.
"""

from typing import Any

import numpy as np
from jaxtyping import Float, Int
from scipy.ndimage import gaussian_filter
from scipy.spatial import KDTree

from capture_plan.errors import PlanError
from capture_plan.mask.glyphs import outlines
from capture_plan.mask.labels import DEPTH_MM, WIDTH
from capture_plan.mask.record import LEAST_WALL_MM, Hole, Label, MaskSettings, Mesh, level_frame
from capture_plan.mask.skin import Skin
from capture_plan.progress import track

GRID_MM = 0.7
COARSE = 4  # grid steps of the first look at which part of the grid is near the skin
FLANK = 0.25
ROUND_MM = 0.9  # of the outer edge of rim and openings; on the inside flanks end at an angle
SPREAD_MM = 0.35  # half of the distance between points of the skin: so far to the side of a point, skin goes on
BLUR = 0.6  # grid steps: rounds edges and valleys between pads, moves no wall by more than 0.01 mm
SIMPLER_MM = 0.005
OUTSIDE = -2.0
OPEN_MM = 1.0  # from an open edge of the skin
REACH_MM, SHELL_MM = 8.0, 5.5  # how far from the skin the highest eyelet and the highest pad reach
SEGMENTS = 48  # of a hole's circle: its sides lie within 0.005 mm of it
THROUGH_MM = 4.2  # by which a hole starts behind the skin and goes on above its eyelet
SLOPE = 1.0  # of the sides of eyelets and pads, per mm of height: no overhang when printed on any side
BEVEL_MM = 2.0  # of 45 degrees around what is flat on the inside
CHAMFER_MM = 0.1  # of a hole's lower edge: a ray beside it runs along the hole, not into it
SKIRT_MM = 0.4  # by which the flat of the field is wider than the exact one: it is rounded there, and no step is left
BALL_MM = LEAST_WALL_MM / 2 + 0.05  # of radius
FOOT_MM = 2.2  # how far down sides go


def solid(
    skin: Skin,
    cover: Float[np.ndarray, " n"],
    gap: Float[np.ndarray, " n"],
    holes: tuple[Hole, ...],
    labels: tuple[Label, ...],
    settings: MaskSettings,
) -> Any:
    """The mask, a manifold3d.Manifold in the head's frame.

    Raises:
        PlanError: manifold3d or scikit-image is missing, or the shell is no manifold.
    """
    field, origin = _field(skin, cover, gap, holes, labels, settings)
    m3, shell = manifold3d(), _surface(field, origin)
    tools = [_drill(m3, hole) for hole in holes] + [_letters(m3, label) for label in labels]
    cut = shell - m3.Manifold.batch_boolean(tools, m3.OpType.Add) if tools else shell
    return max(cut.decompose(), key=lambda piece: piece.volume())


def manifold3d() -> Any:
    """The library, where it is installed.

    Raises:
        PlanError: it is not.
    """
    try:
        import manifold3d
    except ImportError as error:
        raise PlanError("a mask needs manifold3d and scikit-image: pip install 'capture-plan[mask]'") from error
    return manifold3d


def as_mesh(manifold: Any) -> Mesh:
    """Vertices and triangles of a solid."""
    mesh = manifold.to_mesh()
    return Mesh(np.asarray(mesh.vert_properties[:, :3], dtype=float), np.asarray(mesh.tri_verts, dtype=np.int64))


def _field(
    skin: Skin,
    cover: Float[np.ndarray, " n"],
    gap: Float[np.ndarray, " n"],
    holes: tuple[Hole, ...],
    labels: tuple[Label, ...],
    settings: MaskSettings,
) -> tuple[Float[np.ndarray, "i j k"], Float[np.ndarray, " 3"]]:
    used = cover > -4 * GRID_MM
    points, normals = skin.points[used], skin.normals[used]
    origin = points.min(axis=0) - REACH_MM - 2 * GRID_MM
    shape = np.ceil((points.max(axis=0) + REACH_MM + 2 * GRID_MM - origin) / GRID_MM / COARSE).astype(int) * COARSE
    raised = np.array([hole.dot.position for hole in holes]).reshape(-1, 3)
    at = _near_skin(points, normals, raised, origin, shape)
    x = origin + GRID_MM * at
    values = np.stack([gap[used], cover[used], skin.to_border[used].clip(max=OPEN_MM)], axis=1)
    h, g, c, edge = _over(x, points, normals, values)
    wall, tree = settings.wall_mm, KDTree(x)
    A = h - g
    for hole in holes:
        _hollow(A, tree, x, hole)
    A = _rolled(A, _filled(A, at, shape), x, origin)
    rim = c + FLANK * (h - g - wall / 2)
    F = np.minimum(A, rounded(wall - A, rim))
    clear = np.where(edge < OPEN_MM, np.abs(h) - g, A)  # beyond an open edge there is no inside
    over = np.minimum(A, rim)
    for hole in track(holes, "Raising eyelets"):
        _raise_eyelet(F, tree, x, over, clear, hole)
    for label in labels:
        _raise_pad(F, tree, x, over, label)
    return gaussian_filter(_filled(F, at, shape), BLUR), origin


def _filled(
    values: Float[np.ndarray, " x"], at: Int[np.ndarray, "x 3"], shape: Int[np.ndarray, " 3"]
) -> Float[np.ndarray, "i j k"]:
    """Values at points of the grid, clipped, and `OUTSIDE` at all others."""
    field = np.full(shape, OUTSIDE, dtype=np.float32)
    field[tuple(at.T)] = np.clip(values, OUTSIDE, -OUTSIDE)
    return field


def _hollow(A: Float[np.ndarray, " x"], tree: KDTree, x: Float[np.ndarray, "x 3"], hole: Hole) -> None:
    """Takes away from the heights over the inside, in place, what a hole needs under it: flat around the hole, then
    sides of 45 degrees, then straight down."""
    at = np.array(tree.query_ball_point(hole.dot.position, REACH_MM + 3.0))
    d = x[at] - hole.dot.position
    z = d @ hole.axis - hole.foot_mm
    beyond = np.sqrt(np.maximum(np.einsum("nx,nx->n", d, d) - (d @ hole.axis) ** 2, 0)) - hole.flat_mm - SKIRT_MM
    A[at] = np.minimum(A[at], np.maximum(np.maximum(z, beyond - BEVEL_MM), (z + beyond) / np.sqrt(2)))


def _rolled(
    A: Float[np.ndarray, " x"],
    field: Float[np.ndarray, "i j k"],
    x: Float[np.ndarray, "x 3"],
    origin: Float[np.ndarray, " 3"],
) -> Float[np.ndarray, " x"]:
    """Heights over the inside that a ball leaves which rolls along it, in the plastic: `field` is A on its grid."""
    from skimage.measure import marching_cubes

    vertices, _, normals, _ = marching_cubes(field, BALL_MM)
    centres, low = origin + GRID_MM * vertices, A < BALL_MM
    away, near = map(np.asarray, KDTree(centres).query(x[low], distance_upper_bound=2 * BALL_MM, workers=-1))
    found = np.isfinite(away)
    up = np.einsum("nx,nx->n", x[low][found] - centres[near[found]], normals[near[found]])
    aside = np.sqrt(np.maximum(away[found] ** 2 - up**2, 0))
    away[found] = np.hypot(up, np.maximum(aside - SPREAD_MM, 0))
    rolled = A.copy()
    rolled[low] = np.minimum(A[low], BALL_MM - np.minimum(away, 2 * BALL_MM))
    return rolled


def rounded(a: Float[np.ndarray, " x"], b: Float[np.ndarray, " x"]) -> Float[np.ndarray, " x"]:
    """min(a, b), its corner rounded by `ROUND_MM`."""
    beyond = np.hypot(np.maximum(ROUND_MM - a, 0), np.maximum(ROUND_MM - b, 0))
    return np.where(np.minimum(a, b) < ROUND_MM, ROUND_MM - beyond, np.minimum(a, b))


def _near_skin(
    points: Float[np.ndarray, "n 3"],
    normals: Float[np.ndarray, "n 3"],
    raised: Float[np.ndarray, "m 3"],
    origin: Float[np.ndarray, " 3"],
    shape: Int[np.ndarray, " 3"],
) -> Int[np.ndarray, "x 3"]:
    """Indices of the grid points that the shell, or an eyelet around the dots `raised`, may reach: whole cells of a
    coarse grid."""
    cells = np.stack(np.meshgrid(*(np.arange(n // COARSE) for n in shape), indexing="ij"), axis=-1).reshape(-1, 3)
    middle = origin + GRID_MM * (COARSE * cells + (COARSE - 1) / 2)
    half = np.sqrt(3) / 2 * COARSE * GRID_MM
    away, near = map(np.asarray, KDTree(points).query(middle, distance_upper_bound=REACH_MM + half, workers=-1))
    wanted = np.isfinite(away)
    cells, middle, away, near = cells[wanted], middle[wanted], away[wanted], near[wanted]
    outside = np.einsum("nx,nx->n", middle - points[near], normals[near]) > -half - GRID_MM
    wanted = outside & (away < SHELL_MM + half)
    if len(raised):
        wanted |= outside & (KDTree(raised).query(middle)[0] < REACH_MM + half)
    steps = np.stack(np.meshgrid(*[np.arange(COARSE)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    return (COARSE * cells[wanted][:, None] + steps).reshape(-1, 3)


def _over(
    x: Float[np.ndarray, "x 3"],
    points: Float[np.ndarray, "n 3"],
    normals: Float[np.ndarray, "n 3"],
    values: Float[np.ndarray, "n w"],
) -> tuple[Float[np.ndarray, "x ..."], ...]:
    """Height over the nearest point, as over a small disc there, and values interpolated from the nearest
    points."""
    away, near = map(np.asarray, KDTree(points).query(x, k=4, workers=-1))
    offset = x - points[near[:, 0]]
    up = np.einsum("nx,nx->n", offset, normals[near[:, 0]])
    aside = np.sqrt(np.maximum(np.einsum("nx,nx->n", offset, offset) - up**2, 0))
    h = np.sign(up) * np.hypot(up, np.maximum(aside - SPREAD_MM, 0))
    weights = 1 / (away**2 - away[:, :1] ** 2 + SPREAD_MM**2)
    weights /= weights.sum(axis=1, keepdims=True)
    return h, *np.einsum("xk,xkw->wx", weights, values[near])


def _raise_eyelet(
    F: Float[np.ndarray, " x"],
    tree: KDTree,
    x: Float[np.ndarray, "x 3"],
    over: Float[np.ndarray, " x"],
    clear: Float[np.ndarray, " x"],
    hole: Hole,
) -> None:
    """The truncated cone with the flat top of a hole, in place; a whole ring even where the skin ends beside it."""
    at = np.array(tree.query_ball_point(hole.dot.position, REACH_MM + 3.0))
    d = x[at] - hole.dot.position
    z = d @ hole.axis
    beside = np.sqrt(np.maximum(np.einsum("nx,nx->n", d, d) - z**2, 0))
    below = hole.top_mm - z
    side = (hole.rim_mm + SLOPE * np.minimum(below, FOOT_MM) - beside) / np.hypot(1, SLOPE)
    ring = np.minimum(hole.ring_mm - beside, np.minimum(z - hole.foot_mm, clear[at]))
    F[at] = np.maximum(F[at], np.minimum(below, np.maximum(np.minimum(side, over[at]), ring)))


def _raise_pad(
    F: Float[np.ndarray, " x"], tree: KDTree, x: Float[np.ndarray, "x 3"], over: Float[np.ndarray, " x"], label: Label
) -> None:
    """The flat box with sloping sides and rounded corners of a number, in place."""
    half, corner = np.array(label.size_mm) / 2, 1.0
    at = np.array(tree.query_ball_point(label.place, float(np.hypot(*half)) + 4.0))
    local = (x[at] - label.place) @ label.frame.T
    out = np.abs(local[:, :2]) - (half - corner)
    beyond = np.linalg.norm(np.maximum(out, 0), axis=1) + np.minimum(out.max(axis=1), 0) - corner
    below = label.top_mm - local[:, 2]
    side = (SLOPE * np.minimum(below, FOOT_MM) - beyond) / np.hypot(1, SLOPE)
    F[at] = np.maximum(F[at], np.minimum(np.minimum(below, side), over[at]))


def _surface(field: Float[np.ndarray, "i j k"], origin: Float[np.ndarray, " 3"]) -> Any:
    """The solid where the field is above 0: its largest piece."""
    m3 = manifold3d()
    from skimage.measure import marching_cubes

    field = np.where(np.abs(field) < 1e-3, np.float32(-1e-3), field)  # a surface through grid points has flat triangles
    vertices, triangles, _, _ = marching_cubes(field, 0.0)
    mesh = m3.Mesh(
        vert_properties=np.ascontiguousarray(origin + GRID_MM * vertices, dtype=np.float32),
        tri_verts=np.ascontiguousarray(triangles[:, ::-1], dtype=np.uint32),
    )
    shell = m3.Manifold(mesh)
    if shell.status() != m3.Error.NoError or shell.volume() <= 0:
        raise PlanError(f"the shell of the mask does not close ({shell.status()}): report this head")
    return max(shell.decompose(), key=lambda piece: piece.volume()).simplify(SIMPLER_MM)


def _drill(m3: Any, hole: Hole) -> Any:
    """What is cut out for a hole: a cylinder, the cone above it, and the way of the pen above the eyelet."""
    r, high = hole.radius_mm, hole.top_mm + 0.3
    profile = [
        (0.0, -THROUGH_MM),
        (hole.flat_mm + SKIRT_MM, -THROUGH_MM),
        (hole.flat_mm + SKIRT_MM, hole.foot_mm - SKIRT_MM),
        (hole.flat_mm, hole.foot_mm),
        (r + CHAMFER_MM, hole.foot_mm),
        (r, hole.foot_mm + CHAMFER_MM),
        (r, hole.land_mm),
        (hole.mouth_mm, hole.top_mm),
        (hole.mouth_mm + 0.3, high),
        (hole.mouth_mm + 0.3, high + THROUGH_MM),
        (0.0, high + THROUGH_MM),
    ]
    turned = m3.CrossSection([profile]).revolve(SEGMENTS)
    return turned.transform(placed(level_frame(hole.axis), hole.dot.position))


def _letters(m3: Any, label: Label) -> Any:
    """What is cut out for a number."""
    flat = m3.CrossSection(outlines(label.text, label.height_mm, WIDTH * label.height_mm), m3.FillRule.EvenOdd)
    raised = flat.extrude(DEPTH_MM + THROUGH_MM).translate((0, 0, label.top_mm - DEPTH_MM))
    return raised.transform(placed(label.frame, label.place))


def placed(frame: Float[np.ndarray, "3 3"], place: Float[np.ndarray, " 3"]) -> Float[np.ndarray, "3 4"]:
    """The motion that takes the axes to the rows of a frame and 0 to a place."""
    return np.c_[frame.T, place]
