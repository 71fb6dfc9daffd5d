"""Regions that agree with motion: places beside a line go where what moves them belongs, on the sample's kinds."""

from dataclasses import replace

import numpy as np
import pytest

from capture_plan.anatomy.region_motion import clearly_moved, moved_together, with_the_chin
from capture_plan.anatomy.regions import REGIONS, face_regions
from capture_plan.reader.read import rig_from_raw
from capture_plan.sample import sample_rig
from tests.face_family import Truth, raw_rig
from tests.face_heads import bend, narrow_mouthed, sample_head


def as_rig(head):
    truth = Truth("+y", "+z", 1.0, head.eye_left, head.eye_right, head.mouth)
    return rig_from_raw(raw_rig(head, truth, (1.0, "+y", "+z")))


def low_brows(head):
    """Brows that lie low on the eyes: the skin between brow and lid is drawn together by half."""
    top, eye = 762.0, 741.0

    def f(x):
        y = x[:, 1]
        squeeze = np.where((y > eye) & (y < top), eye + (y - eye) * 0.55, np.where(y >= top, y - 0.45 * (top - eye), y))
        return np.stack([x[:, 0], squeeze, x[:, 2]], axis=1)

    return bend(head, f)


@pytest.fixture(scope="module", params=[lambda head: head, low_brows, narrow_mouthed])
def rig(request):
    return as_rig(request.param(sample_head()))


def test_no_eyelid_moves_with_brows_and_no_brow_with_a_blink(rig):
    regions, clear = face_regions(rig).of_vertex, clearly_moved(rig)
    y = rig.neutral[:, 1] - face_regions(rig).anchors.eye_left[1]
    lids, brows = (regions == REGIONS.index(name) for name in ("upper eyelid", "brow"))
    assert not (lids & clear["brows"] & (y > 7)).any()
    assert not (brows & clear["lids"] & (y < 25)).any()


def test_most_of_what_moves_clearly_lies_where_it_belongs(rig):
    of_vertex, clear = face_regions(rig).of_vertex, clearly_moved(rig)
    belongs = {
        "brows": {"brow", "forehead", "temple", "nose", "upper eyelid", "scalp"},
        "lids": {"upper eyelid", "lower eyelid", "brow", "temple"},
        "jaw": {"lower lip", "chin", "jaw", "neck", "mouth corner", "cheek"},
        "smile": {"mouth corner", "cheek", "upper lip", "lower lip", "jaw", "chin"},
    }
    for group, names in belongs.items():
        at = clear[group] & rig.skin
        assert np.isin(of_vertex[at], [REGIONS.index(name) for name in names]).mean() > 0.95, group


def test_what_a_smile_moves_at_a_narrow_opening_is_a_mouth_corner():
    """An opening that ends inside the lips: the lips' own corner is called so, where the smile moves it."""
    rig = as_rig(narrow_mouthed(sample_head()))
    regions = face_regions(rig)
    a, u = regions.anchors, regions.anchors.pupils
    assert a.corner_left[0] - a.midline < 0.32 * u
    off = rig.neutral - [a.midline + 0.4 * u, a.mouth[1], a.mouth[2]]
    at = rig.skin & (np.abs(off[:, 0]) < 0.05 * u) & (np.abs(off[:, 1]) < 0.05 * u) & clearly_moved(rig)["smile"]
    assert at.any()
    assert {regions.names[i] for i in regions.of_vertex[at]} == {"mouth corner"}


@pytest.mark.parametrize(
    ("called", "moved_by", "becomes"),
    [
        ("upper eyelid", "browOuterUpLeft", "brow"),
        ("brow", "eyeBlinkLeft", "upper eyelid"),
        ("scalp", "browOuterUpLeft", "forehead"),
    ],
)
def test_what_a_movement_moves_most_is_of_its_region_whatever_the_lines_call_it(called, moved_by, becomes):
    rig, anchors = sample_rig(), face_regions(sample_rig()).anchors
    lines = np.full(len(rig.neutral), REGIONS.index(called))
    found = moved_together(rig, lines, REGIONS, anchors)
    moved = np.where(rig.skin, rig.displacement[rig.names.index(moved_by)], 0)
    assert REGIONS[found[moved.argmax()]] == becomes
    assert REGIONS[found[np.linalg.norm(rig.neutral - anchors.chin, axis=1).argmin()]] == called


def test_without_names_the_lines_decide_alone():
    rig = sample_rig()
    unnamed = replace(rig, names=tuple(f"shape_{k}" for k in range(len(rig.names))))
    assert clearly_moved(unnamed) == {}


@pytest.mark.parametrize("named", [True, False])
def test_what_goes_down_with_the_chin_is_no_neck(named):
    rig = sample_rig()
    rig = rig if named else replace(rig, names=tuple(f"shape_{k}" for k in range(len(rig.names))))
    regions = face_regions(rig)
    jaw = rig.displacement[sample_rig().names.index("jawOpen")]
    chin, neck = ((regions.of_vertex == REGIONS.index(name)) & rig.skin for name in ("chin", "neck"))
    near = neck & (np.linalg.norm(rig.neutral - regions.anchors.chin, axis=1) < 30)
    assert (jaw[near] < 0.7 * np.median(jaw[chin])).all()
    assert np.median(jaw[neck]) < 0.1 * np.median(jaw[chin])


def test_a_head_that_bows_makes_no_chin_of_its_neck():
    rig = sample_rig()
    without = [k for k, name in enumerate(rig.names) if "jaw" not in name]
    nods = np.broadcast_to(np.array([0, -20.0, 0], dtype=np.float32), rig.neutral.shape)
    nodding = replace(
        rig,
        names=(*(rig.names[k] for k in without), "nod"),
        deltas=np.concatenate([rig.deltas[without], nods[None]]).astype(np.float32),
    )
    chin = face_regions(rig).of_vertex == REGIONS.index("chin")
    assert not with_the_chin(nodding, chin, face_regions(rig).anchors)[~chin].any()


@pytest.mark.parametrize("narrow", [1.0, 0.6, 0.3])
def test_mouth_corners_are_the_ends_of_the_lips_however_narrow_the_mouth(narrow):
    def squeeze(v):
        x, y, _ = v.T
        near = np.exp(-(((y - 661) / 40) ** 4))
        inner, outer = np.abs(x) <= 30, np.clip((60 - np.abs(x)) / 30, 0, 1)
        return v - np.stack([(1 - narrow) * near * np.where(inner, x, np.sign(x) * 30 * outer), 0 * x, 0 * x], axis=1)

    rig = as_rig(bend(sample_head(), squeeze))
    regions = face_regions(rig)
    corner = (regions.of_vertex == REGIONS.index("mouth corner")) & rig.skin
    assert 0.2 < corner[regions.anchors.lips].mean() < 0.6
