"""What a plan says of a recorded take, recomputed without the optimiser: one sparse system per layout.

Data   A stiffness of the shell, Y rows of the take, H landmarks, U what is neither a landmark nor fixed
Model  A_UU D_U = -A_UH Y_H,  D_H = Y_H,  0 where fixed;  RMSE = sqrt(mean of |Y_v - D_v|^2)
"""

import numpy as np
from jaxtyping import Int
from scipy.sparse import csc_array
from scipy.sparse.linalg import splu

from capture_plan.layout.assembly import decided_in
from capture_plan.layout.face import SIXTY_EIGHT, Face
from capture_plan.layout.motion_design import most_telling, pinned_sites
from capture_plan.layout.problem import Task
from capture_plan.layout.record import MotionFit, SubjectFit
from capture_plan.plan.claims import Claim, claim
from capture_plan.plan.record import Plan
from capture_plan.plan.summary import quarters
from capture_plan.shell.take import Take
from capture_plan.shell.takes import Takes

SAME_MM = 1e-4


def motion_claims(plan: Plan, task: Task, takes: Takes | None) -> list[Claim]:
    """The error of the take, with all landmarks, with the first of them, and with other layouts; and what the take
    does not show."""
    fit, layout = plan.layout.motion, plan.layout
    if fit is None or takes is None:
        return [] if fit is None and takes is None else [claim("the take is measured", False, "no take, or no error")]
    vertex_of = {m.name: m.vertex for m in layout.landmarks}
    names = layout.order if fit.curve_mm else tuple(vertex_of)
    vertices = np.array([vertex_of[name] for name in names if name in vertex_of], dtype=int)
    found, missing = direct_error(takes, vertices), takes.missing(plan.audit.used)
    claims = [
        claim(
            f"of {fit.frames:,} frames the landmarks leave {fit.rmse_mm:.3f} mm",
            abs(found - fit.rmse_mm) < SAME_MM and fit.frames == takes.frames,
            f"{found:.4f} mm by solving the shell directly",
        ),
        claim(
            "blendshapes that the take does not show are listed",
            set(fit.missing) == set(missing),
            f"{len(missing)} of {len(plan.audit.used)}",
        ),
    ]
    claims += [*reference_claims(task.face, takes, fit), *subject_claims(takes, vertices, fit.subjects)]
    claims += [order_claim(task, takes, decided_in(layout, task).further)] if layout.method == "motion" else []
    return [*claims, *curve_claims(takes, vertices, fit.curve_mm, fit.rmse_mm)] if fit.curve_mm else claims


def order_claim(task: Task, takes: Takes, chosen: Int[np.ndarray, " n"]) -> Claim:
    """The landmarks stand in the order in which they tell of the take, or in one that is as good everywhere."""
    members = task.sites.members
    own = most_telling(task, takes, np.unique(members(chosen)), pinned_sites(task))
    curves = [np.array(takes.errors(members(one), range(1, len(members(one)) + 1))) for one in (chosen, own)]
    off = float(np.abs(curves[0] - curves[1]).max())
    what = "each landmark of the order tells most of the take, taken away in turn"
    return claim(what, off < SAME_MM, f"the order found again leaves {off:.4f} mm less or more at most")


def subject_claims(takes: Takes, vertices: Int[np.ndarray, " m"], messages: tuple[SubjectFit, ...]) -> list[Claim]:
    """The error of every person, where the takes are of several."""
    if len(takes.subjects) == 1:
        return [claim("the takes are of one person", False, f"{len(messages)} are distinguished")] if messages else []
    names = [tuple(recording.sequence.name for recording in one.recordings) for one in takes.subjects]
    errors = [np.sqrt(direct_squares(one, vertices) / one.motion.weights.sum()) for one in takes.subjects]
    same = [(one.sequences, one.frames) for one in messages] == [
        (own, one.frames) for own, one in zip(names, takes.subjects, strict=True)
    ]
    off = max(abs(one.rmse_mm - mm) for one, mm in zip(messages, errors, strict=True)) if same else np.inf
    return [
        claim(
            f"the takes are of {len(messages)} people: {', '.join(f'{one.rmse_mm:.3f}' for one in messages)} mm",
            bool(off < SAME_MM),
            f"{', '.join(f'{mm:.4f}' for mm in errors)} mm by solving each one's shell directly",
        )
    ]


def reference_claims(face: Face, takes: Takes, fit: MotionFit) -> list[Claim]:
    """What 68 points lose of the take; no other layout can be had again without a solver."""
    if face.points68 is None:
        return []
    lost, message = direct_error(takes, np.unique(face.points68)), fit.references_mm.get(SIXTY_EIGHT, np.inf)
    return [claim(f"{SIXTY_EIGHT} lose {message:.3f} mm of the take", abs(lost - message) < SAME_MM, f"{lost:.4f} mm")]


def curve_claims(
    takes: Takes, vertices: Int[np.ndarray, " m"], curve_mm: tuple[float, ...], rmse_mm: float
) -> list[Claim]:
    """The curve is the error of the first landmarks: everywhere by the weights of each layout, at a quarter, a half,
    three quarters and the end by solving the shell directly."""
    whole = len(curve_mm) == len(vertices)
    every = np.arange(1, len(vertices) + 1)
    by_weights = np.array(takes.errors(vertices, every.tolist()))
    some = np.array([*quarters(len(vertices)), len(vertices)])
    direct = np.array([direct_error(takes, vertices[:m]) for m in some.tolist()])
    message = np.array(curve_mm) if whole else np.full(len(vertices), np.inf)
    off = float(max(np.abs(by_weights - message).max(), np.abs(direct - message[some - 1]).max()))
    return [
        claim(
            "the curve of a take is that of the first landmarks of the order",
            off < SAME_MM and abs(curve_mm[-1] - rmse_mm) < SAME_MM,
            f"{len(every)} places of it, {len(some)} by solving directly, {off:.5f} mm apart at most",
        ),
    ]


def direct_error(takes: Takes, vertices: Int[np.ndarray, " m"]) -> float:
    """RMSE with landmarks at some of the rig's vertices, millimetres."""
    weight = sum(one.motion.weights.sum() for one in takes.subjects)
    return float(np.sqrt(sum(direct_squares(one, vertices) for one in takes.subjects) / weight))


def direct_squares(take: Take, vertices: Int[np.ndarray, " m"]) -> float:
    """sum_v s_v |Y_v - D_v|^2 of one person, square millimetres."""
    A, Y, markers = take.shell.stiffness, take.motion.rows, np.flatnonzero(np.isin(take.at, vertices))
    markers = markers[~take.shell.fixed[markers]]
    placed = ~take.shell.fixed
    placed[markers] = False
    U, D = np.flatnonzero(placed), np.zeros_like(Y)
    if take.holds(markers):  # otherwise the shell floats, and all of the motion is missed
        D[markers] = Y[markers]
        right = -(A[U][:, markers] @ Y[markers])
        solver = splu(csc_array(A[U][:, U]), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
        for column in range(Y.shape[1]):
            D[U, column] = solver.solve(right[:, column])
    return float(np.square(Y - D).sum(axis=1) @ take.motion.weights)
