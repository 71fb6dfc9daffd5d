"""Expression meshes on the artist's own file and on the plan's mesh, read back by trimesh."""

import csv
import json
from dataclasses import replace

import numpy as np
import pytest
import trimesh

from capture_plan.exports.delivery import poses_mm
from capture_plan.exports.expression_meshes import replaced_vertices, write
from capture_plan.plan.inputs import PlanInputs
from capture_plan.progress import listen
from tests.exports.deliveries import Z_UP, as_artists_obj, sample


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    folder = tmp_path_factory.mktemp("plain")
    return folder / "expressions", write(sample(), folder)


@pytest.fixture(scope="module")
def artists(tmp_path_factory):
    folder = tmp_path_factory.mktemp("artists")
    of, polygons = as_artists_obj(folder / "rig")
    return of, polygons, write(of, folder)


def test_without_an_artists_file_each_mesh_is_the_rig_in_that_pose(plain):
    folder, written = plain
    assert all(path.exists() for path in written)
    for name, vertices in poses_mm(sample().plan, sample().inputs):
        mesh = trimesh.load(folder / f"{name}.obj", process=False)
        assert np.abs(mesh.vertices - vertices).max() < 1e-4
        assert np.array_equal(mesh.faces, sample().inputs.rig.triangles)
        assert "millimetre; +y up" in (folder / f"{name}.obj").read_text().splitlines()[0]


def test_on_the_artists_file_all_lines_stay_but_those_of_vertices_that_move(artists):
    of, _, written = artists
    rig = of.inputs.rig
    neutral = (of.rig_file / "neutral.obj").read_text().splitlines()
    for path, (_, pose) in zip(written, poses_mm(of.plan, of.inputs), strict=False):
        lines = path.read_text().splitlines()
        changed = [i for i, (was, now) in enumerate(zip(neutral, lines, strict=True)) if was != now]
        moved = set((1 + rig.source_index[np.abs(pose - rig.neutral).max(axis=1) > 0]).tolist())  # after mtllib
        assert set(changed) <= moved
        assert all(lines[i].endswith(" 0.5 0.25 1") for i in changed)
    assert written[0].read_text().splitlines() == neutral


def test_on_the_artists_file_each_pose_is_there_in_its_own_unit_and_axes(artists):
    of, polygons, written = artists
    for path, (name, pose) in zip(written, poses_mm(of.plan, of.inputs), strict=False):
        assert path.stem == name
        mesh = trimesh.load(path, process=False, maintain_order=True)
        at = of.inputs.rig.source_index
        assert len(mesh.vertices) == 3 + len(pose)
        assert len(mesh.faces) == sum(len(polygon) - 2 for polygon in polygons)
        assert np.abs(10 * mesh.vertices[at] - pose @ Z_UP.T).max() < 1e-3
        assert np.allclose(mesh.vertices[:3], [[0, 0, 100], [5, 0, 100], [0, 5, 100]])


def test_the_examples_say_unit_axes_and_file(artists, plain):
    own = json.loads(artists[2][-1].read_text())
    assert (own["unit"], own["unit_mm"], own["up"], own["facing"]) == ("centimetre", 10, "+z", "-y")
    assert own["template_is"] == "neutral.obj"
    ours = json.loads(plain[1][-1].read_text())
    assert (ours["unit"], ours["up"], ours["template_is"]) == ("millimetre", "+y", "the plan's own mesh")


def test_a_ply_folder_keeps_its_polygons(tmp_path):
    of, polygons = as_artists_obj(tmp_path / "rig")
    lines = (of.rig_file / "neutral.obj").read_text().splitlines()
    vertices = [line.split()[1:4] for line in lines if line.startswith("v ")]
    head = (
        f"ply\nformat ascii 1.0\nelement vertex {len(vertices)}\nproperty float x\nproperty float y\nproperty float z\n"
    )
    head += f"element face {len(polygons)}\nproperty list uchar int vertex_indices\nend_header\n"
    rows = [*(" ".join(v) for v in vertices), *(f"{len(p)} {' '.join(map(str, p))}" for p in polygons)]
    (of.rig_file / "neutral.ply").write_text(head + "\n".join(rows) + "\n")
    (of.rig_file / "neutral.obj").unlink()
    neutral = write(of, tmp_path)[0].read_text().splitlines()
    assert [line for line in neutral if line.startswith("f")] == [
        "f " + " ".join(str(i + 1) for i in polygon) for polygon in polygons
    ]
    assert "unit: centimetre; +z up" in neutral[0]


def test_expression_i_is_on_frame_i_and_the_weights_agree_in_both_files(plain):
    folder, _ = plain
    names, expressions = sample().plan.audit.used, sample().plan.in_session
    rows = list(csv.DictReader((folder / "keyframes.csv").open(newline="", encoding="utf-8")))
    examples = json.loads((folder / "examples.json").read_text())["examples"]
    assert [row["frame"] for row in rows] == [str(k) for k in range(len(expressions) + 1)]
    assert not any(float(rows[0][name]) for name in names)
    for expression, row, example in zip(expressions, rows[1:], examples, strict=True):
        assert {name: float(row[name]) for name in names if float(row[name])} == expression.pose
        assert example["weights"] == expression.pose
        assert example["frame"] == int(row["frame"])


def test_decimal_commas_stay():
    text = b"v 0,5 1,5 2\nv 3,25 4 5\nf 1 2 1\n"
    moved = np.array([[0.5, 1.5, 2], [3.5, 4, 5]])
    assert replaced_vertices(text, moved, np.array([1]), 2) == b"v 0,5 1,5 2\nv 3,50 4,00 5,00\nf 1 2 1\n"


def test_a_rig_of_another_format_is_said_to_be_on_the_plans_mesh(tmp_path):
    heard = []
    (tmp_path / "head.glb").write_bytes(b"glTF")
    of = replace(sample(), inputs=PlanInputs(sample().inputs.rig), rig_file=tmp_path / "head.glb")
    with listen(heard.extend):
        write(of, tmp_path)
    assert "head.glb is no folder of OBJ or PLY files" in " ".join(heard)
