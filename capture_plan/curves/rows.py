"""Which rows of a recorded table are frames: lost faces and damaged rows are left out and counted, never made neutral.

Data      x[t, c]     numbers of all rows, NaN where a cell holds none
Column    left out where it has a number in less than half of the rows that have any
Lost      the file says so, or a row has no number at all. A take of which most is lost is read, and the share said
Silent    zeros or frames that stand still tell of a lost face without a word (`silence.py`)
Damaged   a number is missing in a row that has others; above a fifth of all rows the table is refused
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from capture_plan.curves.json_weights import known
from capture_plan.curves.silence import frozen, marks_no_face, zeroed
from capture_plan.curves.streams import alternate
from capture_plan.curves.weights import WeightTable
from capture_plan.curves.wide import other_columns
from capture_plan.errors import RigError
from capture_plan.names.recognise import recognise

MOST_DAMAGED = 0.2  # of all rows
MOUTH = ("jaw", "mouth", "tongue", "cheekPuff")
ENOUGH = 0.5  # of the rows, for a column
MUCH_LOST = 0.2  # of the frames: as many damaged ones refuse a take; without a face they are no fault of the file


@dataclass(frozen=True, eq=False)
class Rows:
    """All rows of a file. `lost[t]`: the file says that row t has no face; `faults`: what is wrong with a row, by t."""

    columns: tuple[str, ...]
    x: Float[np.ndarray, "t c"]
    lost: Bool[np.ndarray, " t"]
    faults: Mapping[int, str]


def table_of(
    rows: Rows,
    fps: float | None,
    skipped: Sequence[tuple[str, str]] = (),
    notes: Sequence[str] = (),
    stated: float | None = None,
) -> WeightTable:
    """The frames of these rows; `stated` is the full weight that the file states.

    RigError where too many rows are damaged, or none holds a face.
    """
    if not rows.columns and not rows.faults:
        raise RigError("holds no number under any name of its frames: export the weights")
    rows, doubled, whose = _one_face(rows)
    number = np.isfinite(rows.x)
    damaged = np.isin(np.arange(len(rows.x)), list(rows.faults))
    lost = (rows.lost | ~number.any(axis=1)) & ~damaged
    sound = ~lost & ~damaged
    count = number[sound].sum(axis=0)
    full = count >= max(1, ENOUGH * sound.sum())
    if sound.any() and not full.any():
        message = f"{rows.columns[0]}: {count[0]:,} of {sound.sum():,}"
        raise RigError(f"has no column with a number in half of its rows ({message}): export it again")
    damaged |= sound & ~number[:, full].all(axis=1)
    if damaged.sum() > MOST_DAMAGED * len(rows.x):
        message = f"{some_of(damaged, 'rows')} that cannot be read"
        raise RigError(f"has {message} ({fault(rows, damaged, full)}): export it again")
    marked = ~lost & ~damaged & marks_no_face(rows.x[:, full & names_of_face(rows)])
    lost |= marked
    zeros, doubts = silent_rows(rows, ~lost & ~damaged, full)
    keep = ~lost & ~damaged & ~zeros
    if not keep.any():
        raise RigError("has no frame in which the face was tracked: record it again")
    seldom = [
        (name, f"it has a number in {n:,} of {sound.sum():,} rows")
        for name, n, enough in zip(rows.columns, count.tolist(), full, strict=True)
        if not enough
    ]
    left_out = []
    if lost.any():
        left_out.append(f"{some_of(lost, 'frames')} {have(lost)} no face and {were(lost)} left out{much(lost)}")
    if damaged.any():
        message = f"{some_of(damaged, 'rows')} cannot be read and {were(damaged)} left out"
        left_out.append(f"{message} ({fault(rows, damaged, full)})")
    if zeros.any():
        message = f"in {some_of(zeros, 'frames')} every weight is exactly 0 from one frame to the next"
        left_out.append(f"{message}: the face was lost there, and they were left out{much(zeros)}")
    left_out += doubts
    if marked.any():
        number = f"{rows.x[marked.argmax(), int((full & names_of_face(rows)).argmax())]:g}"
        left_out.append(f"in {some_of(marked, 'frames')} every weight is {number}, which stands for no face")
    x = rows.x[np.ix_(keep, full)]
    left_out += [message for message in (frozen(x), alternate(x)) if message]
    columns = tuple(name for name, enough in zip(rows.columns, full, strict=True) if enough)
    return WeightTable(columns, x, fps, (*skipped, *doubled, *seldom), (*notes, *whose, *left_out), stated)


def _one_face(rows: Rows) -> tuple[Rows, list[tuple[str, str]], list[str]]:
    """The columns of one face, those of others with the reason, and a sentence about them."""
    other, message = other_columns(rows.columns, rows.x)
    if not other:
        return rows, [], []
    mine = [c for c in range(len(rows.columns)) if c not in set(other)]
    retained = replace(rows, columns=tuple(rows.columns[c] for c in mine), x=rows.x[:, mine])
    return retained, [(rows.columns[c], "it is of another face or version") for c in other], [message]


def silent_rows(
    rows: Rows, keep: Bool[np.ndarray, " t"], full: Bool[np.ndarray, " c"]
) -> tuple[Bool[np.ndarray, " t"], list[str]]:
    """Rows of zeros that stand for a lost face, by the columns whose names say something of a face, and a doubt.

    A mouth alone pauses so: where no column tells of more, its zeros are only said.
    """
    meant = [recognise(name) for name in rows.columns]
    faces = full & np.array([bool(known and known.arkit) for known in meant])  # a head turns though its face is lost
    found, doubt = np.zeros(len(rows.x), dtype=bool), np.zeros(len(rows.x), dtype=bool)
    at = np.flatnonzero(keep & (rows.x[:, int(faces.argmax())] == 0))
    if not faces.any() or not (rows.x[np.ix_(at, faces)] == 0).all(axis=1).any():
        return found, []
    found[keep], doubt[keep] = zeroed(rows.x[np.ix_(keep, faces)])
    if mouth_alone([name for name, here in zip(rows.columns, faces, strict=True) if here]):
        found, doubt = np.zeros_like(found), found | doubt
    if not doubt.any():
        return found, []
    return found, [f"it is not certain whether the face rests or was lost in {some_of(doubt, 'frames')} where every "
                   "weight is exactly 0: they stay in; cut them out where it was lost"]  # fmt: skip


def mouth_alone(names: Sequence[str]) -> bool:
    """Whether all of these names move nothing but a mouth, as far as it is known what they move."""
    meant = [known for name in names if (known := recognise(name)) and known.arkit]
    return all(one.startswith(MOUTH) for known in meant for one in known.arkit)


def names_of_face(rows: Rows) -> Bool[np.ndarray, " c"]:
    """The columns whose names say something of a face."""
    return np.array([known(name) for name in rows.columns], dtype=bool)


def fault(rows: Rows, damaged: Bool[np.ndarray, " t"], full: Bool[np.ndarray, " c"]) -> str:
    """What is wrong with the first damaged row."""
    t = int(np.flatnonzero(damaged)[0]) if damaged.any() else 0
    if t in rows.faults:
        return f"the first: {rows.faults[t]}"
    empty = np.flatnonzero(full & ~np.isfinite(rows.x[t]))
    return f"the first: no number for '{rows.columns[empty[0] if len(empty) else 0]}' in frame {t:,}"


def some_of(some: Bool[np.ndarray, " t"], what: str) -> str:
    """How many of all are meant, in words: '6 of 300 frames'."""
    return f"{some.sum():,} of {len(some):,} {what}"


def much(lost: Bool[np.ndarray, " t"]) -> str:
    """What has to be said where much of a take is lost; nothing where little is."""
    share = float(lost.mean())
    if share <= MUCH_LOST:
        return ""
    seldom = ", so that it shows little of what the face did" if share > ENOUGH else ""
    return f": {share:.0%} of the take{seldom}"


def have(some: Bool[np.ndarray, " t"]) -> str:
    """'has' of one, 'have' of more."""
    return "has" if some.sum() == 1 else "have"


def were(some: Bool[np.ndarray, " t"]) -> str:
    """'was' of one, 'were' of more."""
    return "was" if some.sum() == 1 else "were"
