"""What cameras of a face are aimed at: the upper philtrum, as makers of head-mounted cameras ask (Epic Games, MetaHuman
documentation).

W          width of the head: extent in x of the skin above the tip of the nose
Philtrum   tip of the nose + W (0, -0.09, -0.11)
"""

import numpy as np
from jaxtyping import Float

from capture_plan.camera.camera import Camera, look_at


def upper_philtrum(face: Float[np.ndarray, "v 3"]) -> tuple[Float[np.ndarray, "3"], float]:
    """The upper philtrum, roughly, and the width of the head, from the tip of the nose: the point farthest ahead."""
    nose = face[np.argmax(face[:, 2])]
    above = face[face[:, 1] >= nose[1]]
    low, high = above[:, 0].min(), above[:, 0].max()
    width = float(high - low)
    middle = np.array([(low + high) / 2, nose[1], nose[2]])
    return middle + width * np.array([0.0, -0.09, -0.11]), width


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
