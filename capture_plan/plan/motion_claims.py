"""What a plan says of a recorded take, recomputed without the optimiser and its algebra: one sparse system per layout.

Data   A stiffness of the shell, Y rows of the take, H landmarks, U what is neither a landmark nor fixed
Model  A_UU D_U = -A_UH Y_H,  D_H = Y_H,  0 where fixed;  RMSE = sqrt(mean over the moving skin of |Y_v - D_v|^2)
"""

from pathlib import Path

import numpy as np
from jaxtyping import Int
from scipy.sparse import csc_array
from scipy.sparse.linalg import splu

from capture_plan.layout.design import known_layouts
from capture_plan.layout.face import Face
from capture_plan.layout.record import MotionFit
from capture_plan.layout.take import Skin, Take, skin_of
from capture_plan.plan.claims import Claim, claim
from capture_plan.plan.places import read_take_of
from capture_plan.plan.record import Plan
from capture_plan.plan.summary import quarters

SAME_MM = 1e-4


def motion_claims(plan: Plan, face: Face, folder: Path) -> list[Claim]:
    """The error of the take, with all landmarks, with the first of them, and with other layouts; and what the take
    does not show."""
    fit, layout, rig = plan.layout.motion, plan.layout, face.rig
    take = read_take_of(rig, plan.audit.used, plan.settings, folder, plan.rig.names)
    if fit is None or take is None:
        return [] if fit is None and take is None else [claim("the take is measured", False, "no take, or no error")]
    vertex_of = {m.name: m.vertex for m in layout.landmarks}
    names = layout.order if fit.curve_mm else tuple(vertex_of)
    vertices = np.array([vertex_of[name] for name in names if name in vertex_of], dtype=int)
    skin = skin_of(rig, take, vertices)
    markers = skin.places(vertices)
    found = direct_error(skin, markers)
    claims = [
        claim(
            f"of {fit.frames:,} frames the landmarks leave {fit.rmse_mm:.3f} mm",
            abs(found - fit.rmse_mm) < SAME_MM and fit.frames == take.frames,
            f"{found:.4f} mm by solving the shell directly",
        ),
        claim(
            "blendshapes that the take does not show are listed",
            set(fit.missing) == set(take.missing),
            f"{len(take.missing)} of {len(plan.audit.used)}",
        ),
        reference_claim(plan, face, take, fit),
    ]
    return [*claims, *curve_claims(skin, markers, fit.curve_mm, fit.rmse_mm)] if fit.curve_mm else claims


def reference_claim(plan: Plan, face: Face, take: Take, fit: MotionFit) -> Claim:
    """Other layouts of the face lose of the take what is said."""
    lost = {}
    for name, vertices in known_layouts(face, plan.settings.landmarks).items():
        skin = skin_of(face.rig, take, vertices)
        lost[name] = direct_error(skin, skin.places(np.unique(vertices)))
    return claim(
        "other layouts lose of the take what is said",
        lost.keys() == fit.references_mm.keys()
        and all(abs(lost[name] - fit.references_mm[name]) < SAME_MM for name in lost),
        ", ".join(f"{name} {error:.3f} mm" for name, error in lost.items()),
    )


def curve_claims(
    skin: Skin, markers: Int[np.ndarray, " m"], curve_mm: tuple[float, ...], rmse_mm: float
) -> list[Claim]:
    """The curve is the error of the first landmarks, at a quarter, a half, three quarters and the end of it."""
    counts = [*quarters(len(markers)), len(markers)]
    whole = len(curve_mm) == len(markers)
    off = max(abs(direct_error(skin, markers[:m]) - curve_mm[m - 1]) for m in counts) if whole else np.inf
    least = min(curve_mm)
    return [
        claim(
            "the curve of a take is that of the first landmarks of the order",
            whole and off < SAME_MM and abs(curve_mm[-1] - rmse_mm) < SAME_MM,
            f"{len(counts)} of {len(curve_mm)} places of it, {off:.5f} mm apart at most",
        ),
        claim(
            "no fewer landmarks of the order lose less of the take than all of them",
            curve_mm[-1] <= least + SAME_MM,
            f"{least:.3f} mm at the least, {curve_mm[-1]:.3f} mm with all",
        ),
    ]


def direct_error(skin: Skin, markers: Int[np.ndarray, " m"]) -> float:
    """RMSE, millimetres."""
    A, Y = skin.shell.stiffness, skin.motion.rows
    placed = ~skin.shell.fixed
    placed[markers] = False
    U = np.flatnonzero(placed)
    D = np.zeros_like(Y)
    D[markers] = Y[markers]
    right = -(A[U][:, markers] @ Y[markers])
    solver = splu(csc_array(A[U][:, U]), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
    for column in range(Y.shape[1]):
        D[U, column] = solver.solve(right[:, column])
    s = skin.motion.weights
    return float(np.sqrt(np.square(Y - D).sum(axis=1) @ s / s.sum()))
