"""A plan that names what is not there is refused in a line, before anything is computed with it."""

import pytest
from msgspec.structs import replace

from capture_plan.check.check import check_plan
from capture_plan.errors import PlanError
from capture_plan.expressions.settings import Edits
from capture_plan.layout.assembly import SINGLE_COVER
from capture_plan.plan.revise import edited_plan, other_plan
from capture_plan.sample import sample_rig
from tests.once import QUICK, plan_of

RIG = sample_rig()


@pytest.fixture(scope="module")
def plan():
    return plan_of(QUICK)


def with_first(plan, **changes):
    first, *others = plan.layout.landmarks
    return replace(plan, layout=replace(plan.layout, landmarks=(replace(first, **changes), *others)))


def with_layout(plan, **changes):
    return replace(plan, layout=replace(plan.layout, **changes))


def with_packing(plan, **changes):
    return replace(plan, packing=replace(plan.packing, **changes))


BROKEN = [
    (lambda p: with_first(p, vertex=len(RIG.neutral)), "has vertex 4,939 of 4,939"),
    (lambda p: with_first(p, vertex=-1), "has vertex -1"),
    (lambda p: with_first(p, triangle=len(RIG.triangles)), "has triangle 9,608 of 9,608"),
    (lambda p: with_first(p, name=p.layout.landmarks[1].name), "has 2 markers called M02"),
    (lambda p: with_layout(p, programs=(replace(p.layout.programs[0], vertices=(99_999,)),)), "has vertex 99,999"),
    (lambda p: with_layout(p, order=("M77",)), "an order with 'M77'"),
    (lambda p: with_layout(p, landmarks=()), "has no landmark"),
    (lambda p: with_layout(p, programs=2 * p.layout.programs), "has 2 programs"),
    (lambda p: with_layout(p, references={}), f"not set beside the {SINGLE_COVER}"),
    (lambda p: with_layout(p, certificate=replace(p.layout.certificate, weights=())), "numbers in the certificate"),
    (lambda p: with_packing(p, clique=("nobody",)), "names 'nobody'"),
    (lambda p: with_packing(p, unscanned=(("nobody",),)), "names 'nobody'"),
    (
        lambda p: with_packing(
            p, expressions=(replace(p.packing.expressions[0], blendshapes=(), weights=()), *p.packing.expressions[1:])
        ),
        "has an expression E01 without blendshapes",
    ),
    (lambda p: replace(p, versions={}), "tells the versions of nothing"),
]


@pytest.mark.parametrize(("change", "says"), BROKEN)
def test_what_is_not_there_is_named_in_a_line(plan, change, says):
    with pytest.raises(PlanError, match=says) as error:
        check_plan(change(plan), RIG)
    assert len(str(error.value).splitlines()) == 1


def test_a_blendshape_that_no_expression_shows_is_found_missing(plan):
    first, *others = plan.packing.expressions
    retained = replace(first, blendshapes=first.blendshapes[1:], weights=first.weights[1:])
    failing = [
        claim for claim in check_plan(with_packing(plan, expressions=(retained, *others)), RIG) if not claim.holds
    ]
    assert any(first.blendshapes[0] in claim.found for claim in failing)


@pytest.mark.parametrize(
    "change", [lambda p: edited_plan(p, RIG, Edits(dropped=("jawOpen",))), lambda p: other_plan(p, RIG)]
)
def test_a_plan_for_what_the_rig_does_not_have_is_not_edited_either(plan, change):
    used = ("nobody", *plan.audit.used[1:])
    with pytest.raises(PlanError, match="plans for 'nobody', which the rig does not have"):
        change(replace(plan, audit=replace(plan.audit, used=used)))
