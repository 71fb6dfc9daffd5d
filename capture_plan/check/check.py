"""Check a plan: recompute every claim from the rig, by code that knows no solver; ask whether the rig was read right.

All that follows from the decisions of a plan is made again and compared, word for word (`again.py`). What was decided
is asked to keep every constraint and to prove what it claims: each claim is one function that says what was found; it
holds or it does not. A proof that only the solver has is checked as far as its certificate goes: the dual prices of the
set cover, the clique of blendshapes no two of which fit together.
"""

from collections.abc import Iterator

import numpy as np
from msgspec.structs import replace

from capture_plan.audit.audit import audit_rig
from capture_plan.audit.audit_cache import audit_once
from capture_plan.check.actor_claims import actor_claims
from capture_plan.check.again import made_again, stated_list
from capture_plan.check.again_claims import again_claims, audit_claim, draft_claim, seal_claim
from capture_plan.check.apart_claims import apart_claims
from capture_plan.check.camera_claims import camera_claims
from capture_plan.check.landmark_claims import bound_claims, information_claims, landmark_claims
from capture_plan.check.list_claims import list_claims
from capture_plan.check.motion_claims import motion_claims
from capture_plan.check.reading_claims import reading_claims
from capture_plan.check.refuted_claims import refuted_claims
from capture_plan.check.ring_claims import ring_claims
from capture_plan.check.sentence_claims import sentence_claims
from capture_plan.expressions.certificate import falling, misplaced, packing_claims
from capture_plan.layout.assembly import decided_in, follow
from capture_plan.layout.face import see_face
from capture_plan.layout.problem import task_of
from capture_plan.plan.claims import Claim, claim
from capture_plan.plan.inputs import PlanInputs, inputs_for
from capture_plan.plan.record import Plan
from capture_plan.plan.structure import check_structure
from capture_plan.rig import Rig


def check_plan(plan: Plan, inputs: Rig | PlanInputs) -> tuple[Claim, ...]:
    """Every claim of the plan, recomputed on the rig it was made for and on what else it was made from.

    A plan for other blendshapes than the rig has to plan for is compared no further.

    Raises:
        PlanError: it names what is not there, or a file that is not among the inputs.
        InfeasibleError: its settings cannot be followed on this rig.

    Example:
        >>> all(claim.holds for claim in check_plan(read_plan("hero.plan.json"), sample_rig()))
        True
    """
    return tuple(claims_of(plan, inputs))


def claims_of(plan: Plan, inputs: Rig | PlanInputs, *, quick: bool = False) -> Iterator[Claim]:
    """The claims of `check_plan`, one after the other as they are found.

    With `quick` the plan's word is taken for what costs most of the time: recorded takes, crews that place dots, and
    which surfaces run through each other; the audit may be one that was found before.
    """
    given = inputs_for(inputs, plan.settings, takes=not quick, carried=plan.cameras)
    rig = given.rig
    report = (audit_once if quick else audit_rig)(rig)
    yield seal_claim(plan)
    yield draft_claim(plan)
    yield audit_claim(plan, report)
    if plan.audit.used != report.used:
        return
    check_structure(plan, rig)
    face = see_face(rig, report.used, given.cameras, given.zones)
    task = task_of(face, plan.settings.landmarks)
    if plan.layout.head:
        task = task.with_head_markers(np.array([m.vertex for m in plan.layout.head]))
    takes = None if quick else given.takes
    listed = stated_list(plan, given, plan.packing.colliding if quick else None)
    decided = decided_in(plan.layout, task)
    again = made_again(plan, report, follow(task, decided, takes), listed, takes)
    if quick:
        again = replace(again, layout=replace(again.layout, motion=plan.layout.motion))
    yield from again_claims(plan, again)
    yield from landmark_claims(plan, task)
    yield from camera_claims(plan, face)
    yield from bound_claims(plan, task)
    yield from information_claims(plan, task)
    yield from refuted_claims(plan, task, decided)
    yield from () if quick else ring_claims(plan, rig)
    yield from () if quick else motion_claims(plan, task, takes)
    yield from expression_claims(plan, given)
    yield from list_claims(plan, listed)
    yield from reading_claims(plan, rig)
    yield from sentence_claims(plan, rig)
    yield from apart_claims(plan, rig)
    yield from actor_claims(plan, given)


def expression_claims(plan: Plan, inputs: PlanInputs) -> list[Claim]:
    """Every blendshape once, no overlap, partners together, rules kept, the clique."""
    packing, mu = plan.packing, plan.settings.expressions.mu
    found = f"{len(packing.expressions)} expressions of {packing.objective}, at least {packing.bound} proved"
    faults = packing_claims(inputs.rig, plan.audit.used, packing, mu, inputs.rules)
    if plan.settings.expressions.method == "early":
        wrong = misplaced(packing)
        asked = wrong or packing.order_proven
        faults |= {"no other order of the expressions covers more after each": wrong} if asked else {}
    elif plan.settings.expressions.uniqueness == 0:
        faults |= {"an order that is called proved goes down in importance": falling(packing)}
    return [claim(what, not lines, "; ".join(lines) or found) for what, lines in faults.items()]
