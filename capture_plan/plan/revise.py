"""Change the expressions of a plan as an artist asks, and leave the rest of what was agreed as it is."""

from msgspec.structs import replace

from capture_plan.expressions.explain import why_apart
from capture_plan.expressions.record import Packing
from capture_plan.expressions.revise import another, repack
from capture_plan.expressions.session import session
from capture_plan.expressions.settings import Edits
from capture_plan.plan.collide import collide
from capture_plan.plan.inputs import PlanInputs, inputs_for
from capture_plan.plan.record import Plan, sealed, with_poses
from capture_plan.plan.structure import check_structure
from capture_plan.rig import Rig


def edited_plan(plan: Plan, inputs: Rig | PlanInputs, edits: Edits) -> Plan:
    """The plan with the shortest list that follows `edits` and moves as few blendshapes as possible.

    Raises:
        PlanError: the plan names what is not there.
        InfeasibleError: no list follows them.

    Example:
        >>> plan = read_plan("hero.plan.json")
        >>> edited = edited_plan(plan, sample_rig(), Edits(apart=(("jawOpen", "browInnerUp"),)))
        >>> any({"jawOpen", "browInnerUp"} <= {*one.blendshapes} for one in edited.packing.expressions)
        False
    """
    given = inputs_for(inputs, plan.settings, takes=False, carried=plan.cameras)
    rig = given.rig
    check_structure(plan, rig)
    settings = replace(plan.settings.expressions, edits=edits)
    packing = repack(
        rig,
        plan.audit.used,
        settings,
        plan.packing,
        edits,
        target=given.target,
        rules=given.rules,
        apart=collide(rig, plan.audit.used, settings),
    )
    return with_packing(replace(plan, settings=replace(plan.settings, expressions=settings)), rig, packing)


def other_plan(plan: Plan, inputs: Rig | PlanInputs) -> Plan:
    """The plan with another list of as many expressions, nearly as good.

    Raises:
        PlanError: the plan names what is not there.
        InfeasibleError: there is none.
    """
    given = inputs_for(inputs, plan.settings, takes=False, carried=plan.cameras)
    rig = given.rig
    check_structure(plan, rig)
    settings = plan.settings.expressions
    packing = another(
        rig,
        plan.audit.used,
        settings,
        [plan.packing],
        target=given.target,
        rules=given.rules,
        apart=collide(rig, plan.audit.used, settings),
    )
    return with_packing(plan, rig, packing)


def why_not_together(plan: Plan, inputs: Rig | PlanInputs, a: str, b: str) -> str:
    """Everything that keeps two blendshapes of a plan out of one expression."""
    given, settings = inputs_for(inputs, plan.settings, takes=False, carried=plan.cameras), plan.settings.expressions
    return why_apart(
        given.rig,
        plan.audit.used,
        settings,
        a,
        b,
        rules=given.rules,
        apart=collide(given.rig, plan.audit.used, settings),
    )


def renumbered_words(former: Packing, changed: Packing) -> tuple[str, ...]:
    """Which expressions have another number than before, in one line; nothing where none has. It is the same expression
    as long as each of the two has more than half of its blendshapes in the other."""
    runs: list[list[tuple[int, int]]] = []
    for a, was in enumerate(former.expressions, 1):
        for b, now in enumerate(changed.expressions, 1):
            shared = 2 * len({*was.blendshapes} & {*now.blendshapes})
            if a != b and shared > len(was.blendshapes) and shared > len(now.blendshapes):
                if not runs or (a - 1, b - 1) != runs[-1][-1]:
                    runs.append([])
                runs[-1].append((a, b))
    moved = [
        f"{span(run[0][0], run[-1][0])} {'are' if len(run) > 1 else 'is'} {span(run[0][1], run[-1][1])}" for run in runs
    ]
    return (f"{', '.join(moved)} now: print the pages again.",) if moved else ()


def span(first: int, last: int) -> str:
    """Expressions from one to another in words: 'E09 to E18'."""
    return f"E{first:02d} to E{last:02d}" if last > first else f"E{first:02d}"


def with_packing(plan: Plan, rig: Rig, packing: Packing) -> Plan:
    """The plan with other expressions, and the session that they make."""
    shots = session(rig, plan.audit.used, packing, plan.settings.session, plan.settings.expressions.importance)
    return sealed(with_poses(replace(plan, packing=packing, session=shots), rig))
