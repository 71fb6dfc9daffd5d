"""Where the moving part of a face ends: fixed points that hold the shell there (Le et al. 2013, sections 4.1 and 4.6).

Data      reach_v  furthest that vertex v gets from rest, millimetres; a vertex below `still_mm` is still
Line      still vertices beside a moving one, and still vertices on the border of the mesh
Fixed     points of the line 10 mm apart: displacement 0, no markers, not counted
Moving    vertices that move: those where a marker tells something, but for the end of the mesh, the longest border:
          a marker on the cut of a neck stands on no skin
The rims of eyes and mouth are borders that move: nothing holds them, and they carry markers.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from capture_plan.mesh import border_edges, boundary_vertices, edges

STILL_MM = 0.5
APART_MM = 10.0


@dataclass(frozen=True, eq=False)
class Boundary:
    """What `Shell` and `optimise` ask for: `fixed` vertices and the `moving` ones, which are the candidates."""

    fixed: Bool[np.ndarray, " v"]
    moving: Bool[np.ndarray, " v"]


def find_boundary(
    vertices: Float[np.ndarray, "v 3"],
    triangles: Int[np.ndarray, "f 3"],
    extent: Float[np.ndarray, " v"],
    *,
    still_mm: float = STILL_MM,
    apart_mm: float = APART_MM,
) -> Boundary:
    """Fixed points along the line where the motion ends; none where everything moves."""
    moving = extent >= still_mm
    line = ~moving & (neighbours_of(triangles, moving) | np.isin(np.arange(len(moving)), boundary_vertices(triangles)))
    fixed = np.zeros(len(moving), dtype=bool)
    fixed[_spread(vertices, np.flatnonzero(line), apart_mm)] = True
    return Boundary(fixed, moving & ~end_of_mesh(vertices, triangles))


def end_of_mesh(vertices: Float[np.ndarray, "v 3"], triangles: Int[np.ndarray, "f 3"]) -> Bool[np.ndarray, " v"]:
    """Vertices of the longest border."""
    a, b = border_edges(triangles).T
    ends = np.zeros(len(vertices), dtype=bool)
    if len(a):
        loop = connected_components(coo_array((np.ones(len(a)), (a, b)), shape=(len(ends),) * 2), directed=False)[1]
        length = np.bincount(loop[a], weights=np.linalg.norm(vertices[a] - vertices[b], axis=1))
        ends[np.r_[a, b]] = loop[np.r_[a, b]] == length.argmax()
    return ends


def neighbours_of(triangles: Int[np.ndarray, "f 3"], some: Bool[np.ndarray, " v"]) -> Bool[np.ndarray, " v"]:
    """Vertices on an edge with one of some."""
    a, b = edges(triangles).T
    near = np.zeros(len(some), dtype=bool)
    near[a[some[b]]] = True
    near[b[some[a]]] = True
    return near


def _spread(vertices: Float[np.ndarray, "v 3"], at: Int[np.ndarray, " n"], apart_mm: float) -> Int[np.ndarray, " _"]:
    """As many of the vertices `at` as come in turn, each `apart_mm` from all before; no other one fits in."""
    if not len(at):
        return at
    tree, open_ = KDTree(vertices[at]), np.ones(len(at), dtype=bool)
    retained = []
    for i in range(len(at)):
        if open_[i]:
            retained.append(at[i])
            open_[tree.query_ball_point(vertices[at[i]], apart_mm * (1 - 1e-9))] = False
    return np.array(retained)
