"""Heads that can be turned: the viewer of the HTML plan in a frame, with what one stage of a plan has to show."""

from typing import Any

import marimo as mo
import numpy as np

from capture_plan.audit.audit import Audit
from capture_plan.expressions import Expression, Packing
from capture_plan.expressions.sentences import sentence
from capture_plan.layout.face import Face
from capture_plan.layout.record import Layout
from capture_plan.plan.record import Plan
from capture_plan.report.page import cameras_html, head_data, head_html, plan_head
from capture_plan.rig import Rig

HEIGHT = "700px"


def plan_view(rig: Rig, plan: Plan) -> mo.Html:
    """The head with the plan's landmarks and their names, and its expressions to step through."""
    return show_head(rig, plan_head(rig, plan))


def cameras_view(rig: Rig, plan: Plan) -> mo.Html:
    """What each camera of the plan sees, and which marker it reads in which expression; a line where none is known."""
    if not plan.cameras:
        return mo.md("*No cameras are known: choose some above to see what they see.*")
    return mo.iframe(cameras_html(rig, plan), height=HEIGHT)


def blendshape_head(rig: Rig, report: Audit) -> mo.Html:
    """The head with every used blendshape to step through, one at a time."""
    alone = tuple(Expression(name, (name,), (1.0,), 0.0, 0.0, sentence(rig, (name,))) for name in report.used)
    return show_head(rig, head_data(rig, report.used, expressions=alone))


def visibility_head(face: Face) -> mo.Html:
    """The head, the darker the less it is seen; what does not move is in full light."""
    shade = np.where(face.moving_skin, face.visibility, 1.0)
    return show_head(face.rig, head_data(face.rig, (), shade=shade))


def layout_head(face: Face, layout: Layout) -> mo.Html:
    """The head with its landmarks."""
    return show_head(face.rig, head_data(face.rig, face.used, landmarks=layout.markers))


def packing_head(rig: Rig, packing: Packing) -> mo.Html:
    """The head with expressions to step through, without landmarks."""
    return show_head(rig, head_data(rig, (), expressions=packing.expressions))


def show_head(rig: Rig, head: dict[str, Any]) -> mo.Html:
    """What `head_data` describes, in a frame."""
    return mo.iframe(head_html(rig, head), height=HEIGHT)
