"""Heads that can be turned: the viewer of the HTML plan in a frame, with what one stage of a plan has to show."""

import marimo as mo
import numpy as np
from jaxtyping import Float

from capture_plan.expressions import Expression, Packing
from capture_plan.expressions.sentences import sentence
from capture_plan.layout.face import Face
from capture_plan.layout.record import Bound, Layout, Worth
from capture_plan.plan.make import assemble_plan
from capture_plan.plan.record import Plan
from capture_plan.plan.settings import Settings
from capture_plan.report import viewer_html
from capture_plan.rig import Rig
from capture_plan.rig.audit import Audit

HEIGHT = "700px"
NO_LANDMARKS = Layout("", (), (), 0, Bound((), (), 0), (), Worth(0, 0, 0, 0.0, 0.0, 0.0), {})
NO_EXPRESSIONS = Packing("", (), 0, 0, False, False, (), (), (), (), ())


def head(rig: Rig, plan: Plan, *, expressions: bool = True, shade: Float[np.ndarray, " v"] | None = None) -> mo.Html:
    """The head with the plan's landmarks and their names, and its expressions to step through."""
    return mo.iframe(viewer_html(rig, plan, expressions=expressions, shade=shade), height=HEIGHT)


def blendshape_head(rig: Rig, report: Audit) -> mo.Html:
    """The head with every used blendshape to step through, one at a time."""
    alone = tuple(Expression(name, (name,), (1.0,), 0.0, 0.0, sentence(rig, (name,))) for name in report.used)
    return packing_head(rig, report, Packing("", alone, len(alone), 0, False, False, (), (), (), (), ()))


def visibility_head(face: Face, report: Audit) -> mo.Html:
    """The head, the darker the less it is seen; what does not move is in full light."""
    shade = np.where(face.moving_skin, face.visibility, 1.0)
    plan = assemble_plan(face.rig, Settings(), report, NO_LANDMARKS, NO_EXPRESSIONS)
    return head(face.rig, plan, expressions=False, shade=shade)


def layout_head(rig: Rig, report: Audit, layout: Layout) -> mo.Html:
    """The head with its landmarks."""
    return head(rig, assemble_plan(rig, Settings(), report, layout, NO_EXPRESSIONS), expressions=False)


def packing_head(rig: Rig, report: Audit, packing: Packing) -> mo.Html:
    """The head with expressions to step through, without landmarks."""
    return head(rig, assemble_plan(rig, Settings(), report, NO_LANDMARKS, packing))
