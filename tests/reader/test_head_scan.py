"""Reading a head: every kind of file gives the same surface; what is none is refused in one line."""

import numpy as np
import pytest
import trimesh

from capture_plan.errors import RigError
from capture_plan.mesh.nearest import nearest_on_surface
from capture_plan.reader.head_scan import HEAD_FORMATS, read_head


@pytest.fixture(scope="module")
def ball():
    return trimesh.creation.icosphere(3, 11.0)


@pytest.mark.parametrize("ending", HEAD_FORMATS)
def test_every_kind_of_file_gives_the_same_surface(ball, tmp_path, ending):
    ball.export(tmp_path / f"anna{ending}")
    head = read_head(tmp_path / f"anna{ending}")
    assert head.name == "anna"
    assert len(head.vertices) == len(ball.vertices)  # welded: STL gives each triangle its own corners
    assert len(head.triangles) == len(ball.faces)
    assert np.linalg.norm(head.vertices, axis=1) == pytest.approx(11, abs=1e-3)
    assert head.units_mm[0] == 10.0


@pytest.mark.parametrize(
    ("name", "content", "says"),
    [
        ("head.obj", b"", "cannot be read|holds points"),
        ("head.ply", b"ply\nformat ascii 1.0\nelement vertex 9999999999\n", "cannot be read"),
        ("head.stl", b"\xff" * 200, "cannot be read|holds"),
        ("head.glb", b"glTF" + b"\0" * 40, "cannot be read"),
        ("head.3mf", b"PK", "cannot be read"),
        ("head.off", b"OFF\n3 1 0\n0 0 0\n1 0 0\nnan 1 0\n3 0 1 2\n", "without triangles|NaN"),
        ("head.obj", b"v 0 0 0\nv 100 0 0\nv 0 100 0\nf 1 2 3\n", "1 triangles, expected 200"),
        ("head.max", b"", "no scan of a known kind: give one of .obj"),
    ],
)
def test_what_is_no_head_is_refused_in_one_line(tmp_path, name, content, says):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(RigError, match=says) as caught:
        read_head(tmp_path / name)
    assert "\n" not in str(caught.value)


def test_a_size_that_no_head_has_asks_for_the_unit(ball, tmp_path):
    mesh = ball.copy()
    mesh.apply_scale(1e6)
    mesh.export(tmp_path / "moon.ply")
    with pytest.raises(RigError, match="say --unit-mm"):
        read_head(tmp_path / "moon.ply")
    assert read_head(tmp_path / "moon.ply", unit_mm=1e-5).units_mm == (1e-5,)


def test_the_nearest_point_of_a_surface_is_that_of_the_nearest_triangle(ball):
    """Asked of all triangles, one after another."""
    points = np.random.default_rng(0).normal(0, 12, (20, 3))
    feet = nearest_on_surface(points, ball.vertices, ball.faces)
    for point, foot in zip(points, feet, strict=True):
        every = trimesh.triangles.closest_point(ball.triangles, np.repeat(point[None], len(ball.faces), axis=0))
        assert np.linalg.norm(foot - point) == pytest.approx(np.linalg.norm(every - point, axis=1).min())
