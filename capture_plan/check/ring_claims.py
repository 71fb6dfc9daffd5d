"""Whether the rings that pages print keep what they promise: other crews than those they were made by."""

import numpy as np

from capture_plan.evaluation.rings import PROMISED, placing_for, rings_of
from capture_plan.evaluation.robustness import GROWTH
from capture_plan.plan.claims import Claim, claim
from capture_plan.plan.record import Plan, cameras_of
from capture_plan.rig import Rig

CREWS, SEED = 1000, 4567
CHANCE = 0.02  # three standard deviations of the share among so many crews
AGAIN = "a fault of capture-plan: report it, and place the dots as exactly as you can"


def ring_claims(plan: Plan, rig: Rig) -> list[Claim]:
    """The share of seeded crews within the rings whose error grows by no more than a tenth."""
    landmarks, settings = plan.layout.landmarks, plan.settings.landmarks
    if not landmarks:
        return []
    cameras = cameras_of(plan)
    rings = rings_of(rig, plan.audit.used, settings, landmarks, cameras)
    placing = placing_for(rig, plan.audit.used, settings, np.array([one.vertex for one in landmarks]), cameras)
    kept = placing.kept(np.array([rings.mm[one.name] for one in landmarks]), crews=CREWS, seed=SEED)
    share = min(PROMISED, rings.kept)
    what = f"{share:.0%} of crews that keep to the rings on the pages stay under {GROWTH - 1:+.0%} of error"
    return [claim(what, kept >= share - CHANCE, f"{kept:.1%} of {CREWS:,} others", AGAIN)]
