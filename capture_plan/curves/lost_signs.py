"""What numbers beside the weights say of a lost face, where they are more than yes and no.

Sure     confidence or quality as a share or in per cent: rows far below most of the others have lost the face, rows
         between are said
Codes    whole numbers of a state, of which nobody tells whether 0 is the good one or the lost: rows of 0 that are most
         of a take, and move as a face does, are not lost for it; of several numbers above 0 the seldom ones are said
"""

from collections import Counter
from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float

from capture_plan.curves.columns import plain
from capture_plan.curves.presence import without_face
from capture_plan.curves.text import to_number

FAR, BELOW = 0.25, 0.6  # of the usual confidence: lost, and not certain
HIGH = 0.4  # of the full scale, for a usual confidence that says anything
MOST, MOVING = 0.5, 0.3  # of the rows; of these change
STATES = ("state", "status", "trackingstate", "trackingstatus", "trackerstate", "trackerstatus", "facestate")
CODES = 9  # the highest number of a state


def rows_without_face(
    name: str, cells: Sequence[str], x: Float[np.ndarray, "t c"], kind: str | None
) -> tuple[Bool[np.ndarray, " t"], str]:
    """Rows of which a column of a kind says that they have no face, and what has to be said; x are the weights."""
    lost, message = without_face(name, cells, opposite=kind == "lost")
    messages = [] if kind == "confidence" else [message]
    if kind in ("confidence", "tracked"):
        less, doubt = little_sure(name, cells)
        lost, messages = lost | less, [*messages, doubt]
    if kind == "tracked":
        lost, doubt = state_codes(name, cells, lost, x)
        messages.append(doubt)
    return lost, "; ".join(filter(None, messages))


def little_sure(name: str, cells: Sequence[str]) -> tuple[Bool[np.ndarray, " t"], str]:
    """Rows of far less confidence than most, and a sentence about those between."""
    x = np.array([to_number(cell) for cell in cells])
    lost = np.zeros(len(x), dtype=bool)
    some = np.isfinite(x) & (x > 0)
    values = np.unique(x[some])
    if len(values) < 2 or set(values.tolist()) <= set(range(CODES)):
        return lost, ""
    usual, full = float(np.median(x[some])), 1.0 if values[-1] <= 1 else 100.0
    if usual < HIGH * full or values[-1] > 100:
        return lost, ""
    lost = some & (x < FAR * usual)
    between = some & ~lost & (x < BELOW * usual)
    if not between.any():
        return lost, ""
    message = (
        f"'{name}' is {x[between].min():.3g} to {x[between].max():.3g} in {between.sum():,} rows and mostly {usual:.3g}"
    )
    return lost, f"{message}: it is not certain whether the face was tracked there, and they stay"


def state_codes(
    name: str, cells: Sequence[str], lost: Bool[np.ndarray, " t"], x: Float[np.ndarray, "t c"]
) -> tuple[Bool[np.ndarray, " t"], str]:
    """The rows that a state loses, and a sentence where its numbers do not tell; x are the weights."""
    codes = np.array([to_number(cell) for cell in cells])
    some = codes[np.isfinite(codes)]
    if plain(name) not in STATES or not len(some) or not (some == np.round(some)).all() or some.max(initial=0) > CODES:
        return lost, ""
    counts = Counter(some.astype(int).tolist())
    listed = ", ".join(f"{code} in {n:,}" for code, n in sorted(counts.items()))
    doubt = f"it is not certain what the numbers of '{name}' mean ({listed} rows)"
    if lost.mean() > MOST and lost.any() and not lost.all() and moves(x[lost]):
        message = f"{doubt}: as most rows have one that may stand for a lost face, all of them stay"
        return np.zeros_like(lost), f"{message}; cut out those where it was lost"
    above = [code for code in counts if code > 0]
    if len(above) > 1:
        return lost, f"{doubt}: rows above 0 stay"
    return lost, ""


def moves(x: Float[np.ndarray, "t c"]) -> bool:
    """Whether weights change from row to row as those of a face do."""
    if len(x) < 2:
        return False
    here = np.nan_to_num(x)
    return bool(np.mean((here[1:] != here[:-1]).any(axis=1)) > MOVING)
