"""A plan with any one value changed is refused or fails its check, with the seal broken or made anew."""

import json

import pytest

from capture_plan.plan.files import read_plan, write_plan
from tests.tampering import FREE, KINDS, answers_kept, is_free, outcomes, verdict

CHANGES = 120  # of each plan; all kinds of its fields have a turn or nearly


@pytest.fixture(scope="module", autouse=True)
def asked_once():
    with answers_kept():
        yield


@pytest.mark.parametrize("name", KINDS)
def test_no_changed_value_goes_unnoticed(made, name):
    found = outcomes(made[name], CHANGES, 1, resealed=False)
    assert sorted(kind for said, kind in found if said == "uncaught") == []
    assert sum(times for (said, _), times in found.items() if said == "caught") > CHANGES / 4


@pytest.mark.parametrize("name", KINDS)
def test_a_forger_who_seals_anew_is_found_out_but_for_a_short_list(made, name):
    found = outcomes(made[name], CHANGES, 2, resealed=True)
    assert sorted(kind for said, kind in found if said == "uncaught" and not is_free(kind)) == []
    assert len(FREE) < 10


@pytest.mark.parametrize("name", KINDS)
def test_a_plan_that_nobody_changed_holds(made, name):
    plan, document = read_plan(made[name]), json.loads(made[name].read_bytes())
    assert verdict(document, plan, made[name], resealed=False) == "same"
    document["seal"] = ""
    assert verdict(document, plan, made[name], resealed=True) == "uncaught"


def test_writing_a_plan_seals_it(made, tmp_path):
    plan = read_plan(made["default"])
    assert read_plan(write_plan(plan, tmp_path / "again.json")) == plan
