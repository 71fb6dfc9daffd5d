"""Columns that differ in one word that nobody knows and mean one movement: two sides of a face, or two versions.

Data     mapping, where one of two such columns drives both sides and the other is left out
Result   a sentence for each pair whose numbers differ, with what to do; equal columns are one, whatever they are called
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from capture_plan.curves.mapping import WeightMapping
from capture_plan.names.name_map import NameMap
from capture_plan.names.recognise import recognise_all
from capture_plan.names.tokens import split_words

NUMBERED = ("FACS", "MetaHuman", "MB-Lab", "VRM")  # other numbers and ends of these are other movements
FEW = 3  # pairs in a sentence


def unclear_sides(
    mapping: WeightMapping, columns: Sequence[str], x: Float[np.ndarray, "t c"], mine: NameMap | None = None
) -> list[str]:
    """A sentence about pairs of columns of which one is left out though it may be the other side."""
    meant, given = recognise_all(columns, mine=mine), {*mine.weights, *mine.names} if mine else set()
    unsided = {
        column: (known.arkit, known.part)
        for column, known in meant.items()
        if known and known.arkit and known.side is None and column not in given
    }
    own = {column for column, known in meant.items() if known and known.standard in NUMBERED}
    out = [column for column, _ in mapping.left_out if column in unsided]
    driving = [column for column in columns if column in mapping.columns and column in unsided]
    place = {column: c for c, column in enumerate(columns)}
    pairs = [
        (one, other)
        for other in out
        for one in driving
        if unsided[one] == unsided[other]
        and not {one, other} <= own
        and differ_in_one(one, other)
        and not np.array_equal(x[:, place[one]], x[:, place[other]])
    ]
    if not pairs:
        return []
    some = ", ".join(f"{one} and {other}" for one, other in pairs[:FEW])
    more = f" and {len(pairs) - FEW:,} more pairs" if len(pairs) > FEW else ""
    verb = "seem" if len(pairs) == 1 else "each seem"
    return [
        f"{some}{more} {verb} to be two sides or two versions of one movement: it is not certain which; "
        f"{pairs[0][0]} drives it and {pairs[0][1]} is left out: write a name map that says what each of them drives"
    ]


def differ_in_one(one: str, other: str) -> bool:
    """Whether two names of several words differ in one of them at most, or one of them has one more."""
    a, b = split_words(one), split_words(other)
    if len(a) == len(b):
        return sum(x != y for x, y in zip(a, b, strict=True)) <= (len(a) > 1)
    few, many = sorted((a, b), key=len)
    return len(many) == len(few) + 1 and any(many[:i] + many[i + 1 :] == few for i in range(len(many)))
