"""Frames in a second as people and programs state them, beside the times of the frames.

rate_in_words("29,97"), rate_in_words("60 fps"), rate_in_words("30000/1001"), rate_in_words("1/60 s")
                                                                                     29.97, 60, 29.97, 60
rates_in_line("# recorded at 60fps"), rates_in_line("frame rate;30")                 {60}, {30}
A fraction below 1 is how long a frame lasts.
"""

import re
from collections.abc import Mapping
from typing import Any

LEAST_FPS, MOST_FPS = 1.0, 1000.0  # that a take was recorded with: scans are taken once in a second too
AMOUNT = r"\d+(?:[.,]\d+)?(?:e[+-]?\d+)?(?:\s*/\s*\d+(?:[.,]\d+)?)?"
CALLED = r"fps|frame[ _]?rate|frames (?:per|in a) second|sample[ _]?rate"
UNITS = r"fps|frames(?: per | in a |/)s(?:ec(?:ond)?)?|hz"
RATE = re.compile(rf"(?:{CALLED})[^\w]*(?<![\d.])({AMOUNT})|({AMOUNT})\s*(?:{UNITS})\b", re.IGNORECASE)
CELL = re.compile(rf"({AMOUNT})\s*(?:{UNITS}|s(?:ec)?)?", re.IGNORECASE)
PARTS = (("num", "den"), ("numerator", "denominator"))


def possible(fps: float) -> bool:
    """Whether a take can have so many frames in a second."""
    return LEAST_FPS <= fps <= MOST_FPS


def rate_in_words(text: str) -> float | None:
    """The rate that a cell or a value states; None where it states none that a take can have."""
    match = CELL.fullmatch(text.strip().strip("\"'").strip())
    return _rate(match[1]) if match else None


def rates_in_line(line: str) -> set[float]:
    """Every rate that a line of words states."""
    found = (_rate(match[1] or match[2]) for match in RATE.finditer(line))
    return {rate for rate in found if rate is not None}


def rate_in_value(value: Any) -> float | None:
    """The rate in a value of a document: a number, words, or a fraction in two parts."""
    if isinstance(value, bool) or value is None:
        return None
    if isinstance(value, (int, float)):
        return float(value) if possible(float(value)) else None
    if isinstance(value, str):
        return rate_in_words(value)
    if isinstance(value, list) and len(value) == 2:
        return rate_in_words(f"{value[0]}/{value[1]}")
    if isinstance(value, Mapping):
        return next((rate_in_words(f"{value[n]}/{value[d]}") for n, d in PARTS if n in value and d in value), None)
    return None


def _rate(amount: str) -> float | None:
    over, _, under = (part.strip().replace(",", ".") for part in amount.partition("/"))
    try:
        rate = float(over) / (float(under) if under else 1.0)
    except ZeroDivisionError:
        return None
    if under and 0 < rate < 1:
        rate = 1 / rate
    return round(rate, 6) if possible(rate) else None
