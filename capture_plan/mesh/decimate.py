"""Fewer triangles for a dense scan, on vertices of the scan itself (Garland & Heckbert 1997).

Data      x_v in R^3, triangles; Q_v = sum over the triangles at v of area * p p', p = (n, -n . x) the triangle's plane
          a border edge adds the plane through it that stands on its triangle, so that the outline stays where it is
Collapse  u -> v: u is taken out and its triangles end at v. Cost x_v' (Q_u + Q_v) x_v, the shorter edge first among
          equals; then Q_v takes over Q_u
Allowed   u and v share exactly the corners that their common triangles have (the surface stays a surface); a border
          vertex moves along the border only; no triangle turns by more than `MOST_TURN` or becomes a sliver
A vertex is kept where it is or taken out: all frames of a take follow the collapses of its neutral, and a landmark on
the coarse mesh is a vertex of the scan.
"""

import heapq

import numpy as np
from jaxtyping import Float, Int

from capture_plan.errors import RigError
from capture_plan.mesh.geometry import half_edges, triangle_cross

MOST_TURN = 0.3  # cosine: a normal turns by less than 73 degrees
SLIVER = 0.02  # twice the area over the longest side squared: an equilateral triangle has 0.87
BORDER = 100.0  # a border plane against a triangle's: outlines are seen first
ALIKE = 9  # decimals of a cost that count; on a plane all costs are 0 but for rounding

_Point = tuple[float, ...]


def decimate(
    vertices: Float[np.ndarray, "v 3"], triangles: Int[np.ndarray, "f 3"], faces_wanted: int
) -> tuple[Int[np.ndarray, " n"], Int[np.ndarray, "_ 3"]]:
    """The vertices that stay, by their number in the scan, and triangles of places in that list.

    It ends at `faces_wanted` triangles, or earlier where no collapse is allowed any more.

    Raises:
        RigError: fewer than one triangle is wanted.

    Example:
        >>> rig = sample_rig()
        >>> vertices, triangles = decimate(rig.neutral, rig.triangles, 5000)
        >>> len(triangles), len(vertices) < len(rig.neutral)
        (5000, True)
    """
    if faces_wanted < 1:
        raise RigError(f"{faces_wanted} triangles wanted: give 1 or more")
    left = _Surface(vertices - vertices.mean(axis=0), triangles)
    left.collapse_to(faces_wanted)
    corners = np.array([corner for corner in left.corners if corner], dtype=int).reshape(-1, 3)
    retained, places = np.unique(corners, return_inverse=True)
    return retained, places.reshape(-1, 3).astype(triangles.dtype)


class _Surface:
    """A mesh while it is decimated: `corners` of each triangle (empty when gone), `around` are those at a vertex."""

    def __init__(self, x: Float[np.ndarray, "v 3"], triangles: Int[np.ndarray, "f 3"]) -> None:
        self.x: list[_Point] = [tuple(point) for point in x.tolist()]
        self.corners: list[tuple[int, ...]] = [tuple(corner) for corner in triangles.tolist()]
        self.around: list[set[int]] = [set() for _ in self.x]
        for number, corner in enumerate(self.corners):
            for v in corner:
                self.around[v].add(number)
        self.normal: list[_Point] = [tuple(n) for n in triangle_cross(x, triangles).tolist()]
        self.quadric: list[_Point] = [tuple(q) for q in vertex_quadrics(x, triangles).tolist()]
        self.grown = [0] * len(self.x)  # how often a vertex took over a Q: its edges cost something else then
        self.refused: list[set[int]] = [set() for _ in self.x]
        self.faces = len(triangles)
        self.heap: list[tuple[float, float, int, int, int]] = []

    def collapse_to(self, faces_wanted: int) -> None:
        """The cheapest allowed collapse, again and again."""
        for u in range(len(self.x)):
            self.offer(u, self.neighbours(u))
        while self.faces > faces_wanted and self.heap:
            _, _, u, v, grown = heapq.heappop(self.heap)
            if grown != self.grown[u] + self.grown[v] or not self.around[u]:
                continue
            if self.allowed(u, v):
                self.collapse(u, v)
            else:
                self.refused[u].add(v)

    def neighbours(self, u: int) -> set[int]:
        """Vertices that share a triangle with u."""
        near = {v for number in self.around[u] for v in self.corners[number]}
        near.discard(u)
        return near

    def offer(self, u: int, onto: set[int]) -> None:
        """Collapses of u into the heap; what is there for the same two at another cost is void."""
        for v in onto:
            heapq.heappush(self.heap, (*self.cost(u, v), u, v, self.grown[u] + self.grown[v]))

    def cost(self, u: int, v: int) -> tuple[float, float]:
        """x_v' (Q_u + Q_v) x_v, and the squared length of the edge."""
        x, y, z = self.x[v]
        a, b, c, d, e, f, g, h, i, j = map(float.__add__, self.quadric[u], self.quadric[v])
        cost = x * (a * x + 2 * (b * y + c * z + d)) + y * (e * y + 2 * (f * z + g)) + z * (h * z + 2 * i) + j
        p, q, r = self.x[u]
        return round(max(cost, 0.0), ALIKE), (x - p) ** 2 + (y - q) ** 2 + (z - r) ** 2

    def allowed(self, u: int, v: int) -> bool:
        """The surface stays a surface, its border a border, and no triangle turns over."""
        gone = self.around[u] & self.around[v]
        opposite = {w for number in gone for w in self.corners[number]} - {u, v}
        if not gone or len(opposite) != len(gone) or self.neighbours(u) & self.neighbours(v) != opposite:
            return False
        if len(gone) != 1 and self.on_border(u):
            return False
        if len(gone) == 1 and len(self.around[v]) == 1:
            return False
        return all(self.keeps_its_side(number, u, v) for number in self.around[u] - gone)

    def on_border(self, u: int) -> bool:
        """An edge at u has one triangle: as many neighbours as triangles is a closed fan."""
        return len(self.neighbours(u)) != len(self.around[u])

    def keeps_its_side(self, number: int, u: int, v: int) -> bool:
        """The triangle with u moved onto v."""
        after, longest = self.spanned(self.moved(number, u, v))
        nn, nm, mm = products(self.normal[number], after)
        if mm <= (SLIVER * longest) ** 2:
            return False
        return nn == 0 or nm > MOST_TURN * (nn * mm) ** 0.5

    def moved(self, number: int, u: int, v: int) -> tuple[int, ...]:
        """The triangle's corners with v for u."""
        return tuple(v if w == u else w for w in self.corners[number])

    def spanned(self, corners: tuple[int, ...]) -> tuple[_Point, float]:
        """(b - a) x (c - a), and the squared length of the longest side."""
        (a, b, c), (d, e, f), (g, h, i) = (self.x[w] for w in corners)
        p, q, r = d - a, e - b, f - c
        s, t, w = g - a, h - b, i - c
        longest = max(p * p + q * q + r * r, s * s + t * t + w * w, (g - d) ** 2 + (h - e) ** 2 + (i - f) ** 2)
        return (q * w - r * t, r * s - p * w, p * t - q * s), longest

    def collapse(self, u: int, v: int) -> None:
        """Collapse vertex u into its neighbour v."""
        for number in self.around[u]:
            corner = self.corners[number]
            if v in corner:
                self.corners[number] = ()
                self.faces -= 1
                for w in corner:
                    if w != u:
                        self.around[w].discard(number)
            else:
                self.corners[number] = self.moved(number, u, v)
                self.normal[number], _ = self.spanned(self.corners[number])
                self.around[v].add(number)
        self.around[u] = set()
        self.quadric[v] = tuple(map(float.__add__, self.quadric[u], self.quadric[v]))
        self.grown[v] += 1
        near = self.neighbours(v)
        self.offer(v, near)
        for w in near:  # what was refused beside it may be allowed now
            self.offer(w, self.refused[w] | {v})
            self.refused[w] = set()


def vertex_quadrics(x: Float[np.ndarray, "v 3"], triangles: Int[np.ndarray, "f 3"]) -> Float[np.ndarray, "v 10"]:
    """Q_v, its upper triangle row by row."""
    total = np.zeros((len(x), 10))
    for at, planes, weight in (triangle_planes(x, triangles), border_planes(x, triangles)):
        i, j = np.triu_indices(4)
        Q = weight[:, None] * planes[:, i] * planes[:, j]
        for v in at.T:
            np.add.at(total, v, Q)
    return total


Planes = tuple[Int[np.ndarray, "n _"], Float[np.ndarray, "n 4"], Float[np.ndarray, " n"]]


def triangle_planes(x: Float[np.ndarray, "v 3"], triangles: Int[np.ndarray, "f 3"]) -> Planes:
    """Corners, planes and areas of all triangles."""
    normal, length = _unit(triangle_cross(x, triangles))
    return triangles, planes_through(x[triangles[:, 0]], normal), length / 2


def border_planes(x: Float[np.ndarray, "v 3"], triangles: Int[np.ndarray, "f 3"]) -> Planes:
    """Ends of every border edge, the plane through it that stands on its triangle, and a weight."""
    pairs = half_edges(triangles)
    _, first, count = np.unique(np.sort(pairs, axis=1), axis=0, return_index=True, return_counts=True)
    border = first[count == 1]
    ends, of = pairs[border], border % len(triangles)
    along, length = _unit(x[ends[:, 1]] - x[ends[:, 0]])
    normal, _ = _unit(triangle_cross(x, triangles[of]))
    standing, _ = _unit(np.cross(along, normal))
    return ends, planes_through(x[ends[:, 0]], standing), BORDER * length**2


def planes_through(x: Float[np.ndarray, "n 3"], normal: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 4"]:
    """The planes (n, -n . x) through points with normals n."""
    return np.column_stack([normal, -np.einsum("nx,nx->n", normal, x)])


def _unit(a: Float[np.ndarray, "n 3"]) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, " n"]]:
    """Directions, 0 where there is none, and lengths."""
    length = np.linalg.norm(a, axis=1)
    return a / np.where(length > 0, length, 1)[:, None], length


def products(n: _Point, m: _Point) -> tuple[float, float, float]:
    """n . n, n . m and m . m."""
    (a, b, c), (d, e, f) = n, m
    return a * a + b * b + c * c, a * d + b * e + c * f, d * d + e * e + f * f
