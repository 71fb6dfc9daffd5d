"""What packing is worth, in a notebook: its knobs, its tables, and the sentences that say who is best where."""

from collections.abc import Sequence
from typing import Any

import marimo as mo

from capture_plan.evaluation.carrigan2020.mu_sweep import AblationRow
from capture_plan.evaluation.carrigan2020.packing_error import ALONE, RANDOM, Curve, ErrorCurves, error_after
from capture_plan.expressions import PackingSettings
from capture_plan.notebooks_support.figures import show_table
from capture_plan.notebooks_support.knobs import knob_group, slider
from capture_plan.prose import count, in_series
from capture_plan.report.words import percent

OURS = "early"
AFTER = (5, 10, 15, 20)
ALIKE = 0.01  # errors that differ by less than this share are called alike


def packing_error_knobs() -> Any:
    """Mu, rules and pairs; `value` holds fields of `PackingSettings`."""
    start = PackingSettings()
    return knob_group(
        mu=(
            slider(0.1, 0.6, 0.05, start.mu, "Mu"),
            "Two blendshapes clash where both move the skin by this share of their largest movement.",
        ),
        poseable=(
            mo.ui.switch(value=start.poseable, label="Rules"),
            "What no face can do at once, and what would run through itself, is kept apart.",
        ),
        paired=(
            mo.ui.switch(value=start.paired, label="Left and right together"),
            "Partners are performed in one expression.",
        ),
    )


def people_knob() -> Any:
    """How many other persons the lists are tried on; few, so that the notebook opens at once."""
    return slider(1, 4, 1, 1, "Other persons")


def ablation_table(rows: Sequence[AblationRow]) -> mo.Html:
    """Displacement strength and blendshapes shown after the first expressions, one row for each form of importance."""
    counts = {n: f"After {n}" for n in AFTER if n <= min(len(row.shown) for row in rows)}
    return show_table(
        [
            {"Importance": row.terms.capitalize()}
            | {words: f"{percent(row.strength[n - 1])}, {row.shown[n - 1]} shown" for n, words in counts.items()}
            | {"Expressions": len(row.shown)}
            for row in rows
        ],
        numbers=(*counts.values(), "Expressions"),
    )


def value_table(errors: ErrorCurves) -> mo.Html:
    """One row for each target and list: the error after the first scans and after all, mm."""
    rows = [(target, name, curve) for target, curves in errors.items() for name, curve in curves.items()]
    return show_table(
        [
            {"Face": target.capitalize(), "List": name, "No scan": f"{curve[1][0]:.3f} mm"}
            | {f"After {n}": _millimetres(curve, n) for n in AFTER}
            | {"After all": f"{curve[1][-1]:.3f} mm", "Scans": curve[0][-1]}
            for target, name, curve in rows
        ],
        numbers=("No scan", *(f"After {n}" for n in AFTER), "After all", "Scans"),
    )


def saving_words(errors: ErrorCurves) -> mo.Html:
    """Who is best where, after 5, 10, 15, 20 scans and after all, as the numbers say."""
    return mo.md("\n".join(f"- {sentence}" for sentence in value_sentences(errors)))


def value_sentences(errors: ErrorCurves) -> list[str]:
    """Which list is best where, one sentence each; lists within a hundredth of the best are named beside it."""
    curves = list(errors.values())
    scans = curves[0][OURS][0][-1]
    reached = [n for n in AFTER if n < scans]
    said = [f"After {n} scans the best list is {_by_winner(_best(errors, n))}." for n in reached]
    said += [f"Of whole packed lists the best is {_by_winner(_best(errors, None))}."]
    said += [_against(curves, rival, reached) for rival in (RANDOM, ALONE)]
    before, whole, alone = (
        _range([of[name][1][at] for of in curves]) for name, at in ((OURS, 0), (OURS, -1), (ALONE, -1))
    )
    said += [
        f"Deformation transfer without a scan is off by {before} over these faces; all {count(scans, 'expression')} "
        f"of the early list leave {whole}, {count(curves[0][ALONE][0][-1], 'scan')} one at a time {alone}.",
        _price([of[OURS] for of in curves], [of[ALONE] for of in curves]),
    ]
    return said


def _against(curves: Sequence[dict[str, Curve]], rival: str, reached: Sequence[int]) -> str:
    """How much less or more the early list leaves than another list, over all faces."""
    parts = []
    for n in reached:
        less = [1 - _at(of[OURS], n) / _at(of[rival], n) for of in curves]
        parts.append(f"{_less(less)} after {n} scans")
    if rival == RANDOM:
        less = [1 - of[OURS][1][-1] / of[rival][1][-1] for of in curves]
        parts.append(f"{_less(less)} after all")
    return f"Against {rival}, the early list leaves {'; '.join(parts)}."


def _less(shares: Sequence[float]) -> str:
    """'5 to 16 % less', '3 to 8 % more', 'between 5 % more and 18 % less'."""
    low, high = round(100 * min(shares)), round(100 * max(shares))
    if low < 0 < high:
        return f"between {-low} % more and {high} % less"
    near, far = sorted((abs(low), abs(high)))
    return f"{near} to {far} % {'less' if low >= 0 else 'more'}"


def _at(curve: Curve, n: int) -> float:
    """The error after so many scans, or after all where the list is shorter, mm."""
    error = error_after(curve, n)
    return curve[1][-1] if error is None else error


def _price(packed: Sequence[Curve], alone: Sequence[Curve]) -> str:
    """How many scans one at a time it takes to be as good as the whole early list."""
    needed = [
        next((n for n, error in zip(*single, strict=True) if error <= curve[1][-1]), None)
        for curve, single in zip(packed, alone, strict=True)
    ]
    if None in needed:
        return "On some of these faces no number of scans one at a time is as good as the whole packed list."
    low, high = min(n for n in needed if n is not None), max(n for n in needed if n is not None)
    scans = f"{low}" if low == high else f"{low} to {high}"
    return f"One at a time, it takes about {scans} scans to be as good as the {packed[0][0][-1]} packed ones."


def _best(errors: ErrorCurves, n: int | None) -> dict[str, tuple[str, ...]]:
    """By target the lists that leave least after n scans; after all of a packed list where n is None."""
    best = {}
    for target, of in errors.items():
        message = {name: curve[1][-1] if n is None else _at(curve, n) for name, curve in of.items()}
        message = {name: error for name, error in message.items() if n is not None or name != ALONE}
        best[target] = tuple(name for name, error in message.items() if error <= (1 + ALIKE) * min(message.values()))
    return best


def _by_winner(best: dict[str, tuple[str, ...]]) -> str:
    """'minimum (wide, narrow); greedy or random, alike (person 1)'."""
    parts = []
    for names in dict.fromkeys(best.values()):
        faces = [target for target, who in best.items() if who == names]
        who = in_series(names, "or") + ", alike" * (len(names) > 1)
        parts.append(f"{who} ({', '.join(faces) if len(faces) < len(best) else 'every face'})")
    return "; ".join(parts)


def _range(values: Sequence[float]) -> str:
    low, high = min(values), max(values)
    return f"{low:.3f} mm" if f"{low:.3f}" == f"{high:.3f}" else f"{low:.3f} to {high:.3f} mm"


def _millimetres(curve: Curve, n: int) -> str:
    error = error_after(curve, n)
    return "" if error is None else f"{error:.3f} mm"
