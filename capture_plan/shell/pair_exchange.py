"""Two neighbouring markers moved at once, each among the vertices around it.

Where no single move gains, two that compensate each other still may: on recorded motion 0.1-0.3 %, and without it a
planted layout is not found exactly.

Data   24 vertices around each marker; pairs of markers that are near each other
Model  min over (u, v) of the 24 x 24 of E(H - i - j + u + v), by the closed form of two rows; taken where it gains
"""

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.spatial import KDTree

AROUND = 24  # vertices that each of the two may go to
NEAR = 4  # markers that each one is tried with


def neighbourhoods(
    vertices: Float[np.ndarray, "v 3"], candidates: Bool[np.ndarray, " v"], markers: Int[np.ndarray, " m"]
) -> Int[np.ndarray, "m a"]:
    """The candidates around each marker, as the crow flies."""
    may = np.flatnonzero(candidates)
    _, near = KDTree(vertices[may]).query(vertices[markers], k=min(AROUND, len(may)))
    return may[near.reshape(len(markers), -1)]


def near_pairs(places: Float[np.ndarray, "m 3"]) -> list[tuple[int, int]]:
    """Each marker with the `NEAR` nearest others, once."""
    if len(places) < 2:
        return []
    near = KDTree(places).query(places, k=min(NEAR + 1, len(places)))[1].astype(int)
    ends = np.sort(np.stack([np.repeat(np.arange(len(places)), near.shape[1]), near.ravel()], axis=1), axis=1)
    return [(int(i), int(j)) for i, j in np.unique(ends[ends[:, 0] < ends[:, 1]], axis=0)]
