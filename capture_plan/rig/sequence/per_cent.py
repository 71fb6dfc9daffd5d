"""Whether recorded weights are per cent: asked of all values of the columns that drive something, by several signs.

Data     x[t, c]   recorded values of the driving columns, 0 to 1 or 0 to 100; blendshapes may be overdriven (1.3, 2)
Signs    typical   each column's 95th percentile over the frames in which it is not 0; of these the one that a tenth of
                   the columns exceed, so that neither a single value nor a single column decides
         values    share of the values above `OVERDRIVEN`
         columns   share of the columns that get there
         whole     nearly all values are whole numbers
         written   the header or the cells carry a %
Answer   the sum of the signs: above 0 per cent; nearer to 0 than `SURE` it is said that it is not certain
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from capture_plan.rig.sequence.frames import evenly

OVERDRIVEN = 1.5  # weights above it are rare in any take; per cent are beyond it even in a quiet one
PLAINLY, BARELY = 5.0, 2.5  # of a typical value: no rig is driven that far; some are driven so far
TENTH, HIGH = 0.1, 0.95
SURE = 5.0
SAMPLE = 10_000  # frames, evenly over the take


@dataclass(frozen=True)
class Verdict:
    """Whether values are per cent, whether that is certain, and a sentence where it has to be said."""

    per_cent: bool
    sure: bool
    note: str = ""


def judge(columns: Sequence[str], x: Float[np.ndarray, "t c"], *, written: bool = False) -> Verdict:
    """The verdict on the driving columns; `written`: some cells carried a %."""
    largest = np.maximum(x.max(axis=0), -x.min(axis=0))
    if not largest.any():
        return Verdict(False, True)
    written = written or 2 * sum("%" in column for column in columns) > len(columns)
    some = np.abs(x[list(evenly(len(x), SAMPLE))])
    score = float(sum(signs(some[:, some.any(axis=0)], written).values()))
    per_cent, sure = score > 0, abs(score) >= SURE
    return Verdict(per_cent, sure, sentence(columns, largest, per_cent, sure, written))


def signs(size: Float[np.ndarray, "t c"], written: bool) -> dict[str, float]:
    """How much each sign speaks for per cent, against it where negative. Every column moves."""
    some: Bool[np.ndarray, "t c"] = size > 0
    high = np.sort([np.quantile(column[here], HIGH) for column, here in zip(size.T, some.T, strict=True)])[::-1]
    typical = high[min(len(high) - 1, int(np.ceil(TENTH * len(high))))]
    values, columns = np.mean(size[some] > OVERDRIVEN), np.mean((size > OVERDRIVEN).any(axis=0))
    whole = np.mean(size[some] == np.round(size[some])) > HIGH and typical > OVERDRIVEN
    return {
        "typical": 3.0 if typical > PLAINLY else 1.5 if typical > BARELY else -4.0,
        "values": 1.5 if values > 0.2 else -1.5 if values < 0.02 else 0.0,
        "columns": 1.5 if columns > 0.3 else -1.5 if columns < 0.1 else 0.0,
        "whole": 1.0 if whole else 0.0,
        "written": 4.0 if written else 0.0,
    }


def sentence(
    columns: Sequence[str], highest: Float[np.ndarray, " c"], per_cent: bool, sure: bool, written: bool
) -> str:
    """What has to be said of the verdict; `highest` value of each column. Nothing where weights are plainly weights."""
    c = int(highest.argmax())
    largest = float(highest[c])
    doubt = "" if sure else "it is not certain, but "
    wrong = "" if sure else ": where that is wrong, give shares of 100 or 0.01 in a name map"
    if per_cent:
        return f"{doubt}weights reach {largest:.3g} ('{columns[c]}'): they are taken as per cent{wrong}"
    if written:
        return f"{doubt}weights are written with a % and reach {largest:.3g}: they are taken as they are{wrong}"
    if largest > OVERDRIVEN:
        n = int((highest > OVERDRIVEN).sum())
        told = f"weights of {n} of {len(columns)} columns exceed {OVERDRIVEN:g}, '{columns[c]}' reaches {largest:.3g}"
        return f"{doubt}{told}: they are taken as they are, not as per cent{wrong}"
    return ""
