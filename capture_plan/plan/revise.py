"""Change the expressions of a plan as an artist asks, and leave the rest of what was agreed as it is."""

from pathlib import Path

from msgspec.structs import replace

from capture_plan.expressions.record import Packing
from capture_plan.expressions.revise import another, repack
from capture_plan.expressions.session import session
from capture_plan.expressions.settings import Edits
from capture_plan.expressions.why import why_apart
from capture_plan.plan.collide import collide
from capture_plan.plan.places import read_rules_of, read_target
from capture_plan.plan.record import Plan, sealed, with_meetings
from capture_plan.plan.structure import check_structure
from capture_plan.rig import Rig


def edited_plan(plan: Plan, rig: Rig, edits: Edits, *, folder: Path = Path()) -> Plan:
    """The plan with the shortest list that follows `edits` and moves as few blendshapes as possible.

    Raises:
        PlanError: the plan names what is not there.
        InfeasibleError: no list follows them.
    """
    check_structure(plan, rig)
    settings = replace(plan.settings.expressions, edits=edits)
    packing = repack(
        rig,
        plan.audit.used,
        settings,
        plan.packing,
        edits,
        target=read_target(rig, plan.settings, folder),
        rules=read_rules_of(plan.settings, folder),
        apart=collide(rig, plan.audit.used, settings),
    )
    return with_packing(replace(plan, settings=replace(plan.settings, expressions=settings)), rig, packing)


def other_plan(plan: Plan, rig: Rig, *, folder: Path = Path()) -> Plan:
    """The plan with another list of as many expressions, nearly as good.

    Raises:
        PlanError: the plan names what is not there.
        InfeasibleError: there is none.
    """
    check_structure(plan, rig)
    settings = plan.settings.expressions
    packing = another(
        rig,
        plan.audit.used,
        settings,
        [plan.packing],
        target=read_target(rig, plan.settings, folder),
        rules=read_rules_of(plan.settings, folder),
        apart=collide(rig, plan.audit.used, settings),
    )
    return with_packing(plan, rig, packing)


def why_not_together(plan: Plan, rig: Rig, a: str, b: str, *, folder: Path = Path()) -> str:
    """Everything that keeps two blendshapes of a plan out of one expression."""
    settings = plan.settings.expressions
    return why_apart(
        rig,
        plan.audit.used,
        settings,
        a,
        b,
        rules=read_rules_of(plan.settings, folder),
        apart=collide(rig, plan.audit.used, settings),
    )


def with_packing(plan: Plan, rig: Rig, packing: Packing) -> Plan:
    """The plan with other expressions, and the session that they make."""
    shots = session(rig, plan.audit.used, packing, plan.settings.session, plan.settings.expressions.importance)
    return sealed(with_meetings(replace(plan, packing=packing, session=shots), rig))
