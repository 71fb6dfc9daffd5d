"""Blendshapes that were exported wrongly are told by where their vertices lie, go back, and are planned nowhere."""

from dataclasses import replace

import numpy as np
import pytest

from capture_plan.anatomy.agreement import name_doubts
from capture_plan.anatomy.meaning import arkit_by_motion
from capture_plan.audit.audit import audit_rig
from capture_plan.audit.report import audit_text, verdict
from capture_plan.errors import RigError
from capture_plan.face.channels import find_channels, reordered
from capture_plan.face.misexported import misexported
from capture_plan.plan.make import make_plan
from capture_plan.sample import sample_rig

SAMPLE = sample_rig()
X, D = SAMPLE.neutral, SAMPLE.deltas
ODD = SAMPLE.names.index("browDownLeft")


def with_own(positions, k=ODD, rig=SAMPLE):
    """The rig with a blendshape whose vertices lie at these positions."""
    deltas = rig.deltas.copy()
    deltas[k] = positions - rig.neutral
    return replace(rig, deltas=deltas)


def scrambled(count):
    order = np.arange(len(X))
    order[:count] = np.random.default_rng(0).permutation(count)
    return (X + D[ODD])[order]


FAULTS = {
    "displacements": (D[ODD], "holds displacements, not positions"),
    "unit": (0.1 * (X + D[ODD]), "is in another unit (x0.1)"),
    "beside": (X + D[ODD] + [0, 30, 40], "stands beside the neutral (by 50 mm)"),
    "order": (scrambled(200), "has lost its vertex order"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_what_was_exported_wrongly_goes_back_and_is_planned_nowhere(fault):
    positions, words = FAULTS[fault]
    rig = with_own(positions)
    (one,) = misexported(rig)
    assert (one.name, one.fault) == ("browDownLeft", fault)
    found = audit_rig(rig)
    assert found.used == tuple(name for name in audit_rig(SAMPLE).used if name != "browDownLeft")
    assert [one.kind for one in found.apart if one.name == "browDownLeft"] == ["exported wrongly"]
    of_it = [one for one in found.findings if "browDownLeft" in one.blendshapes]
    assert [(one.kind, one.urgency, one.left_out) for one in of_it] == [("export", "stop", True)]
    assert words in of_it[0].message
    page = " ".join(audit_text(found).split())
    assert "browDownLeft cannot be right" in verdict(found)
    assert "exchange these names" not in page
    assert "head's own markers" not in page
    assert "browDownRight has no partner" not in page
    assert arkit_by_motion(rig, "browDownLeft") is None
    assert name_doubts(rig) == ()


@pytest.mark.parametrize("place", [[0, 0, 0], [0, -700, 0], [300, 100, -50]])
@pytest.mark.parametrize("fault", ["displacements", "unit", "beside"])
def test_a_fault_is_told_wherever_the_head_stands_in_its_file(place, fault):
    x = X + place
    rig = replace(SAMPLE, neutral=x)
    positions = {"displacements": D[ODD], "unit": 25.4 * (x + D[ODD]), "beside": x + D[ODD] - [60, 0, 0]}[fault]
    assert [one.fault for one in misexported(with_own(positions, rig=rig))] == [fault]


def test_several_with_one_fault_are_told_at_once():
    rig = replace(SAMPLE, deltas=(D - X).astype(np.float32))
    found = audit_rig(rig)
    assert found.used == ()
    (finding,) = [one for one in found.findings if one.kind == "export"]
    assert "blendshapes hold displacements, not positions" in finding.message
    assert set(finding.blendshapes) == set(SAMPLE.names)
    assert verdict(found).startswith("No: every blendshape was exported wrongly")
    with pytest.raises(RigError, match="hold displacements, not positions"):
        make_plan(rig)


def test_nothing_of_a_face_is_taken_for_a_wrong_export():
    assert misexported(SAMPLE) == ()
    assert misexported(replace(SAMPLE, deltas=3 * D)) == ()


@pytest.mark.parametrize("name", ["head_up", "hide_head"])
def test_heads_that_move_or_hide_by_name_are_no_wrong_export(name):
    rig = with_own(X + np.array([0, 40, 0]) if name == "head_up" else 0 * X)
    assert misexported(replace(rig, names=(*SAMPLE.names[:ODD], name, *SAMPLE.names[ODD + 1 :]))) == ()


def test_a_head_that_bends_its_neck_or_slipped_a_little_was_exported_right():
    fades = np.clip((X[:, 1] - X[:, 1].min()) / (0.6 * np.ptp(X[:, 1])), 0, 1)[:, None]
    assert misexported(with_own(X + fades * [0, 0, 50])) == ()
    assert misexported(with_own(X + D[ODD] + [0, 0, 5])) == ()
    assert misexported(with_own(1.3 * X)) == ()


ORDERS = {
    "by chance": np.random.default_rng(1).permutation(len(X)),
    "by height": np.argsort(X[:, 1]),
    "part after part": np.argsort(-SAMPLE.parts, kind="stable"),
    "backwards": np.arange(len(X))[::-1],
}


@pytest.mark.parametrize("order", ORDERS)
def test_a_file_in_another_vertex_order_is_told_and_finds_no_face(order):
    """Neighbours of a whole mesh in another order may move alike; its edges are longer all the same."""
    jaw = SAMPLE.names.index("jawOpen")
    rig = with_own((X + D[jaw])[ORDERS[order]], k=jaw)
    assert [(one.name, one.fault) for one in misexported(rig)] == [("jawOpen", "order")]
    channels = find_channels(X, rig.triangles, rig.deltas, rig.names)
    assert channels.weight[jaw] == 0


def test_a_neutral_in_another_vertex_order_is_told():
    order = ORDERS["by chance"]
    triangles, deltas = np.argsort(order)[SAMPLE.triangles].astype(np.int32), (X + D - X[order]).astype(np.float32)
    rig = replace(SAMPLE, neutral=X[order], triangles=triangles, deltas=deltas, parts=SAMPLE.parts[order])
    assert {one.fault for one in misexported(rig)} == {"order"}
    assert len(misexported(rig)) == len(SAMPLE.names)


def test_exaggerated_and_larger_faces_keep_their_order():
    assert not reordered(X, SAMPLE.triangles, 3 * D).any()
    assert not reordered(X, SAMPLE.triangles, np.stack([3 * X, 0 * X])).any()
