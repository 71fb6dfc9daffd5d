"""The frame rate of a take from its timecodes or times, and what is odd about them.

Data    c[i] = h:m:s:f     timecodes of a clock of n frames in a second, or times x[i] in seconds or parts of one
Ticks   x[i] = n (3600 h + 60 m + s) + f, without the numbers that drop-frame codes (h:m:s;f) pass over
Step    s = median of x[i + 1] - x[i] > 0: a clock of 60 whose frames are 0, 2, 4, ... stamps 30 in a second
Rate    n / s, or 1 / mean of the steps near s, so that whole milliseconds (33, 33, 34) do not round it
A rate within 2 % of a usual one is that one. Gaps, doubled and backward times are counted over all rows of the file.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime

import numpy as np
from jaxtyping import Float, Int

CLOCKS = (24, 25, 30, 48, 50, 60, 90, 100, 120, 240)  # frames in a second of timecode
RATES = (10.0, 12.0, 12.5, 15.0, *map(float, CLOCKS))
NTSC = 1000 / 1001
CODE = re.compile(r"(\d+):(\d+):(\d+)([:;.])(\d+(?:\.\d+)?)")
STOPWATCH = re.compile(r"(?:(\d+):)?(\d+):(\d+(?:[.,]\d+)?)")  # [h:]m:s.fraction
NEAR, SAME_NTSC = 0.02, 2e-4  # of the rate
GAP = 1.6  # steps of this many usual ones are a gap: a lost frame makes 2, uneven cameras reach 1.5
OFTEN = 0.4  # share of doubled times from which they are the clock's and not the take's
UNITS_S = (1.0, 1e-3, 1e-6, 1e-9)
DAY_S = 86_400


@dataclass(frozen=True)
class Timing:
    """Frames in a second, None where the times do not tell it; sentences about gaps and doubled frames."""

    fps: float | None
    notes: tuple[str, ...] = ()


def timing_of(cells: Sequence[str], unit_s: float | None = None) -> Timing:
    """Timing of a column of a table, whatever its cells hold: timecodes, stopwatch times, dates or numbers."""
    texts = [cell.strip().strip('"') for cell in cells]
    texts = [text for text in texts if text]
    readers = (
        lambda some: from_codes(codes(some)),
        lambda some: from_times(stopwatch(some), 1.0),
        numbers_timing(unit_s),
    )
    for fits, read in zip((CODE.fullmatch, STOPWATCH.fullmatch, is_number), readers, strict=True):
        good = [text for text in texts if fits(text)]
        if len(good) > max(1, len(texts) // 2):
            return read(good)
    return from_times(dates(texts), 1.0)


def numbers_timing(unit_s: float | None):
    """A reader of plain numbers in a unit, which may be unknown."""
    return lambda some: from_times(np.array([float(text.replace(",", ".")) for text in some]), unit_s)


def is_number(text: str) -> bool:
    """Whether a cell holds a finite number."""
    try:
        return bool(np.isfinite(float(text.replace(",", "."))))
    except ValueError:
        return False


def codes(texts: Sequence[str]) -> list[re.Match[str]]:
    """Matches of timecodes."""
    return [match for text in texts if (match := CODE.fullmatch(text))]


def stopwatch(texts: Sequence[str]) -> Float[np.ndarray, " t"]:
    """Seconds of h:m:s.fraction or m:s.fraction."""
    parts = [match for text in texts if (match := STOPWATCH.fullmatch(text))]
    return np.array([3600 * int(m[1] or 0) + 60 * int(m[2]) + float(m[3].replace(",", ".")) for m in parts])


def dates(texts: Sequence[str]) -> Float[np.ndarray, " t"]:
    """Seconds of dates as ISO 8601 writes them; none where these are no dates."""
    try:
        return np.array([datetime.fromisoformat(text).timestamp() for text in texts])
    except (ValueError, OverflowError):
        return np.zeros(0)


def from_codes(found: Sequence[re.Match[str]]) -> Timing:
    """Timing of timecodes; of h:m:s.fff with three digits or more, the fraction is one of a second."""
    if sum(match[4] == "." and len(match[5]) > 2 for match in found) > len(found) // 2:
        return from_times(stopwatch([match[0] for match in found]), 1.0)
    h, m, s = (np.array([int(match[part]) for match in found]) for part in (1, 2, 3))
    f = np.array([float(match[5]) for match in found])
    seconds = 3600 * h + 60 * m + s
    seconds = seconds + DAY_S * np.cumsum(np.diff(seconds, prepend=seconds[0]) < -DAY_S / 2)
    n, sure = clock_frames(f, seconds)
    dropped = skipped_frames(n, f, seconds, drop=sum(match[4] == ";" for match in found) > len(found) // 2)
    step, notes = steps(n * seconds + f - (0 if dropped is None else dropped))
    if step == 0 or not sure:
        return Timing(None, notes)
    fps = usual(n / step)  # fractions of a frame drift: 0, 2.014, 4.028, ...
    return Timing(fps if dropped is None else round(fps * NTSC, 3), notes)


def clock_frames(f: Float[np.ndarray, " t"], seconds: Int[np.ndarray, " t"]) -> tuple[int, bool]:
    """Frames in a second of the clock, and whether the codes show it: a whole second of them, or its last frame."""
    highest = int(f.max())
    n = next((clock for clock in CLOCKS if clock > highest), highest + 1)
    inside = np.diff(f)[np.diff(seconds) == 0]
    step = float(np.median(inside[inside > 0])) if (inside > 0).any() else 1.0
    return n, len(np.unique(seconds)) > 2 or highest + step >= n


def skipped_frames(
    n: int, f: Float[np.ndarray, " t"], seconds: Int[np.ndarray, " t"], *, drop: bool
) -> Int[np.ndarray, " t"] | None:
    """Numbers that a drop-frame clock has passed over (SMPTE ST 12-1); None where the codes use those numbers."""
    minutes, per_minute = seconds // 60, n // 15
    first = (seconds % 60 == 0) & (minutes % 10 != 0) & (f < per_minute)
    if not drop or n not in (30, 60) or first.any():
        return None
    return per_minute * (minutes - minutes // 10)


def from_times(times: Float[np.ndarray, " t"], unit_s: float | None = None) -> Timing:
    """Timing of times in a unit of so many seconds: the one told where it gives a usual rate, else by their size."""
    step, notes = steps(times)
    if step == 0 or (unit_s is None and step == 1 and (times == np.round(times)).all()):
        return Timing(None, notes)  # 0, 1, 2, ... only counts the frames
    likely = next((unit for unit in UNITS_S if step * unit < 1 or unit == UNITS_S[-1]), 1.0)
    unit = unit_s if unit_s is not None and 1e-3 <= step * unit_s <= 1 else likely
    if unit_s is not None and unit != unit_s:
        notes = (*notes, f"its times step by {step:g}, which is taken as {step * unit:.3g} s whatever their name says")
    return Timing(usual(1 / (step * unit)), notes)


def steps(ticks: Float[np.ndarray, " t"] | Int[np.ndarray, " t"]) -> tuple[float, tuple[str, ...]]:
    """The usual step between frames, 0 where there is none, and sentences about the unusual ones."""
    d = np.diff(ticks)
    if not (d > 0).any():
        return 0.0, ()
    median = float(np.median(d[d > 0]))
    near = d[(d > 0.5 * median) & (d < 1.5 * median)]
    step = float(near.mean()) if len(near) else median
    doubled, back = int((d == 0).sum()), int((d < 0).sum())
    gaps = d[d > GAP * median]
    notes = []
    if doubled > OFTEN * len(d):
        times = round(len(d) / (len(d) - doubled))
        step /= times
        notes.append(f"each time stands {times} times in a row: that many frames are read within it")
    elif doubled:
        notes.append(f"{doubled:,} of {len(ticks):,} frames have the time of the frame before (doubled frames)")
    if back:
        notes.append(f"the time runs backwards at {back:,} of {len(ticks):,} frames")
    if len(gaps):
        lost = int(np.round(gaps / median).sum()) - len(gaps)
        notes.append(f"{len(gaps):,} gaps in its times, {lost:,} frames long in all: frames are missing there")
    return step, tuple(notes)


def usual(fps: float) -> float:
    """The usual rate nearest to this one, where one is near."""
    near = min(RATES, key=lambda rate: abs(fps - rate) / rate)
    if abs(fps - near) > NEAR * near:
        return round(fps, 3)
    return round(near * NTSC, 3) if abs(fps - near * NTSC) < SAME_NTSC * near else near
