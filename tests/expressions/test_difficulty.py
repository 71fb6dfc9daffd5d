"""How hard an expression is, and what replaces it where an actor fails."""

import pytest
from msgspec.structs import replace

from capture_plan.expressions.collision import collisions
from capture_plan.expressions.difficulty import difficulty
from capture_plan.expressions.fallback import fallback, is_upper
from capture_plan.expressions.pack import pack
from capture_plan.expressions.sentences import sentence
from capture_plan.expressions.settings import PackingSettings
from capture_plan.sample import sample_rig

RIG = sample_rig()
PACKING = pack(RIG, RIG.names, PackingSettings(method="minimum"))


@pytest.mark.parametrize("expression", PACKING.expressions, ids=lambda e: e.name)
def test_a_level_has_as_many_reasons_as_it_needs(expression):
    found = difficulty(RIG, expression.blendshapes + expression.drivers)
    assert 1 <= found.level <= 5
    assert (found.level == 1) == (found.reasons == ())
    assert len(set(found.reasons)) == len(found.reasons)


def test_more_at_once_is_never_easier():
    names = ("jawLeft", "eyeWideLeft", "eyeWideRight", "noseSneerLeft", "noseSneerRight")
    levels = [difficulty(RIG, names[:count]).level for count in (1, 3, 5)]
    assert levels == sorted(levels)
    assert levels[0] < levels[-1]


def test_one_side_is_harder_than_both_and_left_as_hard_as_right():
    both = difficulty(RIG, ("mouthSmileLeft", "mouthSmileRight"))
    left, right = difficulty(RIG, ("mouthSmileLeft",)), difficulty(RIG, ("mouthSmileRight",))
    assert left == right
    assert left.level == both.level + 1


def test_what_eases_a_movement_takes_its_reason_away():
    alone = difficulty(RIG, ("browInnerUp",))
    eased = difficulty(RIG, ("browInnerUp", "browOuterUpLeft", "browOuterUpRight"))
    assert alone.reasons
    assert not set(alone.reasons) & set(eased.reasons)


def test_the_order_of_blendshapes_does_not_matter():
    names = PACKING.expressions[0].blendshapes
    assert difficulty(RIG, names) == difficulty(RIG, names[::-1])


@pytest.mark.parametrize("expression", PACKING.expressions, ids=lambda e: e.name)
def test_a_fallback_shows_the_same_blendshapes_in_two_simpler_expressions(expression):
    parts = fallback(RIG, RIG.names, expression)
    if not parts:
        assert len(expression.blendshapes) <= 2
        return
    first, second = parts
    assert (first.name, second.name) == (f"{expression.name}a", f"{expression.name}b")
    assert sorted(first.blendshapes + second.blendshapes) == sorted(expression.blendshapes)
    assert set(first.drivers + second.drivers) == set(expression.drivers)
    whole = difficulty(RIG, expression.blendshapes + expression.drivers).level
    for part in parts:
        assert difficulty(RIG, part.blendshapes + part.drivers).level <= whole
        assert part.sentence == sentence(RIG, part.blendshapes)
        assert collisions(RIG, part.pose) == ()
    for a, b in PACKING.pairs:
        assert all((a in part.blendshapes) == (b in part.blendshapes) for part in parts)


def test_a_fallback_parts_eyes_from_mouth_where_nothing_speaks_against_it():
    upper = ("browInnerUp", "eyeBlinkLeft", "eyeBlinkRight")
    lower = ("mouthSmileLeft", "mouthSmileRight", "noseSneerLeft", "noseSneerRight")
    both = replace(PACKING.expressions[0], blendshapes=(*lower, *upper), weights=(1.0,) * 7, drivers=())
    first, second = fallback(RIG, RIG.names, both)
    assert set(first.blendshapes) == set(upper)
    assert set(second.blendshapes) == set(lower)


def test_eyes_and_mouth_are_told_apart():
    assert is_upper(RIG, ("browDownLeft", "browDownRight"))
    assert is_upper(RIG, ("eyeBlinkLeft",))
    assert not is_upper(RIG, ("mouthSmileLeft",))
    assert not is_upper(RIG, ("jawOpen",))
