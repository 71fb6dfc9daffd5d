"""Why a camera sees nothing of the face, in words that say what to change.

Judged by where it stands and what its image holds, in this order: another convention in which it would see the face (a
unit first); inside the head; behind the head; the face outside its image; the face not upright in it; hidden.
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from capture_plan.camera.calibration import UNITS
from capture_plan.camera.camera import Camera
from capture_plan.camera.frame import AS_STATED, HEAD_WORLD, SHOWN, Convention, conventions, sampled, standing

FRAME = "millimetres, +y up, the face looks along +z"
MENDS = {
    "OpenGL": "its camera has OpenGL's axes: negate the second and third row of R and of t",
    "inverted": "its pose is camera to world: write the inverse, R transposed and t = -R' t",
    "rotation inverted": "its rotation is camera to world: transpose R",
    "centre for translation": "its t is the place of the camera: write t = -R place",
    "translation for centre": "its place is a t: write place = -R' t",
}


def why_blind(cameras: Sequence[Camera], skin: Float[np.ndarray, "v 3"]) -> str:
    """Why none of the cameras sees the skin whose vertices are given: the first of them in full, the others counted."""
    first = f"camera '{cameras[0].name}' sees no skin that moves: {why(cameras[0], skin)}"
    others = len(cameras) - 1
    return first + (f" (the other {others} see none either)" if others else "")


def misplaced(camera: Camera, head: Float[np.ndarray, "v 3"]) -> str | None:
    """What is wrong with where a camera of the head's frame stands or looks, and its mend; None where nothing is."""
    stand = standing(camera, sampled(head))
    upright = abs(stand.roll) <= 135  # a camera on its side is no slip; one upside down often is
    if stand.outside and stand.share > SHOWN and stand.before and upright:
        return None
    return f"camera '{camera.name}': {why(camera, head)}"


def why(camera: Camera, skin: Float[np.ndarray, "v 3"]) -> str:
    """Where the camera goes wrong."""
    points = sampled(skin)
    stand = standing(camera, points)
    place = f"it stands at {_words(camera.position)} mm"
    if not (stand.holds and stand.before) and (other := fitting(camera, points)):
        moved = other.of(camera, 1.0)
        if other.unit != "millimetres":
            away = f"{stand.away:.4g} mm from the middle of the face"
            return f"{place}, {away}, which would fit in {other.unit}: write {_words(moved.position)} ({FRAME})"
        return f"{place}, and {mends(other)} ({FRAME})"
    if not stand.outside:
        return f"{place}, inside the head, {stand.away:.0f} mm from the middle of the face: write its place in {FRAME}"
    if not stand.before:
        return f"{place}, behind the head, {stand.away:.0f} mm from the face: move it to the front ({FRAME})"
    if stand.share <= SHOWN:
        return (
            f"{place}, {stand.away:.0f} mm from the face, and looks past it: correct its look_at, R or rvec ({FRAME})"
        )
    if abs(stand.roll) > 135:
        return f"{place}, and has the face upside down: its y axis is to point down in the image ({FRAME})"
    return f"{place} and looks at the face, but other parts of the head hide it: move it to the front"


def mends(other: Convention) -> str:
    """What to change in a file that is meant as another convention."""
    if other.mirrored:
        return "its axes are left-handed: export it right-handed, or negate one axis of the world"
    turned = other.axes if other.pose == AS_STATED else other.pose
    return MENDS.get(turned, f"its unit and axes are others: write it in {FRAME}")


def fitting(camera: Camera, points: Float[np.ndarray, "p 3"]) -> Convention | None:
    """The convention that differs least from our own in which one camera has the face upright before it."""
    ways = [one for one in conventions("millimetres", {"world": HEAD_WORLD}) if one.otherwise("millimetres") in (1, 2)]
    held = []
    for one in ways:
        stand = standing(one.of(camera, UNITS["millimetres"]), points)
        if stand.holds and stand.before and "before" not in one.axes:
            held.append((one.otherwise("millimetres"), abs(np.log(stand.fill)), len(held), one))
    return min(held)[-1] if held else None


def _words(position: Float[np.ndarray, "3"]) -> str:
    """A place in words: '(0, 690, 400)'."""
    return f"({', '.join(f'{x:.4g}' for x in position)})"
