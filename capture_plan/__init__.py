"""Plans facial capture sessions: markers to place, expressions to scan, and every page the set needs.

What stands here loads when it is first used, so that importing the package costs nothing.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from capture_plan.audit.audit import audit_rig
    from capture_plan.camera import Camera
    from capture_plan.check.check import check_plan
    from capture_plan.errors import CapturePlanError, InfeasibleError, PlanError, RigError, SettingsError
    from capture_plan.evaluation.compare import compare_layouts
    from capture_plan.expressions.record import Packing
    from capture_plan.expressions.settings import PackingSettings
    from capture_plan.inspection.inspect import inspect_plan
    from capture_plan.layout.face import see_face
    from capture_plan.layout.record import Layout
    from capture_plan.layout.settings import LayoutSettings
    from capture_plan.plan.files import read_plan, write_plan
    from capture_plan.plan.inputs import PlanInputs, read_inputs
    from capture_plan.plan.make import make_plan
    from capture_plan.plan.record import Plan
    from capture_plan.plan.revise import edited_plan
    from capture_plan.plan.settings import Settings
    from capture_plan.reader.read import read_rig
    from capture_plan.report import write_html
    from capture_plan.rig.record import Rig
    from capture_plan.sample import sample_rig
    from capture_plan.sequence import Sequence, read_sequence
    from capture_plan.sheets import write_sheets
    from capture_plan.shell.takes import takes_of

__all__ = [
    "Camera",
    "CapturePlanError",
    "InfeasibleError",
    "Layout",
    "LayoutSettings",
    "Packing",
    "PackingSettings",
    "Plan",
    "PlanError",
    "PlanInputs",
    "Rig",
    "RigError",
    "Sequence",
    "Settings",
    "SettingsError",
    "audit_rig",
    "check_plan",
    "compare_layouts",
    "edited_plan",
    "inspect_plan",
    "make_plan",
    "read_inputs",
    "read_plan",
    "read_rig",
    "read_sequence",
    "sample_rig",
    "see_face",
    "takes_of",
    "write_html",
    "write_plan",
    "write_sheets",
]

_HOME = {
    "Camera": "camera.camera",
    "CapturePlanError": "errors",
    "InfeasibleError": "errors",
    "Layout": "layout.record",
    "LayoutSettings": "layout.settings",
    "Packing": "expressions.record",
    "PackingSettings": "expressions.settings",
    "Plan": "plan.record",
    "PlanError": "errors",
    "PlanInputs": "plan.inputs",
    "Rig": "rig.record",
    "RigError": "errors",
    "Sequence": "sequence",
    "Settings": "plan.settings",
    "SettingsError": "errors",
    "audit_rig": "audit.audit",
    "check_plan": "check.check",
    "compare_layouts": "evaluation.compare",
    "edited_plan": "plan.revise",
    "inspect_plan": "inspection.inspect",
    "make_plan": "plan.make",
    "read_inputs": "plan.inputs",
    "read_plan": "plan.files",
    "read_rig": "reader.read",
    "read_sequence": "sequence",
    "sample_rig": "sample",
    "see_face": "layout.face",
    "takes_of": "shell.takes",
    "write_html": "report",
    "write_plan": "plan.files",
    "write_sheets": "sheets",
}


def __getattr__(name: str) -> object:
    if name not in _HOME:
        raise AttributeError(f"module 'capture_plan' has no attribute '{name}'")
    return getattr(import_module(f"capture_plan.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    return __all__
