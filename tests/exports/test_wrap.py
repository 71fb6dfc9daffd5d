"""Points for Wrap: on the artist's file, counted and cut as its documentation says."""

import json
from dataclasses import replace

import numpy as np
import pytest

from capture_plan.errors import PlanError
from capture_plan.exports.wrap import wrap_points, write
from tests.exports.deliveries import Z_UP, as_artists_obj, badly_named, dots, sample


def places(points, folder, polygons):
    """P = A u + B v + C (1 - u - v), fans counted one by one over all polygons of the file."""
    lines = (folder / "neutral.obj").read_text().splitlines()
    vertices = [np.array(line.split()[1:4], float) for line in lines if line.startswith("v ")]
    fans = [(p[0], p[k], p[k + 1]) for p in polygons for k in range(1, len(p) - 1)]
    found = []
    for t, u, v in points:
        a, b, c = (vertices[i] for i in fans[t])
        found.append(a * u + b * v + c * (1 - u - v))
    return np.array(found)


def test_points_on_the_artists_file_are_where_the_dots_are(tmp_path):
    of, polygons = as_artists_obj(tmp_path / "rig")
    assert any(len(polygon) == 4 for polygon in polygons)
    (path,) = write(of, tmp_path)
    points = json.loads(path.read_text())
    assert tuple(points) == of.names
    assert np.abs(10 * places(points.values(), of.rig_file, polygons) - dots(of) @ Z_UP.T).max() < 0.01


def test_a_point_inside_a_triangle_keeps_its_weights_whatever_the_corners_order():
    triangles = np.array([[7, 8, 9], [5, 3, 4], [3, 5, 6]])
    assert wrap_points([{3: 0.5, 4: 0.2, 5: 0.3}], triangles) == [(1, 0.3, 0.5)]
    assert wrap_points([{6: 1.0}], triangles) == [(2, 0.0, 0.0)]


def test_names_that_are_alike_stay_apart(tmp_path):
    of, _ = as_artists_obj(tmp_path / "rig")
    of = replace(badly_named(30), inputs=of.inputs, rig_file=of.rig_file)
    (path,) = write(of, tmp_path)
    assert len(json.loads(path.read_text())) == len(of.names) > len(set(of.names))


def test_without_the_artists_polygons_it_says_why_and_what_to_do(tmp_path):
    with pytest.raises(PlanError, match=r"the bundled head .* plan on a folder of OBJ files"):
        write(sample(), tmp_path)
    (tmp_path / "head.glb").write_bytes(b"glTF")
    with pytest.raises(PlanError, match=r"head.glb is no folder of OBJ or PLY files.*export the rig as OBJ"):
        write(replace(sample(), rig_file=tmp_path / "head.glb"), tmp_path)
    assert not list(tmp_path.glob("*.json"))


def test_a_file_of_another_mesh_is_refused():
    with pytest.raises(PlanError, match="no triangle at vertices 9"):
        wrap_points([{9: 1.0}], np.array([[0, 1, 2]]))
