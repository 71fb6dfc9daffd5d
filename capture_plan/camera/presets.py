"""Cameras that stand as cameras usually do, by a name alone, or as a tape measures them on a helmet.

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
    slip_mm = 2               # how far the helmet may slip on the head in any way, and turn; left out: 0
    slip_degrees = 1

W         width of the head (`philtrum.py`); all image centres lie on the upper philtrum
Presets   phone               a phone upright in a hand or on a stand, 2.3 W in front (about 370 mm)
          frontal             one portrait camera 6 W in front (about 1 m)
          head-mounted        the table above with one lens 1.5 W (about 250 mm) ahead
          head-mounted-pair   another 0.6 W (about 100 mm) below it
          head-mounted-four   two such pairs, 0.6 W apart
          ring-N, dome-N      N cameras on a ring, or spread over a dome, around the face (`candidates.py`)

Distances, baselines and fields of view are assumptions: measure your own and write a camera file.
"""

import re
from dataclasses import replace
from typing import Any, TypeGuard

import numpy as np
from jaxtyping import Float

from capture_plan.camera.camera import NOISE_PX, Camera
from capture_plan.camera.candidates import BOOM, BOOM_SIZE, FIELD_DEGREES, candidates
from capture_plan.camera.fields import numbers, whole_pixels
from capture_plan.camera.own import OPTICS, SLIP, optics_of, slip_of
from capture_plan.camera.philtrum import aimed, upper_philtrum
from capture_plan.errors import RigError

PRESETS = ("phone", "frontal", "head-mounted", "head-mounted-pair", "head-mounted-four", "ring-N", "dome-N")
AROUND = re.compile(r"(ring|dome)-([1-9]\d{0,2})")
PHONE, PHONE_SIZE, PHONE_FIELD = 2.3, (1080, 1920), 55.0  # of W; pixels; degrees
FRONTAL, FRONTAL_SIZE, FRONTAL_FIELD = 6.0, (2160, 3840), 24.0
BASELINE = 0.6  # of W
KEYS = ("boom_mm", "rise_mm", "baseline_mm", "side_by_side", "field_degrees", "width", "height", "noise_px")


def is_preset(spec: str | None) -> TypeGuard[str]:
    """Whether a name is that of a preset: 'head-mounted-pair', 'ring-12'."""
    return spec is not None and (spec in PRESETS or AROUND.fullmatch(spec) is not None)


def preset(name: str, face: Float[np.ndarray, "v 3"]) -> tuple[Camera, ...]:
    """The cameras of a preset in front of these vertices of the face (mm).

    Raises:
        RigError: a ring or dome without the number of its cameras.

    Example:
        >>> rig = sample_rig()
        >>> [camera.name for camera in preset("ring-3", rig.neutral[rig.skin])]
        ['ring 1', 'ring 2', 'ring 3']
    """
    philtrum, W = upper_philtrum(face)
    if around := AROUND.fullmatch(name):
        return candidates(around[1], int(around[2]), face)
    if name == "phone":
        return (aimed(name, philtrum + np.array([0, 0, PHONE * W]), philtrum, PHONE_SIZE, PHONE_FIELD),)
    if name == "frontal":
        return (aimed(name, philtrum + np.array([0, 0, FRONTAL * W]), philtrum, FRONTAL_SIZE, FRONTAL_FIELD),)
    if name == "head-mounted-four":
        places = {
            f"boom {height} {side}": np.array([x, y, BOOM]) * W
            for height, y in (("top", 0.0), ("bottom", -BASELINE))
            for side, x in (("left", BASELINE / 2), ("right", -BASELINE / 2))
        }
        return tuple(aimed(who, philtrum + at, philtrum, BOOM_SIZE, FIELD_DEGREES) for who, at in places.items())
    if name in ("head-mounted", "head-mounted-pair"):
        return head_mounted({} if name.endswith("pair") else {"baseline_mm": 0}, name, face)
    raise RigError(f"cameras: '{name}' is without a number: write how many, as {name.replace('N', '12')}")


def head_mounted(table: Any, where: str, face: Float[np.ndarray, "v 3"]) -> tuple[Camera, ...]:
    """The camera or the pair that a [head_mounted] table describes; `where` opens the lines of its errors."""
    keys = (*KEYS, *OPTICS, *SLIP)
    if not isinstance(table, dict) or set(table) - set(keys):
        raise RigError(f"{where}: write a table with some of {', '.join(keys)}")
    philtrum, width = upper_philtrum(face)
    assumed = {"boom_mm": BOOM * width, "rise_mm": 0, "baseline_mm": BASELINE * width, "side_by_side": False}
    lens = {"field_degrees": FIELD_DEGREES, "width": BOOM_SIZE[0], "height": BOOM_SIZE[1], "noise_px": NOISE_PX}
    known = assumed | lens | table
    boom, rise, baseline, field = (
        float(numbers(known, key, where)) for key in ("boom_mm", "rise_mm", "baseline_mm", "field_degrees")
    )
    if boom <= 0 or baseline < 0 or not 0 < field < 180 or not isinstance(known["side_by_side"], bool):
        raise RigError(
            f"{where}: boom_mm must be above 0, baseline_mm 0 or more, field_degrees between 0 and 180, "
            "side_by_side true or false"
        )
    size_px = whole_pixels(known, "width", where), whole_pixels(known, "height", where)
    first, apart = philtrum + np.array([0, rise, boom]), np.array([0, baseline, 0])
    places = {"boom top": first, "boom bottom": first - apart}
    if baseline == 0:
        places = {"boom": first}
    elif known["side_by_side"]:
        places = {"boom left": first + apart[[1, 0, 2]] / 2, "boom right": first - apart[[1, 0, 2]] / 2}
    more = {"optics": optics_of(table, where), "slip": slip_of(table, where)}
    noise_px = float(numbers(known, "noise_px", where))
    return tuple(
        replace(aimed(name, place, philtrum, size_px, field), noise_px=noise_px, **more)
        for name, place in places.items()
    )
