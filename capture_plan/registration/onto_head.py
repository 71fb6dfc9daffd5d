"""A rig's neutral laid onto a scan of the actor's head: any topology, any pose, with picked points or without.

Data       x_v          the rig's neutral;  q, m samples of the scan with their normals; millimetres
           y_i          points that a person picked on the scan, each at a place w_i of the rig (a row over vertices)
Pose       similarity from three picks or more, else found (`pose_search.py`); refused where it fits no face
Start      p0 = the neutral in that pose, bent by a thin spline through the picks where there are four or more
Repeat     j(i) = nearest sample in (q, FACING m);  c_i = trust in the pair, 0 at the end of the scan and off the skin
           goal = FOOT of the foot of p on j's plane, the rest of q_j: points slide along the skin, but not freely;
           at the end the foot alone, so that the softest rounds lay the skin down and move nothing along it
           p    = argmin sum_i c_i |p_i - goal_i|² + PICK sum |w p - y|² + b |L (p - p0)|²    for b falling
Rest       what hangs together with the skin follows by L; loose pieces (eyes, teeth) by the similarity that fits
           the spline through the skin best, so that balls stay balls

Error      leaving one out: each pick laid from the others, its distance from where it was picked. Without picks nobody
           measured anything: a rule of thumb found on heads with known places, more where the skin had to be bent far
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.interpolate import RBFInterpolator
from scipy.sparse import csc_array, csr_array, diags_array
from scipy.sparse.linalg import splu
from scipy.spatial import KDTree

from capture_plan.errors import RigError
from capture_plan.face.anchors import face_anchors, face_surface
from capture_plan.mesh import pieces, similarity_fit, vertex_normals
from capture_plan.once import once
from capture_plan.reader.head_scan import HeadScan
from capture_plan.registration.correspondence import face_part, surface_part
from capture_plan.registration.nonrigid_icp import graph_stiffness, spline_start
from capture_plan.registration.pose_search import Face, Pose, face_points, find_pose, refined
from capture_plan.registration.surface_samples import FACING_MM, Samples, sampled
from capture_plan.rig import Rig
from capture_plan.visibility import hemisphere_visibility

FOOT = 0.75
ROUNDS = (*((b, FOOT) for b in np.geomspace(5e4, 200, 11)), *((b, 1.0) for b in np.geomspace(200, 5, 4)))
STRETCHES, RIDGE = 10, 1e-2  # rounds of an affine fit before
FAR_MM, DOUBTFUL_MM = 30.0, 8.0  # pairs further apart are dropped, pairs this far apart count half
PICK = 20.0  # of what a picked point weighs beside a vertex
SURE_MM = 4.2  # cost of a pose: 22 heads had 3.3 at most; wrong poses, animals and things 5.5 and more
LEAD = 1.15  # of the cost of the best pose elsewhere over that of the best
AROUND_NOSE = 1.45  # pupil distances: what a mask has too tells where the face is
FEWEST, MOST_LEFT_OUT = 3, 10  # picks that give a pose; picks that are left out in turn
REFINED = 5  # fits of a pose from picks: those that lie in one plane leave its tilt open
HALF_WIDTH_MM = 25.0  # between picks: nearer together they give no pose
MEDIAN_MM, TAIL_MM = 2.5, 6.0  # 16 heads with known places had medians of 0.8 to 2.3, 95th percentiles of 1.8 to 6.0
MEDIAN_SHARE, TAIL_SHARE = 0.5, 1.3  # of the bending, where that says more
STRAY_MM = 15.0  # from where the others lay a pick: honest ones on 8 people 3.6 at most; exchanged mouth corners 49
OPEN, HIDDEN = 0.25, 0.1  # shares of the hemisphere that see a vertex of the skin, and of what lies below
SUNK_MM, SINKINGS = 2.0, 6
RAYS = 64
CONTROLS = 400
SPLINE_MM = 60.0


@dataclass(frozen=True, eq=False)
class Laid:
    """A rig's neutral on a head.

    Attributes:
        neutral: on the head, millimetres, turned as the rig is: +y up, facing +z.
        rotation, translation: from there to the file's axes, millimetres: R x + t.
        unit_mm: millimetres in one unit of the file.
        cost_mm: of the pose; see SURE_MM.
        left_out_mm: distance of each pick from where the others lay it, by name; empty with fewer than four.
        bent_mm: how far each vertex of the face had to be bent from the rig's own shape in its best size and pose.
    """

    neutral: Float[np.ndarray, "v 3"]
    rotation: Float[np.ndarray, "3 3"]
    translation: Float[np.ndarray, " 3"]
    unit_mm: float
    cost_mm: float
    left_out_mm: Mapping[str, float]
    bent_mm: Float[np.ndarray, " n"]

    def in_file(self, x: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
        """Points in the coordinates and the unit of the head's file."""
        return (x @ self.rotation.T + self.translation) / self.unit_mm

    @property
    def error_mm(self) -> tuple[float, float]:
        """Median and 95th percentile of the error along the skin, millimetres: measured on picks, else estimated."""
        if self.left_out_mm:
            found = np.array(list(self.left_out_mm.values()))
            return float(np.median(found)), float(np.percentile(found, 95))
        return estimated_error(self.bent_mm)


Picks = Mapping[str, tuple[Float[np.ndarray, " v"], Float[np.ndarray, " 3"]]]  # by name: row over vertices, place


def lay_onto_head(rig: Rig, head: HeadScan, picks: Picks | None = None) -> Laid:
    """The rig's neutral on a head; `picks` are in the head file's own coordinates.

    Raises:
        RigError: no face is found on the head, or picks contradict the head or each other.
    """
    picks = picks or {}
    if 0 < len(picks) < FEWEST:
        raise RigError(f"{len(picks)} points picked on {head.name}, expected none, or {FEWEST} or more that lie apart")
    tried = [_posed(rig, head, unit, picks) for unit in head.units_mm]
    unit, scan, pose = min(tried, key=lambda one: one[2].cost)
    if not sure(pose):
        what = "the picked points fit no face of it" if picks else "not sure where the face is"
        raise RigError(
            f"{head.name}: {what} (cost {pose.cost:.1f} mm, a face has {SURE_MM:g} at most, the next best place "
            f"{pose.runner_up:.1f}): " + ("pick again" if picks else "give points with --points, or --unit-mm")
        )
    places = {name: (row, unit * at) for name, (row, at) in picks.items()}
    laid = fitted(rig, scan, pose, places)
    left = _left_out(rig, scan, places) if len(picks) > FEWEST else {}
    refuse_strays(head.name, left)
    R = pose.A / pose.scale
    here = Scene.of(rig)
    bent = np.linalg.norm(laid - _best_similarity(rig.neutral, laid, here.face), axis=1)[here.face]
    return Laid((laid - pose.u) @ R, R, pose.u, unit, pose.cost, left, bent)


def refuse_strays(head: str, left_out_mm: Mapping[str, float]) -> None:
    """RigError where picks lie far from where all others put them: such a pick bends the face out of shape."""
    far = sorted((-mm, name) for name, mm in left_out_mm.items() if mm > STRAY_MM)
    if far:
        names = ", ".join(f"'{name}' ({-mm:.0f} mm)" for mm, name in far)
        raise RigError(
            f"{head}: points lie far from where the others put them: {names}. Left and right are the actor's own; pick "
            "these again, or leave them out"
        )


def sure(pose: Pose) -> bool:
    """Whether a pose shows a face where no other place shows one."""
    return pose.cost <= SURE_MM and pose.runner_up >= LEAD * pose.cost


def estimated_error(bent_mm: Float[np.ndarray, " n"]) -> tuple[float, float]:
    """Median and 95th percentile of the error along the skin where nobody picked points, millimetres."""
    typical = float(np.median(bent_mm))
    return max(MEDIAN_MM, MEDIAN_SHARE * typical), max(TAIL_MM, TAIL_SHARE * typical)


@dataclass(frozen=True, eq=False)
class Scene:
    """What a fit needs of a rig: the vertices `at` of all that hangs together with its skin, their triangles, LᵀL,
    which of them are `drawn` to the scan, the share of the hemisphere that sees each, the face as vertices and
    triangles of these, and its points for the pose."""

    at: Int[np.ndarray, " n"]
    triangles: Int[np.ndarray, "f 3"]
    stiffness: csc_array
    drawn: Bool[np.ndarray, " n"]
    openness: Float[np.ndarray, " n"]
    face: Int[np.ndarray, " a"]
    face_triangles: Int[np.ndarray, "g 3"]
    points: Face

    @staticmethod
    def of(rig: Rig) -> "Scene":
        """The scene of a rig, which holds it."""
        return _scene(rig)


@once
def _scene(rig: Rig) -> Scene:
    anchors, surface = face_anchors(rig), face_surface(rig)
    piece = pieces(rig.triangles, len(rig.neutral))
    with_skin = np.isin(piece, np.unique(piece[surface_part(rig, surface)[0]]))
    at, triangles = surface_part(rig, with_skin)
    face, own = face_part(rig, anchors)
    near = np.linalg.norm(rig.neutral - anchors.nose_tip, axis=1) < AROUND_NOSE * anchors.pupils
    points = face_points(rig.neutral, *surface_part(rig, surface & near), anchors.nose_tip)
    openness = hemisphere_visibility(rig.neutral[at], triangles, np.arange(len(at)), rays=RAYS)
    return Scene(at, triangles, graph_stiffness(triangles, len(at)), surface[at], openness, face, own, points)


def fitted(rig: Rig, scan: Samples, pose: Pose, picks: Picks) -> Float[np.ndarray, "v 3"]:
    """The whole neutral laid onto the scan, in its axes; `picks` in millimetres."""
    scene, start = Scene.of(rig), pose.lay(rig.neutral)
    if len(picks) > FEWEST:
        rows, to = _stacked(picks)
        here = rows @ start  # without a linear part: eyes and mouth lie in one plane, which says nothing of depth
        bend = RBFInterpolator(here / SPLINE_MM, to - here, kernel="linear", degree=0, smoothing=0.1)
        start = start + bend(start / SPLINE_MM)
    else:
        start = _stretched(start, scene, scan)
    p = kept_inside(_bent(start[scene.at], scene, scan, picks), scene)
    laid = start.copy()
    laid[scene.at] = p
    rest = np.setdiff1d(np.unique(rig.triangles), scene.at)
    if len(rest):
        some = np.unique(np.linspace(0, len(scene.face) - 1, CONTROLS).astype(int))
        a, b = start[scene.face[some]], laid[scene.face[some]]
        bent = spline_start(start[rest], (a, b), SPLINE_MM, SPLINE_MM, smoothing=0.1)
        piece = pieces(rig.triangles, len(rig.neutral))[rest]
        for number in np.unique(piece):
            on = piece == number
            x = rig.neutral[rest[on]]
            sR, u = similarity_fit(x, bent[on])
            laid[rest[on]] = x @ sR.T + u
    return laid


def _stretched(start: Float[np.ndarray, "v 3"], scene: Scene, scan: Samples) -> Float[np.ndarray, "v 3"]:
    """The start made wider, longer and deeper as the scan is: argmin sum_i c_i |B x_i + t - goal_i|² + ridge |B|²."""
    x = start[scene.face] - start[scene.face].mean(axis=0)
    size = np.sqrt(np.square(x).mean())
    X, moved = np.column_stack([x / size, np.ones(len(x))]), np.zeros((4, 3))
    triangles = scene.face_triangles
    for _ in range(STRETCHES):
        p = start[scene.face] + X @ moved
        c, away, foot = _pairs(p, vertex_normals(p, triangles), scan)
        goal = p + FOOT * foot + (1 - FOOT) * away - start[scene.face]
        ridge = RIDGE * c.sum() * np.diag([1.0, 1, 1, 0])
        moved = np.linalg.solve((X.T * c) @ X + ridge, (X.T * c) @ goal)
    every = np.column_stack([(start - start[scene.face].mean(axis=0)) / size, np.ones(len(start))])
    return start + every @ moved


def kept_inside(p: Float[np.ndarray, "n 3"], scene: Scene) -> Float[np.ndarray, "n 3"]:
    """What is hidden on the rig, as the linings of nose and mouth are, hidden on the head: a smaller nose would show
    them. What came out is sunk to `SUNK_MM` below the tangent plane at the nearest skin."""
    p, skin = p.copy(), np.flatnonzero(scene.openness > OPEN)
    hidden = np.flatnonzero(scene.openness < HIDDEN)
    for _ in range(SINKINGS):
        seen = hidden[hemisphere_visibility(p, scene.triangles, hidden, rays=RAYS) > OPEN]
        if not len(seen):
            break
        normals = vertex_normals(p, scene.triangles)[skin]
        near = KDTree(p[skin]).query(p[seen])[1]
        above = np.einsum("ix,ix->i", p[seen] - p[skin][near], normals[near])
        p[seen] -= np.maximum(above + SUNK_MM, 0)[:, None] * normals[near]
    return p


def _pairs(
    p: Float[np.ndarray, "n 3"], n: Float[np.ndarray, "n 3"], scan: Samples
) -> tuple[Float[np.ndarray, " n"], Float[np.ndarray, "n 3"], Float[np.ndarray, "n 3"]]:
    """Trust in the nearest sample of each point, the way to it, and the way to the foot on its plane."""
    j = scan.facing_tree.query(np.hstack([p, FACING_MM * n]))[1]
    away = scan.q[j] - p
    gap = np.linalg.norm(away, axis=1)
    facing = np.einsum("nx,nx->n", n, scan.m[j]) > 0.5
    c = facing * scan.inner[j] * (gap < FAR_MM) / (1 + (gap / DOUBTFUL_MM) ** 2)
    return c, away, np.einsum("nx,nx->n", away, scan.m[j])[:, None] * scan.m[j]


def _bent(start: Float[np.ndarray, "n 3"], scene: Scene, scan: Samples, picks: Picks) -> Float[np.ndarray, "n 3"]:
    rows, to = _stacked(picks, scene.at)
    WW, Wy = PICK * (rows.T @ rows), PICK * (rows.T @ (to - rows @ start))
    p = start
    for b, share in ROUNDS:
        c, away, foot = _pairs(p, vertex_normals(p, scene.triangles), scan)
        c = scene.drawn * c
        goal = p + share * foot + (1 - share) * away
        # (C + PICK WᵀW + b LᵀL) (p - start) = C (goal - start) + PICK Wᵀ (y - W start)
        A = csc_array(diags_array(c + 1e-6) + WW + b * scene.stiffness)
        solver = splu(A, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0, options={"SymmetricMode": True})
        p = start + solver.solve(c[:, None] * (goal - start) + Wy)
    return p


def _posed(rig: Rig, head: HeadScan, unit: float, picks: Picks) -> tuple[float, Samples, Pose]:
    """The scan in millimetres, its skin outside, and the best pose on it."""
    scan, face = sampled(unit * head.vertices, head.triangles), Scene.of(rig).points
    if picks:
        rows, to = _stacked({name: (row, unit * at) for name, (row, at) in picks.items()})
        _check_apart(head, to)
        A, u = similarity_fit(rows @ rig.neutral, to)
        _check_sides(head, rows @ rig.neutral, to)
        outside = min((scan, scan.inside_out), key=lambda side: refined(face, side, A, u, 0).cost)
        return unit, outside, refined(face, outside, A, u, REFINED)
    found = find_pose(face, scan)
    if sure(found):
        return unit, scan, found
    other = find_pose(face, scan.inside_out)  # the triangles of some files run the other way round
    return (unit, scan.inside_out, other) if other.cost < found.cost else (unit, scan, found)


def _left_out(rig: Rig, scan: Samples, picks: Picks) -> dict[str, float]:
    """How far each pick lies from where the others lay it, millimetres."""
    names, face = list(picks), Scene.of(rig).points
    asked = np.unique(np.linspace(0, len(names) - 1, min(len(names), MOST_LEFT_OUT)).astype(int))
    away = {}
    for name in (names[i] for i in asked):
        others = {other: pick for other, pick in picks.items() if other != name}
        rows, to = _stacked(others)
        row, place = picks[name]
        laid = fitted(rig, scan, refined(face, scan, *similarity_fit(rows @ rig.neutral, to), REFINED), others)
        away[name] = float(np.linalg.norm(row @ laid - place))
    return away


def _check_apart(head: HeadScan, to: Float[np.ndarray, "m 3"]) -> None:
    spread = np.linalg.svd(to - to.mean(axis=0), compute_uv=False) / np.sqrt(len(to))
    if spread[1] < HALF_WIDTH_MM / 4:
        raise RigError(f"the points picked on {head.name} lie on one line or together: pick eyes, nose and chin")


def _check_sides(head: HeadScan, here: Float[np.ndarray, "m 3"], to: Float[np.ndarray, "m 3"]) -> None:
    """RigError where the picks are the mirror image of the rig's points."""
    flat = here * [-1, 1, 1]
    misses = [np.square(x @ A.T + u - to).sum() for x in (here, flat) for A, u in (similarity_fit(x, to),)]
    if len(to) > FEWEST and 4 * misses[1] < misses[0]:
        raise RigError(
            f"left and right of the points picked on {head.name} are exchanged, or the file is a mirror image: sides "
            "are the actor's own; mirror the file back if its actor is mirrored"
        )


def _best_similarity(
    neutral: Float[np.ndarray, "v 3"], laid: Float[np.ndarray, "v 3"], face: Int[np.ndarray, " a"]
) -> Float[np.ndarray, "v 3"]:
    A, u = similarity_fit(neutral[face], laid[face])
    return neutral @ A.T + u


def _stacked(picks: Picks, at: Int[np.ndarray, " n"] | None = None) -> tuple[csr_array, Float[np.ndarray, "m 3"]]:
    """The rows of the picks, over the vertices `at` alone where these are given, and their places."""
    if not picks:
        return csr_array((0, 0 if at is None else len(at))), np.empty((0, 3))
    rows = csr_array(np.array([row for row, _ in picks.values()]))
    return rows if at is None else rows[:, at], np.array([place for _, place in picks.values()])
