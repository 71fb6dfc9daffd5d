"""Several faces or devices whose frames stand in one list in turn: A, B, A, B.

Together   names or numbers of faces come in turn: one returns after less than `AWAY` rows, or two stand at one time
In turn    a column of a few values under any name is that of devices where each time stands once with each of them
Alternate  without such a column: every second frame is like the last but one, and unlike the last
"""

from collections import Counter, defaultdict
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

AWAY = 3  # rows; faces found again stay for longer
MOST = 8  # devices
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
    return any(length < AWAY for length in lengths[2:-1]) or twice > 1


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
    next_one, but_one = np.abs(x[1:-1] - x[:-2]).sum(axis=1), np.abs(x[2:] - x[:-2]).sum(axis=1)
    if not np.median(but_one) < SAME * np.median(next_one) or np.mean(but_one < SAME * next_one) < NEARLY / 2:
        return ""
    return (
        "it is not certain that its frames are of one face: every second is unlike the one before and like the last "
        "but one, as if two devices had been written in turn: save each as a file of its own"
    )
