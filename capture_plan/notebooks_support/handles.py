"""Markers as handles in a notebook: choose a frame, drag a marker, see the skin follow."""

from dataclasses import replace
from typing import Any

import marimo as mo
import numpy as np

from capture_plan.evaluation.le2013 import methods
from capture_plan.evaluation.le2013.evaluation import Evaluation
from capture_plan.evaluation.le2013.handles import drag
from capture_plan.layout.face import Face
from capture_plan.layout.naming import name_landmarks
from capture_plan.layout.record import Landmark
from capture_plan.layout.settings import LayoutSettings
from capture_plan.notebooks_support.frame import working
from capture_plan.notebooks_support.heads import show_head
from capture_plan.notebooks_support.knobs import knob_group, slider
from capture_plan.report.page import head_data
from capture_plan.shell.take import Take

EXTENT_MM = 15.0  # as far as a marker is dragged: the corner of a smiling mouth moves about as much
AXES = {"sideways": "To the actor's left, mm", "up": "Up, mm", "forward": "Forward, mm"}


def handles(face: Face, found: Evaluation) -> tuple[Landmark, ...]:
    """The markers of our smallest layout, named from the top of the face down."""
    m = found.counts[0]
    ours = next(one for one in found.scored if (one.method, one.markers) == (methods.OURS, m))
    at = np.array(ours.vertices)
    order = at[np.argsort(-face.rig.neutral[at, 1], kind="stable")]
    return name_landmarks(face, LayoutSettings(), order, [None] * m)


def handle_knobs(markers: tuple[Landmark, ...], take: Take) -> Any:
    """A frame, a marker and how far it is dragged along each axis; `value` holds all five."""
    names = {f"{one.name} {one.label}": i for i, one in enumerate(markers)}
    lowest = min(names, key=lambda name: markers[names[name]].position[1])
    last = len(take.sequence) - 1
    return knob_group(
        frame=(slider(0, last, 1, last // 2, "Frame"), "The frame that is changed, counted from 0."),
        marker=(
            mo.ui.dropdown(names, lowest, label="Marker", searchable=True, full_width=True),
            "The one that is dragged; all others hold the skin.",
        ),
        **{name: (slider(-EXTENT_MM, EXTENT_MM, 0.5, 0.0, label), "") for name, label in AXES.items()},
    )


def dragged_head(take: Take, markers: tuple[Landmark, ...], knobs: Any) -> mo.Html:
    """The frame as the dragged marker leaves it, with its markers."""
    moved = np.zeros((len(markers), 3))
    moved[knobs.value["marker"]] = [knobs.value[axis] for axis in AXES]
    number = {int(v): n for n, v in enumerate(take.at)}
    at = np.array([number[one.vertex] for one in markers])
    with working():
        pose = drag(take, at, moved, knobs.value["frame"])
    rig = replace(take.rig, neutral=pose)
    return show_head(rig, head_data(rig, (), landmarks=markers, shade=np.ones(len(pose))))
