"""What `check` prints: every correction once, nothing lost, and what no check can recompute."""

import pytest
from msgspec.structs import replace

from capture_plan.check.again import packing_again, stated_list
from capture_plan.check.check import check_plan
from capture_plan.check.differences import differences
from capture_plan.check.report import as_rows, check_lines
from capture_plan.check.unchecked import ASKED, unchecked
from capture_plan.face.sense import Sense
from capture_plan.plan.advice import correction, corrections, say_names, stated
from capture_plan.plan.claims import CHANGED, Claim, claim
from capture_plan.plan.inputs import PlanInputs
from capture_plan.plan.record import RigReference
from capture_plan.plan.settings import Settings
from capture_plan.sample import sample_rig
from tests.once import QUICK, plan_of

RIG = sample_rig()
NOTHING = RigReference("head", "head.npz", "", 3)
WRONG = Sense("the jaw opens downwards", False, "it opens up", "axes")
VOTED = Sense("all signs agree", False, "they speak for +y", "axes", (("--up", "+y"), ("--facing", "+z")))
LARGE = Sense("the face has the size of a face", False, "300 mm", "size")
SIDES = Sense("what is called left moves the left", False, "0 of 4", "sides")
REGIONS = Sense("regions move as they do", False, "3 of 9", "regions")
CLAIMS = (
    Claim("a", False, "1", "turn it"),
    Claim("b", True, "2"),
    Claim("c", False, "3", "scale it"),
    Claim("d", False, "4", "turn it"),
    Claim("e", False, "5"),
)


@pytest.fixture(scope="module")
def plan():
    return plan_of(Settings(landmarks=QUICK.landmarks))


def test_claims_that_fail_stand_below_what_to_correct_which_is_said_once():
    assert check_lines(CLAIMS, ()) == [
        "To correct: turn it.",
        "  FAILS  a: 1",
        "  FAILS  d: 4",
        "To correct: scale it.",
        "  FAILS  c: 3",
        f"To correct: {CHANGED}.",
        "  FAILS  e: 5",
        "1 of 5 claims hold; --all lists each.",
    ]


def test_what_differs_is_called_as_people_know_it(plan):
    mark, shot, item = plan.layout.landmarks[1], plan.packing.expressions[2], plan.session.items[4]
    said = [replace(mark, label="elsewhere"), replace(shot, sentence="Smile."), replace(item, sentence="Smile.")]
    paths = [next(differences([one], [true])).path for one, true in zip(said, (mark, shot, item), strict=True)]
    assert paths == ["[M02].label", "[E03].sentence", f"[shot {int(item.slate)}].sentence"]
    assert next(differences([1, 2], [1, 3], "order")).path == "order[1]"


def test_every_claim_has_its_line_in_the_order_of_the_check_where_all_are_asked():
    *lines, message = check_lines(CLAIMS, (), every=True)
    assert lines == [
        "FAILS  a: 1: turn it",
        "holds  b: 2",
        "FAILS  c: 3: scale it",
        "FAILS  d: 4: turn it",
        "FAILS  e: 5",
    ]
    assert message == "1 of 5 claims hold."


def test_programs_read_what_was_found_and_what_to_correct_in_one_text():
    assert as_rows(CLAIMS)[0] == {"what": "a", "holds": False, "found": "1: turn it"}
    assert as_rows([claim("a", True, "1", "turn it")]) == [{"what": "a", "holds": True, "found": "1"}]


@pytest.mark.parametrize("every", [False, True])
def test_what_is_not_checked_is_always_said(every):
    assert check_lines(CLAIMS, ("the weather", "the light"), every=every)[-2:] == [
        "Not checked: the weather.",
        "Not checked: the light.",
    ]


@pytest.mark.parametrize(
    ("given", "sense"),
    [
        ({"up": "+z"}, WRONG),
        ({"up": "+z"}, VOTED),
        ({"up": "+y", "facing": "-z"}, VOTED),
        ({"unit_mm": 30.0}, LARGE),
        ({"facing": "-z"}, SIDES),
        ({"names": "names.toml"}, SIDES),
        ({"skin": "skin.txt"}, REGIONS),
        ({"up": "-x", "skin": "skin.txt"}, REGIONS),
    ],
)
def test_advice_names_what_was_stated_and_never_asks_for_it_anew(given, sense):
    message = correction(replace(NOTHING, **given), RIG, sense)
    wrong = {"facing": "-z"} if given == {"up": "+y", "facing": "-z"} else given  # the way up is right
    for value in wrong.values():
        assert (f"{value:g}" if isinstance(value, float) else value) in message
    assert not [option for option in stated(replace(NOTHING, **given)) if f"plan again with {option}" in message]


@pytest.mark.parametrize("sense", [WRONG, LARGE, SIDES, REGIONS])
def test_advice_where_nothing_was_stated_says_what_to_give(sense):
    message = correction(NOTHING, RIG, sense)
    assert "plan again with --" in message
    assert "this plan was made with" not in message


def test_a_stated_option_that_agrees_is_not_blamed():
    message = correction(replace(NOTHING, up="+y"), RIG, VOTED)
    assert message == "it was read with +y up and +z forward: plan again with --up +y --facing +z"


def test_a_head_that_lies_has_one_correction_for_its_sides_and_regions_too_but_not_for_its_size():
    given = replace(NOTHING, up="+z", unit_mm=30.0)
    holds = Sense("the nose lies above the mouth", True, "31 mm", "axes")
    axes, one, sides, regions, size, fine = corrections(given, RIG, (VOTED, WRONG, SIDES, REGIONS, LARGE, holds))
    assert axes == one == sides == regions == "this plan was made with --up +z: plan again without it, or with --up +y"
    assert "--unit-mm 30" in size
    assert "--up" not in size
    assert fine == ""


def test_a_name_map_that_the_plan_has_is_to_be_corrected():
    assert "names.toml" in say_names(replace(NOTHING, names="names.toml"))
    assert "say in a file" in say_names(NOTHING)


def test_questions_that_are_not_asked_are_said_and_those_of_a_whole_head_all_are_asked(plan):
    claims = check_plan(plan, RIG)
    assert not [line for line in unchecked(plan, claims) if line.startswith("whether all signs")]
    assert set(ASKED) <= {claim.what for claim in claims}
    without = [claim for claim in claims if claim.what not in ASKED]
    assert len(unchecked(plan, without)) == len(unchecked(plan, claims)) + len(ASKED)


def test_what_only_the_solver_knows_is_said(plan):
    shown = plan.packing.bound - 1
    weaker = replace(plan, packing=replace(plan.packing, bound=shown))
    assert any(f"proved here: at least {shown}" in line for line in unchecked(weaker, ()))
    assert not any("proved here" in line for line in unchecked(plan, ()))


def test_the_order_is_the_solvers_word_but_for_an_early_list_whose_order_is_checked(plan):
    def message(method):
        packing = replace(plan.packing, method=method, order_proven=True)
        return any("most important one possible" in line for line in unchecked(replace(plan, packing=packing), ()))

    assert message("minimum")
    assert not message("early")


def test_an_early_order_is_found_out_where_it_is_not_kept_and_where_nothing_is_claimed(plan):
    first, second, *rest = plan.packing.expressions
    unsaid = replace(plan, packing=replace(plan.packing, order_proven=False))
    swapped = replace(plan, packing=replace(plan.packing, expressions=(second, first, *rest)))
    proved = [
        packing_again(one, stated_list(one, PlanInputs(RIG), apart=plan.packing.colliding)).order_proven
        for one in (plan, unsaid, swapped)
    ]
    assert proved == [True, True, False]
