"""Several faces or devices whose frames stand in one list in turn: A, B, A, B.

Together   names or numbers of faces come in turn: one returns after less than `AWAY` rows, two stand at one time, or
           the time goes back where they change
In turn    a column of a few values under any name is that of devices where each time stands once with each of them
Alternate  without such a column: each frame is like the one two to four before, and unlike the last
"""

from collections import Counter, defaultdict
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from jaxtyping import Float

from capture_plan.curves.text import to_number

AWAY = 3  # rows; faces found again stay for longer
MOST = 8  # devices
DEVICES = (2, 3, 4)
NEARLY = 0.9  # of the times
SAME = 0.25  # of the way from frame to frame, to the next but one
FEWEST = 12  # frames


def together(faces: Sequence[str], times: Sequence[str] = ()) -> bool:
    """Whether faces come in turn; rows without a face ('') say nothing. `times` may be empty."""
    named = [(face, times[t] if times else "") for t, face in enumerate(faces) if face]
    lengths, before = [0], ""
    for face, _ in named:
        lengths = [*lengths[:-1], lengths[-1] + 1] if face == before else [*lengths, 1]
        before = face
    at: dict[str, str] = {}
    twice = sum(at.setdefault(time, face) != face for face, time in named if time)
    turns = [(one[1], other[1]) for one, other in pairwise(named) if one[0] != other[0] and one[1] and other[1]]
    back = sum(is_before(b, a) for a, b in turns)
    return any(length < AWAY for length in lengths[2:-1]) or twice > 1 or back > 1


def is_before(one: str, other: str) -> bool:
    """Whether a time is before another one; timecodes are compared as they stand."""
    a, b = to_number(one), to_number(other)
    return a < b if np.isfinite([a, b]).all() else len(one) == len(other) and one < other


def in_turn(values: Sequence[str], times: Sequence[str]) -> bool:
    """Whether nearly each time stands once with each of a few values."""
    count = len(set(values))
    if not 2 <= count <= MOST or len(times) != len(values) or len(values) < FEWEST:
        return False
    at: dict[str, list[str]] = defaultdict(list)
    for value, time in zip(values, times, strict=True):
        at[time].append(value)
    full = Counter(len(some) == count == len(set(some)) for some in at.values())
    return full[True] >= NEARLY * len(at) and len(at) > 2


def alternate(x: Float[np.ndarray, "t c"]) -> str:
    """A sentence where the frames seem to be of two faces in turn; nothing where they are of one."""
    if len(x) < FEWEST:
        return ""
    next_one = np.abs(np.diff(x, axis=0)).sum(axis=1)
    for apart in DEVICES:
        later = np.abs(x[apart:] - x[:-apart]).sum(axis=1)
        if np.median(later) < SAME * np.median(next_one):
            return _in_turn(apart)
    return ""


def _in_turn(apart: int) -> str:
    """The doubt about frames of which each is like the one so many before it."""
    return (
        f"it is not certain that its frames are of one face: each is unlike the one before and like that {apart} "
        "frames before, as if several devices had been written in turn: save each as a file of its own"
    )
