"""Columns that say how far an eye is open: 1 at rest, 0 where it is shut. They are no wide eyes.

Data     x[t, c] weights, 1 is full; column c is read as a wide-open eye by a word for open, EyeOpenLeft
Open     median_t x[t, c] >= MOSTLY: no eye is wide for half of a take, but most eyes are open; where they are shut
         more, x[t, c] >= AT_REST in frames where the rest of the face moves least
Result   1 - x is the blink where no other column is one for that eye; else the column is left out. Both are said
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float

from capture_plan.curves.weights import WeightTable
from capture_plan.names.movements import says
from capture_plan.names.name_map import NameMap
from capture_plan.names.recognise import recognise_all

MOSTLY, HALF, AT_REST = 0.6, 0.4, 0.75  # of a full weight; wide eyes have medians of 0 to 0.3
LEAST = 0.05  # of the frames: those in which a face moves least
WIDE, BLINK = "eyeWide", "eyeBlink"


def open_eyes(
    columns: Sequence[str], x: Float[np.ndarray, "t c"], mine: NameMap | None = None
) -> dict[str, tuple[str, ...]]:
    """ARKit's blinks that 1 less a column would be, for every column that says how far an eye is open."""
    given = {*mine.weights, *mine.names} if mine else set()
    meant = recognise_all(columns, mine=mine)
    wide = {
        column: known.arkit
        for column, known in meant.items()
        if known and known.arkit and all(name.startswith(WIDE) for name in known.arkit) and "open" in says(column)
    }
    moves = [column not in wide and bool(known and known.arkit) for column, known in meant.items()]
    rests = _is_open(x, np.array(moves, dtype=bool))
    return {
        column: tuple(name.replace(WIDE, BLINK) for name in wide[column])
        for column, open_at_rest in zip(columns, rests.tolist(), strict=True)
        if open_at_rest and column in wide and column not in given
    }


def _is_open(x: Float[np.ndarray, "t c"], moves: Bool[np.ndarray, " c"]) -> Bool[np.ndarray, " c"]:
    """Columns that are near 1 at rest; `moves` are those that tell when the face rests."""
    middle = np.median(x, axis=0)
    still = np.abs(x[:, moves]).sum(axis=1).argsort(kind="stable")[: max(1, round(LEAST * len(x)))]
    rest = np.median(x[still], axis=0) if moves.any() else middle
    return (middle >= MOSTLY) | ((middle >= HALF) & (rest >= AT_REST))


def as_blinks(
    take: WeightTable, full: float, names: Sequence[str], mine: NameMap | None = None
) -> tuple[WeightTable, dict[str, str]]:
    """The take without columns of open eyes, or with 1 less these; and what each of them is read as then.

    `full` is a full weight; `names` are the rig's: what has the name of a column is driven by it as it is.
    """
    eyes = {c: blinks for c, blinks in open_eyes(take.columns, take.weights / full, mine).items() if c not in names}
    if not eyes:
        return take, {}
    meant = recognise_all(take.columns, mine=mine)
    there = {name for column, known in meant.items() if known and column not in eyes for name in known.arkit}
    turned = {c: blinks for c, blinks in eyes.items() if there.isdisjoint(blinks)}
    apart = [c for c in eyes if c not in turned]
    x = take.weights.copy()
    for column in turned:
        x[:, take.columns.index(column)] = full - x[:, take.columns.index(column)]
    return _without(replace(take, weights=x, notes=(*take.notes, *_messages([*turned], apart))), apart), {
        column: "blink" if len(blinks) > 1 else "".join(blinks) for column, blinks in turned.items()
    }


def _without(take: WeightTable, apart: Sequence[str]) -> WeightTable:
    """The take without some columns, which are told as left out."""
    stay = [c for c, column in enumerate(take.columns) if column not in apart]
    why = "it is near 1 at rest: it says how far an eye is open, and the blink has a column of its own"
    skipped = (*take.skipped, *((column, why) for column in apart))
    return replace(take, columns=tuple(take.columns[c] for c in stay), weights=take.weights[:, stay], skipped=skipped)


def _messages(turned: Sequence[str], apart: Sequence[str]) -> list[str]:
    messages = []
    if turned:
        messages.append(
            f"{_listed(turned)} near 1 at rest: how far an eye is open, no wide eye; 1 less the value is "
            "taken as the blink"
        )
    if apart:
        messages.append(
            f"{_listed(apart)} near 1 at rest: how far an eye is open, no wide eye; left out beside the blink"
        )
    return messages


def _listed(columns: Sequence[str]) -> str:
    return f"{', '.join(columns)} {'is' if len(columns) == 1 else 'are'}"
