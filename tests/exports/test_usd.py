"""USD stages read back by usd-core itself."""

import sys
from dataclasses import replace

import numpy as np
import pytest
from pxr import Usd, UsdGeom

from capture_plan.errors import PlanError
from capture_plan.exports.usd import write
from capture_plan.plan.inputs import PlanInputs
from tests.exports.deliveries import Z_UP, badly_named, dots, posed_dots, sample


def markers_in(path):
    stage = Usd.Stage.Open(str(path))
    return stage, UsdGeom.Points(stage.GetPrimAtPath("/capture_plan_markers"))


def primvar(points, name):
    return UsdGeom.PrimvarsAPI(points).GetPrimvar(name)


def test_points_stand_where_the_dots_are_in_each_pose(tmp_path):
    (path,) = write(sample(), tmp_path)
    stage, points = markers_in(path)
    assert (UsdGeom.GetStageMetersPerUnit(stage), UsdGeom.GetStageUpAxis(stage)) == (0.001, "Y")
    frames = [np.array(points.GetPointsAttr().Get(code)) for code in range(int(stage.GetEndTimeCode()) + 1)]
    assert np.abs(np.array(frames) - posed_dots(sample())).max() < 0.01
    assert np.abs(np.array(points.GetPointsAttr().Get()) - dots(sample())).max() < 0.01
    assert tuple(primvar(points, "names").Get()) == sample().names
    assert primvar(points, "names").GetInterpolation() == "vertex"
    assert set(points.GetWidthsAttr().Get()) == {sample().plan.settings.landmarks.dot_mm}


def test_bad_names_stay_as_they_are_and_apart(tmp_path):
    (path,) = write(badly_named(30), tmp_path)
    _stage, points = markers_in(path)
    names = list(primvar(points, "names").Get())
    assert len(set(names)) == 30
    assert "lèvre supérieure" in names


def test_over_a_rig_of_usd_points_are_in_its_own_unit_and_axes_and_follow_it_anywhere(tmp_path):
    (tmp_path / "show").mkdir()
    rig_file = tmp_path / "show" / "hero.usda"
    stage = Usd.Stage.CreateNew(str(rig_file))
    UsdGeom.SetStageMetersPerUnit(stage, 0.01)
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    UsdGeom.Mesh.Define(stage, "/hero")
    stage.Save()
    turned = replace(sample().inputs.rig, unit_mm=10.0, up="+z", facing="-y", turn=(1.0, 0, 0, 0, 0, 1.0, 0, -1.0, 0))
    of = replace(sample(), inputs=PlanInputs(turned), rig_file=rig_file, stands_in=tmp_path / "out")
    (tmp_path / "out" / "being_made").mkdir(parents=True)
    for made in write(of, tmp_path / "out" / "being_made"):
        made.rename(tmp_path / "out" / made.name)
    stage, points = markers_in(tmp_path / "out" / "markers_on_rig.usda")
    assert stage.GetPrimAtPath("/hero").IsA(UsdGeom.Mesh)
    assert (UsdGeom.GetStageMetersPerUnit(stage), UsdGeom.GetStageUpAxis(stage)) == (0.01, "Z")
    assert np.abs(10 * np.array(points.GetPointsAttr().Get()) - dots(sample()) @ Z_UP.T).max() < 0.01
    assert points.GetWidthsAttr().Get()[0] == pytest.approx(sample().plan.settings.landmarks.dot_mm / 10)


def test_without_the_library_it_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pxr", None)
    with pytest.raises(PlanError, match=r"pip install 'capture-plan\[usd\]'"):
        write(sample(), tmp_path)
