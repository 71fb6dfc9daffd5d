"""The actor's neutral on the rig's mesh."""

import numpy as np
import pytest

from capture_plan.errors import RigError
from capture_plan.reader.neutral import read_neutral


def write_obj(path, vertices):
    path.write_text("".join(f"v {x} {y} {z}\n" for x, y, z in vertices) + "f 1 2 3\n")
    return path


def test_a_neutral_of_the_same_mesh_keeps_its_order(rig, tmp_path):
    taller = rig.neutral * [1, 1.1, 1]
    np.testing.assert_allclose(read_neutral(write_obj(tmp_path / "actor.obj", taller), rig), taller)


def test_of_a_whole_figure_the_vertices_of_the_rig_are_taken(rig, tmp_path):
    figure = np.random.default_rng(0).normal(size=(rig.source_index.max() + 100, 3))
    figure[rig.source_index] = rig.neutral
    np.testing.assert_allclose(read_neutral(write_obj(tmp_path / "figure.obj", figure), rig), rig.neutral)


@pytest.mark.parametrize(
    ("vertices", "says"), [(np.zeros((3, 3)), "has 3 vertices"), (np.full((4939, 3), np.nan), "NaN|number")]
)
def test_what_is_no_neutral_of_this_rig_is_refused(rig, tmp_path, vertices, says):
    with pytest.raises(RigError, match=says):
        read_neutral(write_obj(tmp_path / "actor.obj", vertices), rig)


def test_a_missing_file_is_named(rig, tmp_path):
    with pytest.raises(RigError, match=r"nobody\.obj does not exist"):
        read_neutral(tmp_path / "nobody.obj", rig)
