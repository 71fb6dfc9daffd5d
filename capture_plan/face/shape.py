"""What the shape of a head tells without names: its mirror axis, where skin tears apart, balls, and rims of openings.

Region   vertices within EXTENT rho of the middle of the face: bodies and stages do not count
Mirror   m[axis]  60th percentile of the distance in (v, rho n / 2) from a reflected point to the nearest one; normals
         tell a head that is turned within its plane, which places alone do not
Tear     t[i, j] = max over k of |d_ki - d_kj| / (|v_i - v_j| + rho / 25) for neighbours i, j in space: lips and lids
         part where skin meets skin without an edge; 1 is the strain of a wide smile
"""

import re
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from capture_plan.face.channels import EXTENT, Channels
from capture_plan.face.skin import is_ball
from capture_plan.mesh import border_edges, pieces, vertex_areas, vertex_normals

MOST_EXTENT = 12.0  # rho, from a single movement of a lid to the nape
COARSE, SAMPLE = 200, 600  # points that are reflected: to place a plane, to judge it
NORMALS = 0.5  # rho that a turned normal counts for
MIRRORED = 60  # percentile: ears, hair and partings have no image
LOWEST = -4.0  # nats that one axis can lose to the best
NEIGHBOURS = 8
LEAST = 1e-3  # of the facial energy: a piece with less does not move with the face
EYE_PART = re.compile(
    r"sclera|iris|cornea|pupil|eye(?!.?(lash|brow|lid|occl|blend|wet|shadow|socket|tear|lac|line|shell|fluid|glass))",
    re.IGNORECASE,
)
SOFT = 0.04  # rho: closer neighbours than that tear no faster
TORN = 2.5  # tear of lips and lids; cheeks stay below 1
LINK = 0.2  # rho between torn vertices of one opening
CELL, CELLS = 0.15, 32  # rho, and cells to either side of the middle, in which the front is looked for
FRONT = 0.5  # rho behind the front of its cell
TWIN, ALIKE, ASIDE = 0.2, 0.02, 0.3  # share of the facial energy; of the size: unlike, and from middle to middle
LARGE, GAP = 0.2, 0.1  # of the largest area that moves, so brows and eyes are none; of the size of a head
WITHOUT_AXES = ("near", "head", "called_eyes", "lengths", "areas", "piece", "tears", "rims", "doubled", "parted")
COMPACT = 0.45  # least over largest extent of an eyeball, or of the half that shows


@dataclass(frozen=True, eq=False)
class Shape:
    """A rig near its face, in any unit and any axes; `near` are its vertices within reach."""

    neutral: Float[np.ndarray, "v 3"]
    triangles: Int[np.ndarray, "f 3"]
    deltas: Float[np.ndarray, "k v 3"]
    channels: Channels
    parts: Int[np.ndarray, " v"]
    part_names: tuple[str, ...]

    def turned(self, R: Float[np.ndarray, "3 3"]) -> "Shape":
        """The head in the axes that R turns these into, with all that was found of it and tells no axes."""
        if np.array_equal(R, np.eye(3)):
            return self
        deltas = self.deltas @ R.T.astype(self.deltas.dtype)
        other = replace(self, neutral=self.neutral @ R.T, deltas=deltas, channels=self.channels.turned(R))
        vars(other).update({name: value for name, value in vars(self).items() if name in WITHOUT_AXES})
        if "normals" in vars(self):
            vars(other)["normals"] = self.normals @ R.T
        return other

    @cached_property
    def near(self) -> Bool[np.ndarray, " v"]:
        """Vertices of a surface within reach of the face."""
        used = np.zeros(len(self.neutral), dtype=bool)
        used[self.triangles] = True
        away = np.linalg.norm(self.neutral - self.channels.middle, axis=1)
        extent = EXTENT * self.channels.rho
        if self.channels.few:  # one brow says nothing of the size of a head
            of_face = self.piece == self.piece[int(np.argmax(self.channels.moved))]
            extent = max(extent, min(float(away[of_face].max()), MOST_EXTENT * self.channels.rho))
        return used & (away < extent) & ~self.channels.off_face

    @cached_property
    def head(self) -> Bool[np.ndarray, " v"]:
        """Of these the pieces that the face moves: no hat, no stand, no hair of its own."""
        moving = np.bincount(self.piece, self.channels.moved) > LEAST
        of_head = self.near & moving[self.piece]
        return of_head if of_head.any() else self.near

    @cached_property
    def called_eyes(self) -> Bool[np.ndarray, " v"]:
        """Vertices near the face of parts whose names say eyes."""
        return np.isin(self.parts, [i for i, name in enumerate(self.part_names) if EYE_PART.search(name)]) & self.near

    def eye_parts(self, sides: int) -> list[Float[np.ndarray, "2 3"]]:
        """Middles of the parts called eyes on either side of the mirror plane across an axis; nothing without them."""
        aside = self.neutral[:, sides] - self.mirror_across(sides)[1]
        halves = [self.neutral[self.called_eyes & (sign * aside > 0)] for sign in (1, -1)]
        return [np.stack([middle_of_box(half) for half in halves])] if min(map(len, halves)) > 2 else []

    @cached_property
    def lengths(self) -> Float[np.ndarray, "k v"]:
        """How far every blendshape moves every vertex; nothing of what stands beside the face."""
        return np.sqrt(np.einsum("kvx,kvx->kv", self.deltas, self.deltas)) * ~self.channels.off_face

    @cached_property
    def areas(self) -> Float[np.ndarray, " v"]:
        """The area around every vertex, (v)."""
        return vertex_areas(self.neutral, self.triangles)

    @cached_property
    def normals(self) -> Float[np.ndarray, "v 3"]:
        """Unit normals that point out of the head, whichever way its triangles wind."""
        n, a = vertex_normals(self.neutral, self.triangles), self.areas * self.head
        away = self.neutral - a @ self.neutral / a.sum()
        outward = np.einsum("v,vx,vx->", a, away, n)
        return -n if outward < 0 else n

    @cached_property
    def piece(self) -> Int[np.ndarray, " v"]:
        """Connected piece of every vertex."""
        return pieces(self.triangles, len(self.neutral))

    @cached_property
    def doubled(self) -> bool:
        """Whether two pieces of one shape, moved by like shares, stand beside each other: two heads in one file."""
        share = np.bincount(self.piece, self.channels.moved)
        if len(share) < 2 or np.sort(share)[-2] < TWIN:
            return False
        first, second = (self.neutral[self.piece == number] for number in np.argsort(share, kind="stable")[:-3:-1])
        size = float(np.ptp(first, axis=0).max())
        apart = middle_of_box(second) - middle_of_box(first)
        off = KDTree(second).query(first[:: max(1, len(first) // SAMPLE)] + apart)[0]
        return bool(np.linalg.norm(apart) > ASIDE * size and np.median(off) < ALIKE * size)

    @cached_property
    def parted(self) -> bool:
        """Whether two large pieces with a gap between them take like shares of what moves: two unlike heads, or a face
        and a hand."""
        share = np.bincount(self.piece, self.channels.moved)
        if len(share) < 2 or np.sort(share)[-2] < TWIN:
            return False
        area = np.bincount(self.piece, self.areas)
        one, other = np.argsort(share, kind="stable")[:-3:-1]
        if min(area[one], area[other]) < LARGE * area[share > LEAST].max():
            return False
        first, second = (self.neutral[self.piece == number] for number in (one, other))
        gap = np.maximum(first.min(axis=0) - second.max(axis=0), second.min(axis=0) - first.max(axis=0)).max()
        return bool(gap > GAP * np.ptp(first, axis=0).max())

    @cached_property
    def mirror(self) -> Float[np.ndarray, " 3"]:
        """Log likelihood of each axis to be the sideways one."""
        apart = np.array([self.mirror_across(axis)[0] for axis in range(3)]) + 1e-3 * self.channels.rho
        return np.clip(2 * np.log(apart.min() / apart), LOWEST, 0)

    def mirror_across(self, axis: int) -> tuple[float, float]:
        """How far the head is from its mirror image in the best plane across an axis, and where that plane lies."""
        if axis not in self._mirrors:
            self._mirrors[axis] = self._mirror(axis)
        return self._mirrors[axis]

    @cached_property
    def _mirrors(self) -> dict[int, tuple[float, float]]:
        return {}

    def _mirror(self, axis: int) -> tuple[float, float]:
        at = np.flatnonzero(self.near)
        v, n = self.neutral[at], NORMALS * self.channels.rho * self.normals[at]
        return _axis_mirror(v, n, axis, float(self.channels.middle[axis]))

    @cached_property
    def tears(self) -> tuple[Float[np.ndarray, " n"], Int[np.ndarray, "n 2"]]:
        """How far each pair of neighbours in space is torn apart by the worst facial blendshape, and the pairs."""
        rho = self.channels.rho
        at = np.flatnonzero(self.near & (self.channels.moved > 0))
        if len(at) < 2:
            return np.zeros(0), np.zeros((0, 2), dtype=np.int64)
        tree = KDTree(self.neutral[at])
        distance, other = tree.query(self.neutral[at], k=min(NEIGHBOURS + 1, len(at)), distance_upper_bound=LINK * rho)
        i = np.arange(len(at)).repeat(np.size(other) // len(at))
        j, distance = other.ravel(), distance.ravel()
        fits = (j < len(at)) & (i < j)
        i, j, distance = i[fits], j[fits], distance[fits]
        i, j = at[i], at[j]
        torn = np.zeros(len(i))
        for k in np.flatnonzero(self.channels.facial):
            more = np.flatnonzero(self.lengths[k, i] + self.lengths[k, j] > torn)  # no two part by more than that
            apart = np.linalg.norm(self.deltas[k, i[more]] - self.deltas[k, j[more]], axis=1)
            torn[more] = np.maximum(torn[more], apart)
        return torn / (distance + SOFT * rho), np.stack([i, j], axis=1)

    @cached_property
    def openings(self) -> list[tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, " n"]]]:
        """Places and tears of each set of torn neighbours that lie together, the strongest set first."""
        tear, pair = self.tears
        tear, pair = tear[tear > TORN], pair[tear > TORN]
        if len(tear) == 0:
            return []
        place = self.neutral[pair].mean(axis=1)
        links = KDTree(place).query_pairs(LINK * self.channels.rho, output_type="ndarray")
        graph = coo_array((np.ones(len(links), dtype=bool), (links[:, 0], links[:, 1])), shape=(len(place),) * 2)
        count, label = connected_components(graph, directed=False)
        sets = [(place[label == c], tear[label == c]) for c in range(count)]
        return sorted(sets, key=lambda one: -float(one[1].sum()))

    @cached_property
    def front(self) -> Bool[np.ndarray, " v"]:
        """Vertices near the front of what moves, in a head that looks along +z: not throat, palate or nape."""
        rho, middle = self.channels.rho, self.channels.middle
        moving = self.near & (self.channels.moved > 0)
        cell = np.floor((self.neutral[:, :2] - middle[:2]) / (CELL * rho)).astype(np.int64)
        cell = np.clip(cell, -CELLS, CELLS - 1) + CELLS
        number = cell[:, 0] * 2 * CELLS + cell[:, 1]
        front = np.full((2 * CELLS) ** 2, -np.inf)
        np.maximum.at(front, number[moving], self.neutral[moving, 2])
        return moving & (self.neutral[:, 2] > front[number] - FRONT * rho)

    @cached_property
    def balls(self) -> list[Float[np.ndarray, "n 3"]]:
        """Pieces near the face that are balls or half balls, the largest first."""
        numbers, count = np.unique(self.piece[self.near], return_counts=True)
        found = [self.neutral[self.piece == number] for number in numbers[count >= 12]]
        found = [points for points in found if compact(points) and is_ball(points)]
        return sorted(found, key=lambda points: -float(np.prod(np.ptp(points, axis=0))))

    @cached_property
    def rims(self) -> list[Int[np.ndarray, " _"]]:
        """Vertices of every border of the surface near the face, the longest first."""
        return [loop for loop in border_loops(self.triangles) if self.near[loop].all()]


def compact(points: Float[np.ndarray, "n 3"]) -> bool:
    """Whether a piece is as deep as an eyeball, or the half of it that shows."""
    extent = np.ptp(points, axis=0)
    return bool(extent.min() > COMPACT * extent.max())


def middle_of_box(points: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, " 3"]:
    """Middle of the box around points."""
    return (points.min(axis=0) + points.max(axis=0)) / 2


def border_loops(triangles: Int[np.ndarray, "f 3"]) -> list[Int[np.ndarray, " _"]]:
    """Vertices of each connected border of the triangles, the longest border first."""
    edge = border_edges(triangles)
    vertex, index = np.unique(edge, return_inverse=True)
    index = index.reshape(edge.shape)
    graph = coo_array((np.ones(len(edge), dtype=bool), index.T), shape=(len(vertex),) * 2)
    count, label = connected_components(graph, directed=False)
    return sorted((vertex[label == i] for i in range(count)), key=lambda loop: (-len(loop), loop[0]))


def _axis_mirror(
    v: Float[np.ndarray, "n 3"], n: Float[np.ndarray, "n 3"], axis: int, middle: float
) -> tuple[float, float]:
    """Distance to the mirror image in the best plane across an axis, and where that plane lies."""
    flip, along = np.where(np.arange(3) == axis, -1.0, 1.0), np.arange(3) == axis
    places, both = KDTree(v), KDTree(np.hstack([v, n]))
    few, some = (np.unique(np.linspace(0, len(v) - 1, count).astype(int)) for count in (COARSE, SAMPLE))
    best = (np.inf, middle)
    for c in (middle, float(v[:, axis].min() + v[:, axis].max()) / 2):
        for _ in range(8):
            _, image = places.query(v[few] * flip + 2 * c * along)
            moved = float(np.median((v[few, axis] + v[image, axis]) / 2))
            if abs(moved - c) < 1e-4 * np.ptp(v[:, axis]):
                break
            c = moved
        distance, _ = both.query(np.hstack([v[some] * flip + 2 * c * along, n[some] * flip]))
        best = min(best, (float(np.percentile(distance, MIRRORED)), float(c)))
    return best
