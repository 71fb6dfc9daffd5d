"""Weights that some frames of a take leave out, as names of JSON or as blank cells: 0 there, or as they were?

Data     x[t, c]   weights, given[t, c] whether frame t names c
Zero     tools that leave out zeros: what is last said before a gap is small, low among the column's own values
Held     tools that write only what changes: what is last said is like any value, and holding moves the face less
         or columns come to rest before gaps, at a 0 that is written or at one other value
Between the two it is taken as 0, and said to be uncertain.
Cells    blank cells of a table are such only where they are many, in rows that hold other numbers, or where whole rows
         are blank between steady ones: every sixth has numbers. Else they are damage or a lost face (`rows.py`)
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float

LIKE_ANY = 0.4  # mean rank of the last values before gaps, 0.5 of values drawn at random
LOW = 0.25
ENOUGH = 8  # gaps, before they tell anything
CALMER = 0.5  # of the motion, where held values are right
SELDOM = 0.01  # of the values
FAR = 3.0  # usual steps
MOSTLY = 0.6  # of the gaps
MANY = 0.2  # of the rows: as many damaged ones refuse a table
LEAP = 1.3  # steps after a blank cell, of those without one
FEW = 4  # names in a sentence
STEADY = 0.9  # of the distances between rows with numbers are the same


def fill(
    x: Float[np.ndarray, "t c"],
    given: Bool[np.ndarray, "t c"],
    names: Sequence[str],
    also: Bool[np.ndarray, " t"] | None = None,
) -> tuple[Float[np.ndarray, "t c"], tuple[str, ...]]:
    """The weights with what frames leave out, and a sentence about it; frames that name nothing stay without.

    Columns without gaps tell nothing: they move alike whatever stands in the gaps. `also` are frames that name nothing
    and are gaps all the same.
    """
    named = np.flatnonzero(given.any(axis=1) if also is None else given.any(axis=1) | also)
    seldom = ~np.asarray(given[named].all(axis=0))
    if not seldom.any():
        return x, ()
    y, here = x[named], given[named]
    rank, zero, held = last_rank(y, here), np.where(here, y, 0.0), hold(y, here)
    calm = _moved(held[:, seldom]) < CALMER * _moved(zero[:, seldom])
    as_before = (rank > LIKE_ANY and calm) or resting(held, y, here)
    filled = x.copy()
    filled[named] = held if as_before else zero
    message = f"{seldom.sum():,} of {seldom.size:,} names are missing in some frames and "
    some = [name for name, here_not in zip(names, seldom, strict=True) if here_not]
    which = f" ({', '.join(some)})" if len(some) <= FEW else ""
    if as_before:
        return filled, (f"{message}keep their last value there{which}: the file seems to write only what changes",)
    doubt = " (not certain: they may be unchanged instead)" if rank > LOW and calm else ""
    return filled, (f"{message}count as 0 there{which}{doubt}",)


def hold(x: Float[np.ndarray, "t c"], given: Bool[np.ndarray, "t c"]) -> Float[np.ndarray, "t c"]:
    """What was last given of each column; 0 before the first."""
    last = np.maximum.accumulate(np.where(given, np.arange(len(x))[:, None], -1), axis=0)
    return np.where(last >= 0, np.take_along_axis(x, np.maximum(last, 0), axis=0), 0.0)


def resting(held: Float[np.ndarray, "t c"], x: Float[np.ndarray, "t c"], given: Bool[np.ndarray, "t c"]) -> bool:
    """Whether columns come to rest before most gaps, at a 0 that is written or always at one value far from 0.

    `held` is what was last given. A file in which a value stands twice in a row writes more than what changes.
    """
    again = given[1:] & given[:-1] & (x[1:] == x[:-1])
    if again.sum() > SELDOM * given.sum():
        return False
    at_rest = []
    for column, before, here in zip(x.T, held.T, given.T, strict=True):
        last, step = column[:-1][here[:-1] & ~here[1:]], np.abs(np.diff(before))
        values, counts = np.unique(last, return_counts=True)
        one = values[counts.argmax()] if len(last) else 0.0
        far = one == 0 or abs(one) > FAR * float(np.median(step[step > 0])) if (step > 0).any() else False
        at_rest += ((last == one) & far).tolist() if len(last) > 1 else []
    return len(at_rest) >= ENOUGH and float(np.mean(at_rest)) > MOSTLY


def _moved(x: Float[np.ndarray, "t c"]) -> float:
    """How far all columns move in all frames together."""
    return float(np.nansum(np.abs(np.diff(x, axis=0))))


def last_rank(x: Float[np.ndarray, "t c"], given: Bool[np.ndarray, "t c"]) -> float:
    """Mean share of a column's given values below the last one before a gap; 0 where gaps are too few to tell."""
    ranks = []
    for column, here in zip(x.T, given.T, strict=True):
        last = column[:-1][here[:-1] & ~here[1:]]
        values = np.sort(column[here & np.isfinite(column)])
        low, high = np.searchsorted(values, last, "left"), np.searchsorted(values, last, "right")
        ranks += ((low + high) / 2 / max(1, len(values))).tolist()
    return float(np.mean(ranks)) if len(ranks) >= ENOUGH else 0.0


def fill_cells(
    x: Float[np.ndarray, "t c"], usable: Bool[np.ndarray, " t"], faces: Bool[np.ndarray, " c"], names: Sequence[str]
) -> tuple[Float[np.ndarray, "t c"], str]:
    """A table with what blank cells of its columns of a face leave out in usable rows, and a sentence about it.

    Nothing is said where there are none, or where they are damage.
    """
    where = np.ix_(usable, faces)
    given = np.isfinite(x[where])
    if given.all() or not given.any():
        return x, ""
    blank = ~given.any(axis=1)
    partly = ~blank & ~given[:, given.any(axis=0)].all(axis=1)
    many, filled = partly.mean() > MANY and gaps(given) >= ENOUGH, x.copy()
    if not many and partly.mean() <= MANY and (every := steady_rows(np.asarray(~blank))):
        filled[where] = from_first(hold(x[where], given), given)
        return filled, f"numbers stand in 1 of every {every} rows: the rows between keep the last ones"
    if not many:
        return x, ""
    filled[where], message = fill_many(x[where], given, [name for name, here in zip(names, faces, strict=True) if here])
    return filled, message


def fill_many(
    x: Float[np.ndarray, "t c"], given: Bool[np.ndarray, "t c"], names: Sequence[str]
) -> tuple[Float[np.ndarray, "t c"], str]:
    """What `fill` makes of many blank cells; where these keep their values, rows without any number do so too.

    Values that went on in between tell that numbers are missing: these cells stay blank.
    """
    y, notes = fill(x, given, names)
    message = notes[0].replace("names are missing in some frames", "columns are blank in some rows")
    blank = ~given.any(axis=1)
    if not held_in(y, x, given):
        return y, message
    if leaps(hold(x, given), given):
        return x, ""
    more = f"; so do {blank.sum():,} rows without any number" if blank.any() else ""
    return from_first(hold(x, given), given), f"{message}{more}"


def from_first(x: Float[np.ndarray, "t c"], given: Bool[np.ndarray, "t c"]) -> Float[np.ndarray, "t c"]:
    """Given numbers alone, without those in the rows before the first that has any."""
    x[: int(given.any(axis=1).argmax())] = np.nan
    return x


def leaps(x: Float[np.ndarray, "t c"], given: Bool[np.ndarray, "t c"]) -> bool:
    """Whether values go further after blank cells than from one row to the next: then they went on in between."""
    step = np.abs(np.diff(x, axis=0))
    new = given[1:] & (step > 0)
    after, along = step[new & ~given[:-1]], step[new & given[:-1]]
    return min(len(after), len(along)) >= ENOUGH and bool(after.mean() > LEAP * along.mean())


def held_in(y: Float[np.ndarray, "t c"], x: Float[np.ndarray, "t c"], given: Bool[np.ndarray, "t c"]) -> bool:
    """Whether `fill` took what x leaves out as it was."""
    return np.array_equal(y[given.any(axis=1)], hold(x, given)[given.any(axis=1)])


def gaps(given: Bool[np.ndarray, "t c"]) -> int:
    """How often a column's cells become blank in rows that hold other numbers."""
    rows = given[given.any(axis=1)]
    return int((rows[:-1] & ~rows[1:]).sum())


def steady_rows(some: Bool[np.ndarray, " t"]) -> int:
    """The distance of rows with numbers where that is always the same, and more than 1; else 0."""
    apart = np.diff(np.flatnonzero(some))
    if len(apart) < ENOUGH:
        return 0
    usual = int(np.median(apart))
    return usual if usual > 1 and np.mean(apart % usual == 0) >= STEADY else 0
