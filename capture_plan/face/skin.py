"""The face skin: where a marker can be stuck and what a scan sees.

A rig also holds eyeballs, teeth, tongue, lashes, tear and occlusion shells, and a bag behind the lips. Three questions,
asked in this order, tell them from skin; names help where there are any, and no rig needs them.

Data       p[v]      piece: vertices joined by triangles, or by lying on the same spot at a border (a UV seam)
           h[v]      hemisphere visibility in the neutral, 0 to 1
Name       a part called 'teeth' or 'M_EyeOcclusion' is no skin; the part with most of the area is, whatever its name
Piece      the largest that moves is skin; a further one has to be large enough, seen, moving (or called skin), no ball
Hidden     the inside of mouth, nostrils and eye sockets: connected vertices with h <= HIDDEN, spread while h <= DIM,
           given back as far as RIM of the size of what moves from the visible skin, since lips and lids part when
           they move
Extent     a body below the neck is left off: what is further than EXTENT times the size of the moving face
Face       where eyes and mouth are known, they tell a face of loose pieces, clothes and bodies (`face_skin.py`)
"""

from collections.abc import Collection

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.sparse.csgraph import dijkstra

from capture_plan.face.face_skin import FacePlace, above_neck, around_eyes, bodies, own_movers, upper_neck
from capture_plan.mesh import boundary_vertices, piece_areas, pieces, surface_graph, triangle_areas
from capture_plan.rig.parts import DRAWN, NOT_SKIN, WORN, PartKind, part_kind
from capture_plan.visibility import hemisphere_visibility

HIDDEN, DIM = 0.02, 0.10  # ICT-FaceKit: 99 % of the mouth bag is below the first, lips at rest apart above the second
RIM = 1 / 62  # of the diagonal of the moving skin: 4 mm on a human head, in whatever unit it was read
SAME_SPOT = 3e-6  # of the extent: 1e-3 mm on a human head
PIECE_AREA, PIECE_SEEN = 0.01, 0.4  # ears: 2 % and 0.5; a lash strip 0.3 %; rows of teeth 0.38
LITTLE = 0.1  # of the largest piece: no face is so small a part of its head
COVER_AREA = 0.15  # of what moves: a piece so large that never moves is hair or clothes; an eyeball has 0.08
ROUND = 0.06  # scatter of the radius of a fitted ball over the radius: eyeballs 0.00 to 0.05, teeth and heads from 0.09
MOVES = 0.05  # share of the largest displacement
EXTENT = 2.5  # a head with its neck lies within 2.1 half diagonals of the moving face


def find_skin(
    neutral: Float[np.ndarray, "v 3"],
    triangles: Int[np.ndarray, "f 3"],
    deltas: Float[np.ndarray, "k v 3"],
    parts: Int[np.ndarray, " v"],
    part_names: tuple[str, ...],
    face: FacePlace | None = None,
) -> Bool[np.ndarray, " v"]:
    """True where a vertex is skin of face, ears, scalp or upper neck; `neutral` and `deltas` in millimetres.

    `face` says where eyes and mouth are, where that is certain.
    """
    moving = np.linalg.norm(deltas, axis=2).max(axis=0)
    moving = moving > MOVES * moving.max()
    called_skin = np.isin(parts, _called_skin(parts, part_names, moving, face))
    named_out = _named(NOT_SKIN, neutral, triangles, parts, part_names)
    if face is not None:
        named_out &= ~around_eyes(neutral, _seamless_in(neutral, triangles, parts), moving, parts, part_names, face)
    retained = triangles[~named_out[triangles].any(axis=1)]
    if len(retained) == 0:
        return np.zeros(len(neutral), dtype=bool)
    piece = _seamless_pieces(neutral, retained)
    areas = triangle_areas(neutral, retained)
    area = piece_areas(neutral, retained, piece)
    moves = np.bincount(piece, moving, len(area)) > 0
    main = np.where(moves, area, area * 1e-9).argmax()
    loose = bool(area[main] < LITTLE * area.max())  # eyes and lips move as pieces of their own on a head that stands
    least, main = area[main], _head_piece(neutral, retained, piece, area, face) if loose else main

    # what is worn over the skin or drawn on it hides nothing that make-up cannot reach
    worn = (
        ~moves
        & (np.bincount(piece, called_skin, len(area)) == 0)
        & (area > COVER_AREA * areas[moving[retained].any(axis=1)].sum())
    )
    worn[main] = False
    over = _named(WORN, neutral, triangles, parts, part_names) | worn[piece]
    seen = np.zeros(len(neutral))
    at = np.unique(retained)
    drawn = _named(DRAWN, neutral, triangles, parts, part_names)
    uncovered = triangles[~over[triangles].any(axis=1)]
    seen[at] = hemisphere_visibility(neutral, uncovered[~drawn[uncovered].any(axis=1)], at, rays=64)

    skin = piece == main
    for i in np.flatnonzero((area >= PIECE_AREA * least) & ~worn):
        of_piece = piece == i
        if np.median(seen[of_piece]) >= PIECE_SEEN and (moving | called_skin)[of_piece].any():
            skin |= of_piece & (i == main or not is_ball(neutral[of_piece]))
    rim = RIM * _diagonal(neutral[moving & skin])
    skin &= ~_inside(neutral, retained[skin[retained].all(axis=1)], seen, skin, rim)
    skin &= _near_enough(neutral, moving & skin)
    if face is None:
        return _without_islands(neutral, triangles, skin)
    whole = _seamless_pieces(neutral, triangles)
    skin = _without_islands(neutral, triangles, _of_the_head(neutral, triangles, skin, parts, part_names, whole, face))
    rest = np.flatnonzero(named_out & ~over)
    if len(rest):
        seen[rest] = hemisphere_visibility(neutral, uncovered, rest, rays=64)
    return skin | own_movers(neutral, triangles, deltas, whole, seen, skin, face)


def _called_skin(
    parts: Int[np.ndarray, " v"], part_names: tuple[str, ...], moving: Bool[np.ndarray, " v"], face: FacePlace | None
) -> list[int]:
    """Parts that are called skin; one called body only where no part that moves is called a face."""
    kinds = [part_kind(name) for name in part_names]
    called = [i for i, kind in enumerate(kinds) if kind in ("skin", "body")]
    has_face = any(kinds[i] == "skin" and moving[parts == i].any() for i in called)
    if face is None or not has_face:
        return called
    return [i for i in called if kinds[i] == "skin" or moving[parts == i].any()]


def _head_piece(
    neutral: Float[np.ndarray, "v 3"],
    triangles: Int[np.ndarray, "f 3"],
    piece: Int[np.ndarray, " v"],
    area: Float[np.ndarray, " p"],
    face: FacePlace | None,
) -> int:
    """The piece that a face of loose pieces lies on: that with most area in front, else the largest."""
    if face is None:
        return int(area.argmax())
    inside = face.front(neutral[triangles].mean(axis=1))
    return int(np.bincount(piece[triangles[:, 0]], triangle_areas(neutral, triangles) * inside, len(area)).argmax())


def _of_the_head(
    neutral: Float[np.ndarray, "v 3"],
    triangles: Int[np.ndarray, "f 3"],
    skin: Bool[np.ndarray, " v"],
    parts: Int[np.ndarray, " v"],
    part_names: tuple[str, ...],
    piece: Int[np.ndarray, " v"],
    face: FacePlace,
) -> Bool[np.ndarray, " v"]:
    """The skin without clothes, bodies and busts."""
    bare = np.isin(parts, [i for i, name in enumerate(part_names) if part_kind(name) in ("skin", "body")])
    chin_y = face.chin_y(neutral[skin])
    inner = triangles[skin[triangles].all(axis=1)]
    for group in (parts, piece):
        skin = skin & ~bodies(neutral, inner, group, face, upper_neck(face, chin_y), bare)
    return above_neck(neutral, skin, face, chin_y)


def _seamless_in(
    neutral: Float[np.ndarray, "v 3"], triangles: Int[np.ndarray, "f 3"], parts: Int[np.ndarray, " v"]
) -> Int[np.ndarray, " v"]:
    """Connected pieces of every part by itself."""
    one = (parts[triangles] == parts[triangles[:, :1]]).all(axis=1)
    apart = neutral + parts[:, None] * (10 * np.ptp(neutral, axis=0).max())
    return _seamless_pieces(apart, triangles[one])


def _named(
    kinds: Collection[PartKind],
    neutral: Float[np.ndarray, "v 3"],
    triangles: Int[np.ndarray, "f 3"],
    parts: Int[np.ndarray, " v"],
    part_names: tuple[str, ...],
) -> Bool[np.ndarray, " v"]:
    """Vertices of the parts of these kinds by name, except for the part with most of the area."""
    area = np.bincount(parts[triangles[:, 0]], triangle_areas(neutral, triangles), len(part_names))
    out = [i for i, name in enumerate(part_names) if part_kind(name) in kinds and area[i] <= area.sum() / 2]
    return np.isin(parts, out)


def _seamless_pieces(neutral: Float[np.ndarray, "v 3"], triangles: Int[np.ndarray, "f 3"]) -> Int[np.ndarray, " v"]:
    """Connected pieces after border vertices on the same spot are taken for one."""
    border = boundary_vertices(triangles)
    spot = np.round(neutral[border] / (SAME_SPOT * max(_diagonal(neutral), 1e-300)))
    _, first, same = np.unique(spot, axis=0, return_index=True, return_inverse=True)
    weld = np.arange(len(neutral))
    weld[border] = border[first[same.ravel()]]
    return pieces(weld[triangles], len(neutral))[weld]


def _diagonal(points: Float[np.ndarray, "v 3"]) -> float:
    """Diagonal of the box around points; 0 where there are none."""
    return float(np.linalg.norm(np.ptp(points, axis=0))) if len(points) else 0.0


def is_ball(points: Float[np.ndarray, "v 3"]) -> bool:
    """Whether all points lie on one sphere, as those of an eyeball do, bulge of the cornea included.

    |x|^2 = 2 c . x + (r^2 - |c|^2), least squares in the centre c and the radius r.
    """
    x = points - points.mean(axis=0)
    solution = np.linalg.lstsq(np.c_[2 * x, np.ones(len(x))], (x**2).sum(axis=1), rcond=None)[0]
    radius = np.sqrt(max(solution[3] + (solution[:3] ** 2).sum(), 1e-12))
    return bool(np.linalg.norm(x - solution[:3], axis=1).std() < ROUND * radius)


def _inside(
    neutral: Float[np.ndarray, "v 3"],
    triangles: Int[np.ndarray, "f 3"],
    seen: Float[np.ndarray, " v"],
    skin: Bool[np.ndarray, " v"],
    rim: float,
) -> Bool[np.ndarray, " v"]:
    """Vertices of `skin` inside mouth, nostrils or sockets, further than `rim` along the skin from what is seen."""
    dim = skin & (seen <= DIM)
    piece = pieces(triangles[dim[triangles].all(axis=1)], len(neutral))
    deep = np.unique(piece[skin & (seen <= HIDDEN)])
    hidden = dim & np.isin(piece, deep)
    if not hidden.any() or hidden[skin].all():
        return np.zeros(len(neutral), dtype=bool)
    near = dijkstra(
        surface_graph(neutral, triangles),
        directed=False,
        indices=np.flatnonzero(skin & ~hidden),
        min_only=True,
        limit=rim,
    )
    return hidden & ~np.isfinite(near)


def _near_enough(neutral: Float[np.ndarray, "v 3"], moving: Bool[np.ndarray, " v"]) -> Bool[np.ndarray, " v"]:
    """Vertices within EXTENT half diagonals of the moving skin, around its middle; all where nothing moves."""
    if not moving.any():
        return np.ones(len(neutral), dtype=bool)
    low, high = neutral[moving].min(axis=0), neutral[moving].max(axis=0)
    return np.linalg.norm(neutral - (low + high) / 2, axis=1) <= EXTENT * np.linalg.norm(high - low) / 2


def _without_islands(
    neutral: Float[np.ndarray, "v 3"], triangles: Int[np.ndarray, "f 3"], skin: Bool[np.ndarray, " v"]
) -> Bool[np.ndarray, " v"]:
    """Skin without scraps that the cuts left over."""
    inner = triangles[skin[triangles].all(axis=1)]
    if len(inner) == 0:
        return np.zeros_like(skin)
    piece = _seamless_pieces(neutral, inner)
    area = piece_areas(neutral, inner, piece)
    used = np.zeros_like(skin)
    used[inner] = True
    return used & (area >= PIECE_AREA * area.max())[piece]
