"""What every blendshape moves and where, and which of them speak of the face: a hat that is hidden does not.

Data       d[k, v]   deltas in the file's unit; a[v] areas
Letters    e[k, v]   share of a blendshape's energy at a vertex, e = a |d|^2 / sum a |d|^2
           C[k]      its centre, sum e v;  r[k] its radius, the root of sum e |v - C|^2
           D[k]      its direction, sum a |d| d / sum a |d|^2: length 1 where all moves one way, 0 where it spreads
           w[k]      how far it is heeded: 1 by a name of the face, 0.6 without one, 0 where it was set aside
           c, rho    where the face is and how large: middle of all facial energy, its root mean square distance
Left out   what moves with the face and stands beside it (`islands.py`): its deltas count as none
Set aside  by name (hats, hair, bodies, head turns), where it folds what it moves to a third of its size (a part that
           is hidden), where a few vertices fly off (`flying.py`), where it moves no surface (neighbours go each their
           own way, as after vertices were exchanged), where it moves nearly all rigidly (a head turn), or where it lies
           far from the others: what is one skin with theirs, or floats on it as drawn brows do, may lie farther off and
           be wider, since heads are long and mouths small
On four human heads rho is 54 to 77 mm: it is the unit of length until the eyes are found.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.spatial import KDTree

from capture_plan.errors import RigError
from capture_plan.face.edge import cut_off, outer_edge
from capture_plan.face.flying import flying
from capture_plan.face.islands import off_face
from capture_plan.face.moving import moving_pieces
from capture_plan.mesh import edges, pieces, vertex_areas
from capture_plan.names.movements import Movement, movements_of

BY_NAME, WITHOUT_NAME = 1.0, 0.6
NOT_OF_THE_FACE = ("hide or shrink", "head turn", "body", "hair or clothes", "neutral")
MOVES = 0.1  # share of a blendshape's largest displacement
FOLDS = 0.3  # of the extent of what moves: lids that close keep their width, a hat drawn into the head keeps nothing
RIGID = 0.12  # of the motion left after the best rigid fit: a wide open jaw leaves 0.4
MOST_OF_IT = 0.6  # of the area within reach: a jaw that opens moves up to half of a head
CALLED = 2  # blendshapes named for the face, whose size is then the typical one
FAR, FAR_ON_SKIN = 5.0, 10.0  # median radii from the middle of the face; where it moves the skin of that face
TOO_WIDE, WIDE_ON_SKIN = 3.0, 5.0  # median radii; a drawn face that is all angry 3.6
ON_SKIN, FLOATS = 0.5, 0.5  # of a blendshape's energy; median radii above the skin
FEW = 5  # blendshapes
LITTLE = 0.5  # of the usual distance between movements: where each moves a single vertex
SMALLEST = 0.02  # of the diagonal of the pieces that move: a single vertex that moves is no face
ROUNDING = 4e-7  # of the largest coordinate: single precision rounds to a seventh of that
SCRAMBLED, MANY = 0.6, 24  # of what neighbours move, that they move apart: 1 by chance, 25 faces 0.46 at most; vertices
STRETCHED, REORDERED = 2.0, 0.4  # times as long; of all edges: faces that shout have 0.02, other orders 0.57 or more
EXTENT = 3.5  # rho: on a human head past the crown and the throat


@dataclass(frozen=True, eq=False)
class Channels:
    """The figures of the module's docstring; lengths in the unit of the vertices.

    `elsewhere` are blendshapes that are named for a face and lie far from this one. `still` says that all that moves is
    rounding of the coordinates or no surface, which tells of no face. `cut` are those that go on beyond the edge of the
    mesh (`edge.py`). `off_face` are vertices that move with the face and are none of it. `extent` is the largest one of
    the pieces that move, along an axis of the file.
    """

    energy: Float[np.ndarray, "k v"]
    centre: Float[np.ndarray, "k 3"]
    radius: Float[np.ndarray, " k"]
    direction: Float[np.ndarray, "k 3"]
    weight: Float[np.ndarray, " k"]
    movements: tuple[Movement | None, ...]
    elsewhere: Bool[np.ndarray, " k"]
    middle: Float[np.ndarray, " 3"]
    rho: float
    cut: Bool[np.ndarray, " k"]
    off_face: Bool[np.ndarray, " v"]
    extent: float
    still: bool = False

    @property
    def few(self) -> bool:
        """Whether so few blendshapes move the face that they do not show how large it is."""
        return int((self.weight > 0).sum()) < FEW

    @property
    def facial(self) -> Bool[np.ndarray, " k"]:
        """Blendshapes that move the face."""
        return self.weight > 0

    @cached_property
    def moved(self) -> Float[np.ndarray, " v"]:
        """Share of the facial energy at each vertex, every blendshape counted by its weight; sums to 1."""
        return self.weight @ self.energy / self.weight.sum()

    def turned(self, R: Float[np.ndarray, "3 3"]) -> "Channels":
        """The channels in the axes that R turns these into."""
        return replace(self, centre=self.centre @ R.T, direction=self.direction @ R.T, middle=R @ self.middle)

    def placed(self, *kinds: str) -> list[int]:
        """Those of these kinds that show where on the face they are: all but what the edge of the mesh cuts off."""
        return [k for k in self.of(*kinds) if not self.cut[k]]

    def gone(self, *kinds: str) -> bool:
        """Whether the edge of the mesh cuts off most of these kinds: what they move is not on it."""
        rows = self.of(*kinds)
        return 2 * int(self.cut[rows].sum()) > len(rows)

    def of(self, *kinds: str, side: str | None = None) -> list[int]:
        """Facial blendshapes whose names say one of these kinds (of this side, where one is given)."""
        return [
            k
            for k, movement in enumerate(self.movements)
            if movement and movement.kind in kinds and self.weight[k] > 0 and (side is None or movement.side == side)
        ]


def find_channels(
    neutral: Float[np.ndarray, "v 3"],
    triangles: np.ndarray,
    deltas: Float[np.ndarray, "k v 3"],
    names: tuple[str, ...],
) -> Channels:
    """What the blendshapes of a rig move. RigError where none moves a triangle that has an area."""
    found = _all_channels(neutral, triangles, deltas, names)
    if found.still:
        return found
    aside = off_face(neutral, triangles, deltas[found.facial], vertex_areas(neutral, triangles), found.rho)
    if aside.any():
        found = replace(_all_channels(neutral, triangles, deltas * ~aside[:, None], names), off_face=aside)
    return replace(found, cut=cut_off(deltas, ~found.off_face, outer_edge(neutral, triangles, found.rho)))


def _all_channels(
    neutral: Float[np.ndarray, "v 3"],
    triangles: np.ndarray,
    deltas: Float[np.ndarray, "k v 3"],
    names: tuple[str, ...],
) -> Channels:
    """What the blendshapes move, wherever it is."""
    a = vertex_areas(neutral, triangles)
    squared = np.einsum("kvx,kvx->kv", deltas, deltas)
    length, energy = np.sqrt(squared), a * squared
    total = energy.sum(axis=1, dtype=np.float64)
    if not total.any():
        raise RigError("no blendshape moves a triangle that has an area: export the face mesh with its faces")
    moves = total > 0
    energy /= np.where(moves, total, 1)[:, None]
    centre = energy @ neutral
    spread = energy @ (neutral**2).sum(axis=1) - (centre**2).sum(axis=1)
    radius = np.sqrt(np.clip(spread, 0, None))
    D = np.einsum("kv,kvx->kx", a * length, deltas) / np.where(moves, total, 1)[:, None]
    movements = movements_of(names)
    w = np.array([WITHOUT_NAME if movement is None else BY_NAME for movement in movements]) * moves
    folds = np.array([_folds(neutral, delta, far) for delta, far in zip(deltas, length, strict=True)])
    aside = folds | np.array([movement is not None and movement.kind in NOT_OF_THE_FACE for movement in movements])
    part = neutral[moving_pieces(triangles, deltas)]  # a stage that stands still has no say in any size
    smallest = SMALLEST * float(np.linalg.norm(np.ptp(part, axis=0)))
    rounding = length.max(axis=1) < ROUNDING * np.abs(part).max()
    nothing = rounding | scrambled(triangles, deltas, length)
    w = _without(w, reordered(neutral, triangles, deltas))
    w = _without(_without(_without(w, nothing), flying(neutral, triangles, deltas)), aside)
    called = np.array([movement is not None for movement in movements]) & (w > 0)
    apart = np.linalg.norm(centre[w > 0] - np.median(centre[w > 0], axis=0), axis=1)
    least = max(smallest, LITTLE * float(np.median(apart)))
    typical = max(float(np.median(radius[called if called.sum() >= CALLED else w > 0])), least)
    middle, near = _densest(centre, typical, w)
    if (near & called).sum() >= CALLED:
        typical = max(float(np.median(radius[near & called])), least)
    on_skin = _on_one_skin(neutral, triangles, energy, w * near, FLOATS * typical)
    far, wide = np.where(on_skin, FAR_ON_SKIN, FAR), np.where(on_skin, WIDE_ON_SKIN, TOO_WIDE)
    beyond = (np.linalg.norm(centre - middle, axis=1) > far * typical) | (radius > wide * typical)
    if (w > 0).sum() < FEW:  # a jaw and two blinks lie far from each other for their size
        beyond &= ~called
    elsewhere = beyond & called & (radius <= TOO_WIDE * typical)
    w = _without(w, beyond)
    w, middle, rho = _settled(neutral, a, deltas, energy, w, smallest)
    none, nowhere = np.zeros(len(w), dtype=bool), np.zeros(len(neutral), dtype=bool)
    return Channels(
        *(energy, centre, radius, D, w, movements, elsewhere & (w == 0), middle, rho, none, nowhere),
        extent=float(np.ptp(part, axis=0).max()),
        still=bool(nothing.all()),
    )


def _without(w: Float[np.ndarray, " k"], aside: Bool[np.ndarray, " k"]) -> Float[np.ndarray, " k"]:
    """The weights without those set aside; all of them where nothing else is left."""
    retained = np.where(aside, 0, w)
    return retained if retained.any() else w


def _on_one_skin(
    neutral: Float[np.ndarray, "v 3"],
    triangles: Int[np.ndarray, "f 3"],
    energy: Float[np.ndarray, "k v"],
    w: Float[np.ndarray, " k"],
    within: float,
) -> Bool[np.ndarray, " k"]:
    """Which blendshapes move mostly the connected piece that those of weight w move most, or what floats that near."""
    piece = pieces(triangles, energy.shape[1])
    skin = piece == np.bincount(piece, w @ energy).argmax()
    rest = np.flatnonzero(~skin & (energy.max(axis=0) > 0))
    gap, _ = KDTree(neutral[skin]).query(neutral[rest], distance_upper_bound=within)
    skin[rest] = np.isfinite(gap)
    return energy[:, skin].sum(axis=1) > ON_SKIN


def _settled(
    neutral: Float[np.ndarray, "v 3"],
    a: Float[np.ndarray, " v"],
    deltas: Float[np.ndarray, "k v 3"],
    energy: Float[np.ndarray, "k v"],
    w: Float[np.ndarray, " k"],
    smallest: float,
) -> tuple[Float[np.ndarray, " k"], Float[np.ndarray, " 3"], float]:
    """Weights, middle and size of the face once the head's own motion is set aside."""
    middle, rho = _size(neutral, energy, w, smallest)
    near = np.linalg.norm(neutral - middle, axis=1) < EXTENT * rho
    rigid = np.array([k for k in np.flatnonzero(w) if moves_rigidly(neutral[near], a[near], deltas[k, near])])
    if len(rigid):
        w = _without(w, np.isin(np.arange(len(w)), rigid))
        middle, rho = _size(neutral, energy, w, smallest)
    return w, middle, rho


def _size(
    neutral: Float[np.ndarray, "v 3"], energy: Float[np.ndarray, "k v"], w: Float[np.ndarray, " k"], smallest: float
) -> tuple[Float[np.ndarray, " 3"], float]:
    moved = w @ energy / w.sum()
    middle = moved @ neutral
    rho = float(np.sqrt(moved @ ((neutral - middle) ** 2).sum(axis=1)))
    return middle, max(rho, smallest)


def _folds(neutral: Float[np.ndarray, "v 3"], delta: Float[np.ndarray, "v 3"], length: Float[np.ndarray, " v"]) -> bool:
    """Whether a blendshape draws what it moves together to nearly nothing."""
    moving = length > MOVES * length.max()
    points = neutral[moving]
    if len(points) < 2:
        return False
    before, after = (np.linalg.norm(np.ptp(x, axis=0)) for x in (points, points + delta[moving]))
    return bool(after < FOLDS * before)


def scrambled(
    triangles: Int[np.ndarray, "f 3"], deltas: Float[np.ndarray, "k v 3"], length: Float[np.ndarray, "k v"]
) -> Bool[np.ndarray, " k"]:
    """Which blendshapes move many vertices, each its own way: sum |d_i - d_j|^2 over sum |d_i|^2 + |d_j|^2 of edges."""
    i, j = edges(triangles).T
    found = []
    for d, m in zip(deltas, length, strict=True):
        moving = m > MOVES * m.max()
        some = moving[i] | moving[j]
        apart, both = ((d[i[some]] - d[j[some]]) ** 2).sum(), (m[i[some]] ** 2 + m[j[some]] ** 2).sum()
        found.append(moving.sum() >= MANY and apart > SCRAMBLED * both)
    return np.array(found)


def reordered(
    neutral: Float[np.ndarray, "v 3"], triangles: Int[np.ndarray, "f 3"], deltas: Float[np.ndarray, "k v 3"]
) -> Bool[np.ndarray, " k"]:
    """Which blendshapes have all vertices in another order: most edges are far longer then, for the mesh's size."""
    i, j = edges(triangles).T
    length, size = np.linalg.norm(neutral[i] - neutral[j], axis=1), np.linalg.norm(np.ptp(neutral, axis=0))
    found = []
    for shape in (neutral + delta for delta in deltas):
        grown = max(1.0, float(np.linalg.norm(np.ptp(shape, axis=0)) / size))
        longer = np.linalg.norm(shape[i] - shape[j], axis=1) > STRETCHED * grown * length
        found.append((longer & (length > 0)).mean() > REORDERED)
    return np.array(found)


def moves_rigidly(
    points: Float[np.ndarray, "n 3"], a: Float[np.ndarray, " n"], delta: Float[np.ndarray, "n 3"]
) -> bool:
    """Whether most of the head moves, and as one rigid piece: least squares over small rotations w and shifts t.

    d ~ t + w x p, weights a over what moves; the rest of the motion in root mean square over the whole.
    """
    length = np.linalg.norm(delta, axis=1)
    moving = length > MOVES * length.max(initial=0)
    if a[moving].sum() < MOST_OF_IT * a.sum() or moving.sum() < 4:
        return False
    p, d, root = points[moving], delta[moving], np.sqrt(a[moving])[:, None, None]
    p = p - p.mean(axis=0)
    zero = np.zeros(len(p))
    cross = np.stack(
        [
            np.stack([zero, p[:, 2], -p[:, 1]], axis=1),
            np.stack([-p[:, 2], zero, p[:, 0]], axis=1),
            np.stack([p[:, 1], -p[:, 0], zero], axis=1),
        ],
        axis=1,
    )
    A = np.concatenate([np.broadcast_to(np.eye(3), (len(p), 3, 3)), cross, p[:, :, None]], axis=2)  # and a scale
    A, b = (A * root).reshape(-1, 7), (d[:, :, None] * root).ravel()
    rest = b - A @ np.linalg.lstsq(A, b, rcond=None)[0]
    return bool(np.linalg.norm(rest) < RIGID * np.linalg.norm(b))


def _densest(
    centre: Float[np.ndarray, "k 3"], typical: float, w: Float[np.ndarray, " k"]
) -> tuple[Float[np.ndarray, " 3"], Bool[np.ndarray, " k"]]:
    """The place around which most blendshapes lie (mean shift over three typical radii), and which do."""
    some = w > 0
    extent = TOO_WIDE * typical
    near = np.linalg.norm(centre[:, None] - centre, axis=2) < extent
    middle = centre[np.argmax(np.where(some, near @ w, -1))]
    for _ in range(10):
        middle = np.average(centre, axis=0, weights=w * (np.linalg.norm(centre - middle, axis=1) < extent))
    return middle, (np.linalg.norm(centre - middle, axis=1) < extent) & some
