"""Check a plan: recompute every claim from the rig, by code that knows no solver; ask whether the rig was read right.

Each claim is one function that says what was found; it holds or it does not. A proof that only the solver has (that no
cover has fewer landmarks than `minimum`, that no shorter list of expressions exists) is checked as far as its
certificate goes: the dual prices of the set cover, the clique of blendshapes no two of which fit together.
"""

from pathlib import Path

import numpy as np
from msgspec.structs import replace

from capture_plan.expressions.certificate import packing_claims
from capture_plan.expressions.session import session
from capture_plan.layout.face import see_face
from capture_plan.plan.apart_claims import apart_claims
from capture_plan.plan.camera_claims import camera_claims
from capture_plan.plan.claims import Claim, claim
from capture_plan.plan.collide import collide
from capture_plan.plan.landmark_claims import bound_claims, landmark_claims, worth_claims
from capture_plan.plan.motion_claims import motion_claims
from capture_plan.plan.places import read_cameras_of, read_rules_of, with_zones_found
from capture_plan.plan.reading_claims import reading_claims
from capture_plan.plan.record import Plan
from capture_plan.plan.sentence_claims import sentence_claims
from capture_plan.rig import Rig


def check_plan(plan: Plan, rig: Rig, *, folder: Path = Path()) -> tuple[Claim, ...]:
    """Every claim of the plan, recomputed on the rig it was made for; `folder` is where the plan file lies."""
    plan = replace(plan, settings=with_zones_found(plan.settings, folder))
    face = see_face(rig, plan.audit.used, read_cameras_of(rig, plan.settings, folder))
    return (
        *landmark_claims(plan, rig, face),
        *camera_claims(plan, face),
        *bound_claims(plan, face),
        *worth_claims(plan, face),
        *motion_claims(plan, face, folder),
        *expression_claims(plan, rig, folder),
        *reading_claims(plan, rig),
        *sentence_claims(plan, rig),
        *apart_claims(plan, rig),
    )


def expression_claims(plan: Plan, rig: Rig, folder: Path) -> list[Claim]:
    """Every blendshape once, no overlap, partners together, rules kept, the clique, and shares that add up."""
    packing, mu = plan.packing, plan.settings.expressions.mu
    found = f"{len(packing.expressions)} expressions of {packing.objective}, the solver's own bound is {packing.bound}"
    faults = packing_claims(rig, plan.audit.used, packing, mu, read_rules_of(plan.settings, folder))
    running = np.cumsum([e.gain for e in packing.expressions])
    adds_up = np.allclose(running, [e.covered for e in packing.expressions], atol=1e-3)
    return [
        *(claim(what, not lines, "; ".join(lines) or found) for what, lines in faults.items()),
        claim(
            "surfaces that collide are those of the rig",
            packing.colliding == collide(rig, plan.audit.used, plan.settings.expressions),
            f"{len(packing.colliding)} pairs of blendshapes",
        ),
        claim("covered importance adds up", adds_up, f"{running[-1]:.1%} after the last expression"),
        claim(
            "the session is that of these expressions",
            plan.session == session(rig, plan.audit.used, packing, plan.settings.session),
            f"{len(plan.session.items)} items, {plan.session.minutes:.0f} minutes",
        ),
    ]
