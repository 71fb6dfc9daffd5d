"""Raw columns beside filtered ones of the same name: the filtered drives, the raw is left out and said.

JawOpen_raw beside JawOpen_filtered or JawOpen      the words but for these are the same
"""

from collections.abc import Sequence
from dataclasses import replace

from capture_plan.curves.weights import WeightTable
from capture_plan.names.tokens import split_words

RAW = frozenset(("raw", "unfiltered", "unsmoothed", "noisy", "original", "orig", "uncalibrated"))
FILTERED = frozenset(("filtered", "filter", "smooth", "smoothed", "clean", "cleaned", "denoised", "calibrated"))


def raw_columns(columns: Sequence[str]) -> dict[str, str]:
    """The filtered column of every raw one that has one."""
    words = {column: tuple(split_words(column)) for column in columns}
    rest = {column: tuple(word for word in w if word not in RAW | FILTERED) for column, w in words.items()}
    better: dict[tuple[str, ...], str] = {}
    for column in sorted(columns, key=lambda one: FILTERED.isdisjoint(words[one])):
        if RAW.isdisjoint(words[column]):
            better.setdefault(rest[column], column)
    return {c: better[rest[c]] for c in columns if not RAW.isdisjoint(words[c]) and rest[c] and rest[c] in better}


def without_raw(take: WeightTable, given: Sequence[str] = ()) -> WeightTable:
    """The take without the raw columns of which it has filtered ones; `given` are those that a name map names."""
    raw = {column: other for column, other in raw_columns(take.columns).items() if column not in given}
    if not raw:
        return take
    pairs = ", ".join(f"{column} beside {other}" for column, other in raw.items())
    skipped = (*take.skipped, *((column, f"it is the raw form of {other}") for column, other in raw.items()))
    stay = [c for c, column in enumerate(take.columns) if column not in raw]
    return replace(
        take,
        columns=tuple(take.columns[c] for c in stay),
        weights=take.weights[:, stay],
        skipped=skipped,
        notes=(*take.notes, f"raw columns are left out where a filtered one has the same name: {pairs}"),
    )
