"""What a full weight is in a recording, 1, 100 or another number: asked of all values that drive something.

Data     x[t, c]   recorded values of the driving columns; blendshapes may be overdriven (1.3, 2)
Beyond   do values go beyond weights of 0 to 1? The sum of signs:
         typical   each column's 95th percentile over the frames in which it is not 0; of these the one that a tenth of
                   the columns exceed, so that neither a single value nor a single column decides
         values    share of the values above `OVERDRIVEN`
         columns   share of the columns that get there
         whole     nearly all values are whole numbers
Full     1 where they do not; else what names, units or cells say (%, 0-255), else by how far the second highest column
         gets: 100 in most takes, 255 or 1000 above what per cent reach, 10 where many columns end just below it, 5
         where most are action units and none gets beyond it (A to E of Ekman and Friesen 1978, counted as 1 to 5)
What is unlikely or has two answers is said to be uncertain: all near 0, all a little above 1, nobody past half of
the way, some columns or some frames on another scale, columns beyond twice a full weight. A name map settles it:
full = 255. Single cells far outside a take decide nothing: they are left out before (`outliers.py`).
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from capture_plan.curves.frames import evenly
from capture_plan.curves.joined_scales import mixed_frames
from capture_plan.curves.units_in_names import stated_in
from capture_plan.errors import RigError

OVERDRIVEN = 1.5  # weights above it are rare in any take; per cent are beyond it even in a quiet one
MOST_DRIVEN = 2.0  # full weights; rigs are overdriven to 1.5, and a jaw at 2 opens by 80 mm
PLAINLY, BARELY = 5.0, 2.5  # of a typical value: no rig is driven that far; some are driven so far
TENTH, HIGH = 0.1, 0.95
SURE = 5.0
ONE = 1.05  # weights that end at 1, with what filters add
BELOW = 0.2  # of the furthest a column gets: filters swing less below 0
NEGATIVE = 0.3  # of the columns
TINY = 0.05  # no take of a face stays below it
HALF = 0.6  # of full: blinks and jaws go further in a take that shows a face
NEARLY = 0.95
TEN = (6.0, 10.01)  # a take in per cent has columns that get further, one of 0 to 10 has many that end here
UNITS = re.compile(r"(?:.*[^a-z])?AU[ _]?\d{1,2}(?:[^0-9].*)?", re.IGNORECASE)  # names of action units
FIVE = (2.0, 5.01)  # how far units get on their scale of five
PER_CENT_MOST = 150.0
SCALES = (255.0, 1000.0, 1023.0, 4095.0, 10_000.0, 32_767.0, 65_535.0)  # bytes, per mille, sliders, words
SAMPLE = 10_000  # frames, evenly over the take
STATE = "if that is wrong, say what a full weight is at the top of a name map, such as full = "
FEW = 4  # names in a sentence


@dataclass(frozen=True)
class Verdict:
    """The value of a full weight, whether that is certain, and a sentence where it has to be said."""

    full: float
    sure: bool
    note: str = ""


def judge(
    columns: Sequence[str], x: Float[np.ndarray, "t c"], *, stated: float | None = None, given: float | None = None
) -> Verdict:
    """The verdict on the driving columns; `stated` by the file, `given` by the person, who is right.

    Raises:
        RigError: the values are beyond every scale that is known.
    """
    if given is not None:
        return Verdict(given, True, f"a full weight is {given:g}, as the name map says")
    verdict = scale_of(columns, x, stated)
    doubts = driven_too_far(columns, x, verdict.full)
    note = "; ".join([*([verdict.note] if verdict.note else []), *doubts])
    return Verdict(verdict.full, verdict.sure and not doubts, note)


def scale_of(columns: Sequence[str], x: Float[np.ndarray, "t c"], stated: float | None) -> Verdict:
    """The verdict on the columns together."""
    highest = np.maximum(x.max(axis=0), -x.min(axis=0))
    below = (x.min(axis=0) < -BELOW * highest) & (highest > TINY)
    if below.sum() > max(1, NEGATIVE * len(columns)):
        return below_zero(scale_of(columns, np.abs(x), stated), columns, x, int(below.sum()))
    if not highest.any():
        return Verdict(1.0, True)
    stated = stated_in(columns) or stated
    size = np.abs(x[list(evenly(len(x), SAMPLE))])
    moving = size.any(axis=0)
    score = float(sum(signs(size[:, moving]).values()))
    peak = float(np.sort(highest)[-2]) if moving.sum() > 2 else float(highest.max())
    if stated is not None and stated > 1:
        return by_statement(columns, highest, peak, stated)
    if score <= 0:
        return weights_of_one(columns, highest, score)
    return beyond_one(columns, size, highest, peak, whole=bool(whole_numbers(size)))


def driven_too_far(columns: Sequence[str], x: Float[np.ndarray, "t c"], full: float) -> list[str]:
    """A sentence on columns that go beyond `MOST_DRIVEN` full weights in more than a single frame."""
    far = (np.abs(x) > MOST_DRIVEN * full).sum(axis=0) > 1
    if not far.any():
        return []
    names = [column for column, here in zip(columns, far, strict=True) if here]
    more = f" and {len(names) - FEW} more" if len(names) > FEW else ""
    times = np.abs(x[:, far]).max() / full
    one = len(names) == 1
    return [
        f"it is not certain that {', '.join(names[:FEW])}{more}, which {'reaches' if one else 'reach'} {times:.3g} "
        f"times a full weight, {'has' if one else 'have'} the same scale: if not, give {'it' if one else 'them'} "
        f"{'a share' if one else 'shares'} such as {share_of(times):g} in a name map"
    ]


def share_of(times: float) -> float:
    """What one unit of a column is worth that reaches so many full weights: 0.01 where it seems to be in per cent."""
    return 0.01 if times <= PER_CENT_MOST else round(1 / next((s for s in SCALES if times <= s), times), 8)


def below_zero(verdict: Verdict, columns: Sequence[str], x: Float[np.ndarray, "t c"], below: int) -> Verdict:
    """The verdict on the sizes of values that go below 0 in many columns, and the doubt about that."""
    low = x.min(axis=0)
    message = f"weights of {below} of {len(columns)} columns go below 0"
    message = f"{message}, one to {low.min():.4g} ({columns[int(low.argmin())]})"
    message = f"{message}: it is not certain what that means, and they are taken as they are"
    return Verdict(verdict.full, False, "; ".join([*([verdict.note] if verdict.note else []), message]))


def by_statement(columns: Sequence[str], highest: Float[np.ndarray, " c"], peak: float, stated: float) -> Verdict:
    """Names, units or cells state the scale: so it is, unless all values lie where weights of 0 to 1 lie."""
    message = f"weights are written as {unit_words(stated)} and reach {furthest(columns, highest)}"
    if peak <= ONE:
        return Verdict(1.0, False, f"{message}: it is not certain, but they are taken as they are; {STATE}{stated:g}")
    if peak > 2 * stated:
        return Verdict(stated, False, f"{message}: it is not certain, but they are taken so; {STATE}1")
    if peak < TINY * stated:
        return Verdict(stated, False, f"{message} only: it is not certain, but they are taken so; {STATE}1")
    return Verdict(stated, True, f"{message}: they are taken so")


def weights_of_one(columns: Sequence[str], highest: Float[np.ndarray, " c"], score: float) -> Verdict:
    """Values that are weights of 0 to 1, which some overdrive."""
    over, beyond = int((highest > ONE).sum()), int((highest > OVERDRIVEN).sum())
    doubt = "it is not certain, but "
    if highest.max() < TINY:
        message = f"no weight gets beyond {furthest(columns, highest)}: {doubt}1 is taken as full"
        return Verdict(1.0, False, f"{message}; {STATE}{highest.max():.1g}")
    if beyond:
        sure = abs(score) >= SURE
        message = f"weights of {beyond} of {len(columns)} columns exceed {OVERDRIVEN:g}, one"
        message = f"{message} reaches {furthest(columns, highest)}"
        message = f"{'' if sure else doubt}{message}: they are taken as they are"
        return Verdict(1.0, sure, message if sure else f"{message}; {STATE}100")
    if over > 0.3 * (highest > 0).sum():
        message = f"weights of {over} of {len(columns)} columns exceed 1, one reaches {furthest(columns, highest)}"
        return Verdict(1.0, False, f"{message}: {doubt}they are taken as they are; {STATE}100")
    return Verdict(1.0, True)


def beyond_one(
    columns: Sequence[str],
    size: Float[np.ndarray, "t c"],
    highest: Float[np.ndarray, " c"],
    peak: float,
    *,
    whole: bool,
) -> Verdict:
    """Values that go beyond weights: the scale that fits how far they get, and what speaks against it."""
    if peak > SCALES[-1]:
        raise RigError(
            f"has weights up to {peak:.3g}, beyond every usual scale: say what a full weight is at the top of a name "
            "map, such as full = 100000"
        )
    full = 100.0
    if peak > PER_CENT_MOST:
        full = next(scale for scale in SCALES if peak <= scale + 0.5)
    elif TEN[0] < peak <= TEN[1] and highest.max() <= TEN[1]:
        full = 10.0
    elif (
        FIVE[0] < peak
        and highest.max() <= FIVE[1]
        and 2 * sum(bool(UNITS.fullmatch(c)) for c in columns) > len(columns)
    ):
        full = 5.0
    exact = whole and full in (100, *SCALES) and highest.max() == full
    enough = NEARLY if whole else HALF  # whole numbers up to 85 may be bytes of a quiet take
    sure = exact or (full == 100 and enough * full <= peak <= 1.1 * full)
    message = f"{'' if sure else 'it is not certain, but '}weights reach {furthest(columns, highest)}"
    message = f"{message}: they are taken as {unit_words(full)}"
    doubts = [] if sure else [f"{STATE}{other_scale(full, peak):g}"]
    doubts += mixed_columns(columns, highest, full) + mixed_frames(size, full)
    return Verdict(full, sure and not doubts, "; ".join([message, *doubts]))


def other_scale(full: float, peak: float) -> float:
    """What else a full weight may be, for a name map that says so."""
    if full != 100:
        return 1
    return 127 if peak > full else 10 if peak < 30 else 50 if peak < 50 else 255


def mixed_columns(columns: Sequence[str], highest: Float[np.ndarray, " c"], full: float) -> list[str]:
    """A sentence where some columns end as weights of 0 to 1 do and all others far beyond."""
    low = (highest > 0.3) & (highest <= ONE)
    between = (highest > ONE) & (highest < 0.1 * full)
    if not low.any() or between.any() or full < 20:
        return []
    names = [column for column, here in zip(columns, low, strict=True) if here]
    more = f" and {len(names) - FEW} more" if len(names) > FEW else ""
    return [
        f"it is not certain that {', '.join(names[:FEW])}{more}, which stay below {ONE:g}, have the same scale: "
        f"if not, give them shares of {full:g} in a name map"
    ]


def signs(size: Float[np.ndarray, "t c"]) -> dict[str, float]:
    """How much each sign speaks for values beyond weights, against it where negative. Every column moves."""
    some: Bool[np.ndarray, "t c"] = size > 0
    high = np.sort([np.quantile(column[here], HIGH) for column, here in zip(size.T, some.T, strict=True)])[::-1]
    typical = high[min(len(high) - 1, int(np.ceil(TENTH * len(high))))]
    values, columns = np.mean(size[some] > OVERDRIVEN), np.mean((size > OVERDRIVEN).any(axis=0))
    return {
        "typical": 3.0 if typical > PLAINLY else 1.5 if typical > BARELY else -4.0,
        "values": 1.5 if values > 0.2 else -1.5 if values < 0.02 else 0.0,
        "columns": 1.5 if columns > 0.3 else -1.5 if columns < 0.1 else 0.0,
        "whole": 1.0 if typical > OVERDRIVEN and whole_numbers(size) else 0.0,
    }


def whole_numbers(size: Float[np.ndarray, "t c"]) -> bool:
    """Whether nearly all values that are not 0 are whole numbers."""
    some = size[size > 0]
    return bool(np.mean(some == np.round(some)) > HIGH)


def furthest(columns: Sequence[str], highest: Float[np.ndarray, " c"]) -> str:
    """'99 (jawOpen)', the highest value of all."""
    c = int(highest.argmax())
    return f"{highest[c]:.4g} ({columns[c]})"


def unit_words(full: float) -> str:
    """'per cent' or '0 to 255'."""
    return "per cent" if full == 100 else f"0 to {full:g}"
