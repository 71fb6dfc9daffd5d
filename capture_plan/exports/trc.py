"""Markers as a TRC table: `markers.trc`, for OpenSim, Cortex and MotionBuilder. Millimetres, +y up, facing +z.

Frames   the neutral on frame 1, expression i on frame i + 1, one a second: poses, no motion
Head     its first line names the file and, where readers skip, which plan it is of

Letters: m markers, e frames.
"""

from itertools import chain
from pathlib import Path

from capture_plan.exports.delivery import Delivery, posed_dots_mm
from capture_plan.exports.marker_names import plain_names
from capture_plan.output import write_whole
from capture_plan.plan.record import words_of

LONGEST = 30  # letters of a label, as readers of C3D expect too
COLUMNS = (
    *("DataRate", "CameraRate", "NumFrames", "NumMarkers", "Units"),
    *("OrigDataRate", "OrigDataStartFrame", "OrigNumFrames"),
)
RATE = 1  # frames a second


def write(of: Delivery, folder: Path) -> list[Path]:
    """Write the neutral and every expression, one frame each."""
    path = of.place(folder, "markers", ".trc")
    names = plain_names(of.names, longest=LONGEST)
    frames = posed_dots_mm(of.plan, of.inputs)
    e, m = frames.shape[:2]
    head = [
        ["PathFileType", 4, "(X/Y/Z)", path.name, words_of(of.plan)],
        COLUMNS,
        [RATE, RATE, e, m, "mm", RATE, 1, e],
        ["Frame#", "Time", *chain.from_iterable((name, "", "") for name in names)],
        ["", "", *chain.from_iterable((f"X{i}", f"Y{i}", f"Z{i}") for i in range(1, m + 1))],
        [],
    ]
    rows = [[i + 1, f"{i / RATE:.3f}", *(f"{x:.4f}" for x in frame.ravel().tolist())] for i, frame in enumerate(frames)]
    write_whole(path, "".join("\t".join(map(str, row)) + "\n" for row in (*head, *rows)).encode())
    return [path]
