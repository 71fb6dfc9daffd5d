"""The usual step between the times of frames, and sentences about what is odd: gaps, doubled times, uneven clocks.

Data    x[i] ticks of frame a[i], d[i] = x[i + 1] - x[i], each[i] = d[i] / (a[i + 1] - a[i])
Step    the mean of `each` near its median
Count   the time from the first frame to the last, divided by the frames and those lost in gaps, says the same; where
        it does not, frames come in bursts (20, 20, 20, 3), and this mean counts; so too where gaps are many and regular
        and x stays near a line. A late frame has an early one beside it and is no gap
Coarse  steps are one or two ticks of a clock coarser than the frames, so evenly spread that x stays near a line: their
        mean counts. Ticks that frames wait for are uneven, which is said; lost frames leave the line
Runs    a clock of 24 that stamps 60 frames has runs of 2 and 3 equal times: their mean counts, not their median
Rates   of blocks of even frames, by the mean and the median of their steps: where some have another, none is told
"""

import numpy as np
from jaxtyping import Bool, Float, Int

GAP = 1.6  # steps of this many usual ones are a gap: a lost frame makes 2, uneven cameras reach 1.5
OFTEN = 0.4  # share of doubled times from which they are the clock's and not the take's
EARLY = 0.85  # of the usual step
NEAR_STEP = (0.49, 1.55)  # of the usual step: frames of 24 in a clock of 60 are 2 and 3 apart
COARSE_SHARE = 0.08  # of the steps are not the usual one, as 90 frames in a second have them in hundredths
MANY, LINE_FRAMES = 0.1, 0.7  # of the steps; standard deviation from a line, from which lost frames lead away
REGULARLY = 0.3  # standard deviation of the distances between gaps, of their mean
TIGHT = 0.1  # of the usual step: the standard deviation of steps near it, where single late frames are seen
WHOLE = 0.02  # of a tick
LINE, REGULAR = 1.8, 1.3  # ticks that times of a coarse clock lie off a line; of one that frames wait for
CHANGED = (1.15, 10.0)  # times as long are the steps of some blocks; beyond it the unit changed, not the rate
BLOCK, OTHER_BLOCKS, EVEN = 15, 0.05, 0.35  # frames; of the blocks; standard deviation of the mean
BY_CHANCE = 6.0  # standard errors of a block's mean: the least and the greatest of many lie far apart
STEADY = 0.6  # share of steps near the usual one
SAME = 0.02  # of the step
SAME_RUNS = 0.9  # of the runs of equal times
WIDE = 6.0  # usual steps that the longest of uneven ones may take
BACKWARD = 0.1  # share of steps
Ticks = Float[np.ndarray, " t"]


def usual_step(ticks: Ticks) -> float:
    """The mean of the steps near their median; 0 where none goes forward."""
    d = np.diff(ticks)
    if not (d > 0).any():
        return 0.0
    return float(d[near(d, float(np.median(d[d > 0])))].mean())


def near(d: Ticks, step: float) -> Bool[np.ndarray, " t"]:
    """Which steps are near this one."""
    return (d > NEAR_STEP[0] * step) & (d < NEAR_STEP[1] * step)


def roughness(ticks: Ticks) -> float:
    """How far times lie off those of an even clock: standard deviation, in frames; infinite where none goes forward."""
    if len(ticks) < 3 or ticks[-1] <= ticks[0]:
        return float("inf")
    t = np.arange(len(ticks))
    slope, start = np.polyfit(t, ticks - ticks[0], 1)
    return float(np.std(ticks - ticks[0] - slope * t - start) / slope) if slope > 0 else float("inf")


def steps(
    ticks: Ticks | Int[np.ndarray, " t"], at: Int[np.ndarray, " t"] | None = None
) -> tuple[float, tuple[str, ...]]:
    """The usual step between frames, 0 where there is none, and sentences about the unusual ones.

    `at` are the numbers of the frames, where not all have a time.
    """
    d, n = np.diff(ticks), np.ones(max(0, len(ticks) - 1)) if at is None else np.diff(at)
    forward = d > 0
    if not forward.any():
        return 0.0, (f"the time runs backwards at {(d < 0).sum():,} of {len(ticks):,} frames",) if (d < 0).any() else ()
    each = d / n
    if changed := change(each):
        return 0.0, (f"its frames come {changed}: export it at one rate",)
    if (found := coarse(each)) is not None:
        return found
    median = float(np.median(each[forward]))
    usual_ones = near(each, median)
    step = float(d[usual_ones].sum() / n[usual_ones].sum()) if usual_ones.any() else median
    doubled, back = int((d == 0).sum()), int((d < 0).sum())
    notes = [f"the time runs backwards at {back:,} of {len(ticks):,} frames"] if back else []
    uneven = usual_ones.sum() < STEADY * forward.sum()
    span = f"{each[forward].min():.3g} to {each.max():.3g}"
    if back > max(1, BACKWARD * len(d)) or (uneven and each.max() > WIDE * median):
        return 0.0, (*notes, f"its times do not grow steadily (by {span} a frame): they tell no frame rate")
    lost, gaps = lost_frames(each, n, median)
    bursts = in_bursts(ticks, each, each[usual_ones].std() > TIGHT * step if usual_ones.any() else False, (lost, gaps))
    lost, gaps = (0, 0) if bursts else (lost, gaps)
    mean = float(d[forward].sum() / (n.sum() + lost)) if not uneven else float(d[forward].sum() / n[forward].sum())
    if doubled > OFTEN * len(d):
        times = equal_times(d, len(d), doubled)
        step /= times
        whole = abs(times - round(times)) <= SAME * times
        shown = f"{round(times) if whole else times:.3g}"
        notes.append(f"each time stands {shown} times in a row: that many frames are read within it")
    elif uneven or bursts or (not back and abs(mean - step) > SAME * step):
        step = mean
        notes.append(f"its times are uneven (by {span}): their mean is taken")
    if 0 < doubled <= OFTEN * len(d):
        notes.append(f"{doubled:,} of {len(ticks):,} frames have the time of the frame before (doubled frames)")
    if gaps:
        message = "1 gap in its times," if gaps == 1 else f"{gaps:,} gaps in its times,"
        notes.append(f"{message} {lost:,} frames long in all: frames are missing there")
    return step, tuple(notes)


def lost_frames(each: Ticks, n: Ticks | Int[np.ndarray, " t"], median: float) -> tuple[int, int]:
    """How many frames are lost, and in how many gaps: a late frame has early ones beside it, and none is lost."""
    lost, gaps, used = 0, 0, 0
    for i in np.flatnonzero(each > (GAP + n - 1) / n * median).tolist():
        start, stop = i, i + 1
        while start > used and 0 <= each[start - 1] < EARLY * median:
            start -= 1
        while stop < len(each) and 0 <= each[stop] < EARLY * median:
            stop += 1
        missing = round(float((each[start:stop] * n[start:stop]).sum() / median - n[start:stop].sum()))
        lost, gaps, used = lost + max(0, missing), gaps + (missing > 0), stop
    return lost, gaps


def in_bursts(ticks: Ticks | Int[np.ndarray, " t"], each: Ticks, loose: np.bool | bool, found: tuple[int, int]) -> bool:
    """Whether what look like (lost frames, gaps) are frames that come late: the times stay near a line all the same.

    `loose`: the usual steps differ so much that single late frames are seen among them.
    """
    lost, gaps = found
    step = float(np.median(each[each > 0]))
    many = lost > SAME * len(each) if loose else gaps > MANY * len(each) and comes_regularly(each > GAP * step)
    return bool(many) and roughness(np.asarray(ticks, dtype=float)) < LINE_FRAMES


def comes_regularly(some: Bool[np.ndarray, " d"]) -> bool:
    """Whether what is meant comes after equally many frames each time; losses come by chance."""
    apart = np.diff(np.flatnonzero(some))
    return len(apart) > 1 and bool(apart.std() < REGULARLY * apart.mean())


def equal_times(d: Ticks, count: int, doubled: int) -> float:
    """How many frames stand at one time: of runs of equal times the usual one, or their mean where they alternate."""
    runs = np.diff(np.flatnonzero(np.r_[True, d != 0, True]))  # but for the first and the last, which are cut off
    if len(runs) <= 2:
        return float(round(count / (count - doubled)))
    usual = float(np.median(runs[1:-1]))
    mean = float(runs[1:-1].mean())  # a lost frame shortens a run, and none lengthens it
    return usual if mean < usual and np.mean(runs[1:-1] == usual) >= SAME_RUNS else mean


def change(each: Ticks) -> str:
    """'2 times as slowly at its end as at its start', where blocks of frames agree on another rate than others."""
    count = len(each) // BLOCK
    if count < 4:
        return ""
    blocks = each[: count * BLOCK].reshape(count, BLOCK)
    even = blocks.std(axis=1) <= EVEN * blocks.mean(axis=1)
    if even.sum() < 4:
        return ""
    medians, means = np.median(blocks[even], axis=1), blocks[even].mean(axis=1)
    if medians.min() <= 0:
        return ""
    slow, fast = np.minimum(medians, means), np.maximum(medians, means)
    few = max(1, int(OTHER_BLOCKS * len(means)))
    least, most = np.sort(fast)[few], np.sort(slow)[-1 - few]
    times = float(np.median(medians[slow >= most]) / np.median(medians[fast <= least]))
    chance = BY_CHANCE * float(np.median(blocks[even].std(axis=1))) / np.sqrt(BLOCK)
    if most < max(CHANGED[0] * least, least + chance) or times >= CHANGED[1]:
        return ""
    ends = medians[-2:].mean() / medians[:2].mean()
    if max(ends, 1 / ends) < CHANGED[0]:
        return f"{times:.3g} times as slowly in some parts of it as in others"
    return f"{times:.3g} times as {'slowly' if ends > 1 else 'fast'} at its end as at its start"


def coarse(each: Ticks) -> tuple[float, tuple[str, ...]] | None:
    """The mean of steps that are a few ticks of a clock coarser than the frames, with a sentence; None where they are
    not."""
    if not (each > 0).any() or (each < 0).any():
        return None
    tick = float(each[each > 0].min())
    tick = float(each[(each > 0) & (each < NEAR_STEP[1] * tick)].mean())  # whatever its last digit was rounded to
    numbers = each / tick
    whole = np.abs(numbers - np.round(numbers)).max() <= WHOLE
    usual = np.median(np.round(numbers))
    odd = (np.round(numbers) != usual).mean()
    few = usual <= 2.01 and numbers.max() <= 3.01 and (numbers < 0.5).mean() <= OFTEN
    if not whole or not few or odd < COARSE_SHARE:
        return None
    x = np.concatenate([[0.0], np.cumsum(numbers)])
    off = np.ptp(x - np.linspace(0, x[-1], len(x)))
    digit = tick / 10 ** np.floor(np.log10(tick) + 1e-9)
    if min(abs(digit - one) for one in (1.0, 2.0, 5.0)) <= 1e-3:
        return (float(each.mean()), ()) if off <= LINE else None
    span = f"{each[each > 0].min():.3g} to {each.max():.3g}"
    return (float(each.mean()), (f"its times are uneven (by {span}): their mean is taken",)) if off <= REGULAR else None
