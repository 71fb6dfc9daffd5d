"""Landmarks from a take alone, where there is no rig (Le et al. 2013, section 7.2).

A short take is scanned densely, the layout is chosen on it, and everything after is recorded with these markers.
"""

from capture_plan.layout.design import design_layout
from capture_plan.layout.face import see_face
from capture_plan.layout.record import Layout
from capture_plan.layout.settings import LayoutSettings
from capture_plan.layout.shell.takes import takes_of
from capture_plan.rig.sequence import Sequence
from capture_plan.rig.sequence.stand_in import stand_in_rig


def layout_from_take(sequence: Sequence, settings: LayoutSettings, *, triangles: int) -> Layout:
    """The layout on at most so many triangles; `source_vertex` of a landmark is its number in the take's own mesh, and
    its `blendshapes` are frames that move it.

    Raises:
        RigError: the take has blendshapes of its own, or stands still.
        InfeasibleError: the settings cannot be kept.
    """
    rig, coarse = stand_in_rig(sequence, triangles=triangles)
    return design_layout(see_face(rig, rig.names), settings, takes=takes_of(rig, [coarse]))
