"""The frame rate of a take from its timecodes or times, and what is odd about them.

Data    c[i] = h:m:s:f     timecodes of a clock of n frames in a second, or times x[i] in seconds or parts of one
        a[i]               numbers of the frames that have a time: not all need one
Ticks   x[i] = n (3600 h + 60 m + s) + f, without the numbers that drop-frame codes (h:m:s;f) pass over
Wraps   a clock that begins again after an hour, half a day or a day goes on
Order   frames whose times make a steady clock only when they are sorted are sorted; without times by their numbers
Step    s, the usual (x[i + 1] - x[i]) / (a[i + 1] - a[i]) (`clock_steps.py`): a clock of 60 whose frames are 0, 2, 4,
        ... stamps 30
Rate    n / s, or 1 / s
Clocks  that disagree are said; the first is taken, or one that is much steadier
A rate within 2 % of a usual one is that one. Gaps, doubled and backward times are counted over all rows of the file.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int

from capture_plan.curves.clock_cells import DAY_S, NTSC, READERS, Clock, is_clock_number, plain_numbers
from capture_plan.curves.clock_steps import near, roughness, steps
from capture_plan.curves.clock_units import LIKELY_FPS, RATES, unit_by
from capture_plan.curves.stated_rate import possible, rate_in_words

NEAR, SAME_NTSC = 0.02, 2e-4  # of the rate
WRAPS_S = (3600, DAY_S // 2, DAY_S)
ORDERED = 0.95  # share of steps near the usual one
STEADIER, ROUGH = 0.5, 0.1  # of the roughness of another clock; frames, less is steady
UNTIMED = 0.2  # share of frames without a time, from which it is said


@dataclass(frozen=True, eq=False)
class Timing:
    """Frames in a second, None where the times do not tell it; sentences about gaps and doubled frames.

    `order` are the frames by their times, where the file has them in another order; `rough` is how far the times lie
    off an even clock, in frames.
    """

    fps: float | None
    notes: tuple[str, ...] = ()
    order: Int[np.ndarray, " t"] | None = None
    rough: float = float("inf")


def timing_by(kind: str, cells: Sequence[str], unit_s: float | None = None) -> Timing:
    """Timing of a column of one of the `CLOCK_KINDS`: codes or times, the time since the frame before, or the rate."""
    if kind == "step":
        return _of_steps(cells, unit_s)
    return _of_rates(cells) if kind == "rate" else timing_of(cells, unit_s)


def _of_steps(cells: Sequence[str], unit_s: float | None) -> Timing:
    """Timing of how long each frame lasted."""
    texts = [cell.strip() for cell in cells]
    if not texts or not all(map(is_clock_number, texts)) or (lasted := plain_numbers(texts).ticks).min() < 0:
        return Timing(None)
    if len(lasted) > 2 and (np.diff(lasted) > 0).mean() >= ORDERED:  # it goes on: a time or a number of the step
        return timing_of(cells, unit_s)
    found = timing_of([repr(x) for x in np.cumsum(lasted).tolist()], unit_s)
    likely = found.fps is not None and LIKELY_FPS[0] <= found.fps <= LIKELY_FPS[1]
    return found if likely else Timing(None)  # 2 is every second frame, not two thousandths


def _of_rates(cells: Sequence[str]) -> Timing:
    """The rate that most rows of a column state; none where they state several."""
    stated = {cell: rate_in_words(cell) for cell in {*map(str.strip, cells)} - {""}}
    rates = np.array([rate for cell in cells if (rate := stated.get(cell.strip())) is not None])
    if len(rates) < ORDERED * sum(bool(cell.strip()) for cell in cells) or not len(rates):
        return Timing(None)
    fps = float(np.median(rates))
    alike = np.abs(rates - fps) <= NEAR * fps
    return Timing(usual(fps)) if possible(fps) and alike.mean() >= ORDERED else Timing(None)


def timing_of(cells: Sequence[str], unit_s: float | None = None) -> Timing:
    """Timing of a column of a table, whatever its cells hold: timecodes, stopwatch times, dates or numbers."""
    texts = [cell.strip().strip('"').strip() for cell in cells]
    filled = [t for t, text in enumerate(texts) if text]
    for fits, read in READERS:
        good = [t for t in filled if fits(texts[t])]
        if len(good) > max(1, len(filled) // 2):
            clock = read([texts[t] for t in good])
            clock = clock if unit_s is None or clock.unit_s else replace(clock, stated_s=unit_s)
            return untimed(_measure(clock, np.array(good), len(texts)), len(good), len(texts))
    return Timing(None)


def agreed(timings: Sequence[tuple[str, Timing]]) -> Timing:
    """The first of named timings that tells a rate, or a much steadier one that tells another, with a sentence where
    they disagree; else the first."""
    telling = [(name, timing) for name, timing in timings if timing.fps is not None]
    if not telling:
        return timings[0][1] if timings else Timing(None)
    first, found = telling[0]
    fps = found.fps or 1.0
    against = [(name, timing) for name, timing in telling if abs((timing.fps or 0) - fps) > NEAR * fps]
    if not against:
        return found
    steadiest, best = min(against, key=lambda one: one[1].rough)
    others = ", ".join(f"'{name}' {timing.fps:g}" for name, timing in against)
    message = f"its clocks disagree: '{first}' makes {fps:g} frames in a second, {others}"
    if best.rough < STEADIER * found.rough and found.rough > ROUGH:
        message = f"{message}: '{steadiest}' is steadier and is taken"
        return replace(best, notes=(*best.notes, message))
    return replace(found, notes=(*found.notes, f"{message}: the first is taken"))


def untimed(timing: Timing, good: int, count: int) -> Timing:
    """The timing of a take, and a sentence where many of its frames have no time."""
    if timing.fps is None or count - good <= UNTIMED * count:
        return timing
    message = f"only {good:,} of {count:,} frames have a time: the others are taken as evenly between these"
    return replace(timing, notes=(*timing.notes, message))


def _measure(clock: Clock, at: Int[np.ndarray, " t"], count: int) -> Timing:
    """Timing of ticks of frames `at`, of `count` in all; only where all have a time, they can be sorted by it."""
    ticks = unwrapped(clock)
    if clock.rate is None and clock.unit_s is None and not np.array_equal(ticks, clock.ticks):
        clock = replace(clock, unit_s=second_of(clock))  # what begins again after a day of ms counts ms
    order = _order_of(ticks) if len(at) == count else None
    ticks = ticks if order is None else ticks[order]
    step, notes = steps(ticks, at)
    notes = (clock.doubt, *notes) if clock.doubt else notes
    rough = roughness(ticks)
    if order is not None:
        notes = ("frames do not stand in the order of their times: they are sorted by these", *notes)
    if step == 0:
        return Timing(None, notes, order)
    if clock.rate is None:
        return replace(from_step(clock, step, notes), order=order, rough=rough)
    fps = usual(clock.rate / step)  # fractions of a frame drift: 0, 2.014, 4.028, ...
    fps = fps if clock.factor == 1 else round(fps * clock.factor, 3)
    return Timing(fps if clock.sure else None, notes, order, rough)


def _order_of(ticks: Float[np.ndarray, " t"]) -> Int[np.ndarray, " t"] | None:
    """The frames by their times where these make a steady clock that the file's order does not show."""
    if (np.diff(ticks) >= 0).all():
        return None
    order = np.argsort(ticks, kind="stable")
    d = np.diff(ticks[order])
    return order if (d > 0).all() and np.mean(near(d, float(np.median(d)))) >= ORDERED else None


def by_numbers(name: str, cells: Sequence[str]) -> Timing:
    """The order that the numbers of frames under this name tell; they tell no rate."""
    texts = [cell.strip().strip('"').strip() for cell in cells]
    order = _order_of(plain_numbers(texts).ticks) if len(texts) > 1 and all(map(is_clock_number, texts)) else None
    message = f"frames do not stand in the order of '{name}': they are sorted by it"
    return Timing(None, () if order is None else (message,), order)


def unwrapped(clock: Clock) -> Float[np.ndarray, " t"]:
    """Ticks that go on where the clock begins again after an hour, half a day or a day."""
    d = np.diff(clock.ticks)
    if np.sum(d > 0) <= len(d) / 2 or not (d < 0).any():
        return clock.ticks
    step = float(np.median(d[d > 0]))
    second = clock.rate or 1 / second_of(clock)
    ticks = clock.ticks
    for wrap in WRAPS_S:
        again = (d < 0) & (d + wrap * second > 0) & (d + wrap * second < 10 * step)
        ticks = ticks + wrap * second * np.concatenate([[0], np.cumsum(again)])
    return ticks


def second_of(clock: Clock) -> float:
    """Seconds in a unit of times by their usual step."""
    d = np.diff(clock.ticks)
    return clock.unit_s or unit_by(clock, float(np.median(d[d > 0])))[0]


def from_step(clock: Clock, step: float, notes: tuple[str, ...]) -> Timing:
    """Timing of times by their usual step."""
    if clock.unit_s is None and clock.stated_s is None and step == 1 and (clock.ticks == np.round(clock.ticks)).all():
        return Timing(None, notes)  # 0, 1, 2, ... only counts the frames
    unit, doubt = (clock.unit_s, "") if clock.unit_s else unit_by(clock, step)
    if clock.stated_s is not None and unit != clock.stated_s:
        notes = (*notes, f"its times step by {step:g}, which is taken as {step * unit:.3g} s whatever their name says")
    fps = 1 / (step * unit)
    guessed = clock.unit_s is None and clock.stated_s is None
    if not possible(fps) or (guessed and not LIKELY_FPS[0] / 2 <= fps <= 2 * LIKELY_FPS[1]):
        message = f"its times would make {fps:,.4g} frames in a second: they tell no frame rate, give it if it is known"
        return Timing(None, (*notes, message))
    return Timing(usual(fps), (*notes, doubt) if doubt else notes)


def usual(fps: float) -> float:
    """The usual rate nearest to this one, where one is near."""
    near = min(RATES, key=lambda rate: abs(fps - rate) / rate)
    if abs(fps - near) > NEAR * near:
        return round(fps, 3)
    return round(near * NTSC, 3) if abs(fps - near * NTSC) < SAME_NTSC * near else near
