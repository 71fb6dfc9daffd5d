"""Cameras for teams without a calibration, placed relative to the face.

Image centres lie on the upper philtrum, as makers of head-mounted cameras ask (Epic Games, MetaHuman documentation).

Letters    W     width of the head: extent in x of the skin above the tip of the nose
Philtrum   tip of the nose + W (0, -0.09, -0.11)
Presets    frontal             one portrait camera 6 W in front (about 0.9 m), the head in its image
           head-mounted-pair   two portrait cameras 1.5 W in front (about 230 mm) on a boom, 0.6 W apart, one above the
                               other, the upper one at the height of the philtrum

Distances, baseline and fields of view are assumptions: measure your own and write a camera file.
"""

from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float

from capture_plan.errors import RigError
from capture_plan.visibility.camera import Camera, look_at
from capture_plan.visibility.camera_file import read_cameras

# name: (camera, offset from the philtrum in W, image in pixels, height of the field of view in degrees)
PRESETS = {
    "frontal": (("frontal", (0.0, 0.0, 6.0), (2160, 3840), 24.0),),
    "head-mounted-pair": (
        ("boom top", (0.0, 0.0, 1.5), (1536, 2048), 60.0),
        ("boom bottom", (0.0, -0.6, 1.5), (1536, 2048), 60.0),
    ),
}


def cameras_for(spec: str, neutral: Float[np.ndarray, "v 3"], skin: Bool[np.ndarray, " v"]) -> tuple[Camera, ...]:
    """The cameras of a preset, placed in front of this face, or of a camera file: whichever `spec` names."""
    if spec in PRESETS:
        return placed(spec, neutral[skin])
    if not Path(spec).is_file():
        raise RigError(f"cameras: '{spec}' is neither a file nor one of {', '.join(PRESETS)}")
    return read_cameras(spec)


def placed(preset: str, face: Float[np.ndarray, "v 3"]) -> tuple[Camera, ...]:
    """The cameras of a preset in front of these vertices of the face."""
    philtrum, width = upper_philtrum(face)
    cameras = []
    for name, offset, size_px, field in PRESETS[preset]:
        position = philtrum + width * np.array(offset)
        focal = size_px[1] / 2 / np.tan(np.radians(field) / 2)
        cameras.append(
            Camera(
                name=name,
                position=position,
                rotation=look_at(position, philtrum),
                intrinsics=np.array(
                    [[focal, 0.0, (size_px[0] - 1) / 2], [0.0, focal, (size_px[1] - 1) / 2], [0.0, 0.0, 1.0]]
                ),
                size_px=size_px,
                distortion=np.zeros(5),
            )
        )
    return tuple(cameras)


def upper_philtrum(face: Float[np.ndarray, "v 3"]) -> tuple[Float[np.ndarray, "3"], float]:
    """The upper philtrum, roughly, and the width of the head, from the tip of the nose: the point farthest ahead."""
    nose = face[np.argmax(face[:, 2])]
    above = face[face[:, 1] >= nose[1]]
    low, high = above[:, 0].min(), above[:, 0].max()
    width = float(high - low)
    middle = np.array([(low + high) / 2, nose[1], nose[2]])
    return middle + width * np.array([0.0, -0.09, -0.11]), width
