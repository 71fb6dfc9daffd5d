"""What a plan sets apart, recomputed: for the reasons it gives, in no expression, and nothing lost on the way."""

from capture_plan.anatomy.kinds import expression_kinds, set_apart
from capture_plan.plan.claims import Claim, claim
from capture_plan.plan.record import Plan
from capture_plan.rig import Rig


def apart_claims(plan: Plan, rig: Rig) -> list[Claim]:
    """Every blendshape is planned for, or left out by a finding; what is set apart is so by what it moves."""
    audit, found = plan.audit, set_apart(expression_kinds(rig))
    performed = {name for expression in plan.packing.expressions for name in expression.blendshapes}
    out = {name for finding in audit.findings if finding.left_out for name in finding.blendshapes}
    silent = [name for name in rig.names if name not in {*audit.used, *out}]
    wrong = sorted({(one.name, one.kind) for one in audit.apart} ^ {(one.name, one.kind) for one in found})
    scanned = sorted(performed & {one.name for one in audit.apart})
    return [
        claim(
            "no blendshape is left out in silence", not silent, ", ".join(silent) or f"{len(out)} left out, each said"
        ),
        claim(
            "what is set apart is no expression of the face",
            not wrong and not scanned,
            "; ".join([*(f"{name}: {kind}" for name, kind in wrong), *(f"{name} is scanned" for name in scanned)])
            or f"{len(found)} set apart",
        ),
    ]
