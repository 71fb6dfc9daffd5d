"""Why two blendshapes are not in one expression, in words."""

from itertools import product

from capture_plan.errors import RigError
from capture_plan.expressions.problem import Pairs, Problem, state_problem
from capture_plan.expressions.rules import Rules
from capture_plan.expressions.settings import PackingSettings
from capture_plan.input.documents import closest
from capture_plan.rig import Rig


def why_apart(
    rig: Rig,
    used: tuple[str, ...],
    settings: PackingSettings,
    a: str,
    b: str,
    *,
    rules: Rules | None = None,
    apart: Pairs = (),
) -> str:
    """Everything that keeps two blendshapes, or their partners, apart; or that nothing does."""
    for name in (a, b):
        if name not in used:
            meant = closest(name, used) or ": see what the audit lists"
            raise RigError(f"'{name}' is no blendshape in use{meant}")
    problem = state_problem(rig, used, settings, rules, apart)
    for name in (a, b):
        if name not in problem.names:
            return f"'{name}' is dropped"
    i, j = problem.item_of(a), problem.item_of(b)
    if i == j:
        return f"'{a}' and '{b}' are performed together"
    reasons = _direct(problem, a, b) or _by_company(problem, i, j)
    if too_many := _too_many(problem, i, j):
        reasons = [*reasons, too_many]
    if reasons:
        return "; ".join(reasons)
    cost = next((c for one, other, c in problem.instance.costs if {one, other} == {i, j}), 0)
    hard = f", though it is hard (cost {cost} of 3)" if cost else ""
    return f"'{a}' and '{b}' can be performed at once{hard}: others made a better list"


def _direct(problem: Problem, a: str, b: str) -> list[str]:
    reasons = []
    shared = int((problem.active[problem.names.index(a)] & problem.active[problem.names.index(b)]).sum())
    if shared:
        reasons.append(f"'{a}' and '{b}' share {shared:,} active vertices")
    said = (
        (problem.exclusive, "a rule says that no face does both at once"),
        (problem.colliding, "collide: their surfaces run through each other"),
        (problem.edits.apart, "are asked to be apart"),
    )
    for pairs, words in said:
        if (a, b) in pairs or (b, a) in pairs:
            reasons.append(f"'{a}' and '{b}': {words}" if words.startswith("a rule") else f"'{a}' and '{b}' {words}")
    numbers = problem.edits.numbers
    if a in numbers and b in numbers and numbers[a] != numbers[b]:
        reasons.append(f"'{a}' and '{b}' are locked to E{numbers[a]:02d} and E{numbers[b]:02d}")
    return reasons


def _by_company(problem: Problem, i: int, j: int) -> list[str]:
    """What keeps those apart that are performed together with the two."""
    found = (_direct(problem, a, b) for a, b in product(problem.labels(i), problem.labels(j)))
    return next(([f"{reasons[0]}, and partners are performed together"] for reasons in found if reasons), [])


def _too_many(problem: Problem, i: int, j: int) -> str | None:
    things = int(problem.instance.things[[i, j]].sum())
    if problem.most_things is None or things <= problem.most_things:
        return None
    return f"too many at once: {things} movements, {problem.most_things} are allowed"
