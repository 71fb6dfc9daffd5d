"""What a check cannot recompute: the solver's own word, other layouts, and questions that a rig has no evidence for."""

from collections.abc import Sequence

from capture_plan.check.promise_claims import NO_COVER, NO_ROUND
from capture_plan.expressions.ordered import PROVING
from capture_plan.layout.assembly import SINGLE_COVER
from capture_plan.layout.settings import BY_ERROR, ORDERED
from capture_plan.plan.claims import Claim
from capture_plan.plan.record import Plan

# Questions that are asked only where there is evidence, and what is missing where they are not.
ASKED = {
    "all signs of the face together agree with how it lies": "they do not speak clearly for any way",
    "the jaw opens downwards": "no blendshape is known as the one that opens it",
    "the eyes lie above the mouth": "they were not all found",
    "most of moving skin is seen from the front": "no skin moves",
    "left and right of the face mirror each other": "the face is not symmetric",
    "what is called left moves the subject's left": "no names tell sides",
    "markers are called by regions that move as they do": "places have no names, or too few blendshapes move",
}


def unchecked(plan: Plan, claims: Sequence[Claim]) -> list[str]:
    """What nobody should take for checked, a sentence each without its full stop."""
    return [*_solver_alone(plan), *_unproved(plan, claims), *_not_asked(claims)]


def _solver_alone(plan: Plan) -> list[str]:
    """What no certificate in the plan proves."""
    layout, packing = plan.layout, plan.packing
    found = []
    if packing.solver_bound > packing.bound:
        proved = f"the solver says no; proved here: at least {packing.bound}"
        found.append(f"whether fewer than {packing.solver_bound} expressions are enough ({proved})")
    if packing.order_proven and packing.method != "early":
        found.append("whether each expression is the most important one possible after those before it")
    if packing.as_made and packing.method in PROVING and not packing.order_proven:
        found.append(f"whether the list is the one that '{packing.method}' makes (its order is not proved)")
    if packing.method == "early":
        other = f"other lists of {packing.objective} expressions"
        found.append(f"whether {other} leave less error early on (a search chose this one)")
    if packing.unmoved is not None and not packing.order_proven:
        found.append("whether another order of the edited list covers more earlier (the order is not proved)")
    if packing.unmoved is not None:
        found.append(
            f"whether a person changed the list that '{packing.method}' makes, and {packing.unmoved} blendshapes "
            "stayed where they were then"
        )
    if layout.method in ORDERED:
        found.append("whether other landmarks would serve better, or fewer as well (a search chose them)")
    elif layout.programs:
        found.append("whether other landmarks would serve better under these settings (only the solver can say)")
    if layout.head:
        found.append("whether the head markers could stand where the face stays stiller yet")
    if layout.method in BY_ERROR:
        unproved = [one.bound for one in layout.programs if one.bound > layout.certificate.landmarks]
        found += [
            f"whether fewer than {bound:g} landmarks see every blendshape under these constraints" for bound in unproved
        ]
    made_with = ", ".join(f"{name} {number}" for name, number in plan.versions.items())
    return [*found, f"whether no cheaper {SINGLE_COVER} exists", f"whether {made_with} made the plan"]


def _unproved(plan: Plan, claims: Sequence[Claim]) -> list[str]:
    """What a method promises, where neither a certificate nor a second look could tell."""
    layout, asked, found = plan.layout, {claim.what for claim in claims}, []
    if layout.method == "budget" and not layout.programs and NO_COVER not in asked:
        most = plan.settings.landmarks.budget or plan.settings.landmarks.number
        found.append(f"whether {most} landmarks can see every blendshape (the plan says no, and proves it by nothing)")
    if layout.method == "adaptive" and NO_ROUND not in asked:
        rounds = f"{len(layout.programs)} of {plan.settings.landmarks.rounds} rounds"
        found.append(f"whether what is crowded could have more landmarks ({rounds} were made)")
    if layout.method in BY_ERROR and not plan.packing.as_made:
        found.append("whether other landmarks would serve better since the expressions were changed")
    return found


def _not_asked(claims: Sequence[Claim]) -> list[str]:
    asked = {claim.what for claim in claims}
    return [f"whether {what} ({why})" for what, why in ASKED.items() if what not in asked]
