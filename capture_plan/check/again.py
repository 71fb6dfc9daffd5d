"""A plan made again from its decisions alone: which vertices, which blendshapes in which expression, what was proved.

No solver is asked. Everything else that a plan says follows from the rig, the settings and these decisions, by the code
that wrote it, so that whatever a plan says otherwise is not true of this rig.
"""

from dataclasses import dataclass
from functools import cached_property

from msgspec.structs import replace

from capture_plan.audit.audit import Audit
from capture_plan.expressions.early import Model, in_best_order, model_of
from capture_plan.expressions.listing import (
    Proofs,
    TargetDeltas,
    blendshape_importance,
    item_importance,
    packing_record,
)
from capture_plan.expressions.ordered import PROVING, order_refuted
from capture_plan.expressions.problem import Problem, state_problem
from capture_plan.expressions.record import Packing
from capture_plan.expressions.session import session
from capture_plan.expressions.settings import PackingSettings
from capture_plan.layout.record import Layout
from capture_plan.plan.collide import collide
from capture_plan.plan.inputs import PlanInputs
from capture_plan.plan.record import Plan, with_poses, with_takes
from capture_plan.rig import Rig
from capture_plan.shell.takes import Takes

Pairs = tuple[tuple[str, str], ...]


@dataclass(frozen=True, eq=False)
class Stated:
    """The list of a plan as its problem has it: `chosen` are the blendshapes of every expression by their number there;
    what the plan performs in none of them stands at its end."""

    rig: Rig
    settings: PackingSettings
    problem: Problem
    target: TargetDeltas
    chosen: list[tuple[int, ...]]

    @cached_property
    def model(self) -> Model:
        """What error any list of the problem leaves."""
        return model_of(self.rig, self.problem, self.settings, self.target)


def stated_list(plan: Plan, inputs: PlanInputs, apart: Pairs | None = None) -> Stated:
    """The problem of a plan's list. `apart` are blendshapes whose surfaces run through each other, found on the rig
    where they are not given."""
    rig, settings, said = inputs.rig, plan.settings.expressions, plan.packing
    apart = collide(rig, plan.audit.used, settings) if apart is None else apart
    problem = state_problem(rig, plan.audit.used, settings, inputs.rules, apart)
    place = {name: k for k, name in enumerate(problem.names)}
    lists = [set(names) for names in (*(one.blendshapes for one in said.expressions), *said.unscanned)]
    lists.append(set(place).difference(*lists))
    chosen = [own for names in lists if (own := tuple(sorted(place[name] for name in names & set(place))))]
    return Stated(rig, settings, problem, inputs.target, chosen)


def made_again(plan: Plan, report: Audit, layout: Layout, given: Stated, takes: Takes | None = None) -> Plan:
    """The plan of these decisions: `report` is the rig's audit, `layout` follows from what was decided of landmarks,
    `given` is the list. Without `takes` what is said of them is taken over."""
    rig, packing = given.rig, packing_again(plan, given)
    again = replace(
        plan,
        rig=replace(plan.rig, name=rig.name, fingerprint=rig.fingerprint, vertices=len(rig.neutral)),
        audit=report,
        layout=layout,
        packing=packing,
        session=session(rig, plan.audit.used, packing, plan.settings.session, plan.settings.expressions.importance),
    )
    return with_takes(with_poses(again, rig), takes)


def packing_again(plan: Plan, given: Stated) -> Packing:
    """The list of the same expressions."""
    rig, settings, said, problem = given.rig, given.settings, plan.packing, given.problem
    importance = blendshape_importance(rig, problem.names, settings, given.target)
    clique = tuple(name for name in problem.names if name in said.clique)
    proofs = Proofs(said.solver_bound, order_proven=order_stands(given, said), clique=clique)
    return packing_record(rig, problem, settings, given.chosen, importance, proofs, unmoved=said.unmoved)


def order_stands(given: Stated, said: Packing) -> bool:
    """Whether the order of a list is the one that its method promises; where only a solver can say, the plan's word
    that no exchange refutes. Nobody proves an order again when a list is edited, or another is asked for."""
    settings, problem, parts = given.settings, given.problem, given.problem.items_of(given.chosen)
    if settings.method == "early":
        return in_best_order(given.model, parts)
    if not said.order_proven or not said.as_made or settings.method not in PROVING:
        return False
    weigh = item_importance(given.rig, problem, settings, given.target)
    return not order_refuted(problem.instance, weigh, settings.method, parts)
