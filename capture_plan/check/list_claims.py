"""Whether a list of expressions is one that its method makes, asked again without a solver.

early    no move of two expressions leaves less error: the search would have made it
greedy   the list is made again, and is the same
Nothing is asked of a list that was edited or that a person asked for (`as_made`): `unchecked` says so.
"""

from capture_plan.check.again import Stated
from capture_plan.expressions.early import can_be_lowered
from capture_plan.expressions.greedy import one_after_another
from capture_plan.expressions.listing import item_importance
from capture_plan.plan.claims import Claim, claim
from capture_plan.plan.record import Plan


def list_claims(plan: Plan, given: Stated) -> list[Claim]:
    """What the method promises of who is in which expression."""
    settings, problem, shots = plan.settings.expressions, given.problem, f"{len(given.chosen)} expressions"
    if not plan.packing.as_made:
        return []
    if settings.method == "early":
        less = can_be_lowered(given.model, problem.items_of(given.chosen))
        found = "one does: another list, or another method's" if less else shots
        return [claim("no exchange between two expressions leaves less error", not less, found)]
    if settings.method == "greedy":
        weigh = item_importance(given.rig, problem, settings, given.target)
        order = one_after_another(problem.instance, weigh, lambda chosen, proposed: True)
        same = [frozenset(items.tolist()) for items in order.expressions] == problem.items_of(given.chosen)
        return [claim("the list is the one that 'greedy' makes", same, shots if same else "it makes another one")]
    return []
