"""A place that one sign takes for the eyes or the mouth, and how far that sign is trusted."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

PUPILS_RHO = (0.3, 3.2)  # rho between the pupils: humans 0.9 to 1.3, cartoons up to 2.5


@dataclass(frozen=True, eq=False)
class Candidate:
    """Places that one sign gives: a pair (left, right) for the eyes, one for the mouth."""

    kind: str
    words: str
    trust: float
    places: Float[np.ndarray, "n 3"]


def mirror_image(place: Float[np.ndarray, " 3"], x0: float) -> Float[np.ndarray, " 3"]:
    """A place reflected in the plane x = x0."""
    return np.array([2 * x0 - place[0], place[1], place[2]])


def extent(points: Float[np.ndarray, "n 3"]) -> float:
    """Longest side of the box around points, along the axes."""
    return float(np.ptp(points, axis=0).max())
