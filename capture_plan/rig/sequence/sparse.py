"""Names that some frames of a JSON take leave out: are their weights 0 there, or as they were?

Data     x[t, c]   weights, given[t, c] whether frame t names c
Zero     tools that leave out zeros: what is last said before a gap is small, low among the column's own values
Held     tools that write only what changes: what is last said is like any value, and holding moves the face less
Between the two it is taken as 0, and said to be uncertain.
"""

import numpy as np
from jaxtyping import Bool, Float

LIKE_ANY = 0.4  # mean rank of the last values before gaps, 0.5 of values drawn at random
LOW = 0.25
ENOUGH = 8  # gaps, before they tell anything
CALMER = 0.5  # of the motion, where held values are right


def fill(
    x: Float[np.ndarray, "t c"], given: Bool[np.ndarray, "t c"]
) -> tuple[Float[np.ndarray, "t c"], tuple[str, ...]]:
    """The weights with what frames leave out, and a sentence about it; frames that name nothing stay without."""
    named = np.flatnonzero(given.any(axis=1))
    seldom = ~np.asarray(given[named].all(axis=0))
    if not seldom.any():
        return x, ()
    y, here = x[named], given[named]
    rank, zero, held = last_rank(y, here), np.where(here, y, 0.0), hold(y, here)
    calm = moved(held) < CALMER * moved(zero)
    as_before = rank > LIKE_ANY and calm
    filled = x.copy()
    filled[named] = held if as_before else zero
    told = f"{seldom.sum():,} of {seldom.size:,} names are missing in some frames and "
    if as_before:
        return filled, (f"{told}keep their last value there: the file seems to write only what changes",)
    doubt = " (not certain: they may be unchanged instead)" if rank > LOW and calm else ""
    return filled, (f"{told}count as 0 there{doubt}",)


def hold(x: Float[np.ndarray, "t c"], given: Bool[np.ndarray, "t c"]) -> Float[np.ndarray, "t c"]:
    """What was last given of each column; 0 before the first."""
    last = np.maximum.accumulate(np.where(given, np.arange(len(x))[:, None], -1), axis=0)
    return np.where(last >= 0, np.take_along_axis(x, np.maximum(last, 0), axis=0), 0.0)


def moved(x: Float[np.ndarray, "t c"]) -> float:
    """How far all columns move in all frames together."""
    return float(np.nansum(np.abs(np.diff(x, axis=0))))


def last_rank(x: Float[np.ndarray, "t c"], given: Bool[np.ndarray, "t c"]) -> float:
    """Mean share of a column's given values below the last one before a gap; 0 where gaps are too few to tell."""
    ranks = []
    for column, here in zip(x.T, given.T, strict=True):
        last = column[:-1][here[:-1] & ~here[1:]]
        values = np.sort(column[here & np.isfinite(column)])
        low, high = np.searchsorted(values, last, "left"), np.searchsorted(values, last, "right")
        ranks += ((low + high) / 2 / max(1, len(values))).tolist()
    return float(np.mean(ranks)) if len(ranks) >= ENOUGH else 0.0
