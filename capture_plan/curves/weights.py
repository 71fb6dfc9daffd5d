"""Recorded weights as tables, whatever file they come from; and those that an NPZ archive holds.

CSV     a header and one row for each frame (`delimited.py`); Face Cap's lines (`face_cap.py`)
JSON    frames of named weights in many dialects (`json_take.py`)
NPZ     weights (t c), names (c), fps
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from capture_plan.curves.columns import plain
from capture_plan.curves.stated_rate import rate_in_words
from capture_plan.errors import RigError

RATE_NAMES = ("fps", "framerate", "rate")


@dataclass(frozen=True, eq=False)
class WeightTable:
    """`weights` of `columns` in every frame, as recorded; `fps` is None where the file does not say it.

    `skipped`: columns that cannot be weights, and why; `stated`: the full weight that the file states, 100 of a %.
    """

    columns: tuple[str, ...]
    weights: Float[np.ndarray, "t c"]
    fps: float | None
    skipped: tuple[tuple[str, str], ...] = ()
    notes: tuple[str, ...] = ()
    stated: float | None = None

    def __post_init__(self) -> None:
        if len(set(self.columns)) < len(self.columns):
            twice = next(column for column in self.columns if self.columns.count(column) > 1)
            raise RigError(f"has two columns '{twice}': give each its own name")
        if self.weights.shape != (len(self.weights), len(self.columns)) or self.weights.size == 0:
            raise RigError(f"has {self.weights.shape} weights for {len(self.columns)} names: export the take again")
        if not np.isfinite(self.weights).all():
            t, c = np.argwhere(~np.isfinite(self.weights))[0]
            raise RigError(f"has no number for '{self.columns[c]}' in frame {t:,}: export the take again")


def rate_of(arrays: Mapping[str, np.ndarray]) -> float | None:
    """The archive's frame rate, when it has one, however it spells the name; also one that is written as text."""
    fps = next((array for name, array in arrays.items() if plain(name) in RATE_NAMES), None)
    if fps is None or fps.size != 1 or fps.dtype.kind not in "fiuU":
        return None
    return rate_in_words(str(fps.ravel()[0]))
