"""Surface correspondence: the face of one rig laid onto that of another, to carry points from skin to skin.

Unit       the distance between the pupils, of each face its own
Start      the source's face bent by a thin spline through eyes, mouth, nose, chin and ears of both
Face       what lies before the ears, laid onto the target's surface (`nonrigid_icp.py`); the end of the target's mesh
           attracts nothing, for a mask without ears is no narrow face
Beyond     ears, skull and neck follow the same way, from a spline through the face as it lies
Answer     for each point a vertex of the target's skin of its own, or none where no skin is near
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.sparse import csr_array
from scipy.spatial import KDTree

from capture_plan.errors import RigError
from capture_plan.face.anchors import Anchors, face_anchors, face_surface
from capture_plan.mesh import boundary_vertices, vertex_normals
from capture_plan.once import once
from capture_plan.registration.nonrigid_icp import fit, own_nearest, spline_start
from capture_plan.rig import Rig

SMOOTHING = 0.5  # control points are a few millimetres wrong
FACE_ABOVE, FACE_BELOW = 1.2, 0.4  # pupil distances above the eyes and below the chin: the part that is fitted
ABSENT = 0.25  # pupil distances: a point this far from all of the surface is not on the mesh, as ears of a mask
EAR_SIZE = 0.85  # pupil distances from the point furthest to the side to the rim, the lobe and the cheek beside it
OUTSIDE = 0.05  # pupil distances: a point this much nearer to the surface than to the skin is where none is allowed
CONTROLS = 400  # vertices of the fitted face that carry the rest of the head along
CONTROL_POINTS = (
    "eye_left",
    "eye_right",
    "mouth",
    "corner_left",
    "corner_right",
    "nose_tip",
    "chin",
    "ear_left",
    "ear_right",
)


@dataclass(frozen=True, eq=False)
class Carried:
    """Points of a source on a target: skin vertices, and how far from each place the skin lies, millimetres.

    `absent` are points without skin near: the ears on a mask, the chin where a person allows no landmarks. They have
    no vertex: -1.
    """

    vertices: Int[np.ndarray, " m"]
    gaps_mm: Float[np.ndarray, " m"]
    absent: Bool[np.ndarray, " m"]


@dataclass(frozen=True, eq=False)
class Correspondence:
    """Where the vertices `face` of the source came to lie on the target, millimetres; `unit` is its pupil distance."""

    source: Rig
    target: Rig
    face: Int[np.ndarray, " n"]
    places: Float[np.ndarray, "n 3"]
    unit: float

    @cached_property
    def head(self) -> tuple[Int[np.ndarray, " n"], Float[np.ndarray, "n 3"]]:
        """The vertices of the source's whole surface and where they came to lie; those of the face as they are."""
        at, triangles = surface_part(self.source, face_surface(self.source))
        some = np.unique(np.linspace(0, len(self.face) - 1, CONTROLS).astype(int))
        here, there = face_anchors(self.source), face_anchors(self.target)
        a, b = self.source.neutral[self.face[some]], self.places[some]
        if "ears" in here.found and "ears" in there.found:
            a, b = np.vstack([a, control_points(here)[-2:]]), np.vstack([b, control_points(there)[-2:]])
        start = spline_start(self.source.neutral[at], (a, b), here.pupils, self.unit, smoothing=0.0)
        laid = self.unit * fit(start / self.unit, triangles, *surface_of(self.target, self.unit))
        laid[np.searchsorted(at, self.face)] = self.places
        return at, laid

    @property
    def without_partner(self) -> Float[np.ndarray, " v"]:
        """1 for vertices of the source's ears where the target has no ears, 0 elsewhere."""
        here, there = face_anchors(self.source), face_anchors(self.target)
        if "ears" not in here.found or "ears" in there.found:
            return np.zeros(len(self.source.neutral))
        ears = KDTree(control_points(here)[-2:]).query(self.source.neutral)[0]
        return (ears < EAR_SIZE * here.pupils).astype(float)

    def carry(self, weights: csr_array) -> Carried:
        """Each point, a row of `weights` (m v) of the source's vertices, as a vertex of its own of the target's skin.

        Raises:
            RigError: the target has fewer skin vertices than there are points, or a point is not on the source's skin.
        """
        skin, m = np.flatnonzero(self.target.skin), len(weights.indptr) - 1
        if len(skin) < m:
            raise RigError(f"{self.target.name}: {len(skin)} skin vertices for {m} points: a finer mesh is needed")
        p, n = self._lay(weights)
        surface, facing, _ = surface_of(self.target, self.unit)
        allowed = self.target.skin[face_surface(self.target)]
        to_skin, to_surface = (KDTree(to).query(p)[0] for to in (surface[allowed], surface))
        absent = (to_surface > ABSENT) | (to_skin > to_surface + OUTSIDE) | (weights @ self.without_partner > 0)
        vertices = np.full(m, -1)
        vertices[~absent] = skin[own_nearest(p[~absent], n[~absent], surface[allowed], facing[allowed])]
        return Carried(vertices, self.unit * to_skin, absent)

    def _lay(self, weights: csr_array) -> tuple[Float[np.ndarray, "m 3"], Float[np.ndarray, "m 3"]]:
        """Where the points came to lie, in pupil distances, and which way the skin faces there."""
        used = np.unique(weights.indices)
        at, laid = (self.face, self.places) if np.isin(used, self.face).all() else self.head
        if not np.isin(used, at).all():
            raise RigError(f"{self.source.name}: vertex {used[~np.isin(used, at)][0]} is no skin: choose points on it")
        triangles = self.source.triangles[np.isin(self.source.triangles, at).all(axis=1)]
        W = weights[:, at]
        return W @ laid / self.unit, W @ vertex_normals(laid, np.searchsorted(at, triangles))


def correspond(source: Rig, target: Rig) -> Correspondence:
    """The source's face laid onto the target, which holds the answer: the source is mostly the sample."""
    return _laid_onto(target, source)


@once
def _laid_onto(target: Rig, source: Rig) -> Correspondence:
    here, there = face_anchors(source), face_anchors(target)
    u = there.pupils
    at, triangles = face_part(source, here)
    controls = control_points(here), control_points(there)
    start = spline_start(source.neutral[at], controls, here.pupils, u, smoothing=SMOOTHING)
    places = u * fit(start / u, triangles, *surface_of(target, u))
    return Correspondence(source, target, at, places, u)


def transfer(source: Rig, vertices: Int[np.ndarray, " m"], target: Rig) -> Carried:
    """Any layout of one rig, by its vertices, on another rig."""
    one = np.ones(len(vertices))
    weights = csr_array((one, (np.arange(len(vertices)), vertices)), shape=(len(vertices), len(source.neutral)))
    return correspond(source, target).carry(weights)


def surface_of(
    rig: Rig, unit: float
) -> tuple[Float[np.ndarray, "s 3"], Float[np.ndarray, "s 3"], Bool[np.ndarray, " s"]]:
    """Vertices of a rig's surface, in pupil distances, their normals, and which of them do not lie on its outer border.

    The borders of lids and lips are what they are on any face; any other is where somebody's mesh ends.
    """
    surface, anchors = face_surface(rig), face_anchors(rig)
    triangles = rig.triangles[surface[rig.triangles].all(axis=1)]
    ends = np.zeros(len(surface), dtype=bool)
    ends[np.setdiff1d(boundary_vertices(triangles), np.r_[anchors.lids, anchors.lips])] = True
    return rig.neutral[surface] / unit, vertex_normals(rig.neutral, triangles)[surface], ~ends[surface]


def face_part(rig: Rig, anchors: Anchors) -> tuple[Int[np.ndarray, " n"], Int[np.ndarray, "f 3"]]:
    """Surface in front of the ears from neck to forehead: see `surface_part`."""
    u, points = anchors.pupils, rig.neutral
    back = (anchors.ear_left[2] + anchors.ear_right[2]) / 2
    front = face_surface(rig) & (points[:, 2] > back)
    front &= (points[:, 1] > anchors.chin[1] - FACE_BELOW * u) & (points[:, 1] < anchors.eye_left[1] + FACE_ABOVE * u)
    return surface_part(rig, front)


def surface_part(rig: Rig, inside: Bool[np.ndarray, " v"]) -> tuple[Int[np.ndarray, " n"], Int[np.ndarray, "f 3"]]:
    """The vertices of all triangles inside, in rising order, and these triangles, numbered in that order."""
    at, local = np.unique(rig.triangles[inside[rig.triangles].all(axis=1)], return_inverse=True)
    return at, local.reshape(-1, 3)


def control_points(anchors: Anchors) -> Float[np.ndarray, "a 3"]:
    """The points that the start matches, millimetres; the ears last."""
    return np.stack([getattr(anchors, name) for name in CONTROL_POINTS])
