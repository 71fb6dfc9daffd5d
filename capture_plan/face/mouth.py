"""Places that signs take for the mouth: on the mirror plane x0, from names, from skin that parts, from openings."""

import numpy as np
from jaxtyping import Float

from capture_plan.face.candidate import Candidate, extent
from capture_plan.face.shape import Shape, middle_of_box

LIPS = (
    *("mouth narrow", "mouth wide", "smile", "frown", "lip up", "lip down", "lip roll", "lip press"),
    *("mouth close", "mouth other", "mouth side", "mouth open"),
)
STRONG_TEAR = 6.0
FRONT = 0.25  # rho: lips are about 12 mm deep
WIDEST = 1.2  # rho: a movement of the mouth alone is smaller
ASIDE = 0.7  # rho from the middle: half a smile lies at 0.4, what lies further is another head's
MOST = 12  # candidates


def mouth_candidates(shape: Shape, x0: float, *, named: bool) -> list[Candidate]:
    """Every place that a sign takes for the mouth."""
    channels, rho = shape.channels, shape.channels.rho
    found = []
    rows = [k for k in channels.placed(*LIPS) if channels.radius[k] < WIDEST * rho] if named else []
    rows = [k for k in rows if abs(channels.centre[k, 0] - x0) < ASIDE * rho]
    if rows:
        place = np.median(channels.centre[rows], axis=0)
        found.append(Candidate("name", "what is named for the mouth", 2.0, _on_plane(place, x0)))
    for place, tear in shape.openings:
        middle = np.abs(place[:, 0] - x0) < 0.25 * rho
        across = middle.any() and place[:, 0].min() < x0 < place[:, 0].max()
        if across:  # at the front: behind the lips, teeth and tongue part too
            front = middle & (place[:, 2] > place[middle, 2].max() - FRONT * rho)
            centre = np.average(place[front], axis=0, weights=tear[front] ** 2)
            trust = 1.8 if tear.max() > STRONG_TEAR else 1.2
            found.append(Candidate("tear", "skin parts across the middle", trust, _on_plane(centre, x0)))
    for loop in shape.rims:
        points = shape.neutral[loop]
        centre = middle_of_box(points)
        if len(loop) >= 6 and abs(centre[0] - x0) < 0.1 * rho and extent(points) < 2.5 * rho:
            found.append(Candidate("rim", "an opening across the middle", 0.7, _on_plane(centre, x0)))
    return found[:MOST]


def _on_plane(place: Float[np.ndarray, " 3"], x0: float) -> Float[np.ndarray, "1 3"]:
    return np.array([[x0, place[1], place[2]]])
