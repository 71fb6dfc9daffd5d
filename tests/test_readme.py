"""What the README shows is so: its code runs, its settings are settings, its commands and options are there."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import typer.main

from capture_plan import sample_rig
from capture_plan.camera import cameras_for
from capture_plan.cli import app
from capture_plan.names.name_map import read_name_map
from capture_plan.plan.files import read_settings
from capture_plan.registration.picked_points import named_vertices
from tests.camera.camera_files import pose2sim, stage
from tests.formats.test_gltf import write_sample_glb

README = (Path(__file__).parents[1] / "README.md").read_text()
BLOCKS = re.findall(r"```(\w*)\n(.*?)```", README, flags=re.DOTALL)
CAMERA = """[[cameras]]
name = "front"
width = 2000
height = 2000
fx = 3000
fy = 3000
position = [0, 690, 900]
look_at = [0, 690, 0]
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with the files that the README speaks of."""
    folder = tmp_path_factory.mktemp("readme")
    write_sample_glb(folder / "hero.glb", k=8)
    (folder / "stage.toml").write_text(CAMERA)
    (folder / "take.csv").write_text("browInnerUp,cheekPuff,eyeBlinkLeft\n1,0,0.2\n0.5,0.6,0\n0,1,0.9\n")
    return folder


@pytest.mark.parametrize("code", [code for kind, code in BLOCKS if kind == "python"], ids=["first", "inputs"])
def test_the_code_runs_as_it_stands(folder, monkeypatch, code):
    monkeypatch.chdir(folder)
    exec(compile(code, "README.md", "exec"), {})


def test_the_settings_are_settings_and_the_names_are_a_name_map(tmp_path):
    names, _, settings = (code for kind, code in BLOCKS if kind == "toml")
    (tmp_path / "names.toml").write_text(names)
    assert read_name_map(str(tmp_path / "names.toml")).names["Smile_01"] == "mouthSmileLeft"
    (tmp_path / "settings.toml").write_text(settings)
    found = read_settings(tmp_path / "settings.toml", lambda words, _: tuple(int(re.sub(r"\D", "", w)) for w in words))
    assert found.landmarks.pins == (12,)
    assert found.landmarks.keep_out["scar.ply"] == 0


def test_the_calibration_is_aligned_as_its_lines_say(tmp_path):
    rig, (_, calibration, _) = sample_rig(), (code for kind, code in BLOCKS if kind == "toml")
    (tmp_path / "own.toml").write_text(calibration.replace("session.xcp", "Calib.toml"))
    places = {name: rig.neutral[vertex] for name, vertex in named_vertices(rig).items()}
    away = np.array([12, 1580, 310]) - places["nose_tip"]
    pose2sim(tmp_path, [replace(one, t=(one.t - one.R @ away) / 1000) for one in stage()])
    cameras = cameras_for(str(tmp_path / "own.toml"), rig.neutral, rig.skin, lambda: places)
    for one, truth in zip(cameras, stage(), strict=True):
        assert np.linalg.norm(one.position - truth.centre) < 2.0  # its numbers are whole millimetres
        assert one.slip is not None
        assert (one.slip.mm, one.slip.degrees) == (20, 15)


def test_every_command_and_option_is_there():
    commands = typer.main.get_command(app).commands
    lines = [line for _, code in BLOCKS for line in code.splitlines() if "capture-plan " in line]
    assert {re.search(r"capture-plan (\w+)", line)[1] for line in lines} >= set(commands) - {"demo", "settings"}
    for line in lines:
        command = commands[re.search(r"capture-plan (\w+)", line)[1]]
        known = {option for parameter in command.params for option in (*parameter.opts, *parameter.secondary_opts)}
        assert set(re.findall(r"(?<!\w)--[a-z][a-z-]*", line)) <= known, line
