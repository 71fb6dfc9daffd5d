"""Pairs of dots that a tracker may take for each other, told apart by colour or shape: the fewest that get another.

Model   one kind q for each dot, no pair of the same kind, as many dots as can be of kind 0: an integer program (CP-SAT)
"""

from collections.abc import Mapping, Sequence

from ortools.sat.python import cp_model

from capture_plan.layout.labels import FPS, SECONDS, Labels, moment_words
from capture_plan.solver import solve

MOST_TOLD, WORK = 5, 5.0  # pairs; of the solver


def told_apart(names: Sequence[str], pairs: Sequence[tuple[str, str]], *, kinds: int = 2) -> dict[str, int] | None:
    """The fewest dots that get another colour or shape, 1 to `kinds` - 1, so that no pair has the same; None where so
    many kinds do not do. The others keep kind 0."""
    model = cp_model.CpModel()
    x = {name: [model.new_bool_var("") for _ in range(kinds)] for name in names}
    for kind in x.values():
        model.add_exactly_one(kind)
    for a, b in pairs:
        for q in range(kinds):
            model.add_at_most_one([x[a][q], x[b][q]])
    model.maximize(sum(kind[0] for kind in x.values()))
    solver, status = solve(model, work_limit=WORK)
    if status not in (cp_model.OPTIMAL, cp_model.FEASIBLE):
        return None
    picked = {name: next(q for q in range(kinds) if solver.value(kind[q])) for name, kind in x.items()}
    return {name: q for name, q in picked.items() if q}


def label_words(
    found: Sequence[Labels], names: Sequence[str], shots: Mapping[str, str], asked_mm: float | None = None
) -> list[str]:
    """What can be confused, by a margin that is asked for where one is, and what would tell it apart, a sentence
    each. `shots` has the words for an expression by its name."""
    if not found:
        return []
    takes = ", and in the takes as they are" if any(labels.take for labels in found) else ""
    how = f"Followed to the nearest dot at {FPS:g} pictures a second, expressions taken up in {SECONDS:g} s{takes},"
    bad = [(one, labels) for labels in found for one in labels.confusable]
    if not bad:
        least = min(found, key=lambda labels: labels.margin_mm)
        asked = f"; {asked_mm:g} mm were asked for" if asked_mm else ""
        return [
            f"{how} no two dots are taken for each other: each may be {least.margin_mm:.1f} mm off (least between "
            f"{' and '.join(least.dots)}, {moment_words(least.between, least, shots)}{asked})."
        ]
    told = ", ".join(
        f"{' and '.join(one.dots)} ({moment_words(one.between, labels, shots)})" for one, labels in bad[:MOST_TOLD]
    )
    more = f" and {len(bad) - MOST_TOLD} more" if len(bad) > MOST_TOLD else ""
    off = f" where each is found {asked_mm:g} mm off" if asked_mm else ""
    lines = [f"{how} these may be taken for each other{off}: {told}{more}."]
    pairs = list(dict.fromkeys(one.dots for one, _ in bad))
    for kinds in (2, 3):
        if (apart := told_apart(names, pairs, kinds=kinds)) is not None:
            colours = "a second colour" if kinds == 2 else "a second and a third colour"
            return [*lines, f"{colours.capitalize()} on {', '.join(sorted(apart))} tells them apart."]
    return [*lines, "Three colours do not tell them apart: space dots wider or record more pictures a second."]
