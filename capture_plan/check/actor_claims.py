"""What a plan says of the actor's head that it was carried onto: both files unchanged, dots on both surfaces."""

import numpy as np

from capture_plan.mesh.nearest import nearest_on_surface
from capture_plan.plan.carry import ON_SURFACE_MM, laid_fingerprint, places_on
from capture_plan.plan.claims import Claim, claim
from capture_plan.plan.inputs import PlanInputs
from capture_plan.plan.record import ActorHead, Plan

ON_HEAD_MM = 0.01  # coordinates in a plan have four decimals, in a file of metres seven
AGAIN = "carry the plan onto the head again with `capture-plan carry`"


def actor_claims(plan: Plan, inputs: PlanInputs) -> list[Claim]:
    """The claims of the record `actor`; of the scan only where it was read."""
    if (actor := plan.actor) is None:
        return []
    if inputs.worn is None:
        return [claim("the head that was laid is there", False, "it was not given", AGAIN)]
    return [*laid_claims(plan, actor, inputs), *(head_claims(actor, inputs) if inputs.head else [])]


def laid_claims(plan: Plan, actor: ActorHead, inputs: PlanInputs) -> list[Claim]:
    """What was laid is unchanged, and every dot lies on it as far as the record says."""
    assert inputs.worn is not None
    same = laid_fingerprint(inputs.worn) == actor.laid_fingerprint
    names = tuple(marker.name for marker in plan.layout.markers)
    dots = tuple(dot.name for dot in actor.dots)
    claims = [
        claim("the neutral laid on the actor's head is unchanged", same, actor.laid, AGAIN),
        claim("every marker has its dot on the actor's head", dots == names, f"{len(dots)} of {len(names)}", AGAIN),
    ]
    if dots != names:
        return claims
    at = np.array([dot.position for dot in actor.dots])
    gap = np.array([dot.gap_mm for dot in actor.dots])
    off = np.linalg.norm(places_on(plan.layout.markers, inputs.rig.triangles, inputs.worn) - at, axis=1)
    away = np.abs(off - np.where(gap <= ON_SURFACE_MM, gap, 0)).max(initial=0)
    R = np.reshape(actor.rotation, (3, 3))
    there = (at @ R.T + np.array(actor.translation)) / actor.unit_mm
    turned = np.abs(there - np.array([dot.in_file for dot in actor.dots])).max(initial=0) * actor.unit_mm
    return [
        *claims,
        claim(
            "dots lie where the rig's skin came to lie",
            away < ON_HEAD_MM,
            f"at most {off.max(initial=0):.2f} mm off",
            AGAIN,
        ),
        claim(
            "dots have the same places in the head's own file", turned < ON_HEAD_MM, f"within {turned:.4f} mm", AGAIN
        ),
    ]


def head_claims(actor: ActorHead, inputs: PlanInputs) -> list[Claim]:
    """The scan is unchanged, and the dots lie on it."""
    assert inputs.head is not None
    same = inputs.head.fingerprint == actor.fingerprint
    on = np.array([dot.in_file for dot in actor.dots if dot.gap_mm <= ON_SURFACE_MM]).reshape(-1, 3)
    feet = nearest_on_surface(on, inputs.head.vertices, inputs.head.triangles)
    away = float(np.linalg.norm(feet - on, axis=1).max(initial=0)) * actor.unit_mm
    found = f"{len(on)} of {len(actor.dots)} dots on it, at most {away:.4f} mm off"
    return [
        claim("the scan of the actor's head is unchanged", same, actor.path, AGAIN),
        claim("dots lie on the surface of the actor's head", away < ON_HEAD_MM, found, AGAIN),
    ]
