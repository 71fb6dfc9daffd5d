"""C3D files read back by ezc3d and by the pure-Python package c3d."""

import sys

import c3d
import ezc3d
import numpy as np
import pytest

from capture_plan.errors import PlanError
from capture_plan.exports.c3d import LONGEST, write
from tests.exports.deliveries import Z_UP, badly_named, posed_dots, sample


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    (path,) = write(sample(), tmp_path_factory.mktemp("c3d"))
    return path


def strings(parameters, name):
    """A parameter and what goes on in NAME2, NAME3."""
    more = (f"{name}{number}" for number in range(2, 9) if f"{name}{number}" in parameters)
    return [text for each in (name, *more) for text in parameters[each]["value"]]


def test_ezc3d_reads_the_neutral_and_each_expression_in_order_z_up(path):
    read = ezc3d.c3d(str(path))
    frames = read["data"]["points"][:3].transpose(2, 1, 0)
    assert np.abs(frames - posed_dots(sample()) @ Z_UP.T).max() < 0.01
    point = read["parameters"]["POINT"]
    assert point["UNITS"]["value"] == ["mm"]
    assert (point["X_SCREEN"]["value"], point["Y_SCREEN"]["value"]) == (["+X"], ["+Z"])
    assert tuple(point["LABELS"]["value"]) == sample().names
    assert read["parameters"]["POSES"]["NAMES"]["value"] == list(sample().poses)
    assert (read["data"]["meta_points"]["residuals"] >= 0).all()


def test_another_reader_finds_the_same_points(path):
    with path.open("rb") as file:
        reader = c3d.Reader(file)
        frames = np.array([points[:, :3] for _, points, _ in reader.read_frames()])
        assert [label.strip() for label in reader.point_labels] == list(sample().names)
        assert reader.point_rate == 1
        assert reader.get("POINT").get("UNITS").string_value.strip() == "mm"
    assert np.abs(frames - posed_dots(sample()) @ Z_UP.T).max() < 0.01


def test_three_hundred_badly_named_markers_are_all_there_each_by_its_own_name(tmp_path):
    of = badly_named(300)
    (path,) = write(of, tmp_path)
    read = ezc3d.c3d(str(path))
    labels = strings(read["parameters"]["POINT"], "LABELS")
    assert len({label.casefold() for label in labels}) == len(labels) == 300
    assert all(label.isascii() and 0 < len(label) <= LONGEST for label in labels)
    assert np.abs(read["data"]["points"][:3].transpose(2, 1, 0) - posed_dots(of) @ Z_UP.T).max() < 0.01
    with path.open("rb") as file:
        assert c3d.Reader(file).point_used == 300


def test_the_same_plan_gives_the_same_bytes(path, tmp_path):
    assert write(sample(), tmp_path)[0].read_bytes() == path.read_bytes()


def test_without_the_library_it_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "ezc3d", None)
    with pytest.raises(PlanError, match=r"pip install 'capture-plan\[c3d\]'"):
        write(sample(), tmp_path)
