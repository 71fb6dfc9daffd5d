"""Markers for a take without a rig, from the command line: sheets, table and layout in the take's own numbers."""

import csv
import json
import sys

import numpy as np
import pypdfium2
import pytest

from capture_plan.cli import main
from capture_plan.curves.frames import PosedFrames
from capture_plan.errors import RigError
from capture_plan.exports.expression_meshes import obj_bytes
from capture_plan.layout.settings import LayoutSettings
from capture_plan.layout.take_without_rig import layout_from_take, on_scan
from capture_plan.sample import sample_rig
from capture_plan.sequence import Sequence, read_sequence
from tests.light import light_sample

NUMBER, FRAMES = 12, 24


@pytest.fixture(scope="module")
def scan():
    """Frames and triangles of the skin of a face, as a scanner has them: no blendshapes, no eyes."""
    rig, rng = light_sample(), np.random.default_rng(4)
    w = np.zeros((FRAMES, len(rig.names)))
    for row in w[1:]:
        row[rng.choice(len(rig.names), 4, replace=False)] = rng.uniform(0, 1, 4)
    used, corners = np.unique(rig.triangles[rig.skin[rig.triangles].all(axis=1)], return_inverse=True)
    return np.stack([rig.pose(row)[used] for row in w]), corners.reshape(-1, 3)


@pytest.fixture(scope="module")
def folder(scan, tmp_path_factory):
    """The same take as an archive and as numbered OBJ files; `face.txt` lists the vertices below the brows."""
    folder = tmp_path_factory.mktemp("scans")
    frames, triangles = scan
    np.savez(folder / "scan.npz", frames=frames, faces=triangles, units=np.array("mm"))
    (folder / "objs").mkdir()
    for t, frame in enumerate(frames):
        (folder / "objs" / f"take.{t:04}.obj").write_bytes(obj_bytes(frame, triangles))
    (folder / "face.txt").write_text(" ".join(map(str, np.flatnonzero(frames[0][:, 1] < BROWS))))
    return folder


BROWS = 740.0  # millimetres, of the sample


@pytest.fixture
def run(folder, monkeypatch, capsys):
    """The command as a person types it in the folder: exit code and what it says."""

    def typed(*arguments):
        monkeypatch.chdir(folder)
        monkeypatch.setattr(sys, "argv", ["capture-plan", *map(str, arguments)])
        with pytest.raises(SystemExit) as left:
            main()
        said = capsys.readouterr()
        return left.value.code, said.out + said.err

    return typed


AS_IT_IS = ["--unit-mm", 1, "--up", "+y", "--facing", "+z", "--dpi", 72]


def written(folder):
    layout = json.loads((folder / "layout.json").read_text())
    rows = list(csv.DictReader((folder / "landmarks.csv").read_text().splitlines()))
    return layout, rows, pypdfium2.PdfDocument(folder / "sheets" / "sheets.pdf")


@pytest.mark.parametrize("take", ["scan.npz", "objs"])
def test_a_take_becomes_sheets_a_table_and_a_layout_in_its_own_numbers(run, folder, scan, tmp_path, take):
    code, message = run("markers", take, "--number", NUMBER, "-o", tmp_path, "--faces", 3000, *AS_IT_IS)
    assert code == 0, message
    layout, rows, pdf = written(tmp_path)
    frames, triangles = scan
    assert len(rows) == len(layout["landmarks"]) == NUMBER
    for row, mark in zip(rows, layout["landmarks"], strict=True):
        place = [float(row[axis]) for axis in ("x_mm", "y_mm", "z_mm")]
        assert frames[0][int(row["vertex_in_file"])] == pytest.approx(place, abs=2e-3)
        corners = frames[0][triangles[mark["triangle"]]]
        assert np.array(mark["barycentric"]) @ corners == pytest.approx(place, abs=2e-3)
        assert "frame_" in row["frames"] or not row["frames"]
    pages = [pdf[i].get_textpage().get_text_range() for i in range(len(pdf))]
    assert len(pages) == len(list((tmp_path / "sheets" / "pages").glob("*.png"))) == len(pages)
    error = f"{layout['motion']['rmse_mm']:.2f} mm"
    assert all(f"{NUMBER} dots of 3 mm" in page for page in pages[:-1])
    for said in (f"{NUMBER} markers for the take", f"{FRAMES} frames", error):
        assert said in pages[-1]
    assert all(f"{int(row['vertex_in_file']):,}" in pages[-1] and row["name"] in pages[-1] for row in rows)
    assert error in message
    assert "rank" in message


def test_an_archive_and_its_obj_files_get_the_same_markers(run, folder, tmp_path):
    found = []
    for take in ("scan.npz", "objs"):
        run("markers", take, "--number", NUMBER, "-o", tmp_path / take, *AS_IT_IS)
        found.append([row["vertex_in_file"] for row in written(tmp_path / take)[1]])
    assert found[0] == found[1]


def test_markers_keep_to_the_skin_that_was_listed(run, scan, tmp_path):
    asked = ["markers", "scan.npz", "--number", NUMBER, "-o", tmp_path, *AS_IT_IS, "--skin", "face.txt"]
    assert run(*asked)[0] == 0
    assert all(scan[0][0][int(row["vertex_in_file"]), 1] < BROWS for row in written(tmp_path)[1])


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["nowhere", "--number", 9], "nowhere does not exist"),
        (["scan.npz", "--number", 0], "number"),
        (["scan.npz", "--number", 9, "--skin", "cheeks"], "'cheeks' is no file"),
        (["scan.npz", "--number", 9, "--skin", "far.txt"], "names no vertex"),
        (["scan.npz", "--number", 9, "--skin", "one.txt"], "no triangle"),
        (["scan.npz", "--number", 9, "--spacing-mm", 90], "9"),
        (["scan.npz", "--number", 9, "--faces", 0], "triangles"),
        (["still.npz", "--number", 9], "moves"),
        (["weights.npz", "--number", 9], "weights"),
        (["scan.npz", "--number", 9, "--dpi", 5], "dpi"),
    ],
)
def test_what_cannot_be_marked_is_said_in_one_line_and_nothing_written(run, folder, scan, arguments, says):
    (folder / "far.txt").write_text("9000000")
    (folder / "one.txt").write_text("12")
    np.savez(folder / "still.npz", frames=np.repeat(scan[0][:1], 3, axis=0), faces=scan[1], units=np.array("mm"))
    np.savez(folder / "weights.npz", weights=np.zeros((4, 2)), names=np.array(["a", "b"]))
    code, message = run("markers", *arguments, "--unit-mm", 1, "--up", "+y", "--facing", "+z", "-o", folder / "out")
    assert code == 2
    assert len(message.strip().splitlines()) == 1
    assert says in message
    assert not (folder / "out").exists()


@pytest.mark.parametrize("triangles", [50_000, 3_000])
def test_a_coarser_mesh_keeps_landmarks_on_vertices_of_the_scan(folder, triangles):
    sequence = read_sequence(folder / "scan.npz", unit_mm=1.0, up="+y", facing="+z")
    asked = LayoutSettings(method="motion", number=NUMBER)
    layout, rig = layout_from_take(sequence, asked, triangles=triangles)
    assert len(layout.landmarks) == NUMBER
    assert len(rig.triangles) <= triangles
    mine = on_scan(layout, sequence)
    for coarse, m in zip(layout.landmarks, mine.landmarks, strict=True):
        assert rig.neutral[coarse.vertex] == pytest.approx(coarse.position, abs=1e-3)
        assert sequence.neutral[m.vertex] == pytest.approx(m.position, abs=1e-3)
        assert m.vertex == coarse.source_vertex == m.source_vertex
        assert m.vertex in sequence.triangles[m.triangle]
    assert 0 < layout.motion.rmse_mm < 3
    assert layout.motion.frames == FRAMES


def test_a_take_with_a_rig_is_sent_to_the_plan():
    rig = sample_rig()
    played = Sequence("played", rig.neutral, rig.triangles, PosedFrames(rig, np.eye(52)[:9]), 30.0, rig)
    with pytest.raises(RigError, match="blendshapes of its own"):
        layout_from_take(played, LayoutSettings(method="motion", number=9), triangles=1000)
