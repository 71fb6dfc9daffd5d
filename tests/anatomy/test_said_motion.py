"""Names exchanged for each other are noticed by what moves, and no true name is disbelieved."""

from dataclasses import replace

import numpy as np
import pytest

from capture_plan.anatomy.agreement import name_doubts
from capture_plan.anatomy.meaning import arkit_by_motion
from capture_plan.anatomy.said_motion import CLAIMS, instead, measures
from capture_plan.audit.audit import audit_rig
from capture_plan.audit.report import audit_text
from capture_plan.expressions.sentences import phrases, sentence
from capture_plan.names.arkit import base_name
from capture_plan.reader.read import rig_from_raw
from capture_plan.sample import sample_rig
from tests.face.test_face_invariance import decimated, mirrored, noisy, renumbered, rig, scaled, turned

SAMPLE = sample_rig()
OPPOSED = [
    ("eyeBlink", "eyeWide"),
    ("browDown", "browOuterUp"),
    ("mouthSmile", "mouthFrown"),
    ("mouthUpperUp", "mouthLowerDown"),
    ("mouthRollUpper", "mouthRollLower"),
    ("mouthShrugUpper", "mouthShrugLower"),
    ("jawOpen", "cheekPuff"),
    ("noseSneer", "cheekSquint"),
]


def exchanged(a, b):
    """The sample with the names of two movements exchanged, on both sides."""
    swap = {a: b, b: a}
    names = (name.replace(base, swap[base]) if (base := base_name(name)) in swap else name for name in SAMPLE.names)
    return replace(SAMPLE, names=tuple(names))


def added(name, *parts):
    """The sample and one more blendshape, a sum of (its name, weight)."""
    new = np.sum([weight * SAMPLE.deltas[SAMPLE.names.index(part)] for part, weight in parts], axis=0)
    return replace(SAMPLE, names=(*SAMPLE.names, name), deltas=np.concatenate([SAMPLE.deltas, new[None]]))


@pytest.mark.parametrize("pair", OPPOSED, ids="-".join)
def test_two_opposed_names_that_were_exchanged_are_both_noticed(pair):
    named = exchanged(*pair)
    wrong = {name for name in named.names if base_name(name) in pair}
    assert {doubt.name for doubt in name_doubts(named)} == wrong
    assert {arkit_by_motion(named, name) for name in wrong} == {None}
    asked = [entry[key] for base in pair if (entry := phrases()[0][base]) for key in ("both", "one") if key in entry]
    asked = [phrase.format(side=side) for phrase in asked for side in ("left", "right")]
    assert not any(phrase in sentence(named, (name,)).lower() for name in wrong for phrase in asked)


def test_a_sneer_on_a_puffed_cheek_is_noticed():
    named = replace(SAMPLE, names=tuple({"cheekPuff": "noseSneerLeft", "noseSneerLeft": "cheekPuff"}.get(name, name)
                                        for name in SAMPLE.names))  # fmt: skip
    assert {doubt.name for doubt in name_doubts(named)} == {"cheekPuff", "noseSneerLeft"}


@pytest.mark.parametrize(
    "change", [renumbered, turned, mirrored, scaled, decimated, noisy], ids=lambda change: change.__name__
)
def test_every_true_name_is_believed_however_the_file_is_made(change):
    assert name_doubts(rig_from_raw(change(*rig("sample"))[0])) == ()


def test_a_smile_that_opens_the_mouth_is_a_smile_though_its_corners_go_down():
    wide = added("smile_open", ("mouthUpperUpLeft", 1), ("mouthUpperUpRight", 1), ("mouthFrownLeft", 0.5),
                 ("mouthFrownRight", 0.5), ("jawOpen", 0.3))  # fmt: skip
    assert measures(wide)["lowers"][-1] < -0.3
    assert "smile_open" not in {doubt.name for doubt in name_doubts(wide)}


def test_a_raised_cheek_goes_up():
    assert "cheek_raise_b" in {doubt.name for doubt in name_doubts(added("cheek_raise_b", ("cheekPuff", 1)))}


@pytest.mark.parametrize("base", CLAIMS)
def test_what_says_nothing_speaks_against_no_name(base):
    assert instead(base, {}) is None
    assert instead(base, dict.fromkeys((claim.measure for claim in CLAIMS[base]), np.nan)) is None


@pytest.mark.parametrize("base", CLAIMS)
def test_a_measure_that_is_not_clear_speaks_against_what_must_be_seen_alone(base):
    for claim in CLAIMS[base]:
        alone = instead(base, {claim.measure: 0.0})
        assert alone == (claim.instead if claim.least > 0 else None)


def test_measures_do_not_depend_on_how_far_a_blendshape_goes():
    half = replace(SAMPLE, deltas=SAMPLE.deltas / 2)
    for measure, values in measures(SAMPLE).items():
        np.testing.assert_allclose(measures(half)[measure], values, atol=1e-3)


def test_cheeks_that_stay_behind_neither_puff_nor_rise():
    for name in ("cheek_puff_b", "cheek_raise_b"):
        assert name in {doubt.name for doubt in name_doubts(added(name, ("mouthRollLower", 1)))}


def test_what_moves_no_skin_says_nothing():
    still = added("cheek_puff_b", ("cheekPuff", 1e-3))
    assert all(np.isnan(values[-1]) for values in measures(still).values())
    assert name_doubts(still) == ()


@pytest.mark.parametrize(
    ("a", "b", "two", "words"),
    [
        ("eyeLookUp", "eyeLookDown", "up and down", "eye looks down (left)"),
        ("eyeLookIn", "eyeLookOut", "in and out", "eye looks away from the nose (left)"),
    ],
)
def test_exchanged_looks_are_said_once_and_the_same_everywhere(a, b, two, words):
    named = exchanged(a, b)
    found = audit_rig(named)
    (finding,) = [one for one in found.findings if one.kind == "name"]
    assert f"{two} are exchanged" in finding.message
    assert finding.urgency == "rigger"
    assert set(finding.blendshapes) == {name for name in named.names if base_name(name) in (a, b)}
    assert arkit_by_motion(named, f"{a}Left") == f"{b}Left"
    assert next(one.words for one in found.details if one.name == f"{a}Left") == words
    text = " ".join(audit_text(found).split())
    assert ("disagree about up and down" in text) == (two == "up and down")
    assert ("disagree about left and right" in text) == (two == "in and out")


def test_lids_say_which_way_an_eye_looks_where_no_ball_is_seen():
    bare = replace(SAMPLE, deltas=SAMPLE.deltas * SAMPLE.skin[:, None])
    assert arkit_by_motion(bare, "eyeLookUpLeft") == "eyeLookUpLeft"
    named = replace(exchanged("eyeLookUp", "eyeLookDown"), deltas=bare.deltas)
    assert arkit_by_motion(named, "eyeLookUpLeft") == "eyeLookDownLeft"


@pytest.mark.parametrize("base", ["jaw", "mouth"])
def test_a_mouth_or_jaw_that_goes_to_the_other_side_is_called_so_in_the_table(base):
    left, right = f"{base}Left", f"{base}Right"
    named = replace(SAMPLE, names=tuple({left: right, right: left}.get(name, name) for name in SAMPLE.names))
    found = audit_rig(named)
    assert "right" in next(one.words for one in found.details if one.name == left)
    assert any("left and right are exchanged" in one.message for one in found.findings if one.kind == "name")
