"""Where the face is on a scan in any pose: a rig's face laid onto it as it is, from every place and every turn.

Data       x, n     points of the rig's face and their normals;  o the tip of its nose
           q, m     samples of the scan
Variables  R, s, u  rotation, scale within SCALES, translation: x is laid at s R x + u
Cost       of a pose: mean over the best KEPT of all points of |s R x + u - q| + W (1 - R n . m), q the nearest sample
           that faces alike; what is too far costs the same whatever it is
Start      the tip of the nose on places all over the scan, the mean normal around it on theirs, every turn about it
Rounds     fit s, R, u to the nearest samples again (Besl & McKay 1992, trimmed: Chetverikov et al. 2002) and keep the
           better ones, with more points each time
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from capture_plan.mesh import vertex_normals
from capture_plan.registration.surface_samples import FACING_MM, Samples

PLACES_MM = 16.0  # between places where the nose is tried
TURNS = 24
AROUND_MM = 45.0  # of the nose, and of a place, whose mean normal counts
NORMAL_MM = 12.0  # W: what a normal that stands square on the other costs
KEPT = 0.8  # of the points: hair, a beard or a hole takes the others
FARTHEST_MM = 25.0
SCALES = (0.85, 1.18)
ROUNDS = ((40, 0, 1200), (40, 2, 250), (80, 5, 50), (200, 8, 8), (600, 20, 3))  # points, fits, poses kept
STANDS_OUT = 0.3  # of how far a nose stands out from what is around it: where a place does not, it is no nose
SAME_MM = 6.0  # poses whose points lie in the same cells of this side are one
APART_MM = 15.0  # root mean square between two poses that are two
COARSE_MM = 5.0
INEXACT = 0.4  # share by which a sample may lie further than the nearest: three times as fast


@dataclass(frozen=True, eq=False)
class Pose:
    """x is laid at A x + u, millimetres, A = s R; `cost` in millimetres, `runner_up` that of the best one elsewhere."""

    A: Float[np.ndarray, "3 3"]
    u: Float[np.ndarray, " 3"]
    cost: float
    runner_up: float = np.inf

    def lay(self, x: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
        """Points of the rig on the scan."""
        return x @ self.A.T + self.u

    @property
    def scale(self) -> float:
        """How many times as large the laid face is as the rig's, s."""
        return float(np.cbrt(np.linalg.det(self.A)))


@dataclass(frozen=True, eq=False)
class Face:
    """What is laid: points of a rig's face and their normals, evenly spread, millimetres, and the tip of the nose."""

    x: Float[np.ndarray, "n 3"]
    n: Float[np.ndarray, "n 3"]
    nose: Float[np.ndarray, " 3"]

    def some(self, count: int) -> "Face":
        """So many of the points, spread over all of them."""
        pick = np.unique(np.linspace(0, len(self.x) - 1, min(count, len(self.x))).astype(int))
        return Face(self.x[pick], self.n[pick], self.nose)


def find_pose(face: Face, scan: Samples) -> Pose:
    """The pose of least cost over all starts; points of `face` are in the order of a random draw."""
    coarse = scan.thinned(COARSE_MM)
    A, u = _starts(face, coarse)
    cost = np.zeros(len(A))
    for points, fits, kept in ROUNDS:
        few, on = face.some(points), scan if points == ROUNDS[-1][0] else coarse
        for _ in range(fits):
            A, u = _fitted(few, on, A, u)
        cost = _costs(few, on, A, u)
        best = _distinct(few, A, u, np.argsort(cost, kind="stable"), kept)
        A, u, cost = A[best], u[best], cost[best]
    few = face.some(100).x
    laid = np.einsum("bxy,ny->bnx", A, few) + u[:, None]
    other = np.sqrt(np.square(laid - laid[0]).sum(axis=2).mean(axis=1)) > APART_MM
    return Pose(A[0], u[0], float(cost[0]), float(cost[other].min(initial=np.inf)))


def refined(face: Face, scan: Samples, A: Float[np.ndarray, "3 3"], u: Float[np.ndarray, " 3"], fits: int) -> Pose:
    """A pose that is nearly right, fitted again; with no fits its cost is found."""
    few, B, w = face.some(ROUNDS[-1][0]), A[None], u[None]
    for _ in range(fits):
        B, w = _fitted(few, scan, B, w)
    return Pose(B[0], w[0], float(_costs(few, scan, B, w)[0]))


def face_points(
    neutral: Float[np.ndarray, "v 3"],
    at: Int[np.ndarray, " n"],
    triangles: Int[np.ndarray, "f 3"],
    nose: Float[np.ndarray, " 3"],
) -> Face:
    """The part of a rig that is laid, in the order of a seeded draw; `triangles` are of places in `at`."""
    order = np.random.default_rng(0).permutation(len(at))
    normals = vertex_normals(neutral[at], triangles)
    return Face(neutral[at][order], normals[order], nose)


def _starts(face: Face, coarse: Samples) -> tuple[Float[np.ndarray, "b 3 3"], Float[np.ndarray, "b 3"]]:
    """Every place with every turn."""
    places = coarse.thinned(PLACES_MM)
    near = coarse.tree.query_ball_point(places.q, AROUND_MM)
    facing = _unit(np.array([coarse.m[some].sum(axis=0) for some in near]))
    out = np.array([f @ (p - coarse.q[some].mean(axis=0)) for f, p, some in zip(facing, places.q, near, strict=True)])
    around = np.linalg.norm(face.x - face.nose, axis=1) < AROUND_MM
    ahead = _unit(face.n[around].sum(axis=0)[None])[0]
    noses = out >= min(STANDS_OUT * float(ahead @ (face.nose - face.x[around].mean(axis=0))), float(out.max()))
    facing, tips = facing[noses], places.q[noses]
    angle = np.linspace(0, 2 * np.pi, TURNS, endpoint=False)
    about = np.array([_about(ahead, a) for a in angle])
    R = np.einsum("pxy,tyz->ptxz", np.array([_onto(ahead, to) for to in facing]), about)
    u = tips[:, None] - np.einsum("ptxy,y->ptx", R, face.nose)
    return R.reshape(-1, 3, 3), u.reshape(-1, 3)


def _matched(
    face: Face, scan: Samples, A: Float[np.ndarray, "b 3 3"], u: Float[np.ndarray, "b 3"]
) -> tuple[Float[np.ndarray, "b n 3"], Int[np.ndarray, "b n"], Float[np.ndarray, "b n"]]:
    """Where points are laid, their nearest samples, and the cost of each."""
    laid = np.einsum("bxy,ny->bnx", A, face.x) + u[:, None]
    turned = np.einsum("bxy,ny->bnx", A, face.n) / np.cbrt(np.linalg.det(A))[:, None, None]
    _, j = scan.facing_tree.query(np.concatenate([laid, FACING_MM * turned], axis=2).reshape(-1, 6), eps=INEXACT)
    j = j.reshape(laid.shape[:2])
    gap, alike = np.linalg.norm(scan.q[j] - laid, axis=2), np.einsum("bnx,bnx->bn", turned, scan.m[j])
    return laid, j, np.minimum(gap, FARTHEST_MM) + NORMAL_MM * (1 - alike)


def _costs(
    face: Face, scan: Samples, A: Float[np.ndarray, "b 3 3"], u: Float[np.ndarray, "b 3"]
) -> Float[np.ndarray, " b"]:
    cost = np.concatenate([_matched(face, scan, A[part], u[part])[2] for part in _parts(len(A))])
    return np.sort(cost, axis=1)[:, : int(KEPT * cost.shape[1])].mean(axis=1)


def _fitted(
    face: Face, scan: Samples, A: Float[np.ndarray, "b 3 3"], u: Float[np.ndarray, "b 3"]
) -> tuple[Float[np.ndarray, "b 3 3"], Float[np.ndarray, "b 3"]]:
    """Umeyama 1991 for all poses at once, on the best pairs of each."""
    _, j, cost = _matched(face, scan, A, u)
    best = np.argsort(cost, axis=1)[:, : int(KEPT * cost.shape[1])]
    x, y = face.x[best], scan.q[np.take_along_axis(j, best, axis=1)]
    a, b = x.mean(axis=1), y.mean(axis=1)
    dx, dy = x - a[:, None], y - b[:, None]
    U, sigma, Vt = np.linalg.svd(np.einsum("bnx,bny->bxy", dy, dx))
    e = np.ones((len(A), 3))
    e[:, 2] = np.sign(np.linalg.det(U @ Vt))
    s = np.clip((sigma * e).sum(axis=1) / np.square(dx).sum(axis=(1, 2)), *SCALES)
    A = s[:, None, None] * (U * e[:, None]) @ Vt
    return A, b - np.einsum("bxy,by->bx", A, a)


def _distinct(
    face: Face, A: Float[np.ndarray, "b 3 3"], u: Float[np.ndarray, "b 3"], order: Int[np.ndarray, " b"], kept: int
) -> list[int]:
    """The first so many poses of an order that are not one and the same."""
    some, found = face.some(8).x, {}
    laid = np.einsum("bxy,ny->bnx", A[order], some) + u[order, None]
    for pose, cells in zip(order.tolist(), np.round(laid / SAME_MM).reshape(len(order), -1).tolist(), strict=True):
        found.setdefault(tuple(cells), pose)
        if len(found) == kept:
            break
    return list(found.values())


def _parts(count: int) -> list[slice]:
    return [slice(first, first + 2000) for first in range(0, count, 2000)]


def _unit(a: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
    length = np.linalg.norm(a, axis=1, keepdims=True)
    return a / np.where(length > 0, length, 1)


def _about(axis: Float[np.ndarray, " 3"], angle: float) -> Float[np.ndarray, "3 3"]:
    """Rotation about an axis of length 1."""
    K = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


def _onto(a: Float[np.ndarray, " 3"], b: Float[np.ndarray, " 3"]) -> Float[np.ndarray, "3 3"]:
    """A rotation that turns the direction a onto b."""
    axis = np.cross(a, b)
    length = float(np.linalg.norm(axis))
    if length < 1e-9:
        return np.eye(3) if a @ b > 0 else _about(_unit(np.cross(a, np.eye(3)[np.abs(a).argmin()])[None])[0], np.pi)
    return _about(axis / length, float(np.arctan2(length, a @ b)))
