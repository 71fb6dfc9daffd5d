"""Single cells far outside a table of weights: damage, which neither moves a face nor tells what a full weight is.

Data     x[t, c]   values of the columns that drive something
Wild     the few largest sizes |x[t, c]| of all, where they are more than `FAR` times the next one, and `FAR` or more
Few      at most `SEVERAL`, or `SHARE` of the frames: more are no accident, and are left to `scale.py`
A frame with such a cell is left out, as one with a blank cell is, and the cell is named.
"""

from collections.abc import Collection
from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float

from capture_plan.curves.weights import WeightTable

FAR = 10.0  # times: no scale of weights is as near to another one in one column
SEVERAL, SHARE = 3, 0.02  # cells; of the frames
LEAST = 0.3  # a take whose other cells stay below it may hold a single pose
FEWEST = 20  # frames: in fewer each may be a pose of its own
SHOWN = 3  # cells in a sentence


def wild_cells(x: Float[np.ndarray, "t c"]) -> Bool[np.ndarray, "t c"]:
    """The few cells of a table that lie far beyond all others."""
    size = np.abs(x)
    few = max(SEVERAL, int(SHARE * len(x)))
    if len(x) < FEWEST or size.size <= few:
        return np.zeros(x.shape, dtype=bool)
    top = np.sort(np.partition(size.ravel(), -few - 1)[-few - 1 :])[::-1]
    gaps = (top[:-1] > FAR * np.maximum(top[1:], 1)) & (top[1:] >= LEAST)
    return size >= top[np.flatnonzero(gaps)[-1]] if gaps.any() else np.zeros(x.shape, dtype=bool)


def without_wild(take: WeightTable, driving: Collection[str]) -> WeightTable:
    """The take without the frames that hold a wild cell in a driving column, and a sentence that names these cells."""
    columns = [c for c, column in enumerate(take.columns) if column in driving]
    wild = wild_cells(take.weights[:, columns])
    if not wild.any():
        return take
    cells = [(t, columns[c]) for t, c in np.argwhere(wild).tolist()]
    shown = ", ".join(f"{take.columns[c]} {take.weights[t, c]:.4g} in frame {t:,}" for t, c in cells[:SHOWN])
    some = "1 weight lies" if len(cells) == 1 else f"{len(cells):,} weights lie"
    gone = wild.any(axis=1)
    frames = "its frame was" if gone.sum() == 1 else f"their {gone.sum():,} frames were"
    more = ", ..." if len(cells) > SHOWN else ""
    message = f"{some} far outside all others ({shown}{more}): {frames} left out"
    return replace(take, weights=take.weights[~gone], notes=(*take.notes, message))
