"""Lips, lids, eyeballs and teeth as surfaces that may touch, on any face.

Data      neutral, triangles, regions of the skin, eyeballs by shape, teeth by the name of their part
Lips      skin near the mouth, as far inside as it counts as skin; upper or lower by the shorter way along the skin to
          the upper or the lower lip, since closed lips touch
Lids      the skin that the regions call lids
Outside   of the lips, what faces forward at rest: teeth belong behind it, and before what faces back
Border    vertices where a surface ends: beside them nothing can be said to lie behind it
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import KDTree

from capture_plan.anatomy.regions import FaceRegions
from capture_plan.expressions.movement import regions_of
from capture_plan.face.anchors import eyeballs
from capture_plan.mesh import boundary_vertices, surface_graph, vertex_normals
from capture_plan.mesh.geometry import triangle_cross
from capture_plan.rig import Rig
from capture_plan.rig.parts import part_kind

LIP_ZONE = 0.25  # of the pupil distance, around the opening of the mouth: 16 mm, a lip with its red and its rim
OUTSIDE = 0.3  # forward part of a normal: the red of closed lips has less where they meet
SIDES = ((1, "left"), (-1, "right"))


@dataclass(frozen=True, eq=False)
class ContactSurface:
    """Vertices of a rig, triangles between them counted within `vertices`, and whether each is on the border."""

    vertices: Int[np.ndarray, " m"]
    triangles: Int[np.ndarray, "f 3"]
    border: Bool[np.ndarray, " m"]


Touching = tuple[str, Int[np.ndarray, " n"], ContactSurface]


def touching_surfaces(rig: Rig) -> list[Touching]:
    """What could pass through what: the words for it, the points, and the surface that they must stay in front of."""
    regions = regions_of(rig)
    upper, lower = _lips(rig, regions)
    found = _both_ways(rig, "upper lip", upper, "lower lip", lower)
    lids: list[tuple[str, Bool[np.ndarray, " v"]]] = []
    for sign, side in SIDES:
        of_side = np.sign(rig.neutral[:, 0] - regions.anchors.midline) == sign
        pair = [(f"{side} {half} eyelid", of_side & _is(regions, f"{half} eyelid")) for half in ("upper", "lower")]
        found += _both_ways(rig, *pair[0], *pair[1])
        lids += pair
    for eye in eyeballs(rig)[:2]:
        side = "left" if rig.neutral[eye, 0].mean() > regions.anchors.midline else "right"
        ball = surface(rig, eye, closed=True)
        found += [(f"{lid} through the eyeball", np.flatnonzero(of), ball) for lid, of in lids if lid.startswith(side)]
    teeth = np.isin(rig.parts, [i for i, name in enumerate(rig.part_names) if part_kind(name) == "teeth"]) & ~rig.skin
    forward = vertex_normals(rig.neutral, rig.triangles)[:, 2] > OUTSIDE
    for lip, of in (("upper lip", upper), ("lower lip", lower)):
        outside = surface(rig, of & forward)
        inwards = ContactSurface(outside.vertices, outside.triangles[:, ::-1], outside.border)
        found.append((f"teeth through the {lip}", np.flatnonzero(teeth), inwards))
    return [each for each in found if len(each[1]) and len(each[2].triangles)]


def surface(rig: Rig, which: Bool[np.ndarray, " v"], *, closed: bool = False) -> ContactSurface:
    """The triangles whose corners are all in `which`; those of a `closed` one are turned outwards if they are not."""
    triangles = rig.triangles[which[rig.triangles].all(axis=1)]
    vertices, local = np.unique(triangles, return_inverse=True)
    local = local.reshape(-1, 3)
    if closed and len(local) and _volume(rig.neutral[vertices], local) < 0:
        local = local[:, ::-1]
    border = np.zeros(len(vertices), dtype=bool)
    border[boundary_vertices(local)] = True
    return ContactSurface(vertices, local, border)


def _both_ways(rig: Rig, a: str, of_a: Bool[np.ndarray, " v"], b: str, of_b: Bool[np.ndarray, " v"]) -> list[Touching]:
    return [
        (f"{a} through the {b}", np.flatnonzero(of_a), surface(rig, of_b)),
        (f"{b} through the {a}", np.flatnonzero(of_b), surface(rig, of_a)),
    ]


def _lips(rig: Rig, regions: FaceRegions) -> tuple[Bool[np.ndarray, " v"], Bool[np.ndarray, " v"]]:
    """Which vertices of the skin near the mouth belong to the upper and which to the lower lip."""
    a = regions.anchors
    line = np.concatenate([np.linspace(a.corner_left, a.mouth, 9), np.linspace(a.mouth, a.corner_right, 9)])
    opening = np.concatenate([rig.neutral[a.lips], line])
    zone = rig.skin & (KDTree(opening).query(rig.neutral)[0] <= LIP_ZONE * a.pupils)
    seeds = [np.flatnonzero(zone & _is(regions, lip)) for lip in ("upper lip", "lower lip")]
    if not all(len(each) for each in seeds):
        return np.zeros_like(zone), np.zeros_like(zone)
    graph = surface_graph(rig.neutral, rig.triangles[zone[rig.triangles].all(axis=1)])
    up, down = (dijkstra(graph, directed=False, indices=each, min_only=True) for each in seeds)
    return zone & (up < down), zone & (down < up)


def _is(regions: FaceRegions, name: str) -> Bool[np.ndarray, " v"]:
    return regions.of_vertex == regions.names.index(name)


def _volume(vertices: Float[np.ndarray, "m 3"], triangles: Int[np.ndarray, "f 3"]) -> float:
    """Six times the volume between the triangles and their middle: negative where they face inwards."""
    corner = vertices[triangles[:, 0]] - vertices.mean(axis=0)
    return float(np.einsum("fx,fx->", corner, triangle_cross(vertices, triangles)))
