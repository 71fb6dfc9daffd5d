"""Whether a plan says what follows from its decisions: every word and number of it against the plan made again."""

from capture_plan.audit.audit import Audit
from capture_plan.check.differences import differences
from capture_plan.plan.claims import Claim, claim
from capture_plan.plan.record import Plan, seal_of

SEALED, NO_DRAFT = "the plan is as it was written", "the plan is no draft"
SHOWN = 3  # differences in a line; the first of many mostly explains the rest
PARTS = {
    "rig": "the plan names the rig it was made for",
    "layout": "markers, their names, places and figures are those of the rig",
    "packing": "expressions, their sentences and figures are those of the rig",
    "session": "the session is that of these expressions",
    "meetings": "dots that come near each other when the face moves are those of the rig",
    "unread": "markers that a camera does not read in an expression are those of the rig",
    "labels": "dots are told from each other as surely as the plan says",
    "take_labels": "dots are told from each other in the takes as surely as the plan says",
}


def audit_claim(plan: Plan, report: Audit) -> Claim:
    """The audit in the plan is a fresh one; `report` is."""
    return _same("audit", "the audit is that of the rig", plan.audit, report)


def seal_claim(plan: Plan) -> Claim:
    """Nobody changed the plan by hand: settings that show nowhere else too."""
    holds = plan.seal == seal_of(plan)
    found = "its seal is unbroken" if holds else "its seal is broken"
    return claim(SEALED, holds, found, "take the plan that was written, or plan again")


def draft_claim(plan: Plan) -> Claim:
    """Nothing is known against the plan: what was made of one that did not hold stays a draft."""
    found = "; ".join(plan.draft) or "nothing was known against it when it was written"
    return claim(NO_DRAFT, not plan.draft, found, "plan again")


def again_claims(plan: Plan, again: Plan) -> list[Claim]:
    """Every part of the plan against the same plan made again."""
    return [_same(part, what, getattr(plan, part), getattr(again, part)) for part, what in PARTS.items()]


def _same(part: str, what: str, said: object, found: object) -> Claim:
    apart = list(differences(said, found, part))
    more = f"; {len(apart) - SHOWN:,} more" if len(apart) > SHOWN else ""
    message = "; ".join(map(str, apart[:SHOWN])) + more if apart else "word for word, number for number"
    return claim(what, not apart, message)
