"""Whether a part of a take in per cent or bytes holds weights of 0 to 1: two takes were joined, or a setting changed.

Data      size[t, c]  values without their sign; full, the full weight of the whole; m[t] = max_c size[t, c]
Low       m[t] <= `OVERDRIVEN`, for most of `AROUND` frames in a row: runs of `LEAST` frames or more
Signs     of such a run, all of which a pause or a quiet stretch of one scale does not show
          jump     m is `JUMP` times as large right outside, and steady on both sides: a face calms down over frames
          smooth   m moves from frame to frame as a face does, and not as noise
          level    full times the median of m in it is near the median outside, as of one face in two scales
          few      runs: a mouth pauses again and again
"""

import numpy as np
from jaxtyping import Bool, Float

from capture_plan.curves.silence import runs

OVERDRIVEN = 1.5  # hardly a weight is driven further
AROUND = 5  # frames
LEAST, PART, MOST_RUNS = 10, 1 / 60, 6  # frames; of the take; runs
JUMP, STEADY = 8.0, 3.0  # times; from one scale to another are 100
SMOOTH = 0.6  # of the standard deviation; noise steps by 1.1 of it
LEVEL = 15.0  # times, up or down; quiet parts of one take differ by as much
LEAST_FULL = 20.0


def mixed_frames(size: Float[np.ndarray, "t c"], full: float) -> list[str]:
    """A sentence where parts of a take seem to be weights of 0 to 1 while the others go as far as `full`."""
    if full < LEAST_FULL or len(size) < 2 * LEAST:
        return []
    top = size.max(axis=1)
    low = mostly(top <= OVERDRIVEN)
    some = [run for run in runs(low) if run[1] - run[0] >= max(LEAST, PART * len(size))]
    joined = [run for run in some if is_of_one(top, low, run, full)]
    if not joined or len(some) > MOST_RUNS:
        return []
    share, first = sum(stop - start for start, stop in joined) / len(size), joined[0][0] / len(size)
    return [
        f"it is not certain that all frames have this scale: in {share:.0%} of them, from {first:.0%} of the take "
        f"on, nothing gets beyond {OVERDRIVEN:g}, so look whether takes in two scales were joined, and cut it there"
    ]


def mostly(some: Bool[np.ndarray, " t"]) -> Bool[np.ndarray, " t"]:
    """Whether most frames around each one are some."""
    window = np.ones(min(AROUND, len(some)))
    return np.convolve(some, window, "same") > np.convolve(np.ones(len(some)), window, "same") / 2


def is_of_one(
    top: Float[np.ndarray, " t"],
    low: Bool[np.ndarray, " t"],
    run: tuple[int, int],
    full: float,
) -> bool:
    """Whether the frames of a run look like weights of 0 to 1 beside those that are not low."""
    start, stop = run
    inside, usual = float(np.median(top[start:stop])), float(np.median(top[~low])) if not low.all() else 0.0
    if inside <= 0 or not 1 / LEVEL <= full * inside / max(usual, 1e-12) <= LEVEL:
        return False
    pairs = [(top[max(0, start - AROUND) : start], top[start : start + AROUND])] if start else []
    pairs += [(top[stop : stop + AROUND], top[stop - AROUND : stop])] if stop < len(top) else []
    return all(breaks(outer, inner) for outer, inner in pairs) and is_smooth(top[start:stop])


def breaks(outer: Float[np.ndarray, " n"], inner: Float[np.ndarray, " m"]) -> bool:
    """Whether values change by a jump, before and behind which they are steady."""
    return bool(np.median(outer) > JUMP * np.median(inner)) and all(x.max() <= STEADY * x.min() for x in (outer, inner))


def is_smooth(x: Float[np.ndarray, " n"]) -> bool:
    """Whether values move as a face does; the noise of a face at rest does not."""
    return bool(np.abs(np.diff(x)).mean() < SMOOTH * x.std())
