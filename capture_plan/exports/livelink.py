"""The shot list as a take of Live Link Face: `expressions_livelink.csv`, to preview on heads that ARKit drives.

Columns   Timecode (hours:minutes:seconds:frames, with a fraction of a frame), BlendshapeCount, ARKit's 52, then head
          and eyes, which stay at 0; weights from 0 to 1
Time      60 frames a second: rest, ramp, hold, ramp for each expression in the order of shooting, and rest at the end
Halves    of one that ARKit does not split, browInnerUp_L and _R, give their larger weight

Letters: t frames, b columns, e expressions.
"""

from pathlib import Path

import numpy as np
from jaxtyping import Float

from capture_plan.errors import PlanError
from capture_plan.exports.delivery import Delivery
from capture_plan.exports.rows import write_rows
from capture_plan.names.arkit import base_name
from capture_plan.progress import tell
from capture_plan.rig import Rig

RATE = 60  # frames a second
REST_S, RAMP_S, HOLD_S = 0.5, 0.5, 1.0
SHOWN = 6  # names in a sentence
EYES = ("Blink", "LookDown", "LookIn", "LookOut", "LookUp", "Squint", "Wide")
MOUTH = ("Smile", "Frown", "Dimple", "Stretch")
LIPS = ("Press", "LowerDown", "UpperUp")
SIDES = ("Left", "Right")
ARKIT = (
    *(f"Eye{what}{side}" for side in SIDES for what in EYES),
    *("JawForward", "JawRight", "JawLeft", "JawOpen"),
    *("MouthClose", "MouthFunnel", "MouthPucker", "MouthRight", "MouthLeft"),
    *(f"Mouth{what}{side}" for what in MOUTH for side in SIDES),
    *("MouthRollLower", "MouthRollUpper", "MouthShrugLower", "MouthShrugUpper"),
    *(f"Mouth{what}{side}" for what in LIPS for side in SIDES),
    *("BrowDownLeft", "BrowDownRight", "BrowInnerUp", "BrowOuterUpLeft", "BrowOuterUpRight"),
    *("CheekPuff", "CheekSquintLeft", "CheekSquintRight", "NoseSneerLeft", "NoseSneerRight", "TongueOut"),
)
TURNS = tuple(f"{what}{turn}" for what in ("Head", "LeftEye", "RightEye") for turn in ("Yaw", "Pitch", "Roll"))


def write(of: Delivery, folder: Path) -> list[Path]:
    """Write the take.

    Raises:
        PlanError: no blendshape of the expressions is one of ARKit's.
    """
    used = list(dict.fromkeys(name for pose in of.poses.values() for name in pose))
    column = {name: at for name in used if (at := column_of(of.inputs.rig, name)) is not None}
    others = [name for name in used if name not in column]
    if not column:
        raise PlanError(
            f"no preview for Live Link: none of the {len(used)} blendshapes of the expressions is known as one of "
            f"ARKit's ({', '.join(others[:SHOWN])}, ...): say which are with a name map, --names, and plan again"
        )
    if others:
        tell([f"note: {len(others)} blendshapes are none of ARKit's and stay at 0: {', '.join(others[:SHOWN])}"])
    weights = take(peaks(list(of.poses.values())[1:], column))
    rows = [
        [timecode(frame), len(ARKIT) + len(TURNS), *(f"{w:.6f}" for w in row), *("0.000000" for _ in TURNS)]
        for frame, row in enumerate(weights.tolist())
    ]
    path = of.place(folder, "expressions_livelink", ".csv")
    return [write_rows(path, [["Timecode", "BlendshapeCount", *ARKIT, *TURNS], *rows])]


def column_of(rig: Rig, name: str) -> int | None:
    """The column of ARKit's that shows a blendshape of the rig; None where none does."""
    known = rig.arkit(name)
    for each in (known, base_name(known)) if known else ():
        title = each[:1].upper() + each[1:]
        if title in ARKIT:
            return ARKIT.index(title)
    return None


def peaks(poses: list[dict[str, float]], column: dict[str, int]) -> Float[np.ndarray, "e b"]:
    """The weights of each expression in ARKit's columns; of several in one the largest."""
    found = np.zeros((len(poses), len(ARKIT)))
    for row, pose in zip(found, poses, strict=True):
        for name, weight in pose.items():
            if name in column:
                row[column[name]] = max(row[column[name]], weight)
    return found


def take(held: Float[np.ndarray, "e b"]) -> Float[np.ndarray, "t b"]:
    """Frames that rest, ramp to each row, hold it, ramp back, and rest at the end."""
    rest, ramp, hold = (round(seconds * RATE) for seconds in (REST_S, RAMP_S, HOLD_S))
    rising = np.arange(1, ramp + 1) / ramp
    shape = np.concatenate([np.zeros(rest), rising, np.ones(hold), rising[::-1] - 1 / ramp])
    return np.concatenate([*(np.outer(shape, row) for row in held), np.zeros((rest, held.shape[1]))])


def timecode(frame: int) -> str:
    """A frame's time as Live Link Face writes it: '00:00:01:30.000' is one second and a half."""
    seconds, frames = divmod(frame, RATE)
    return f"{seconds // 3600:02d}:{seconds // 60 % 60:02d}:{seconds % 60:02d}:{frames:02d}.000"
