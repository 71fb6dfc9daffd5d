"""Frames of a JSON take that name no weight at all, in a file that leaves some names out: at rest, as before, or lost?

Data     x[t, c] weights, given[t, c] whether frame t names c; empty[t] is `EMPTY` of {}, `NAMELESS` where a list or the
         whole object of weights is missing, 0 where a frame names some or says null
Changes  a file that writes only what changes (`sparse.py`) writes nothing where nothing does: the last values stay
Zeros    a file that leaves out zeros writes {} where the face rests; whether it is lost there, `silence.py` tells
         so too where every name stands in every other frame and the face is near rest beside the empty ones
Few      of at most `FEW` names hardly one is missing alone: empty frames are then gaps of these as others are
Elsewhere an empty frame has lost the face and stays without.
"""

import numpy as np
from jaxtyping import Bool, Float, Int

from capture_plan.curves.silence import runs
from capture_plan.curves.sparse import fill, hold
from capture_plan.prose import count

FEW = 3  # names
LOW, HALF = 0.25, 0.5  # of the usual sum of weights; of the frames beside empty ones
NAMELESS, EMPTY = 1, 2


def fill_frames(
    x: Float[np.ndarray, "t c"], given: Bool[np.ndarray, "t c"], empty: Int[np.ndarray, " t"], names: tuple[str, ...]
) -> tuple[Float[np.ndarray, "t c"], tuple[str, ...], Bool[np.ndarray, " t"]]:
    """The weights with what frames leave out, sentences about it, and which empty frames hold a face after all."""
    few = (empty == EMPTY) & (len(names) <= FEW)
    filled, notes = fill(x, given, names, also=few)
    if not empty.any():
        return filled, notes, np.zeros(len(x), dtype=bool)
    before, said = hold(x, given), given.any(axis=1) | few
    if notes and np.array_equal(filled[said], before[said]):
        there = (empty > 0) & (np.arange(len(x)) >= int(given.any(axis=1).argmax()))
        filled[there] = before[there]
        return filled, (*notes, *_message(there & ~few, "keep the last ones too")), there
    there = empty == EMPTY
    there &= bool(notes) or rests_around(there, x, given)
    filled[there] = 0.0
    return filled, (*notes, *_message(there & ~few, "are taken as zeros too")), there


def rests_around(empty: Bool[np.ndarray, " t"], x: Float[np.ndarray, "t c"], given: Bool[np.ndarray, "t c"]) -> bool:
    """Whether the face is near rest beside most runs of empty frames."""
    named = np.asarray(given.any(axis=1))
    if not empty.any() or not named.any():
        return False
    level = np.abs(np.where(given, x, 0.0)).sum(axis=1)
    low = np.array(level <= LOW * np.median(level[named]), dtype=bool)
    beside = [t for start, stop in runs(empty) for t in (start - 1, stop) if 0 <= t < len(x) and named[t]]
    return bool(beside) and float(low[beside].mean()) > HALF


def _message(some: Bool[np.ndarray, " t"], what: str) -> tuple[str, ...]:
    return (f"{count(int(some.sum()), 'frame')} without any weight {what}",) if some.any() else ()
