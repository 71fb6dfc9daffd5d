"""A camera as a plan carries it: its numbers, so that who is mailed a plan can check and draw what it sees."""

import numpy as np
from jaxtyping import Float
from msgspec import Struct

from capture_plan.camera.camera import Camera, Optics, Slip

SAME = 1e-6  # of a number: files carry fewer digits

Row = tuple[float, float, float]


class KnownCamera(Struct, frozen=True, forbid_unknown_fields=True):
    """One camera in the rig's frame (millimetres, +y up, facing +z), as `Camera` has it; `optics` are focus (mm),
    f-number and pixel pitch (micrometres), or nothing; `slip` is millimetres, degrees and the point that the head turns
    about, or nothing."""

    name: str
    size_px: tuple[int, int]
    intrinsics: tuple[Row, Row, Row]
    distortion: tuple[float, ...]
    fisheye: bool
    rotation: tuple[Row, Row, Row]
    position: Row
    noise_px: float
    optics: Row | None = None
    slip: tuple[float, float, Row] | None = None


def recorded(camera: Camera) -> KnownCamera:
    """The numbers of a camera."""
    optics = camera.optics
    return KnownCamera(
        name=camera.name,
        size_px=camera.size_px,
        intrinsics=_rows(camera.intrinsics),
        distortion=tuple(camera.distortion.tolist()),
        fisheye=camera.fisheye,
        rotation=_rows(camera.rotation),
        position=_row(camera.position),
        noise_px=float(camera.noise_px),
        optics=(optics.focus_mm, optics.f_number, optics.pixel_um) if optics else None,
        slip=(slip.mm, slip.degrees, slip.about) if (slip := camera.slip) else None,
    )


def camera_of(known: KnownCamera) -> Camera:
    """The camera of these numbers.

    Raises:
        RigError: they describe none.
    """
    return Camera(
        name=known.name,
        position=np.array(known.position),
        rotation=np.array(known.rotation),
        intrinsics=np.array(known.intrinsics),
        size_px=known.size_px,
        distortion=np.array(known.distortion),
        fisheye=known.fisheye,
        optics=Optics(*known.optics) if known.optics else None,
        noise_px=known.noise_px,
        slip=Slip(*known.slip) if known.slip else None,
    )


def otherwise(was: tuple[KnownCamera, ...], now: tuple[KnownCamera, ...]) -> str:
    """How cameras differ from those that they were, in words; nothing where they do not."""
    names = [[one.name for one in cameras] for cameras in (was, now)]
    if names[0] != names[1]:
        said = [", ".join(each) or "no camera" for each in names]
        return f"{said[1]} instead of {said[0]}"
    for before, after in zip(was, now, strict=True):
        if words := _changed(before, after):
            return f"camera '{after.name}' {words}"
    return ""


def _changed(was: KnownCamera, now: KnownCamera) -> str:
    if was.size_px != now.size_px:
        sizes = [f"{one.size_px[0]} x {one.size_px[1]}" for one in (was, now)]
        return f"has pictures of {sizes[1]} px, not {sizes[0]}"
    was_f, now_f = (np.diag(one.intrinsics)[:2] for one in (was, now))
    was_at, now_at = (np.array(one.position) for one in (was, now))
    if not np.allclose(was_f, now_f, rtol=SAME, atol=0):
        return f"has a focal length of {now_f[0]:.6g} px, not {was_f[0]:.6g}"
    if not np.allclose(was_at, now_at, rtol=SAME, atol=1e-4):
        return f"stands {np.linalg.norm(now_at - was_at):.3g} mm from where it stood"
    turned = np.array(now.rotation) @ np.array(was.rotation).T
    angle = np.degrees(np.arccos(np.clip((np.trace(turned) - 1) / 2, -1, 1)))
    if angle > 1e-3:
        return f"is turned by {angle:.3g} degrees"
    if was.noise_px != now.noise_px:
        return f"finds a dot to {now.noise_px:g} px, not {was.noise_px:g}"
    if was.optics != now.optics:
        return "is focused otherwise"
    if was.slip != now.slip:
        slips = [f"{one.slip[0]:g} mm and {one.slip[1]:g} degrees" if one.slip else "none" for one in (was, now)]
        return f"is to bear a slip of the head of {slips[1]}, not {slips[0]}"
    rest = [np.concatenate([np.ravel(one.intrinsics), one.distortion, [one.fisheye]]) for one in (was, now)]
    same = rest[0].shape == rest[1].shape and np.allclose(rest[0], rest[1], rtol=SAME, atol=1e-9)
    return "" if same else "has another lens or principal point"


def _row(values: Float[np.ndarray, "3"]) -> Row:
    x, y, z = values.tolist()
    return x, y, z


def _rows(values: Float[np.ndarray, "3 3"]) -> tuple[Row, Row, Row]:
    a, b, c = (_row(row) for row in values)
    return a, b, c
