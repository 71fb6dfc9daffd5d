"""Rigid head markers: where the skin stays on the skull, and what a head pose fitted to such markers is worth.

Data       a[v]     largest displacement of skin vertex v over the used blendshapes, millimetres
           l[v]     how well v is seen, 0 to 1
           sectors  places far apart from each other where skin lies on bone: temples, forehead, bridge of the nose
Candidate  v in a sector with a[v] <= limit; the limit is RIGID_MM and rises in steps of it until CHOICE vertices fit
Cost       a[v] / RIGID_MM + 1 - l[v]

Fit        x_i = R x_i + t + noise over m markers, small rotations w, about the markers' middle (r_i = x_i - middle):
           cov w = s² J^-1,  J = sum_i |r_i|² I - r_i r_i',   cov t = s² / m I,   w and t uncorrelated
At d       E |w x d + t|² = s² (|d|² tr J^-1 - d' J^-1 d + 3 / m)      for a point d away from the middle
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from capture_plan.anatomy.performed_deltas import performed_deltas
from capture_plan.anatomy.regions import FaceRegions, face_regions
from capture_plan.camera import Camera
from capture_plan.errors import InfeasibleError
from capture_plan.face.blocking import opaque_triangles
from capture_plan.layout.face import Face
from capture_plan.layout.record import HeadPose
from capture_plan.visibility import camera_visibility, global_visibility

SECTORS = ("left temple", "right temple", "middle forehead", "nose bridge", "left forehead", "right forehead")
HEAD_LAYOUTS = {3: (0, 1, 2), 4: (0, 1, 2, 3), 5: (0, 1, 3, 4, 5)}  # number of markers: sectors that get one each
SPARE = (3, 2, 4, 5)  # sectors that stand in for one whose still skin is hidden, the first that is seen
RIGID_MM = 0.5  # what skin slides over the skull at rest; an assumption of ours, no source found
MOST_MM = 3.0  # beyond it a marker follows the expression more than the head
CHOICE = 3  # vertices from which a marker can still keep its distance to others
FOREHEAD_FROM = 0.55  # of the pupil distance: above the brows
MIDDLE_WITHIN, SIDES_WITHIN = 0.35, 0.9  # of the pupil distance: from the midline; further out is too near the temple
BRIDGE = (-0.4, 0.12, 0.16)  # of the pupil distance: from, to above the eye line; half breadth
TRAGUS = (-0.5, 0.75)  # of the pupil distance: from below the eye line; as far in front of the ear's widest place


@dataclass(frozen=True, eq=False)
class HeadSites:
    """Candidates for rigid head markers. `sector[n]` and `limit_mm[sector]` count as `SECTORS` does.

    `limit_mm` is how far candidates of a sector move at most, 0 where a sector has none; `notes` say where it had to
    rise above `RIGID_MM`.
    """

    vertices: Int[np.ndarray, " n"]
    motion_mm: Float[np.ndarray, " n"]
    sector: Int[np.ndarray, " n"]
    visibility: Float[np.ndarray, " n"]
    limit_mm: tuple[float, ...]
    notes: tuple[str, ...]

    @property
    def cost(self) -> Float[np.ndarray, " n"]:
        """a / RIGID_MM + 1 - l: a marker that never moves and is seen from everywhere costs nothing."""
        return self.motion_mm / RIGID_MM + 1 - self.visibility


def head_candidates(face: Face, cameras: tuple[Camera, ...] = ()) -> HeadSites:
    """Skin that hardly moves in each sector; seen from anywhere or, where they are known, from the cameras."""
    rig, motion = face.rig, face.displacement.max(axis=0)
    found, limits, notes = [], [], []
    for name, place in zip(SECTORS, _sectors(face), strict=True):
        vertices, limit = _still(np.flatnonzero(place & face.places), motion)
        found.append(vertices)
        limits.append(limit)
        if limit == 0:
            notes.append(f"{name}: no skin moves less than {MOST_MM:g} mm, so no rigid marker fits there")
        elif limit > RIGID_MM:
            notes.append(
                f"{name}: no {CHOICE} vertices move less than {RIGID_MM:g} mm, so up to {limit:g} mm are let in"
            )
    vertices = np.concatenate(found)
    deltas = performed_deltas(rig, face.used)
    if cameras:
        visibility = camera_visibility(rig.neutral, deltas, opaque_triangles(rig), vertices, cameras)
    else:
        visibility = global_visibility(rig.neutral, deltas, opaque_triangles(rig), vertices)
    sector = np.repeat(np.arange(len(SECTORS)), [len(of_sector) for of_sector in found])
    return HeadSites(vertices, motion[vertices], sector, visibility, tuple(limits), tuple(notes))


def sectors_for(found: HeadSites, count: int, least: float) -> tuple[int, ...]:
    """The sectors of so many head markers; one of whose still skin none is seen from `least` of the directions (or by
    as many cameras) gives way to another, where there is one."""
    seen, wanted = set(found.sector[found.visibility >= least].tolist()), HEAD_LAYOUTS.get(count, ())
    spare = [q for q in SPARE if q in seen and q not in wanted]
    return tuple(q if q in seen or not spare else spare.pop(0) for q in wanted)


def pose_error(points: Float[np.ndarray, "m 3"], face: Float[np.ndarray, "v 3"], noise_mm: float) -> HeadPose:
    """What a rigid fit of m head markers leaves, each coordinate measured with the standard deviation `noise_mm`.

    `face` are the points over which the error at the surface is averaged.

    Raises:
        InfeasibleError: fewer than three markers, or all in one line.
    """
    middle = points.mean(axis=0)
    r = points - middle
    # J = sum_i |r_i|² I - r_i r_i'
    J = (r**2).sum() * np.eye(3) - r.T @ r
    if len(points) < 3 or not np.linalg.eigvalsh(J)[0] > 1e-9 * np.trace(J):
        raise InfeasibleError(
            f"{len(points)} head markers in one line fix no head pose: give three that span a triangle"
        )
    inverse = np.linalg.inv(J)
    d = face - middle
    turned = (d**2).sum(axis=1) * np.trace(inverse) - np.einsum("vx,xy,vy->v", d, inverse, d)
    return HeadPose(
        rotation_degrees=float(np.degrees(noise_mm * np.sqrt(np.trace(inverse)))),
        translation_mm=float(noise_mm * np.sqrt(3 / len(points))),
        surface_mm=float(noise_mm * np.sqrt((turned + 3 / len(points)).mean())),
    )


def _still(place: Int[np.ndarray, " p"], motion: Float[np.ndarray, " v"]) -> tuple[Int[np.ndarray, " n"], float]:
    """The vertices of a place that move least, and the limit that lets them in; the best there are below MOST_MM."""
    vertices = place[:0]
    for step in range(1, round(MOST_MM / RIGID_MM) + 1):
        vertices = place[motion[place] <= step * RIGID_MM]
        if len(vertices) >= CHOICE:
            return vertices, step * RIGID_MM
    return vertices, MOST_MM if len(vertices) else 0.0


def _sectors(face: Face) -> list[Bool[np.ndarray, " v"]]:
    """Skin of each of SECTORS; none of it is scalp, ear or neck."""
    regions = face_regions(face.rig)
    anchors, u = regions.anchors, regions.anchors.pupils
    eyes, ear = (anchors.eye_left + anchors.eye_right) / 2, (anchors.ear_left + anchors.ear_right) / 2
    x, y, z = ((face.rig.neutral - [anchors.midline, eyes[1], ear[2]]) / u).T
    before_ear = _is(regions, "cheek") & (y > TRAGUS[0]) & (z < TRAGUS[1])
    temple = _is(regions, "temple") | before_ear
    forehead = _is(regions, "forehead") & (y > FOREHEAD_FROM)
    bridge = (_is(regions, "nose") | _is(regions, "brow")) & (y > BRIDGE[0]) & (y < BRIDGE[1]) & (np.abs(x) < BRIDGE[2])
    sides = [forehead & (s * x > MIDDLE_WITHIN) & (s * x < SIDES_WITHIN) for s in (1, -1)]
    middle = forehead & (np.abs(x) <= MIDDLE_WITHIN)
    return [
        temple & (x > 0),
        temple & (x < 0),
        middle,
        bridge,
        *sides,
    ]


def _is(regions: FaceRegions, name: str) -> Bool[np.ndarray, " v"]:
    return regions.of_vertex == regions.names.index(name)
