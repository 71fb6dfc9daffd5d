"""The cameras that a person gives, in the frame of a head: a preset, a measured helmet, a file, or another program's
calibration and what is known of it.

    [calibration]             # in a TOML file; a file of another program; what is left out is found
    file = "session.xcp"      # beside this file
    unit = "metres"           # also axes, pose, mirrored and world, as `frame.py` lists them
    size = [4096, 3000]       # of the images, where the format does not hold it
    slip_mm = 20              # how far the head may leave its place, or a helmet slip on it, and turn; left out: 0
    slip_degrees = 15

    [align]                   # left out: from where the head stands upright in the pictures
    nose_tip = [0.012, 1.58, 0.31]      # three or more places of the head, in the calibration's own frame and unit
    eye_outer_left = [0.053, 1.615, 0.276]
    eye_outer_right = [-0.029, 1.615, 0.276]
    points = "placed.csv"     # or in a file with rows nose_tip,x,y,z; names of dots too, where a plan is checked
    philtrum = true           # or nothing but this: all cameras are aimed at the upper philtrum, the face upright
"""

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from capture_plan.camera.align import AtPhiltrum, check_places, in_unit, middle_of_view, places_of
from capture_plan.camera.blind import mends, misplaced
from capture_plan.camera.calibration import UNITS, Calibration
from capture_plan.camera.camera import Camera, Slip
from capture_plan.camera.fields import numbers
from capture_plan.camera.frame import AS_STATED, AXES, HEAD_WORLD, POSES, WORLDS, find_frame
from capture_plan.camera.own import SLIP, slip_of
from capture_plan.camera.presets import PRESETS, head_mounted, is_preset, preset
from capture_plan.camera.read import GIVE, read_cameras
from capture_plan.errors import RigError
from capture_plan.input.documents import read_toml
from capture_plan.input.points import read_points
from capture_plan.progress import tell

Known = Callable[[], Mapping[str, Float[np.ndarray, "3"]]]  # places of the head (mm) by name, found when asked for


def cameras_for(
    spec: str, neutral: Float[np.ndarray, "v 3"], skin: Bool[np.ndarray, " v"], known: Known = dict
) -> tuple[Camera, ...]:
    """The cameras of a preset, placed in front of this face, or of a camera file: whichever `spec` names; `known` are
    places of the head that a file may align by.

    Raises:
        RigError: it is neither, or the cameras are not where they see the face; the line says what to change.

    Example:
        >>> rig = sample_rig()
        >>> [camera.name for camera in cameras_for("head-mounted-pair", rig.neutral, rig.skin)]
        ['boom top', 'boom bottom']
    """
    return about_head(_given(spec, neutral[skin], known), neutral[skin])


def about_head(cameras: Sequence[Camera], head: Float[np.ndarray, "v 3"]) -> tuple[Camera, ...]:
    """Cameras whose head turns about its own middle, where it may slip."""
    middle = head.mean(axis=0).tolist()
    return tuple(
        replace(one, slip=Slip(one.slip.mm, one.slip.degrees, tuple(middle))) if one.slip else one for one in cameras
    )


def _given(spec: str, head: Float[np.ndarray, "v 3"], known: Known) -> tuple[Camera, ...]:
    if is_preset(spec):
        return preset(spec, head)
    path = Path(spec)
    if not os.path.exists(path):
        raise RigError(f"cameras: '{spec}' is neither a file nor one of {', '.join(PRESETS)}")
    content = read_toml(path, RigError, GIVE) if path.suffix.lower() == ".toml" and path.is_file() else {}
    if "head_mounted" in content and "cameras" in content:
        raise RigError(f"{path}: has [[cameras]] and [head_mounted]: keep the one that you measured")
    if "align" in content and "calibration" not in content:
        raise RigError(
            f"{path}: [align] stands without [calibration]: name the file whose frame its places are in, as "
            '[calibration] file = "session.toml"'
        )
    if "head_mounted" in content:
        return head_mounted(content["head_mounted"], f"{path}, head_mounted", head)
    if "calibration" in content and "cameras" not in content:
        return stated_calibration(content, path, head, known)
    return in_head_frame(read_cameras(path), str(path), head)


def in_head_frame(
    read: Calibration, what: str, head: Float[np.ndarray, "v 3"], given: dict[str, object] | None = None
) -> tuple[Camera, ...]:
    """The cameras of a calibration in the frame of a head (millimetres); how they were read is told.

    RigError where no camera has the head in its picture; `what` opens its line.
    """
    if not np.ptp(head, axis=0).all():  # no head to judge by
        return read.cameras
    if not read.in_head_frame or given:
        found = find_frame(read, head, what, given)
        tell([f"{what}: {line}" for line in (found.said, *read.notes)])
        return found.cameras
    wrong = [line for camera in read.cameras if (line := misplaced(camera, head))]
    if len(wrong) == len(read.cameras):
        raise RigError(f"{what}: {wrong[0]}")
    if wrong:
        check_together(read, what, head)
    tell([f"{what}: {line}" for line in wrong if "behind the head" not in line])
    return read.cameras


def check_together(read: Calibration, what: str, head: Float[np.ndarray, "v 3"]) -> None:
    """RigError where cameras that are written in the head's frame have the head upright in more of their pictures when
    they are read otherwise."""
    try:
        found = find_frame(read, head, what)
    except RigError as error:
        if "several readings" in str(error):
            raise
        return  # what is wrong with each is told
    if (how := found.convention.words(read.unit)) != "nothing":
        mend = mends(found.convention)
        raise RigError(
            f"{what}: {len(found.cameras)} cameras have the head upright in their pictures only with {how}: {mend}"
        )


def stated_calibration(
    content: Mapping[str, Any], path: Path, head: Float[np.ndarray, "v 3"], known: Known = dict
) -> tuple[Camera, ...]:
    """The cameras of the file that a [calibration] table names, in the convention that it states, left open or not,
    and aligned as an [align] table says."""
    table, where = content["calibration"], f"{path}, calibration"
    allowed: dict[str, tuple[object, ...]] = {
        "unit": tuple(UNITS),
        "axes": AXES[:2],
        "pose": POSES,
        "world": WORLDS,
        "mirrored": (True, False),
    }
    if not isinstance(table, dict) or not isinstance(table.get("file"), str):
        raise RigError(f"{where}: write file = the camera file, and what you know of {', '.join(allowed)} and size")
    for key, value in table.items():
        if key not in {*allowed, "file", "size", *SLIP}:
            raise RigError(
                f"{where}: unknown key '{key}': known are file, size, {', '.join(allowed)}, {', '.join(SLIP)}"
            )
        if key in allowed and value not in allowed[key]:
            choices = ", ".join(
                str(choice).lower() if isinstance(choice, bool) else str(choice) for choice in allowed[key]
            )
            raise RigError(f"{where}: {key} is '{str(value)[:40]}', expected one of {choices}")
    size = None
    if "size" in table:
        width, height = numbers(table, "size", where, (2,))
        size = (round(width), round(height))
    file, slip = path.parent / table["file"], slip_of(table, where)
    read, given = read_cameras(file, size_px=size), {key: table[key] for key in allowed if key in table}
    if "align" in content:
        cameras = aligned(content["align"], path, read, file, head, known, given)
    else:
        cameras = in_head_frame(read, str(file), head, given)
    return tuple(replace(camera, slip=slip) for camera in cameras) if slip else cameras


def aligned(
    table: Any,
    path: Path,
    read: Calibration,
    file: Path,
    head: Float[np.ndarray, "v 3"],
    known: Known,
    given: dict[str, object],
) -> tuple[Camera, ...]:
    """The cameras of a calibration in the frame of a head, as an [align] table says; how is told."""
    where = f"{path}, align"
    if not isinstance(table, dict) or not table:
        raise RigError(f"{where}: write places of the head (nose_tip = [x, y, z], ...), points = a file, or philtrum")
    if "world" in given:
        raise RigError(f"{where}: it says how the head stands, and so does world below [calibration]: keep one")
    fixed = {**given, "world": HEAD_WORLD}
    if "philtrum" in table:
        if table != {"philtrum": True}:
            raise RigError(f"{where}: philtrum = true stands alone, or is left out")
        if read.unit is None and "unit" not in given:
            raise RigError(
                f"{where}: {read.format} has no unit, and philtrum tells none: write unit below [calibration]"
            )
        fixed = {"axes": AS_STATED, "pose": AS_STATED, "mirrored": False, "unit": given.get("unit", read.unit), **fixed}
        try:
            middle_of_view(
                *(np.stack([getattr(one, part) for one in read.cameras]) for part in ("rotation", "position"))
            )
        except RigError as error:
            raise RigError(f"{where}: {error}") from error
        found = find_frame(read, head, str(file), fixed, AtPhiltrum(head))
        tell([f"{file}: {line}" for line in (found.said, "aligned by what its cameras look at", *read.notes)])
        return found.cameras
    places = places_of(_points(table, path, where), known(), where)
    try:
        read, places, size = in_unit(read, places, fixed.get("unit"))
    except RigError as error:
        raise RigError(f"{where}: {error}") from error
    fixed = {"mirrored": False, "unit": read.unit, **fixed}
    lies = check_places(places, UNITS[str(fixed["unit"])], fixed["mirrored"] is True, where)
    found = find_frame(read, head, str(file), fixed, places)
    tell([f"{file}: {line}" for line in (found.said, lies, size, *read.notes) if line])
    return found.cameras


def _points(table: dict[str, Any], path: Path, where: str) -> dict[str, Any]:
    """The places of a table, and of the file that it names."""
    found: dict[str, Any] = {}
    if isinstance(table.get("points"), str):
        found |= read_points(path.parent / table["points"], RigError)
    for name in table:
        if name != "points" or not isinstance(table["points"], str):
            found[name] = numbers(table, name, where, (3,))
    return found
