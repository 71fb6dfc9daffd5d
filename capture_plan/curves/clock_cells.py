"""What the cells of a clock's column hold: timecodes, stopwatch times, dates or plain numbers, as ticks.

Timecodes    h:m:s:f, h:m:s;f or h;m;s;f: x = n (3600 h + 60 m + s) + f, without the numbers that drop-frame codes pass
             over; the clock's n from the highest f and the usual step
Others       seconds, or numbers in a unit that their name or their step tells; of [h:]m:s.ff, where no whole second has
             more than its first 24 to 60 hundredths, these are frames of such a clock; so is the last of
             m:s:f and s:f where it grows from row to row
"""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from datetime import datetime

import numpy as np
from jaxtyping import Float, Int

CLOCKS = (24, 25, 30, 48, 50, 60, 90, 100, 120, 240)  # frames in a second of timecode
NTSC = 1000 / 1001
DIGITS, FRACTION = r"\d{1,9}", r"\d{1,30}"  # longer ones are no time
CODE = re.compile(rf"({DIGITS})[:;]({DIGITS})[:;]({DIGITS})([:;.])({DIGITS}(?:\.{FRACTION})?)")
STOPWATCH = re.compile(rf"(?:({DIGITS}):)?({DIGITS}):({DIGITS}(?:[.,]{FRACTION})?)")  # [h:]m:s.fraction
WHOLE = re.compile(r"[+-]?\d+")
FRAMES = re.compile(r"[.,]\d\d$")
FEWEST, HALF = 3, 0.5  # rows; of them
MOST_FRAMES = 60  # a whole second of hundredths has later ones
DAY_S = 86_400


@dataclass(frozen=True, eq=False)
class Clock:
    """Ticks of a clock, so many in a second: `rate` of timecodes, `unit_s` seconds each of times where that is known.

    `stated_s` is what their name says; `sure` whether timecodes show their clock; `factor` is 1000/1001 of drop-frame;
    `whole` whether all are whole numbers; `doubt` a sentence where their form has two meanings.
    """

    ticks: Float[np.ndarray, " t"]
    unit_s: float | None = None
    stated_s: float | None = None
    rate: int | None = None
    sure: bool = True
    factor: float = 1.0
    whole: bool = False
    doubt: str = ""


def is_clock_number(text: str) -> bool:
    """Whether a cell holds a finite number."""
    try:
        return bool(np.isfinite(float(text.replace(",", "."))))
    except ValueError:
        return False


def is_date(text: str) -> bool:
    """Whether a cell holds a date as ISO 8601 writes it."""
    try:
        return bool(datetime.fromisoformat(text))
    except ValueError:
        return False


def plain_numbers(texts: Sequence[str]) -> Clock:
    """Times in a unit that is not known."""
    return Clock(np.array([float(text.replace(",", ".")) for text in texts]), whole=all(map(WHOLE.fullmatch, texts)))


def stopwatch(texts: Sequence[str]) -> Clock:
    """Seconds of h:m:s.fraction or m:s.fraction, or frames of m:s.frames."""
    parts = [match for text in texts if (match := STOPWATCH.fullmatch(text))]
    if all(FRAMES.search(m[3]) for m in parts):
        codes = ticks_of_codes([f"{m[1] or 0}:{m[2]}:{m[3].replace(',', '.')}" for m in parts])
        if codes.sure and codes.rate is not None and codes.rate <= MOST_FRAMES:
            return codes
    if codes := frames_behind_seconds(parts):
        return codes
    return Clock(np.array([3600 * int(m[1] or 0) + 60 * int(m[2]) + float(m[3].replace(",", ".")) for m in parts]), 1.0)


def frames_behind_seconds(parts: Sequence[re.Match[str]]) -> Clock | None:
    """The codes of m:s:f or s:f; None where the last part is seconds, as several rows in a row have the same."""
    if not all(m[3].isdigit() for m in parts) or len(parts) < FEWEST:
        return None
    last, before = np.array([int(m[3]) for m in parts]), np.array([int(m[2]) for m in parts])
    if (np.diff(last) == 0).mean() > HALF:
        return None
    codes = replace(ticks_of_codes([f"0:{m[1] or 0}:{m[2]}:{m[3]}" for m in parts]), sure=True)
    shown = f"'{parts[-1][0]}'"
    if not (np.diff(before) != 0).any():
        doubt = f"it is not certain whether its times, up to {shown}, end in seconds or frames: they tell no frame rate"
        return replace(codes, sure=False, doubt=f"{doubt}, give it if it is known")
    if codes.rate is None or codes.rate > MOST_FRAMES or (codes.rate < MOST_FRAMES and last.max() >= codes.rate):
        return None
    doubt = f"it is not certain, but its times, up to {shown}, are taken as seconds and frames of a clock of 60"
    return replace(codes, doubt=doubt if codes.rate == MOST_FRAMES else "")


def dates(texts: Sequence[str]) -> Clock:
    """The clock of cells that hold dates, in seconds."""
    return Clock(np.array([datetime.fromisoformat(text).timestamp() for text in texts]), 1.0)


def ticks_of_codes(texts: Sequence[str]) -> Clock:
    """Frames of timecodes; of h:m:s.fff with three digits or more, the fraction is one of a second."""
    found = [match for text in texts if (match := CODE.fullmatch(text))]
    if sum(match[4] == "." and len(match[5]) > 2 for match in found) > len(found) // 2:
        return stopwatch([match[0].replace(";", ":") for match in found])
    h, m, s = (np.array([int(match[part]) for match in found]) for part in (1, 2, 3))
    f = np.array([float(match[5]) for match in found])
    seconds = 3600 * h + 60 * m + s
    leap = np.diff(seconds, prepend=seconds[0])
    seconds = seconds + DAY_S * np.cumsum((leap < -DAY_S / 2).astype(int) - (leap > DAY_S / 2))
    n, sure = clock_frames(f, seconds)
    dropped = skipped_frames(n, f, seconds, drop=sum(match[4] == ";" for match in found) > len(found) // 2)
    ticks = n * seconds + f - (0 if dropped is None else dropped)
    return Clock(ticks, rate=n, sure=sure, factor=1.0 if dropped is None else NTSC)


def clock_frames(f: Float[np.ndarray, " t"], seconds: Int[np.ndarray, " t"]) -> tuple[int, bool]:
    """Frames in a second of the clock, and whether the codes show it: a whole second of them, or its last frame."""
    highest = int(f.max())
    inside = np.diff(f)[np.diff(seconds) == 0]
    step = float(np.median(inside[inside > 0])) if (inside > 0).any() else 1.0
    last = highest + round(step)  # 0, 5, ..., 20 are a clock of 25
    n = last if last in CLOCKS else next((clock for clock in CLOCKS if clock > highest), highest + 1)
    return n, len(np.unique(seconds)) > 2 or last >= n


def skipped_frames(
    n: int, f: Float[np.ndarray, " t"], seconds: Int[np.ndarray, " t"], *, drop: bool
) -> Int[np.ndarray, " t"] | None:
    """Numbers that a drop-frame clock has passed over (SMPTE ST 12-1); None where the codes use those numbers."""
    minutes, per_minute = seconds // 60, n // 15
    first = (seconds % 60 == 0) & (minutes % 10 != 0) & (f < per_minute)
    if not drop or n not in (30, 60) or first.any():
        return None
    return per_minute * (minutes - minutes // 10)


READERS: tuple[tuple[Callable[[str], object], Callable[[Sequence[str]], Clock]], ...] = (
    (CODE.fullmatch, ticks_of_codes),
    (STOPWATCH.fullmatch, stopwatch),
    (is_clock_number, plain_numbers),
    (is_date, dates),
)
