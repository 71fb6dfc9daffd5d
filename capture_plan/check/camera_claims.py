"""What a plan says of its cameras, recomputed: that they are the same, and how each of them reads every marker."""

import numpy as np

from capture_plan.camera import otherwise, recorded
from capture_plan.layout.face import Face
from capture_plan.layout.naming import views_of
from capture_plan.layout.record import Landmark, View
from capture_plan.plan.claims import Claim, claim
from capture_plan.plan.record import Plan

SAME_PX, SAME_SHARE = 0.02, 1e-3  # the plan carries two decimals


def camera_claims(plan: Plan, face: Face) -> list[Claim]:
    """The cameras are those of the plan; which of them read each marker in every expression, and how wide it is."""
    marks = plan.layout.markers
    if not face.cameras and not plan.cameras and not any(mark.views for mark in marks):
        return []
    changed = otherwise(plan.cameras, tuple(map(recorded, face.cameras)))
    found = [views_of(face, plan.settings.landmarks, mark.vertex) for mark in marks]
    wrong = [message for mark, views in zip(marks, found, strict=True) if (message := difference(mark, views))]
    stated = f" ({plan.settings.cameras})" if plan.settings.cameras else ""
    also = f"; {len(wrong)} of {len(marks)} markers in all" if len(wrong) > 1 else ""
    mend = f"the cameras{stated} have changed since the plan was made: plan again"
    return [
        claim("the cameras are those that the plan was made for", not changed, changed or "the same numbers", mend),
        claim(
            "the cameras read every marker as the plan says",
            not wrong,
            f"{wrong[0]}{also}" if wrong else f"{len(marks)} markers in {len(face.cameras)} cameras",
            mend,
        ),
    ]


def difference(mark: Landmark, found: tuple[View, ...]) -> str:
    """How the cameras read a marker otherwise than the plan says; nothing where they do not."""
    if [view.camera for view in found] != [view.camera for view in mark.views]:
        names = [", ".join(view.camera for view in views) or "no camera" for views in (mark.views, found)]
        return f"{mark.name} is planned for {names[0]}, not for {names[1]}"
    for said, now in zip(mark.views, found, strict=True):
        if said.always != now.always:
            reads = "no longer reads it" if said.always else "reads it"
            why = f": {now.why}, {now.when}" if now.why else ""
            return f"camera '{now.camera}' {reads} in every expression ({mark.name}{why})"
        if not np.isclose(said.pixels, now.pixels, atol=SAME_PX, rtol=SAME_SHARE):
            return f"{mark.name} is {now.pixels:.2f} px wide in camera '{now.camera}', the plan says {said.pixels:.2f}"
        if (said.share, said.why, said.when) != (now.share, now.why, now.when):
            return (
                f"camera '{now.camera}' reads {mark.name} in {now.share:.0%} of the expressions "
                f"({now.why or 'always'}), the plan says {said.share:.0%} ({said.why or 'always'})"
            )
    return ""
