"""Raw columns beside filtered ones of the same name: the filtered drives, the raw is left out and said.

JawOpen_raw beside JawOpen_filtered or JawOpen      the words but for these are the same
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

from capture_plan.curves.weights import WeightTable
from capture_plan.names.tokens import split_words

RAW = frozenset(("raw", "unfiltered", "unsmoothed", "noisy", "original", "orig", "uncalibrated"))
PASSED = frozenset(("previous", "prev", "old", "last", "target", "goal", "neutral", "baseline", "reference"))
FILTERED = frozenset(("filtered", "filter", "smooth", "smoothed", "clean", "cleaned", "denoised", "calibrated"))


@lru_cache(1024)
def is_version(name: str) -> bool:
    """Whether a name says that what it names is raw, smoothed or past."""
    return not (RAW | FILTERED | PASSED).isdisjoint(split_words(name))


def best_version(names: Sequence[str]) -> str | None:
    """Of names that are versions of one thing (raw, smoothed) the filtered one, else the plain one; None of others."""
    words = {name: frozenset(split_words(name)) for name in names}
    rest = {some - RAW - FILTERED - PASSED for some in words.values()}
    marked = [name for name, some in words.items() if some & (RAW | FILTERED | PASSED)]
    good = [name for name, some in words.items() if not some & (RAW | PASSED)]
    if len(names) < 2 or not good or len(rest - {frozenset()}) > 1 or len(marked) < len(names) - 1:
        return None
    return max(good, key=lambda name: bool(words[name] & FILTERED))


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
