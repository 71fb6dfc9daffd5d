"""The script for Blender: run by Blender itself where bpy is at hand, and in any case taken apart."""

import ast
import importlib.util
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from capture_plan.exports import expression_meshes
from capture_plan.exports.blender import write
from capture_plan.exports.delivery import poses_mm
from tests.exports.deliveries import Z_UP, as_artists_obj, badly_named, posed_dots, sample


def python_with_bpy():
    """A Python that has bpy: this one, or the one that BPY_PYTHON names."""
    if importlib.util.find_spec("bpy"):
        return sys.executable
    if named := os.environ.get("BPY_PYTHON"):
        return named
    pytest.skip("no bpy here: pip install bpy into a Python of its own, and name that in BPY_PYTHON")


def scene_of(script):
    """What stands in Blender's scene once a script has run."""
    reader = Path(__file__).with_name("blender_reader.py")
    done = subprocess.run(
        [python_with_bpy(), reader, script],
        capture_output=True,
        text=True,
        env={name: value for name, value in os.environ.items() if name != "PYTHONPATH"},
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


def numbers_in(script):
    """What the script holds, by Python's own reading of it."""
    (call,) = (
        node.value
        for node in ast.parse(script.read_text()).body
        if isinstance(node, ast.Assign) and node.targets[0].id == "PLAN"
    )
    return json.loads(ast.literal_eval(call.args[0]))


def test_in_blender_empties_and_head_stand_in_metres_z_up_in_each_pose(tmp_path):
    of, polygons = as_artists_obj(tmp_path / "rig")
    (script,) = write(of, tmp_path)
    expression_meshes.write(of, tmp_path)
    said = scene_of(script)
    assert said["unit"] == 1
    assert said["polygons"] == len(polygons) - 1  # without the hat
    assert said["empties"] == list(of.names)
    assert np.abs(1000 * np.array(said["frames"]) - posed_dots(of) @ Z_UP.T).max() < 0.01
    for vertices, (_, pose) in zip(said["head"], poses_mm(of.plan, of.inputs), strict=False):
        assert np.abs(1000 * np.array(vertices)[of.inputs.rig.source_index] - pose @ Z_UP.T).max() < 0.01


def test_the_script_holds_each_marker_in_each_pose(tmp_path):
    (script,) = write(sample(), tmp_path)
    held = numbers_in(script)
    frames = np.array([marker["frames"] for marker in held["markers"]]).transpose(1, 0, 2)
    assert np.abs(1000 * frames - posed_dots(sample()) @ Z_UP.T).max() < 0.01
    assert held["poses"] == list(sample().poses)


def test_the_artists_meshes_are_placed_from_their_own_unit_and_axes(tmp_path):
    of, _ = as_artists_obj(tmp_path / "rig")
    M = np.array(numbers_in(write(of, tmp_path)[0])["mesh_to_blender"])
    rig = of.inputs.rig
    assert np.abs(rig.in_file(rig.neutral) @ M[:3, :3].T - rig.neutral @ Z_UP.T / 1000).max() < 1e-9


def test_bad_names_stay_apart_and_end_no_string(tmp_path):
    (script,) = write(badly_named(30), tmp_path)
    names = [marker["name"] for marker in numbers_in(script)["markers"]]
    assert len(set(names)) == 30
    assert max(len(name.encode()) for name in names) < 64
    assert not re.search(r"[^\x00-\x7f]", script.read_text())
