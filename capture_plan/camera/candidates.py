"""Where cameras might stand: places on a ring, a dome or a boom, each aimed at the upper philtrum.

Ring   n places on a circle around the head at the height of the philtrum, from ear to ear over the face
Dome   n places on a part of a sphere, up to `DOME_UP` degrees above and `DOME_DOWN` below, spread by a golden spiral
Boom   n places of a head-mounted lens: nearer and farther, higher and lower, to either side, on a grid
Lens   without errors, the face filling `FILLS` of the picture's height; of a boom that of a head-mounted camera
"""

import numpy as np
from jaxtyping import Float

from capture_plan.camera.camera import Camera
from capture_plan.camera.philtrum import aimed, upper_philtrum

KINDS = ("ring", "dome", "boom")
SIDEWAYS, DOME_UP, DOME_DOWN = 100.0, 60.0, 40.0  # degrees from straight ahead
DISTANCE = 5.0  # of the head's width: about 0.8 m
FILLS, FACE = 0.7, 1.6  # of the picture's height; height of a face, of the head's width
SIZE, BOOM_SIZE = (4096, 3000), (1536, 2048)
BOOM = 1.5  # of the head's width, to a head-mounted lens
FIELD_DEGREES = 50.0  # at 250 mm an image 233 mm high and 175 mm wide: from the hairline to below an open jaw
GOLDEN = (1 + 5**0.5) / 2
BOOM_FROM, BOOM_TO, RISE, ASIDE = 0.9, 2.0, 0.6, 0.5  # of the head's width


def candidates(kind: str, count: int, face: Float[np.ndarray, "v 3"]) -> tuple[Camera, ...]:
    """`count` cameras of one of `KINDS`, or for a boom about so many, that might stand before these vertices of a face
    (mm).

    Example:
        >>> rig = sample_rig()
        >>> [camera.name for camera in candidates("ring", 3, rig.neutral[rig.skin])]
        ['ring 1', 'ring 2', 'ring 3']
    """
    philtrum, width = upper_philtrum(face)
    if kind == "boom":
        places = _boom(count, width)
        size, field = BOOM_SIZE, FIELD_DEGREES
    else:
        radius = DISTANCE * width
        places = radius * (_ring(count) if kind == "ring" else _dome(count))
        size, field = SIZE, float(np.degrees(2 * np.arctan(FACE * width / FILLS / 2 / radius)))
    return tuple(
        aimed(f"{kind} {number}", philtrum + place, philtrum, size, field)
        for number, place in enumerate(places, start=1)
    )


def _ring(count: int) -> Float[np.ndarray, "n 3"]:
    angle = np.radians(np.linspace(-SIDEWAYS, SIDEWAYS, count) if count > 1 else np.zeros(1))
    return np.stack([np.sin(angle), np.zeros(count), np.cos(angle)], axis=1)


def _dome(count: int) -> Float[np.ndarray, "n 3"]:
    i = np.arange(count)
    high = np.sin(np.radians(-DOME_DOWN)) + (i + 0.5) / count * (
        np.sin(np.radians(DOME_UP)) - np.sin(np.radians(-DOME_DOWN))
    )
    around = np.radians(SIDEWAYS) * (2 * ((i / GOLDEN) % 1) - 1)
    level = np.sqrt(1 - high**2)
    return np.stack([level * np.sin(around), high, level * np.cos(around)], axis=1)


def _boom(count: int, width: float) -> Float[np.ndarray, "n 3"]:
    """A grid of about `count` places: distances from the face, heights and sides."""
    steps = max(round(count ** (1 / 3)), 1)
    far = np.linspace(BOOM_FROM, BOOM_TO, steps) if steps > 1 else np.array([BOOM])
    up = np.linspace(-RISE, RISE, max(round(count / steps / steps), 1))
    aside = np.linspace(-ASIDE, ASIDE, steps) if steps > 1 else np.zeros(1)
    x, y, z = np.meshgrid(aside, up, far, indexing="ij")
    return width * np.stack([x.ravel(), y.ravel(), z.ravel()], axis=1)
