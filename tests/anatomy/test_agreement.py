"""Names are believed where the motion agrees, and said not to be where it does not."""

from dataclasses import replace

import msgspec
import numpy as np
import pytest

from capture_plan.anatomy import agreement
from capture_plan.anatomy.agreement import agreed_meanings, name_doubts
from capture_plan.anatomy.meaning import arkit_by_motion
from capture_plan.audit.audit import audit_rig
from capture_plan.face.of_rig import rig_channels
from capture_plan.face.reading import face_reading
from capture_plan.mesh import vertex_areas
from capture_plan.rig.understood import Eyes


def renamed(rig, **names):
    return replace(rig, names=tuple(names.get(name, name) for name in rig.names))


def test_every_name_of_the_sample_is_believed(rig):
    assert name_doubts(rig) == ()
    assert all(agreed_meanings(rig).values())


def test_house_names_of_right_motion_are_believed(rig):
    names = {"eyeBlinkLeft": "Fcl_EYE_Close_L", "jawOpen": "あ", "browInnerUp": "brow_raise", "mouthPucker": "viseme_U"}
    named = renamed(rig, **names)
    assert name_doubts(named) == ()
    assert agreed_meanings(named)["Fcl_EYE_Close_L"].arkit == ("eyeBlinkLeft",)


@pytest.mark.parametrize(
    ("moves", "says", "why"),
    [
        ("mouthSmileLeft", "blink_left", "at the mouth"),
        ("eyeBlinkRight", "Fcl_MTH_A", "at the eyes"),
        ("browDownLeft", "brow_raise_L", "moves down"),
    ],
)
def test_a_name_that_the_motion_speaks_against_is_not_believed_and_said(rig, moves, says, why):
    named = renamed(rig, **{moves: says})
    assert face_reading(named).eyes.sure
    (doubt,) = name_doubts(named)
    assert doubt.name == says
    assert why in doubt.message
    assert agreed_meanings(named)[says] is None
    found = audit_rig(named)
    assert doubt.message in [finding.message for finding in found.findings if finding.kind == "name"]
    assert next(one.words for one in found.details if one.name == says) == ""


def test_the_users_own_word_is_believed(rig):
    named = replace(renamed(rig, mouthSmileLeft="blink_left"), meanings=(("blink_left", "mouthSmileLeft"),))
    assert name_doubts(named) == ()
    assert agreed_meanings(named)["blink_left"].name == "mouthSmileLeft"


def test_nothing_is_doubted_where_the_face_is_not_sure(rig, monkeypatch):
    named, read = renamed(rig, mouthSmileLeft="blink_left"), face_reading(rig)
    monkeypatch.setattr(
        agreement, "face_reading", lambda _: msgspec.structs.replace(read, eyes=Eyes(None, None, sure=False))
    )
    assert name_doubts(named) == ()


def test_what_a_house_name_does_is_told_in_arkits_words_only_where_the_motion_agrees(rig):
    right = renamed(rig, eyeBlinkLeft="Fcl_EYE_Close_L", mouthSmileLeft="l_smile")
    assert [arkit_by_motion(right, name) for name in ("Fcl_EYE_Close_L", "l_smile")] == [
        "eyeBlinkLeft",
        "mouthSmileLeft",
    ]
    assert arkit_by_motion(renamed(rig, mouthSmileLeft="Fcl_EYE_Close_L"), "Fcl_EYE_Close_L") is None


def test_a_few_large_triangles_do_not_say_where_an_eye_moves(rig):
    """Four vertices of a neck that a blink drags along, with more area than two lids have."""
    deltas = rig.deltas.copy()
    mouth = face_reading(rig).mouth.at[1]
    area = vertex_areas(rig.neutral, rig.triangles) * (rig.neutral[:, 1] < mouth - 60)
    blink = rig.names.index("eyeBlinkLeft")
    stray = area.argsort()[-4:]
    neutral = rig.neutral.copy()
    neutral[stray] += [0, 0, -60]
    deltas[blink, stray] = [0, -12, 0]
    assert name_doubts(replace(rig, neutral=neutral, deltas=deltas)) == ()


def test_a_brow_that_rises_at_one_end_is_not_said_to_move_down(rig):
    deltas, row = rig.deltas.copy(), {name: k for k, name in enumerate(rig.names)}
    inner = np.where(np.abs(rig.neutral[:, :1]) < 8, 3.0, 0) * deltas[row["browInnerUp"]]
    deltas[row["browInnerUp"]] = inner - 2.4 * (deltas[row["browOuterUpLeft"]] + deltas[row["browOuterUpRight"]])
    tilted = renamed(replace(rig, deltas=deltas), browInnerUp="eye_brow_up")
    assert rig_channels(tilted).direction[row["browInnerUp"], 1] < -0.4
    assert name_doubts(tilted) == ()
