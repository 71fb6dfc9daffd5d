"""Units in the names of columns: jawOpen_pct, "jawOpen (%)", jawOpenPercent, jawOpen [0-255].

Full     the full weight that a name or a line of units states: 100 of a %, 255 of 0-255
Plain    a unit at the end of a name says nothing of a face: it goes before names are compared with those of a rig
Some     where few columns state a unit and the others none, the few are divided by it, and that is said
"""

import re
from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from capture_plan.curves.weights import WeightTable

RANGE = re.compile(r"[\[(]\s*[+-]?0(?:\.0*)?\s*(?:-|\u2013|\.\.+|…|to|:|,|;)\s*(\d+(?:\.\d+)?)\s*%?\s*[\])]")
SPELLED = "er[ _]?cent(?:age)?|erc|ct|ro[zc]ent|ourcent(?:age)?|or[ _]?cento|or[ _]?ciento|orcentaje"  # behind a P
WORD = rf"%|(?<![A-Za-z])[Pp](?:{SPELLED})|(?<=[a-z\d])P(?:{SPELLED})|(?<![A-Z])P(?:ERCENT|CT)"
PER_CENT = re.compile(rf"(?:{WORD})(?![A-Za-z])")
END = re.compile(rf"[\s_.:/-]*(?:{RANGE.pattern}|[\[(]?\s*(?:in[ _])?(?:{WORD})\s*[\])]?)\s*$")
WITHIN = 1.05  # weights of 0 to 1 end here
FEW = 3  # names in a sentence


def full_in(text: str) -> float | None:
    """The full weight that a name or a unit states; None where it states none."""
    if match := RANGE.search(text):
        return float(match[1])
    return 100.0 if PER_CENT.search(text) else None


def stated_in(texts: Sequence[str]) -> float | None:
    """The full weight that most of these names or units state, 100 of a %; None where they do not."""
    found = [full_in(text) for text in texts]
    usual = max({*found} - {None}, key=found.count, default=None)
    return usual if usual and 2 * found.count(usual) > len(found) else None


def without_unit(name: str) -> str:
    """A name without the unit at its end; the name itself where nothing else is in it."""
    return END.sub("", name) or name


def without_units(take: WeightTable, given: Collection[str] = ()) -> WeightTable:
    """The take with names without units, but for those in `given`, which a name map names, and those that are there.

    The full weight that most columns state is `stated` then; others that state one are divided by it.
    """
    short = {column: without_unit(column) for column in take.columns if column not in given and full_in(column)}
    there = [*(column for column in take.columns if column not in short), *short.values()]
    short = {column: name for column, name in short.items() if there.count(name) == 1}
    if not any(column != name for column, name in short.items()):
        return take
    stated = stated_in(take.columns) or take.stated
    x, notes = take.weights, []
    own = {c: full for c, column in enumerate(take.columns) if column in short and (full := full_in(column)) != stated}
    if apart := {c: full for c, full in own.items() if full and full > 1 and np.abs(x[:, c]).max() > WITHIN}:
        x = x / np.array([apart.get(c, 1.0) for c in range(len(take.columns))])
        some = ", ".join(take.columns[c] for c in list(apart)[:FEW])
        more = f" and {len(apart) - FEW:,} more" if len(apart) > FEW else ""
        notes.append(f"only {some}{more} of its {len(take.columns):,} columns state this unit: they are divided by it")
    columns = tuple(short.get(column, column) for column in take.columns)
    return replace(take, columns=columns, weights=x, notes=(*take.notes, *notes), stated=stated)
