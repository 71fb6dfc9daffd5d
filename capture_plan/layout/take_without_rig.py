"""Landmarks from a take alone, where there is no rig (Le et al. 2013, section 7.2).

A short take is scanned densely, the layout is chosen on it, and everything after is recorded with these markers.

Coarse    the mesh that is planned on and drawn; its vertices are some of the scan's
Scan      the take's own mesh: `on_scan` says the same layout in its numbers
"""

import numpy as np
from jaxtyping import Bool, Int
from msgspec.structs import replace

from capture_plan.layout.design import design_layout
from capture_plan.layout.face import see_face
from capture_plan.layout.record import Landmark, Layout, Prediction
from capture_plan.layout.settings import LayoutSettings
from capture_plan.rig import Rig
from capture_plan.sequence import Sequence
from capture_plan.sequence.rig_from_take import stand_in_rig
from capture_plan.shell.takes import takes_of


def layout_from_take(
    sequence: Sequence, settings: LayoutSettings, *, triangles: int, skin: Bool[np.ndarray, " v"] | None = None
) -> tuple[Layout, Rig]:
    """The layout on at most so many triangles, and the rig with them that stands in for the take.

    `source_vertex` of a landmark is its number in the take's own mesh, its `blendshapes` are frames that move it;
    `skin` marks vertices of the take, without it the skin is found.

    Raises:
        RigError: the take has blendshapes of its own, or stands still.
        InfeasibleError: the settings cannot be kept.
    """
    rig, coarse = stand_in_rig(sequence, triangles=triangles, skin=skin)
    layout = design_layout(see_face(rig, rig.names), settings, takes=takes_of(rig, [coarse]))
    return replace(
        layout,
        predictions=of_takes(layout.predictions),
        references={
            name: replace(one, predictions=of_takes(one.predictions)) for name, one in layout.references.items()
        },
    ), rig


def of_takes(predictions: tuple[Prediction, ...]) -> tuple[Prediction, ...]:
    """Without mixes of blendshapes, which are frames here: nobody performs some of them at once."""
    return tuple(one for one in predictions if one.beyond_mm is not None)


def on_scan(layout: Layout, sequence: Sequence) -> Layout:
    """The layout with vertices and triangles of the take's own mesh, for its files."""
    return replace(
        layout,
        landmarks=tuple(_moved(m, sequence.triangles) for m in layout.landmarks),
        head=tuple(_moved(m, sequence.triangles) for m in layout.head),
    )


def _moved(landmark: Landmark, triangles: Int[np.ndarray, "f 3"]) -> Landmark:
    """A landmark at its vertex of the scan, a corner of one of these triangles."""
    at = triangles == landmark.source_vertex
    triangle = int(at.any(axis=1).argmax())
    corner = tuple(at[triangle].astype(float).tolist())
    return replace(landmark, vertex=landmark.source_vertex, triangle=triangle, barycentric=corner)
