"""Eyes look one way: partners, sentences and sides of gaze come from what turns, whatever names say."""

import re
from dataclasses import replace

import numpy as np
import pytest

from capture_plan.anatomy.gaze import gazes
from capture_plan.anatomy.meaning import arkit_by_motion
from capture_plan.expressions.compatibility import performed_together
from capture_plan.expressions.pack import pack
from capture_plan.expressions.sentences import phrases, sentence
from capture_plan.expressions.settings import PackingSettings
from capture_plan.face.anchors import eyeballs
from tests.light import light_sample

SAMPLE = light_sample()
TRUTH = ("eyeLookInLeft", "eyeLookInRight", "eyeLookOutLeft", "eyeLookOutRight", "eyeLookUpLeft", "eyeLookUpRight")
TRUTH += ("eyeBlinkLeft", "eyeBlinkRight", "jawLeft", "jawOpen", "jawRight", "mouthSmileLeft", "mouthSmileRight")
LEFT, RIGHT = ("eyeLookOutLeft", "eyeLookInRight"), ("eyeLookInLeft", "eyeLookOutRight")


def with_only(names):
    return replace(SAMPLE, names=names, deltas=SAMPLE.deltas[[SAMPLE.names.index(name) for name in names]])


def exchanged(name, *words):
    a, b = words
    return name.replace(a, "?").replace(b, a).replace("?", b)


def mirrored(rig):
    flip = np.array([-1, 1, 1])
    return replace(
        rig,
        neutral=rig.neutral * flip,
        deltas=rig.deltas * flip.astype(np.float32),
        triangles=rig.triangles[:, ::-1].copy(),
    )


def without_moving_balls(rig):
    balls = np.any(eyeballs(rig), axis=0)
    return replace(rig, deltas=rig.deltas * ~balls[:, None])


def without_balls(rig):
    retained = ~np.any(eyeballs(rig), axis=0)
    number = np.cumsum(retained) - 1
    return replace(
        rig,
        neutral=rig.neutral[retained],
        triangles=number[rig.triangles[retained[rig.triangles].all(axis=1)]],
        deltas=rig.deltas[:, retained],
        skin=rig.skin[retained],
        parts=rig.parts[retained],
        source_index=rig.source_index[retained],
    )


NAMES = {
    "right": lambda name: name,
    "in and out exchanged": lambda name: exchanged(name, "In", "Out"),
    "in and out exchanged on one side": lambda name: exchanged(name, "In", "Out") if "Left" in name else name,
    "left and right exchanged": lambda name: exchanged(name, "Left", "Right"),
    "left out": lambda name: f"shape{TRUTH.index(name)}",
}
SHAPES = {
    "eyeballs turn": lambda rig: rig,
    "eyeballs rest": without_moving_balls,
    "eyeballs absent": without_balls,
    "mirrored": mirrored,
}


def variant(names, shape, truth=TRUTH):
    """A rig whose blendshapes are called something else or that is built otherwise, and what each really does."""
    rig = SHAPES[shape](with_only(truth))
    called = tuple(NAMES[names](name) for name in truth)
    does = tuple(exchanged(name, "Left", "Right") for name in truth) if shape == "mirrored" else truth
    return replace(rig, names=called), dict(zip(called, does, strict=True))


@pytest.mark.parametrize(
    ("names", "shape", "paired"),
    [
        *((names, shape, True) for names in NAMES for shape in SHAPES),
        *((names, next(iter(SHAPES)), False) for names in NAMES),
    ],
)
def test_no_expression_turns_both_eyes_outwards_and_sentences_say_the_way_that_is_seen(names, shape, paired):
    rig, does = variant(names, shape)
    for expression in pack(rig, rig.names, PackingSettings(method="greedy", paired=paired)).expressions:
        shown = {does[name] for name in expression.blendshapes}
        assert not {"eyeLookOutLeft", "eyeLookOutRight"} <= shown
        assert not re.search(r"(eyes|eyelids) (up and |down and )?outwards", expression.sentence)
        for pair, way in ((LEFT, "left"), (RIGHT, "right")):
            if paired:
                assert len(shown & set(pair)) in (0, 2)
            assert (f"ook to your {way} with your eyes" in expression.sentence) == (set(pair) <= shown)


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("names", NAMES)
def test_a_look_that_has_no_partner_is_performed_alone(names, shape):
    rig, does = variant(names, shape, tuple(name for name in TRUTH if not name.startswith("eyeLookIn")))
    paired = {does[name] for pair in performed_together(rig, rig.names) for name in pair}
    assert not paired & {"eyeLookOutLeft", "eyeLookOutRight"}
    for expression in pack(rig, rig.names, PackingSettings(method="greedy")).expressions:
        assert not {"eyeLookOutLeft", "eyeLookOutRight"} <= {does[name] for name in expression.blendshapes}


def test_no_phrase_turns_both_eyes_outwards():
    table, together = phrases()
    assert not any("eyes out" in phrase for phrase in [entry["both"] for entry in table.values()])
    assert not any("eyes out" in phrase for _, phrase in together)
    assert "then" in sentence(SAMPLE, ("eyeLookOutLeft", "eyeLookOutRight"))


@pytest.mark.parametrize("names", [name for name in NAMES if name != "left out"])
def test_sides_and_directions_of_a_name_follow_the_motion(names):
    rig, does = variant(names, "eyeballs turn")
    assert {name: arkit_by_motion(rig, name) for name in rig.names} == does


def test_looks_up_are_told_by_eyeballs_and_blinks_are_no_looks():
    rig, does = variant("left out", "eyeballs turn")
    found = {does[name]: (gaze.eye, gaze.way) for name, gaze in gazes(rig).items()}
    assert set(found) == {name for name in TRUTH if name.startswith("eyeLook")}
    assert found["eyeLookUpLeft"] == (1, "up")
    assert found["eyeLookInLeft"] == (1, "right")


def test_a_shape_that_turns_both_eyes_one_way_is_a_look_of_both():
    rig = with_only(("eyeLookOutLeft", "eyeLookInRight", "jawOpen"))
    both = replace(rig, names=("a", "jawOpen"), deltas=np.stack([rig.deltas[0] + rig.deltas[1], rig.deltas[2]]))
    assert [(gaze.eye, gaze.way) for gaze in gazes(both).values()] == [(0, "left")]


def test_twice_as_strong_looks_find_their_like():
    rig = with_only((*LEFT, *RIGHT))
    k = rig.rows(LEFT)
    more = replace(
        rig, names=(*rig.names, "farLeft", "farRight"), deltas=np.concatenate([rig.deltas, 2 * rig.deltas[k]])
    )
    assert {LEFT, RIGHT, ("farLeft", "farRight")} == set(performed_together(more, more.names))


def test_eyes_that_turn_under_lids_that_close_are_told_no_look():
    rows = [SAMPLE.names.index(name) for name in ("eyeBlinkLeft", "eyeBlinkRight", "eyeLookDownRight")]
    shut = replace(SAMPLE, names=(*SAMPLE.names, "eye_close"),
                   deltas=np.concatenate([SAMPLE.deltas, SAMPLE.deltas[rows].sum(axis=0)[None]]))  # fmt: skip
    assert arkit_by_motion(shut, "eye_close") is None
    assert "turn" not in sentence(shut, ("eye_close",)).lower()
    assert arkit_by_motion(replace(shut, names=(*SAMPLE.names, "shape_9")), "shape_9") is None  # one turns, both close


def rocking(rig, shape, which, degrees=6.0):
    """The rig with its blendshape `shape` turning the balls `which` about their middles, to the side."""
    deltas, k = rig.deltas.copy(), rig.names.index(shape)
    for ball in which:
        r = rig.neutral[ball] - rig.neutral[ball].mean(axis=0)
        deltas[k, ball] = np.cross(np.radians([0, degrees, 0]), r)
    return replace(rig, deltas=deltas)


def both_lids_closing():
    """The sample whose first blendshape closes both eyes and has a name that says nothing."""
    rig = with_only(TRUTH)
    blinks = rig.deltas[[rig.names.index(name) for name in ("eyeBlinkLeft", "eyeBlinkRight")]].sum(axis=0)
    return replace(rig, names=("eye_V", *rig.names), deltas=np.concatenate([blinks[None], rig.deltas]))


def test_one_ball_that_rocks_while_both_lids_close_is_no_look():
    rig = both_lids_closing()
    balls = eyeballs(rig)[:2]
    assert "eye_V" not in gazes(rocking(rig, "eye_V", balls[:1]))
    assert gazes(rocking(rig, "eye_V", balls))["eye_V"].eye == 0
    assert gazes(rocking(rig, "eyeBlinkLeft", [min(balls, key=lambda one: -rig.neutral[one, 0].mean())]))[
        "eyeBlinkLeft"
    ].eye == 1  # fmt: skip


@pytest.mark.parametrize(("shrunk", "away"), [(1.0, 60.0), (0.1, 0.0)])
def test_a_bead_and_a_speck_are_no_eyeballs(shrunk, away):
    rig = both_lids_closing()
    neutral = rig.neutral.copy()
    balls = eyeballs(rig)[:2]
    for ball in balls:
        middle = neutral[ball].mean(axis=0)
        neutral[ball] = middle + shrunk * (neutral[ball] - middle) + [0, away, 0]
    deltas = rig.deltas * ~np.any(balls, axis=0)[:, None]
    moved = rocking(replace(rig, neutral=neutral, deltas=deltas), "eye_V", balls)
    assert "eye_V" not in gazes(moved)
