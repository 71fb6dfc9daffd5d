"""The cameras of a plan in the frame of its head: a preset by name, what a tape measures, or a calibration.

    [head_mounted]            # in a TOML file; every line may be left out
    boom_mm = 250             # from the upper philtrum straight ahead to the lens
    rise_mm = 0               # the lens, of a pair the upper one, above the upper philtrum
    baseline_mm = 100         # between the lenses of a pair; 0 is a single camera
    side_by_side = false      # of a pair: one lens beside the other instead of above it
    field_degrees = 50        # angle that the image's height covers
    width = 1536              # pixels
    height = 2048
    focus_mm = 255            # with f_number and pixel_um, or all three left out: all is in focus
    f_number = 5.6
    pixel_um = 3.45           # micrometres
    noise_px = 0.5            # standard deviation of a dot's middle in a picture, pixels

    [calibration]             # a file of another program; what is left out is found from where the head stands upright
    file = "session.xcp"      # beside this file
    unit = "metres"           # also axes, pose, mirrored and world, as `frame.py` lists them
    size = [4096, 3000]       # of the images, where the format does not hold it

Image centres lie on the upper philtrum, as makers of head-mounted cameras ask (Epic Games, MetaHuman documentation).

Letters    W     width of the head: extent in x of the skin above the tip of the nose
Philtrum   tip of the nose + W (0, -0.09, -0.11)
Presets    frontal             one portrait camera 6 W in front (about 1 m), the head in its image
           head-mounted-pair   the table above with boom_mm = 1.5 W (about 250) and baseline_mm = 0.6 W (about 100)

Distances, baseline and fields of view are assumptions: measure your own and write a camera file.
"""

import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from capture_plan.camera.blind import mends, misplaced
from capture_plan.camera.calibration import UNITS, Calibration
from capture_plan.camera.camera import NOISE_PX, Camera, look_at
from capture_plan.camera.fields import numbers, whole_pixels
from capture_plan.camera.frame import AXES, POSES, WORLDS, find_frame
from capture_plan.camera.own import OPTICS, optics_of
from capture_plan.camera.read import GIVE, read_cameras
from capture_plan.errors import RigError
from capture_plan.input.documents import read_toml
from capture_plan.progress import tell

PRESETS = ("frontal", "head-mounted-pair")
BOOM, BASELINE = 1.5, 0.6  # of W
FIELD_DEGREES = 50.0  # at 250 mm an image 233 mm high and 175 mm wide: from the hairline to below an open jaw
KEYS = ("boom_mm", "rise_mm", "baseline_mm", "side_by_side", "field_degrees", "width", "height", "noise_px", *OPTICS)


def cameras_for(spec: str, neutral: Float[np.ndarray, "v 3"], skin: Bool[np.ndarray, " v"]) -> tuple[Camera, ...]:
    """The cameras of a preset, placed in front of this face, or of a camera file: whichever `spec` names."""
    if spec in PRESETS:
        return _placed(spec, neutral[skin])
    path = Path(spec)
    if not os.path.exists(path):
        raise RigError(f"cameras: '{spec}' is neither a file nor one of {', '.join(PRESETS)}")
    content = read_toml(path, RigError, GIVE) if path.suffix.lower() == ".toml" and path.is_file() else {}
    if "head_mounted" in content and "cameras" in content:
        raise RigError(f"{path}: has [[cameras]] and [head_mounted]: keep the one that you measured")
    if "head_mounted" in content:
        return head_mounted(content["head_mounted"], f"{path}, head_mounted", neutral[skin])
    if "calibration" in content and "cameras" not in content:
        return stated_calibration(content["calibration"], path, neutral[skin])
    return in_head_frame(read_cameras(path), str(path), neutral[skin])


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


def stated_calibration(table: Any, path: Path, head: Float[np.ndarray, "v 3"]) -> tuple[Camera, ...]:
    """The cameras of the file that a [calibration] table names, in the convention that it states, left open or not."""
    where = f"{path}, calibration"
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
        if key not in {*allowed, "file", "size"}:
            raise RigError(f"{where}: unknown key '{key}': known are file, size, {', '.join(allowed)}")
        if key in allowed and value not in allowed[key]:
            choices = ", ".join(
                str(choice).lower() if isinstance(choice, bool) else str(choice) for choice in allowed[key]
            )
            raise RigError(f"{where}: {key} is '{str(value)[:40]}', expected one of {choices}")
    size = None
    if "size" in table:
        width, height = numbers(table, "size", where, (2,))
        size = (round(width), round(height))
    read = read_cameras(path.parent / table["file"], size_px=size)
    return in_head_frame(
        read, str(path.parent / table["file"]), head, {key: table[key] for key in allowed if key in table}
    )


def _placed(preset: str, face: Float[np.ndarray, "v 3"]) -> tuple[Camera, ...]:
    """The cameras of a preset in front of these vertices of the face."""
    if preset == "head-mounted-pair":
        return head_mounted({}, preset, face)
    philtrum, width = upper_philtrum(face)
    return (aimed("frontal", philtrum + np.array([0, 0, 6 * width]), philtrum, (2160, 3840), 24.0),)


def head_mounted(table: Any, where: str, face: Float[np.ndarray, "v 3"]) -> tuple[Camera, ...]:
    """The camera or the pair that a [head_mounted] table describes; `where` opens the lines of its errors."""
    if not isinstance(table, dict) or set(table) - set(KEYS):
        raise RigError(f"{where}: write a table with some of {', '.join(KEYS)}")
    philtrum, width = upper_philtrum(face)
    assumed = {"boom_mm": BOOM * width, "rise_mm": 0, "baseline_mm": BASELINE * width, "side_by_side": False}
    known = assumed | {"field_degrees": FIELD_DEGREES, "width": 1536, "height": 2048, "noise_px": NOISE_PX} | table
    boom, rise, baseline, field = (
        float(numbers(known, key, where)) for key in ("boom_mm", "rise_mm", "baseline_mm", "field_degrees")
    )
    if boom <= 0 or baseline < 0 or not 0 < field < 180 or not isinstance(known["side_by_side"], bool):
        raise RigError(
            f"{where}: boom_mm must be above 0, baseline_mm 0 or more, field_degrees between 0 and 180, "
            "side_by_side true or false"
        )
    size_px = whole_pixels(known, "width", where), whole_pixels(known, "height", where)
    lens, apart = philtrum + np.array([0, rise, boom]), np.array([0, baseline, 0])
    places = {"boom top": lens, "boom bottom": lens - apart}
    if baseline == 0:
        places = {"boom": lens}
    elif known["side_by_side"]:
        places = {"boom left": lens + apart[[1, 0, 2]] / 2, "boom right": lens - apart[[1, 0, 2]] / 2}
    optics, noise_px = optics_of(table, where), float(numbers(known, "noise_px", where))
    return tuple(
        replace(aimed(name, place, philtrum, size_px, field), optics=optics, noise_px=noise_px)
        for name, place in places.items()
    )


def aimed(
    name: str,
    position: Float[np.ndarray, "3"],
    target: Float[np.ndarray, "3"],
    size_px: tuple[int, int],
    field_degrees: float,
) -> Camera:
    """A camera without lens errors with `target` in its image centre; its image's height covers `field_degrees`."""
    focal = size_px[1] / 2 / np.tan(np.radians(field_degrees) / 2)
    return Camera(
        name=name,
        position=position,
        rotation=look_at(position, target),
        intrinsics=np.array([[focal, 0.0, (size_px[0] - 1) / 2], [0.0, focal, (size_px[1] - 1) / 2], [0.0, 0.0, 1.0]]),
        size_px=size_px,
        distortion=np.zeros(5),
    )


def upper_philtrum(face: Float[np.ndarray, "v 3"]) -> tuple[Float[np.ndarray, "3"], float]:
    """The upper philtrum, roughly, and the width of the head, from the tip of the nose: the point farthest ahead."""
    nose = face[np.argmax(face[:, 2])]
    above = face[face[:, 1] >= nose[1]]
    low, high = above[:, 0].min(), above[:, 0].max()
    width = float(high - low)
    middle = np.array([(low + high) / 2, nose[1], nose[2]])
    return middle + width * np.array([0.0, -0.09, -0.11]), width
