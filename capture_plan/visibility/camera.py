"""A camera as OpenCV describes it.

World     the rig's own frame: millimetres, +y up, the face looks along +z
Camera    x to the right of the image, y down, z forward:  (x, y, z) = R (X - position)
Lens      a = x/z, b = y/z, s = a² + b²;  radial = 1 + k1 s + k2 s² + k3 s³   (Brown 1966)
          a' = a radial + 2 p1 a b + p2 (s + 2 a²)
          b' = b radial + p1 (s + 2 b²) + 2 p2 a b
Pixel     u = fx a' + cx,  v = fy b' + cy;  the centre of the first pixel is (0, 0)
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from capture_plan.errors import RigError


@dataclass(frozen=True, eq=False)
class Camera:
    """One pinhole camera with a lens.

    `position` in millimetres; `rotation` world to camera; `intrinsics` [[fx, 0, cx], [0, fy, cy], [0, 0, 1]] in pixels;
    `size_px` width and height; `distortion` k1 k2 p1 p2 k3.
    """

    name: str
    position: Float[np.ndarray, "3"]
    rotation: Float[np.ndarray, "3 3"]
    intrinsics: Float[np.ndarray, "3 3"]
    size_px: tuple[int, int]
    distortion: Float[np.ndarray, "5"]

    def __post_init__(self) -> None:
        for what in ("position", "rotation", "intrinsics", "distortion"):
            object.__setattr__(self, what, np.array(getattr(self, what), dtype=float))
            if not np.isfinite(getattr(self, what)).all():
                raise RigError(f"camera '{self.name}': {what} holds a number that is not finite")
        if np.abs(self.rotation @ self.rotation.T - np.eye(3)).max() > 1e-3 or np.linalg.det(self.rotation) < 0:
            raise RigError(
                f"camera '{self.name}': its rotation is not a rotation (orthogonal, determinant +1): "
                "export it as OpenCV, world to camera"
            )
        if min(self.size_px) < 1 or min(self.intrinsics[0, 0], self.intrinsics[1, 1]) <= 0:
            raise RigError(f"camera '{self.name}': image size and focal lengths must be above 0 pixels")
        for array in (self.position, self.rotation, self.intrinsics, self.distortion):
            array.flags.writeable = False

    def project(self, points: Float[np.ndarray, "p 3"]) -> Float[np.ndarray, "p 2"]:
        """Pixel of each point; NaN behind the camera and where the lens model folds back on itself."""
        x, y, z = ((points - self.position) @ self.rotation.T).T
        front = z > 0
        depth = np.where(front, z, np.nan)
        a, b = x / depth, y / depth
        k1, k2, p1, p2, k3 = self.distortion
        s = a * a + b * b
        s = np.where(s < self._fold, s, np.nan)
        radial = 1 + k1 * s + k2 * s**2 + k3 * s**3
        bent_a = a * radial + 2 * p1 * a * b + p2 * (s + 2 * a * a)
        bent_b = b * radial + p1 * (s + 2 * b * b) + 2 * p2 * a * b
        pixels = np.stack([bent_a, bent_b], axis=1) @ self.intrinsics[:2, :2].T
        return pixels + self.intrinsics[:2, 2]

    @property
    def numbers(self) -> Float[np.ndarray, " n"]:
        """Everything that decides what the camera sees, in one row."""
        return np.concatenate(
            [self.position, self.rotation.ravel(), self.intrinsics.ravel(), self.size_px, self.distortion]
        )

    @property
    def _fold(self) -> float:
        """The s beyond which points would move inwards: d(r radial)/dr = 1 + 3 k1 s + 5 k2 s² + 7 k3 s³ = 0."""
        k1, k2, _, _, k3 = self.distortion
        roots = np.roots(np.trim_zeros([7 * k3, 5 * k2, 3 * k1, 1.0], "f"))
        turning = roots.real[(np.abs(roots.imag) < 1e-9) & (roots.real > 0)]
        return float(turning.min()) if len(turning) else np.inf

    def in_image(self, points: Float[np.ndarray, "p 3"]) -> Bool[np.ndarray, " p"]:
        """Whether each point projects onto the image, whatever lies in between."""
        pixels = self.project(points)
        return np.all((pixels >= -0.5) & (pixels < np.array(self.size_px) - 0.5), axis=1)


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
