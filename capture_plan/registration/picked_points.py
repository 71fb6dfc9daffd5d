"""Points of a face that a person picks on a scan or in a calibration: which have names, and where they are on the rig.

Names    corners of the eyes and of the mouth, tip of the nose and chin, where they were found on the rig, or the name
         of any marker of the plan; sides are the actor's own
"""

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float

from capture_plan.anatomy.eye_corners import eye_corners
from capture_plan.errors import PlanError
from capture_plan.face.anchors import face_anchors, face_surface
from capture_plan.input.points import Point
from capture_plan.rig import Rig


def named_vertices(rig: Rig) -> dict[str, int]:
    """Vertices of the rig that people find on any face, by the names that a file of points has for them."""
    anchors, x = face_anchors(rig), rig.neutral
    skin = np.flatnonzero(face_surface(rig))

    def on_skin(place: Float[np.ndarray, " 3"]) -> int:
        return int(skin[np.linalg.norm(x[skin] - place, axis=1).argmin()])

    found = {f"eye_{end}_{side}": corner for (end, side), corner in eye_corners(rig, anchors).items()}
    if "mouth" in anchors.found:
        found |= {"mouth_left": on_skin(anchors.corner_left), "mouth_right": on_skin(anchors.corner_right)}
    found["nose_tip"] = on_skin(anchors.nose_tip)
    if anchors.chin_sure:
        found["chin"] = on_skin(anchors.chin)
    return found


def picks_on(
    rig: Rig, points: Mapping[str, Point], markers: Mapping[str, int]
) -> dict[str, tuple[Float[np.ndarray, " v"], Float[np.ndarray, " 3"]]]:
    """What `lay_onto_head` reads: the row of each point over the rig's vertices, and where it was picked; `markers` are
    the vertices of the plan's markers by name.

    Raises:
        PlanError: a name is none of the face's points and none of the markers.
    """
    known = named_vertices(rig) | dict(markers)
    if others := [name for name in points if name not in known]:
        anchors = ", ".join(name for name in known if name not in markers)
        words = ", ".join(f"'{name}'" for name in others)
        raise PlanError(f"no points are known as {words}: name one of {anchors}, or a marker of the plan")
    rows = {name: np.zeros(len(rig.neutral)) for name in points}
    for name, row in rows.items():
        row[known[name]] = 1.0
    return {name: (rows[name], np.array(point)) for name, point in points.items()}
