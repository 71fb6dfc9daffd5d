"""The mirror plane and the mirror map of a face: for each vertex, the vertex on the other side.

Letters  v  vertices, millimetres, the subject's left along +x
         c  place of the mirror plane x = c, or of any plane n . x = c
         m  mirror map: vertex m[v] is nearest to the reflection (2 c - x, y, z) of vertex v, or v - 2 (n . v - c) n
Where the mesh is symmetric, m is an involution, m[m[v]] = v, also where vertices coincide (seams, closed lips); a
vertex on the plane is its own mirror image. Elsewhere m[v] is still the nearest, and `mirror_error` says how far off.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial import KDTree

SAMPLE = 2000  # vertices that place the plane: their median is within 1e-3 mm of that over all vertices of a real head
TIE_MM = 0.02  # two vertices this close to the reflection are equally good: seams and closed lips are that exact
NEIGHBOURS = 4  # how many vertices of one place are asked
COARSE, DIRECTIONS, RETAINED = 800, 200, 12  # so many directions are 10 degrees apart: near enough to fall to the plane
COARSE_ROUNDS, ROUNDS = 8, 60
SHARES = (0.2, 0.35, 0.5, 0.65, 0.8)  # of the points on one side: hair on one side only moves the middle that far
EXACT = 1e-3  # of the size: a plane across an axis that mirrors so well needs no search
FINEST = 1e-7  # of the size: below it two points are in one place


@dataclass(frozen=True)
class Plane:
    """All x with normal . x = offset; the normal has length 1, its largest component is positive."""

    normal: tuple[float, float, float]
    offset: float

    def reflect(self, vertices: Float[np.ndarray, "v 3"]) -> Float[np.ndarray, "v 3"]:
        """v - 2 (n . v - c) n."""
        return _reflect(vertices, np.array(self.normal), self.offset)

    def turn(self, vectors: Float[np.ndarray, "*kv 3"]) -> Float[np.ndarray, "*kv 3"]:
        """d - 2 (n . d) n: the mirror image of directions and deltas."""
        n = np.array(self.normal, dtype=vectors.dtype)
        return vectors - 2 * (vectors @ n)[..., None] * n


def reflect(vertices: Float[np.ndarray, "v 3"], c: float) -> Float[np.ndarray, "v 3"]:
    """(2 c - x, y, z)."""
    return np.array([2 * c, 0, 0]) + vertices * np.array([-1, 1, 1])


def mirror_plane(vertices: Float[np.ndarray, "v 3"]) -> float:
    """Place c of the mirror plane x = c, millimetres.

    From each of three starts (0, the middle of the extent, the mean) c = median of (x_v + x_m(v)) / 2 is repeated until
    it stands; the c with the least median error wins.
    """
    tree = KDTree(vertices)
    x = vertices[:, 0]
    some = np.unique(np.linspace(0, len(vertices) - 1, SAMPLE).astype(int))
    best = (np.inf, 0.0)
    for c in (0.0, (x.min() + x.max()) / 2, x.mean()):
        error, image = tree.query(reflect(vertices[some], c))
        for _ in range(30):
            moved = np.median((x[some] + x[image]) / 2)
            if abs(moved - c) < 1e-6:
                break
            c = moved
            error, image = tree.query(reflect(vertices[some], c))
        best = min(best, (round(float(np.median(error)), 6), float(c)), key=lambda found: found[0])
        if best[0] == 0:
            break  # none is better
    return best[1]


def mirror_map(vertices: Float[np.ndarray, "v 3"]) -> Int[np.ndarray, " v"]:
    """Index of the vertex nearest to each vertex's reflection in the mirror plane x = c.

    Example:
        >>> mirror_map(np.array([[-1.0, 0, 0], [0, 1, 0], [1, 0, 0]])).tolist()
        [2, 1, 0]
    """
    return partner_map(vertices, Plane((1.0, 0.0, 0.0), mirror_plane(vertices)), tie=TIE_MM)


def partner_map(vertices: Float[np.ndarray, "v 3"], plane: Plane, *, tie: float) -> Int[np.ndarray, " v"]:
    """Index of the vertex nearest to each vertex's reflection in `plane`; within `tie` two are equally good."""
    near = min(NEIGHBOURS, len(vertices))
    query = KDTree(vertices).query(plane.reflect(vertices), k=near)
    distance, image = (np.reshape(found, (len(vertices), near)) for found in query)
    own = np.arange(len(vertices))
    away = np.abs(vertices @ np.array(plane.normal) - plane.offset)
    mirror = np.where(2 * away <= distance[:, 0] + tie, own, image[:, 0])
    free = mirror[mirror] != own
    for v in np.flatnonzero(free):  # several vertices in one place all chose the same partner: share them out
        for u, distant in zip(image[v], distance[v], strict=True):
            if free[v] and free[u] and u != v and distant <= min(distance[v, 0], distance[u, 0]) + tie:
                mirror[v], mirror[u] = u, v
                free[v] = free[u] = False
    return mirror


def mirror_error(vertices: Float[np.ndarray, "v 3"]) -> Float[np.ndarray, " v"]:
    """Distance in millimetres from each vertex's reflection to the vertex that `mirror_map` gives it."""
    image = vertices[mirror_map(vertices)]
    return np.linalg.norm(reflect(vertices, mirror_plane(vertices)) - image, axis=1)


def find_mirror_plane(vertices: Float[np.ndarray, "v 3"]) -> Plane:
    """The plane that mirrors the points best, whichever way they lie and in whatever unit.

    Starts: the axes, the principal axes, and `DIRECTIONS` spread over a half sphere, each through the mean, the middle
    of the extent and five quantiles; the `RETAINED` stay whose median distance from a reflected point to the nearest
    point is least. Then in turns, as in iterative closest points: q the point nearest to the reflection of p, and the
    plane of least sum w |reflection(p) - q|^2 with w = 1 / (1 + (distance / s)^2)^2, s falling to the median distance,
    so that what has no mirror image (a scar, a missing ear) does not tilt the plane. A cloud of loose hair can: give
    the skin alone.
    """
    middle = vertices.mean(axis=0)
    size = float(np.sqrt(((vertices - middle) ** 2).sum(axis=1).mean()))
    if size == 0 or len(vertices) < 3:
        return Plane((1.0, 0.0, 0.0), float(middle[0]))
    x = (vertices - middle) / size
    full, points = KDTree(x), x[np.unique(np.linspace(0, len(x) - 1, SAMPLE).astype(int))]
    straight = [_refine(full, x, points[::4], n, 0.0, COARSE_ROUNDS) for n in np.eye(3)]
    exact = next((start for start in straight if start[0] < EXACT), None)
    best = exact if exact else _search(full, x, points[::4])
    _, n, c = _refine(full, x, points, *best[1:], ROUNDS)
    n, c = (n, c) if n[np.argmax(np.abs(n))] > 0 else (-n, -c)
    return Plane((float(n[0]), float(n[1]), float(n[2])), float(c * size + n @ middle))


Fit = tuple[float, Float[np.ndarray, " 3"], float]  # median distance, normal and offset of a plane


def _search(full: KDTree, x: Float[np.ndarray, "v 3"], points: Float[np.ndarray, "s 3"]) -> Fit:
    """The best plane from all starts."""
    some = x[np.unique(np.linspace(0, len(x) - 1, COARSE).astype(int))]
    tree = KDTree(some)
    scored = []
    for order, n in enumerate(_directions(x)):
        along = some @ n
        for c in (0.0, (along.min() + along.max()) / 2, *np.quantile(along, SHARES)):
            distance, _ = tree.query(_reflect(some[::4], n, c))
            scored.append((round(float(np.median(distance)), 3), order, float(c), n))
    scored.sort(key=lambda found: found[:3])
    refined = [_refine(full, x, points, n, c, COARSE_ROUNDS) for _, _, c, n in scored[:RETAINED]]
    return refined[min(range(len(refined)), key=lambda i: (round(refined[i][0], 4), i))]


def _directions(x: Float[np.ndarray, "v 3"]) -> Float[np.ndarray, "n 3"]:
    """Axes, principal axes, and directions evenly over a half sphere (a Fibonacci lattice)."""
    _, principal = np.linalg.eigh(x.T @ x)
    i = np.arange(DIRECTIONS) + 0.5
    z, turn = 1 - i / DIRECTIONS, np.pi * (1 + 5**0.5) * i
    r = np.sqrt(1 - z**2)
    return np.vstack([np.eye(3), principal.T[::-1], np.stack([r * np.cos(turn), r * np.sin(turn), z], axis=1)])


def _refine(
    tree: KDTree,
    x: Float[np.ndarray, "v 3"],
    p: Float[np.ndarray, "s 3"],
    n: Float[np.ndarray, " 3"],
    c: float,
    most: int,
) -> Fit:
    """Median distance, normal and offset after up to `most` turns of matching and fitting."""
    distance, near = tree.query(_reflect(p, n, c))
    for turn in range(most):
        q = x[near]
        s = max(float(np.median(distance)) * max(1, 4 - turn), FINEST)
        w = 1 / (1 + (distance / s) ** 2) ** 2
        w /= w.sum()
        m = w @ (p + q) / 2
        # |reflection(p) - q|^2 = |p - q|^2 + 4 (n . (p - m)) (n . (q - m)): least for the smallest eigenvector
        S = ((p - m) * w[:, None]).T @ (q - m)
        _, vectors = np.linalg.eigh(S + S.T)
        new = vectors[:, 0] * np.sign(vectors[:, 0] @ n or 1)
        moved = np.abs(new - n).max() + abs(new @ m - c)
        n, c = new, float(new @ m)
        distance, near = tree.query(_reflect(p, n, c))
        if moved < 1e-9:
            break
    return float(np.median(distance)), n, c


def _reflect(x: Float[np.ndarray, "v 3"], n: Float[np.ndarray, " 3"], c: float) -> Float[np.ndarray, "v 3"]:
    return x - 2 * np.outer(x @ n - c, n)
