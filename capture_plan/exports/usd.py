"""Markers as USD: `markers.usda`, and over a rig that is USD itself `markers_on_rig.usda`.

`markers.usda`          UsdGeom.Points, millimetres (metersPerUnit 0.001), +y up, facing +z, as wide as the dots; with
                        primvars names and places. Time code 0 and the default are the neutral, time code i expression i
`markers_on_rig.usda`   the neutral's points over the rig's own file, in its unit and axes

usd-core is an extra, `capture-plan[usd]`. Letters: m markers, e poses.
"""

# pyright: reportAttributeAccessIssue=false

import importlib.util
import os
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from capture_plan.errors import PlanError
from capture_plan.exports.delivery import Delivery, dots_mm, posed_dots_mm
from capture_plan.exports.marker_names import distinct_names
from capture_plan.formats.usd import SUFFIXES
from capture_plan.output import write_whole
from capture_plan.plan.record import head_words, number_of

LONGEST = 200  # letters of a name
PLACE = "/capture_plan_markers"
MM = 0.001  # metres


def write(of: Delivery, folder: Path) -> list[Path]:
    """Write the markers, and them over the rig where it is USD.

    Raises:
        PlanError: usd-core is missing.
    """
    if importlib.util.find_spec("pxr") is None:
        raise PlanError("USD needs the library usd-core: install it with pip install 'capture-plan[usd]'")
    alone = of.place(folder, "markers", ".usda")
    write_whole(alone, markers_alone(of).encode())
    if of.rig_file is None or of.rig_file.suffix.lower() not in SUFFIXES:
        return [alone]
    over = of.place(folder, "markers_on_rig", ".usda")
    write_whole(over, markers_over(of, of.rig_file).encode())
    return [alone, over]


def markers_alone(of: Delivery) -> str:
    """A stage of the markers, millimetres, in all poses."""
    from pxr import Usd, UsdGeom

    stage = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageMetersPerUnit(stage, MM)
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
    frames = posed_dots_mm(of.plan, of.inputs)
    stage.SetStartTimeCode(0)
    stage.SetEndTimeCode(len(frames) - 1)
    poses = ", ".join(of.poses)
    say_origin(stage, of)
    stage.GetRootLayer().comment = f"One unit is a millimetre, +y up, facing +z; poses by time code: {poses}"
    points = add_points(stage, of, frames[0], 1.0)
    for code, frame in enumerate(frames):
        points.GetPointsAttr().Set(vectors(frame), code)
    return stage.GetRootLayer().ExportToString()


def markers_over(of: Delivery, rig_file: Path) -> str:
    """A stage of the neutral's markers over the artist's file, in its own unit and axes."""
    from pxr import Usd, UsdGeom

    artists = Usd.Stage.Open(str(rig_file.resolve()), Usd.Stage.LoadNone)
    stage, rig = Usd.Stage.CreateInMemory(), of.inputs.rig
    UsdGeom.SetStageMetersPerUnit(stage, UsdGeom.GetStageMetersPerUnit(artists))
    UsdGeom.SetStageUpAxis(stage, UsdGeom.GetStageUpAxis(artists))
    stage.GetRootLayer().subLayerPaths.append(
        Path(os.path.relpath(rig_file.resolve(), of.stands_in.resolve())).as_posix()
    )
    say_origin(stage, of)
    add_points(stage, of, rig.in_file(dots_mm(of.plan, of.inputs)), 1 / rig.unit_mm)
    return stage.GetRootLayer().ExportToString()


def say_origin(stage: Any, of: Delivery) -> None:
    """Which plan and whose head, in the layer's own data."""
    plan = of.plan
    stage.GetRootLayer().customLayerData = {"capture_plan": {"plan": number_of(plan), "head": head_words(plan)}}


def add_points(stage: Any, of: Delivery, places: Float[np.ndarray, "m 3"], millimetre: float) -> Any:
    """The markers at these places of a stage, a millimetre being so long there."""
    from pxr import Sdf, UsdGeom

    points = UsdGeom.Points.Define(stage, PLACE)
    stage.SetDefaultPrim(points.GetPrim())
    points.GetPointsAttr().Set(vectors(places))
    dot = of.plan.settings.landmarks.dot_mm * millimetre
    points.GetWidthsAttr().Set([dot] * len(places))
    points.GetDisplayColorAttr().Set([(0.02, 0.02, 0.02)])
    said = {
        "names": list(distinct_names(of.names, longest=LONGEST)),
        "places": [marker.label for marker in of.plan.layout.markers],
    }
    kind = Sdf.ValueTypeNames.StringArray
    for name, values in said.items():
        UsdGeom.PrimvarsAPI(points).CreatePrimvar(name, kind, UsdGeom.Tokens.vertex).Set(values)
    return points


def vectors(places: Float[np.ndarray, "m 3"]) -> Any:
    """Points as USD holds them."""
    from pxr import Vt

    return Vt.Vec3fArray.FromNumpy(places.astype(np.float32))
