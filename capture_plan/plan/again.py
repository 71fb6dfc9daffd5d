"""A plan made again from its decisions alone: which vertices, which blendshapes in which expression, what was proved.

No solver is asked. Everything else that a plan says follows from the rig, the settings and these decisions, by the code
that wrote it, so that whatever a plan says otherwise is not true of this rig.
"""

from dataclasses import dataclass
from pathlib import Path

from msgspec.structs import replace

from capture_plan.expressions.early import proves_order
from capture_plan.expressions.listing import (
    Proofs,
    Target,
    blendshape_importance,
    item_importance,
    packing_record,
)
from capture_plan.expressions.ordered import PROVING, order_refuted
from capture_plan.expressions.problem import Problem, state_problem
from capture_plan.expressions.record import Packing
from capture_plan.expressions.session import session
from capture_plan.expressions.settings import PackingSettings
from capture_plan.layout.follow import decided_in, follow
from capture_plan.layout.shell.takes import Takes
from capture_plan.layout.task import Task
from capture_plan.plan.collide import collide
from capture_plan.plan.places import read_rules_of, read_target
from capture_plan.plan.record import Plan, with_meetings
from capture_plan.rig import Rig
from capture_plan.rig.audit import Audit

Pairs = tuple[tuple[str, str], ...]


@dataclass(frozen=True, eq=False)
class Stated:
    """The list of a plan as its problem has it: `chosen` are the blendshapes of every expression by their number there;
    what the plan performs in none of them stands at its end."""

    problem: Problem
    target: Target
    chosen: list[tuple[int, ...]]


def stated_list(plan: Plan, rig: Rig, folder: Path = Path(), apart: Pairs | None = None) -> Stated:
    """The problem of a plan's list. `apart` are blendshapes whose surfaces run through each other, found on the rig
    where they are not given."""
    settings, said = plan.settings.expressions, plan.packing
    apart = collide(rig, plan.audit.used, settings) if apart is None else apart
    problem = state_problem(rig, plan.audit.used, settings, read_rules_of(plan.settings, folder), apart)
    place = {name: k for k, name in enumerate(problem.names)}
    lists = [set(names) for names in (*(one.blendshapes for one in said.expressions), *said.unscanned)]
    lists.append(set(place).difference(*lists))
    chosen = [own for names in lists if (own := tuple(sorted(place[name] for name in names & set(place))))]
    return Stated(problem, read_target(rig, plan.settings, folder), chosen)


def made_again(plan: Plan, report: Audit, task: Task, takes: Takes | None, given: Stated) -> Plan:
    """The plan of these decisions. `report` is the rig's audit; `task` that of the settings, without what head markers
    shut out; `takes` are those that the settings name; `given` is the list."""
    rig = task.face.rig
    packing = packing_again(plan, rig, given)
    again = replace(
        plan,
        rig=replace(plan.rig, name=rig.name, fingerprint=rig.fingerprint, vertices=len(rig.neutral)),
        audit=report,
        layout=follow(task, decided_in(plan.layout, task), takes),
        packing=packing,
        session=session(rig, plan.audit.used, packing, plan.settings.session, plan.settings.expressions.importance),
    )
    return with_meetings(again, rig)


def packing_again(plan: Plan, rig: Rig, given: Stated) -> Packing:
    """The list of the same expressions."""
    settings, said, problem = plan.settings.expressions, plan.packing, given.problem
    worth = blendshape_importance(rig, problem.names, settings, given.target)
    ordered = order_stands(rig, problem, settings, given.target, given.chosen, said)
    clique = tuple(name for name in problem.names if name in said.clique)
    proofs = Proofs(said.solver_bound, order_proven=ordered, clique=clique)
    return packing_record(rig, problem, settings, given.chosen, worth, proofs, kept=said.kept)


def order_stands(
    rig: Rig,
    problem: Problem,
    settings: PackingSettings,
    target: Target,
    chosen: list[tuple[int, ...]],
    said: Packing,
) -> bool:
    """Whether the order of a list is the one that its method promises; where only a solver can say, the plan's word
    that no exchange refutes. Nobody proves an order again when a list is edited, or another is asked for."""
    if settings.method == "early":
        return proves_order(rig, problem, settings, target, chosen)
    if not said.order_proven or not said.as_made or settings.method not in PROVING:
        return False
    weigh = item_importance(rig, problem, settings, target)
    return not order_refuted(problem.instance, weigh, settings.method, problem.items_of(chosen))
