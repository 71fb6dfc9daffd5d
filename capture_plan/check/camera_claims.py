"""What a plan says of its cameras, recomputed: how each of them sees every marker."""

import numpy as np

from capture_plan.layout.face import Face
from capture_plan.layout.naming import views_of
from capture_plan.layout.record import Landmark, View
from capture_plan.plan.claims import Claim, claim
from capture_plan.plan.record import Plan

SAME_PX, SAME_SHARE = 0.02, 1e-3  # the plan carries two decimals


def camera_claims(plan: Plan, face: Face) -> list[Claim]:
    """Which cameras see each marker in every expression, and how wide it is in their images."""
    marks = plan.layout.markers
    if not face.cameras and not any(mark.views for mark in marks):
        return []
    found = [views_of(face, plan.settings.landmarks, mark.vertex) for mark in marks]
    wrong = [message for mark, views in zip(marks, found, strict=True) if (message := difference(mark, views))]
    stated = f" ({plan.settings.cameras})" if plan.settings.cameras else ""
    also = f"; {len(wrong)} of {len(marks)} markers in all" if len(wrong) > 1 else ""
    return [
        claim(
            "the cameras see every marker as the plan says",
            not wrong,
            f"{wrong[0]}{also}" if wrong else f"{len(marks)} markers in {len(face.cameras)} cameras",
            f"the cameras{stated} have changed since the plan was made: plan again",
        )
    ]


def difference(mark: Landmark, found: tuple[View, ...]) -> str:
    """How the cameras see a marker otherwise than the plan says; nothing where they do not."""
    if [view.camera for view in found] != [view.camera for view in mark.views]:
        names = [", ".join(view.camera for view in views) or "no camera" for views in (mark.views, found)]
        return f"{mark.name} is planned for {names[0]}, not for {names[1]}"
    for said, now in zip(mark.views, found, strict=True):
        if said.always != now.always:
            sees = "no longer sees it" if said.always else "sees it"
            return f"camera '{now.camera}' {sees} in every expression ({mark.name})"
        if not np.isclose(said.pixels, now.pixels, atol=SAME_PX, rtol=SAME_SHARE):
            return f"{mark.name} is {now.pixels:.2f} px wide in camera '{now.camera}', the plan says {said.pixels:.2f}"
    return ""
