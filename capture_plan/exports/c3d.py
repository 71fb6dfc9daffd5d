"""Markers as C3D: `markers.c3d`, for Vicon, MotionBuilder and Qualisys. Millimetres, z up, the face looking along -y.

Frames   the neutral on frame 1, expression i on frame i + 1, one a second: poses, no motion; POSES:NAMES says which
Axes     (x, -z, y) of the plan's (x, y, z); POINT:X_SCREEN and Y_SCREEN say so too
Labels   at most 30 signs; beyond 255 they go on in LABELS2, as other strings do here
Origin   CAPTURE_PLAN:PLAN is the plan's number, CAPTURE_PLAN:HEAD whose head it shows
Subject  "face", without a prefix before the labels: Nexus wants one

ezc3d is an extra, `capture-plan[c3d]`. Letters: m markers, e frames.
"""

import importlib.util
from collections.abc import Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from jaxtyping import Float

from capture_plan.errors import PlanError
from capture_plan.exports.delivery import Delivery, posed_dots_mm
from capture_plan.exports.marker_names import plain_names
from capture_plan.exports.units import Z_UP
from capture_plan.output import write_whole
from capture_plan.plan.record import head_words, number_of

LONGEST = 30  # letters of a label that every reader takes
RATE = 1.0  # frames a second
MOST = 255  # strings in one parameter, and letters in each


def write(of: Delivery, folder: Path) -> list[Path]:
    """Write the neutral and every expression, one frame each.

    Raises:
        PlanError: ezc3d is missing.
    """
    if importlib.util.find_spec("ezc3d") is None:
        raise PlanError("C3D needs the library ezc3d: install it with pip install 'capture-plan[c3d]'")
    path = of.place(folder, "markers", ".c3d")
    content = c3d_bytes(
        posed_dots_mm(of.plan, of.inputs) @ Z_UP.T,
        plain_names(of.names, longest=LONGEST),
        [marker.label for marker in of.plan.layout.markers],
        tuple(of.poses),
        said={"PLAN": number_of(of.plan), "HEAD": head_words(of.plan)},
    )
    write_whole(path, content)
    return [path]


def c3d_bytes(
    frames: Float[np.ndarray, "e m 3"],
    labels: Sequence[str],
    described: Sequence[str],
    poses: Sequence[str],
    *,
    said: Mapping[str, str],
) -> bytes:
    """A C3D file of these points, millimetres, z up; with what is `said` of it."""
    import ezc3d  # pyright: ignore[reportMissingImports]

    made = ezc3d.c3d()
    e, m = frames.shape[:2]
    points = np.ones((4, m, e))
    points[:3] = frames.transpose(2, 1, 0)
    made["data"]["points"] = points
    made["data"]["meta_points"]["residuals"] = np.zeros((1, m, e))
    point = made["parameters"]["POINT"]
    point["RATE"]["value"] = [RATE]
    point["UNITS"]["value"] = ["mm"]
    point["LABELS"]["value"] = list(labels)
    if m <= MOST:  # ezc3d splits labels, and garbles descriptions that it has to split
        point["DESCRIPTIONS"]["value"] = [_ascii(text) for text in described]
    made.add_parameter("POINT", "X_SCREEN", ["+X"])
    made.add_parameter("POINT", "Y_SCREEN", ["+Z"])
    made.add_parameter("SUBJECTS", "USED", [1])
    made.add_parameter("SUBJECTS", "NAMES", ["face"])
    made.add_parameter("SUBJECTS", "USES_PREFIXES", [0])
    made.add_parameter("SUBJECTS", "LABEL_PREFIXES", [""])
    made.add_parameter("MANUFACTURER", "SOFTWARE", ["capture-plan"])
    for name, text in said.items():
        made.add_parameter("CAPTURE_PLAN", name, [_ascii(text)])
    for start in range(0, e, MOST):
        number = start // MOST + 1 if start else ""
        made.add_parameter("POSES", f"NAMES{number}", [_ascii(name) for name in poses[start : start + MOST]])
    with TemporaryDirectory() as folder:
        made.write(str(Path(folder) / "made.c3d"))
        return (Path(folder) / "made.c3d").read_bytes()


def _ascii(text: str) -> str:
    return text.encode("ascii", "replace").decode()[:MOST]
