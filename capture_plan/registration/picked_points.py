"""Points that a person picks on a scan: which have names, and a small file of them.

Names    corners of the eyes and of the mouth, tip of the nose and chin, where they were found on the rig, or the name
         of any marker of the plan; sides are the actor's own
File     JSON {"chin": [x, y, z]}, TOML chin = [x, y, z], or CSV with rows chin,x,y,z; in the head file's coordinates
"""

import csv
import io
import math
from collections.abc import Mapping
from pathlib import Path

import msgspec
import numpy as np
from jaxtyping import Float

from capture_plan.anatomy.eye_corners import eye_corners
from capture_plan.errors import PlanError
from capture_plan.face.anchors import face_anchors, face_surface
from capture_plan.input.documents import read_plain, read_toml
from capture_plan.rig import Rig

Point = tuple[float, float, float]
GIVE = 'give JSON {"chin": [x, y, z]}, TOML chin = [x, y, z], or CSV with rows chin,x,y,z'
MOST_POINTS = 500


def read_points(path: Path) -> dict[str, Point]:
    """The points in a file, by name.

    Raises:
        PlanError: missing, of another kind, or a row that is no name with three numbers.
    """
    kind = path.suffix.lower()
    if kind not in (".json", ".toml", ".csv"):
        raise PlanError(f"{path} is no file of points: {GIVE}")
    document = read_toml(path, PlanError, GIVE) if kind == ".toml" else None
    try:
        if document is None:
            text = read_plain(path, PlanError, GIVE).decode("utf-8-sig")
            document = msgspec.json.decode(text) if kind == ".json" else _rows(text)
        found = msgspec.convert(document, dict[str, Point], strict=kind != ".csv")
    except (msgspec.DecodeError, msgspec.ValidationError, UnicodeDecodeError, RecursionError) as error:
        raise PlanError(f"{path} holds no points ({error}): {GIVE}") from None
    if not found:
        raise PlanError(f"{path} holds no points: {GIVE}")
    if len(found) > MOST_POINTS or not all(math.isfinite(x) for point in found.values() for x in point):
        raise PlanError(f"{path} holds {len(found)} points, expected at most {MOST_POINTS}, all of finite numbers")
    return found


def _rows(text: str) -> dict[str, list[str]]:
    """Rows of a CSV file that have numbers; a first row of column names is none."""
    rows = [[cell.strip() for cell in row] for row in csv.reader(io.StringIO(text)) if any(map(str.strip, row))]
    if rows and not any(_is_number(cell) for cell in rows[0][1:]):
        rows = rows[1:]
    return {row[0]: row[1:] for row in rows}


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


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
