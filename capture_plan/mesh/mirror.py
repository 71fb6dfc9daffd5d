"""The mirror map of a face: for each vertex, the vertex on the other side.

Letters  v  vertices, millimetres, the subject's left along +x
         c  place of the mirror plane x = c
         m  mirror map: vertex m[v] is nearest to the reflection (2 c - x, y, z) of vertex v
Where the mesh is symmetric, m is an involution, m[m[v]] = v, also where vertices coincide (seams, closed lips); a
vertex on the plane is its own mirror image. Elsewhere m[v] is still the nearest, and `mirror_error` says how far off.
"""

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial import KDTree

SAMPLE = 2000  # vertices that place the plane: their median is within 1e-3 mm of that over all vertices of a real head
TIE_MM = 0.02  # two vertices this close to the reflection are equally good: seams and closed lips are that exact
NEIGHBOURS = 4  # how many vertices of one place are told apart


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
    return best[1]


def mirror_map(vertices: Float[np.ndarray, "v 3"]) -> Int[np.ndarray, " v"]:
    """Index of the vertex nearest to each vertex's reflection in the mirror plane."""
    c = mirror_plane(vertices)
    near = min(NEIGHBOURS, len(vertices))
    query = KDTree(vertices).query(reflect(vertices, c), k=near)
    distance, image = (np.reshape(found, (len(vertices), near)) for found in query)
    own = np.arange(len(vertices))
    mirror = np.where(2 * np.abs(vertices[:, 0] - c) <= distance[:, 0] + TIE_MM, own, image[:, 0])
    free = mirror[mirror] != own
    for v in np.flatnonzero(free):  # several vertices in one place all chose the same partner: share them out
        for u, away in zip(image[v], distance[v], strict=True):
            if free[v] and free[u] and u != v and away <= min(distance[v, 0], distance[u, 0]) + TIE_MM:
                mirror[v], mirror[u] = u, v
                free[v] = free[u] = False
    return mirror


def mirror_error(vertices: Float[np.ndarray, "v 3"]) -> Float[np.ndarray, " v"]:
    """Distance in millimetres from each vertex's reflection to the vertex that `mirror_map` gives it."""
    image = vertices[mirror_map(vertices)]
    return np.linalg.norm(reflect(vertices, mirror_plane(vertices)) - image, axis=1)
