"""A camera as OpenCV describes it.

World     a stated frame in millimetres; a plan's is the rig's own: +y up, the face looks along +z
Camera    x to the right of the image, y down, z forward:  (x, y, z) = R (X - position) = R X + t
Lens      (a', b') of the direction (x, y, z), `lens.py`
Pixel     u = fx a' + skew b' + cx,  v = fy b' + cy;  the centre of the first pixel is (0, 0)
Slip      the head lies at X' = Q (X - c) + c + s, with a shift |s| and a turn Q about its middle c of at most so much:
          the camera stands to the head as one of rotation R Q at Q' (position - c - s) + c
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float

from capture_plan.camera.lens import FISHEYE, SIZES, bend, straighten
from capture_plan.errors import RigError

MOST_PIXELS = 1_000_000  # of an image side: the largest sensors have 20,000
NOISE_PX = 0.5  # an assumption: clean round dots are found to 0.1 px, painted ones on moving skin hardly
MOST_SLIP_MM, MOST_SLIP_DEGREES = 500.0, 90.0
# where a head slips, and the axis about which it turns at once: about +y with what goes to +x, about -x with +y
SLIPS = (
    *((np.array([np.cos(a), np.sin(a), 0]), np.array([-np.sin(a), np.cos(a), 0])) for a in np.arange(8) * np.pi / 4),
    *((np.array([0, 0, near]), np.array([0, 0, roll])) for near in (1.0, -1.0) for roll in (1.0, -1.0)),
)
STEP = 1e-4  # of the depth: what a point is moved by for the derivatives of its pixel


@dataclass(frozen=True)
class Optics:
    """What decides how sharp a point is: the distance in focus along the optical axis (mm), the f-number, and the pitch
    of the sensor's pixels (micrometres)."""

    focus_mm: float
    f_number: float
    pixel_um: float


@dataclass(frozen=True)
class Slip:
    """How far the head may leave its place before the camera, or a helmet slip on it: in any direction (mm), and about
    any axis through a point (degrees; the point in mm)."""

    mm: float
    degrees: float
    about: tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class Camera:
    """One camera with its lens.

    `position` in millimetres; `rotation` world to camera; `intrinsics` [[fx, skew, cx], [0, fy, cy], [0, 0, 1]] in
    pixels; `size_px` width and height; `distortion` in OpenCV's order: k1 k2 p1 p2 k3, or 8, 12 or 14 numbers, or
    k1 k2 k3 k4 of a `fisheye` lens. Without `optics` all is in focus. `noise_px`: standard deviation of a dot's middle
    as it is found in a picture, pixels in each direction. Without a `slip` the head stays where it is.
    """

    name: str
    position: Float[np.ndarray, "3"]
    rotation: Float[np.ndarray, "3 3"]
    intrinsics: Float[np.ndarray, "3 3"]
    size_px: tuple[int, int]
    distortion: Float[np.ndarray, " n"]
    fisheye: bool = False
    optics: Optics | None = None
    noise_px: float = NOISE_PX
    slip: Slip | None = None

    def __post_init__(self) -> None:
        for what in ("position", "rotation", "intrinsics", "distortion"):
            object.__setattr__(self, what, np.array(getattr(self, what), dtype=float))
            if not np.isfinite(getattr(self, what)).all():
                raise RigError(f"camera '{self.name}': {what} holds a number that is not finite")
        if np.abs(self.rotation @ self.rotation.T - np.eye(3)).max() > 1e-3:
            raise RigError(
                f"camera '{self.name}': its rotation is not a rotation (orthogonal, determinant +1): "
                "export it as OpenCV, world to camera"
            )
        if np.linalg.det(self.rotation) < 0:
            raise RigError(
                f"camera '{self.name}': its rotation mirrors, so it is not a rotation (determinant -1, expected +1): "
                "its world or its axes are left-handed: export it right-handed, or negate one axis of the world"
            )
        if max(self.size_px) > MOST_PIXELS:
            raise RigError(
                f"camera '{self.name}': its image has a side of more than {MOST_PIXELS:,} px: correct its size"
            )
        if min(self.size_px) < 1 or min(self.intrinsics[0, 0], self.intrinsics[1, 1]) <= 0:
            raise RigError(
                f"camera '{self.name}': image size and focal lengths must be above 0 pixels, found "
                f"{self.size_px[0]} x {self.size_px[1]}, fx {self.intrinsics[0, 0]:g}, fy {self.intrinsics[1, 1]:g}"
            )
        wanted = (FISHEYE,) if self.fisheye else SIZES
        if self.distortion.shape not in [(n,) for n in wanted]:
            kind = "fisheye lens" if self.fisheye else "lens"
            raise RigError(
                f"camera '{self.name}': a {kind} of {self.distortion.size} numbers, expected "
                f"{' or '.join(map(str, wanted))}: calibrate it with k1 k2 {'k3 k4' if self.fisheye else 'p1 p2 k3'}"
            )
        if not 0 < self.noise_px < MOST_PIXELS:
            raise RigError(f"camera '{self.name}': noise_px must be above 0, found {self.noise_px:g}")
        if self.slip and not (0 <= self.slip.mm < MOST_SLIP_MM and 0 <= self.slip.degrees < MOST_SLIP_DEGREES):
            raise RigError(
                f"camera '{self.name}': a slip of {self.slip.mm:g} mm and {self.slip.degrees:g} degrees, expected 0 to "
                f"{MOST_SLIP_MM:g} mm and 0 to {MOST_SLIP_DEGREES:g} degrees: correct slip_mm and slip_degrees"
            )
        if self.optics and self.optics.focus_mm <= self.focal_mm:
            raise RigError(
                f"camera '{self.name}': nothing is in focus at {self.optics.focus_mm:g} mm from a lens of "
                f"{self.focal_mm:.3g} mm focal length (fx {self.intrinsics[0, 0]:g} px of {self.optics.pixel_um:g} "
                "micrometres): correct focus_mm or pixel_um"
            )
        for array in (self.position, self.rotation, self.intrinsics, self.distortion):
            array.flags.writeable = False

    def project(self, points: Float[np.ndarray, "p 3"]) -> Float[np.ndarray, "p 2"]:
        """Pixel of each point; NaN behind the camera and where the lens model folds back on itself."""
        directions = (points - self.position) @ self.rotation.T
        bent = bend(directions, self.distortion, self.fisheye)
        return bent @ self.intrinsics[:2, :2].T + self.intrinsics[:2, 2]

    def rays(self, pixels: Float[np.ndarray, "p 2"]) -> Float[np.ndarray, "p 3"]:
        """Unit directions in the world that each pixel looks along, the lens undone; NaN where the lens has none."""
        bent = (pixels - self.intrinsics[:2, 2]) @ np.linalg.inv(self.intrinsics[:2, :2]).T
        return straighten(bent, self.distortion, self.fisheye) @ self.rotation

    def jacobian(self, points: Float[np.ndarray, "p 3"]) -> Float[np.ndarray, "p 2 3"]:
        """How each point's pixel moves with the point, pixels a millimetre, by central differences."""
        step = STEP * np.maximum(np.linalg.norm(points - self.position, axis=1), 1e-9)[:, None]
        columns = [(self.project(points + step * e) - self.project(points - step * e)) / (2 * step) for e in np.eye(3)]
        return np.stack(columns, axis=2)

    @property
    def focal_mm(self) -> float:
        """Focal length in millimetres, where the size of a pixel is known; else 0."""
        return self.intrinsics[0, 0] * self.optics.pixel_um / 1000 if self.optics else 0.0

    def blur_px(self, points: Float[np.ndarray, "p 3"]) -> Float[np.ndarray, " p"]:
        """Diameter in pixels of the disc that each point becomes out of focus, by the thin lens: with focal length f,
        f-number N, focus s and depth z it is fx (f / N) |z - s| / (z (s - f))."""
        if not self.optics:
            return np.zeros(len(points))
        s, f = self.optics.focus_mm, self.focal_mm
        z = np.maximum((points - self.position) @ self.rotation[2], 1e-9)
        return self.intrinsics[0, 0] * f / self.optics.f_number * np.abs(z - s) / (z * (s - f))

    @property
    def translation(self) -> Float[np.ndarray, "3"]:
        """t of camera = R world + t, millimetres."""
        return -self.rotation @ self.position

    @cached_property
    def numbers(self) -> Float[np.ndarray, " n"]:
        """Everything that decides what the camera sees, in one row."""
        arrays = [
            self.position,
            self.rotation.ravel(),
            self.intrinsics.ravel(),
            self.size_px,
            self.distortion,
            [self.noise_px],
        ]
        arrays += [[1.0]] if self.fisheye else []
        arrays += [[self.optics.focus_mm, self.optics.f_number, self.optics.pixel_um]] if self.optics else []
        arrays += [[self.slip.mm, self.slip.degrees, *self.slip.about]] if self.slip else []
        return np.concatenate(arrays)

    @cached_property
    def stances(self) -> tuple["Camera", ...]:
        """The camera as it stands to a head that keeps its place, then as it stands to one that has slipped: aside, up
        and down and between, turned the same way, nearer and farther, tipped to either side."""
        still = replace(self, slip=None)
        if not self.slip:
            return (still,)
        c, shift, turn = np.array(self.slip.about), self.slip.mm, np.radians(self.slip.degrees)
        found = []
        for way, axis in SLIPS:
            Q, s = rotation_about(turn * axis), shift * way
            found.append(replace(still, rotation=self.rotation @ Q, position=(self.position - c - s) @ Q + c))
        return (still, *found) if shift or turn else (still,)

    def in_image(self, points: Float[np.ndarray, "p 3"]) -> Bool[np.ndarray, " p"]:
        """Whether each point projects onto the image, whatever lies in between."""
        pixels = self.project(points)
        return np.all((pixels >= -0.5) & (pixels < np.array(self.size_px) - 0.5), axis=1)


def rotation_about(axis: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3 3"]:
    """The rotation about an axis by its length in radians (Rodrigues).

    Example:
        >>> rotation_about(np.array([0, np.pi / 2, 0])).round().astype(int).tolist()
        [[0, 0, 1], [0, 1, 0], [-1, 0, 0]]
    """
    angle = float(np.linalg.norm(axis))
    x, y, z = axis / angle if angle else axis
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


def look_at(position: Float[np.ndarray, "3"], target: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3 3"]:
    """World-to-camera rotation that puts `target` in the image centre and the world's +y up in the image.

    Example:
        >>> look_at(np.array([0, 0, 500.0]), np.zeros(3)).astype(int).tolist()
        [[1, 0, 0], [0, -1, 0], [0, 0, -1]]
    """
    forward = target - position
    right = np.cross(forward, [0.0, 1.0, 0.0])
    if not np.linalg.norm(right) > 1e-9 * np.linalg.norm(forward):
        raise RigError("a camera that looks straight up or down, or at itself, needs R or rvec instead of look_at")
    forward, right = forward / np.linalg.norm(forward), right / np.linalg.norm(right)
    return np.stack([right, np.cross(forward, right), forward])
