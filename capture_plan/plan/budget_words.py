"""What a budget of landmarks bought, in words: what was not spent and why, and how far from the best it can be."""

from capture_plan.layout.settings import LayoutSettings
from capture_plan.plan.record import Plan


def budget_words(plan: Plan) -> str:
    """', for a budget of 34', where landmarks were chosen for one."""
    settings = plan.settings.landmarks
    return f", for a budget of {settings.budget or settings.number}" if plan.layout.method == "budget" else ""


def unspent_words(plan: Plan) -> list[str]:
    """Why a budget is not spent: its search ends where no site is open any more that it pays for (`layout.budget`), the
    default earlier."""
    settings, landmarks = plan.settings.landmarks, len(plan.layout.landmarks)
    budget = settings.budget or settings.number or landmarks
    if landmarks >= budget:
        return []
    if plan.layout.method == "studio":
        return [
            f"{landmarks} of at most {budget} are used: the default stops where more tell little; method budget "
            "(--budget) spends all."
        ]
    if plan.layout.method != "budget":
        return []
    return [f"{landmarks} of the {budget} are used: {no_more_words(settings, budget - landmarks)}."]


def no_more_words(settings: LayoutSettings, left: int) -> str:
    """'beside these no further dot, with its mirror image, keeps 8 mm from the others and all constraints'."""
    constraints = (
        f"keeps {settings.spacing_mm:g} mm from the others and all constraints"
        if settings.spacing_mm
        else "keeps all constraints"
    )
    if settings.symmetric and left == 1:
        return f"the one that is left buys no pair of dots, and no further one in the middle of the face {constraints}"
    image = ", with its mirror image," if settings.symmetric else ""
    return f"beside these no further dot{image} {constraints}"


def bound_words(plan: Plan) -> list[str]:
    """How far from the best a budget can be."""
    layout = plan.layout
    if layout.error_bound is None or not layout.error_bound.error_mm:
        return []
    least = layout.error_bound.error_mm
    return [
        f"Proved: no layout of {len(layout.landmarks)} landmarks has an upper estimate below {least:.3f} mm; "
        f"this one is {layout.information.error_mm / least - 1:.1%} above that."
    ]
