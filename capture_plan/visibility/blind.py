"""Why a camera sees nothing of the face, in words that say what to change.

Judged by where it stands and what its image holds, in this order: another unit in which it would see the face; inside
the head; behind the head; the face outside its image; hidden.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from capture_plan.visibility.camera import Camera

OTHER_UNITS = {"metres": 1000.0, "centimetres": 10.0, "inches": 25.4}
IN_IMAGE = 0.05  # share of the skin
FRAME = "millimetres, +y up, the face looks along +z"


def why_blind(cameras: Sequence[Camera], skin: Float[np.ndarray, "v 3"]) -> str:
    """Why none of the cameras sees the skin whose vertices are given: the first of them in full, the others counted."""
    first = f"camera '{cameras[0].name}' sees no skin that moves: {why(cameras[0], skin)}"
    others = len(cameras) - 1
    return first + (f" (the other {others} see none either)" if others else "")


def why(camera: Camera, skin: Float[np.ndarray, "v 3"]) -> str:
    """Where the camera goes wrong."""
    middle = skin.mean(axis=0)
    radius = float(np.linalg.norm(skin - middle, axis=1).mean())
    way = camera.position - middle
    away = float(np.linalg.norm(way))
    place = f"it stands at {_words(camera.position)} mm"
    for unit, mm in OTHER_UNITS.items():
        moved = replace(camera, position=camera.position * mm)
        if looks_at(moved, skin, middle, radius) and not looks_at(camera, skin, middle, radius):
            return f"{place}, which would fit in {unit}: write {_words(moved.position)} ({FRAME})"
    if away < radius:
        return f"{place}, inside the head, {away:.0f} mm from the middle of the face: write its place in {FRAME}"
    if way[2] < 0:
        return f"{place}, behind the head, {away:.0f} mm from the face: move it to the front ({FRAME})"
    if camera.in_image(skin).mean() <= IN_IMAGE:
        return f"{place}, {away:.0f} mm from the face, and looks past it: correct its look_at, R or rvec ({FRAME})"
    return f"{place} and looks at the face, but other parts of the head hide it: move it to the front"


def looks_at(camera: Camera, skin: Float[np.ndarray, "v 3"], middle: Float[np.ndarray, "3"], radius: float) -> bool:
    """Whether a camera stands before the face, outside the head, and has the face in its image."""
    way = camera.position - middle
    return bool(way[2] > 0 and np.linalg.norm(way) > radius and camera.in_image(skin).mean() > IN_IMAGE)


def _words(position: Float[np.ndarray, "3"]) -> str:
    """A place in words: '(0, 690, 400)'."""
    return f"({', '.join(f'{x:.4g}' for x in position)})"
