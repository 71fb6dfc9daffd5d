"""The chin: where the midline of a face, followed down from the mouth, is lowest and most forward before the throat.

Data       points of the skin near the midline, millimetres; e the middle of the eyes, m the mouth, u pupil distance
Letters    s = z - y grows forward and down; h = e_y - m_y
Profile    z of the foremost point in bands of BAND u from the mouth down; it ends where the throat begins, THROAT u
           behind the most forward point so far; what comes forward again below that is a collar or a chest
Chin       the point of largest s on the profile, from SOON h to LATE h below the mouth
Doubt      the chin lies within USUAL of h below the eyes, and a jaw that opens moves it about as far as anything
"""

import numpy as np
from jaxtyping import Bool, Float

SOON, LATE = 0.2, 0.95  # h below the mouth: lips above, throats below
BAND, THROAT = 0.08, 0.3  # u: on nine heads the throat lies 0.4 and more behind the chin, a lip's fold at most 0.1
BEHIND = 0.8  # u behind the mouth at most: four human heads 0.1 to 0.2
USUAL = (1.15, 1.95)  # h from the eyes: animals 1.3, people 1.5 to 1.75
FOLLOWS = 0.5  # of the largest displacement of a jaw that opens: ten chins 0.70 to 1


def find_chin(
    points: Float[np.ndarray, "n 3"], e: Float[np.ndarray, " 3"], m: Float[np.ndarray, " 3"], u: float
) -> Float[np.ndarray, " 3"] | None:
    """The chin among points near the midline; None where none lie below the mouth."""
    h = e[1] - m[1]
    below = points[(points[:, 1] < m[1] - SOON * h) & (points[:, 1] > m[1] - LATE * h)]
    below = below[below[:, 2] > m[2] - BEHIND * u]  # not the nape, nor the back of a collar
    if len(below) == 0:
        return None
    below = below[_before_throat(below, u)]
    return below[(below[:, 2] - below[:, 1]).argmax()]


def _before_throat(points: Float[np.ndarray, "n 3"], u: float) -> Bool[np.ndarray, " n"]:
    """Which points lie above the first band whose front is THROAT u behind the front of a band above it."""
    band = np.floor((points[:, 1].max() - points[:, 1]) / (BAND * u)).astype(int)
    front = np.full(band.max() + 1, np.nan)
    for number in np.unique(band):
        front[number] = points[band == number, 2].max()
    furthest = np.fmax.accumulate(front)
    throat = np.flatnonzero(front < furthest - THROAT * u)
    return band < throat[0] if len(throat) else np.ones(len(points), dtype=bool)


def chin_agrees(
    chin: Float[np.ndarray, " 3"],
    e: Float[np.ndarray, " 3"],
    m: Float[np.ndarray, " 3"],
    moved: Float[np.ndarray, " 3"] | None,
) -> bool:
    """Whether a chin lies where faces have theirs and goes down with the jaw: `moved` is its displacement over the
    largest of that blendshape, None where no blendshape opens the jaw."""
    low, high = USUAL
    placed = low <= (e[1] - chin[1]) / max(e[1] - m[1], np.finfo(float).tiny) <= high
    return bool(placed and (moved is None or (moved[1] < 0 and np.linalg.norm(moved) >= FOLLOWS)))
