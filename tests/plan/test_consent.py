"""What was agreed about a likeness: as it was written, on page one and nowhere else."""

import json
from datetime import date

import pytest

from capture_plan.errors import PlanError
from capture_plan.plan.consent import Consent, consent_lines, passed_words
from capture_plan.plan.files import read_settings
from capture_plan.plan.settings import Settings


def test_only_what_was_given_is_said():
    assert consent_lines(Settings().consent) == ()
    assert consent_lines(Consent(holder="Studio", keep_until="2027-01-31")) == (
        "Held by: Studio",
        "Keep until: 2027-01-31",
    )


@pytest.mark.parametrize("words", ["x" * 61, "two\nlines"])
def test_more_than_a_line_is_refused(tmp_path, words):
    path = tmp_path / "s.toml"
    path.write_text(f"[consent]\npurpose = {json.dumps(words)}")
    with pytest.raises(PlanError, match="purpose"):
        read_settings(path)


@pytest.mark.parametrize("words", ["2027", "31.12.2027", "20271231", "2027-W01-1", "2027-02-30", "soon"])
def test_what_is_no_day_is_refused_with_the_form_that_is_expected(tmp_path, words):
    path = tmp_path / "s.toml"
    path.write_text(f"[consent]\nkeep_until = {json.dumps(words)}")
    with pytest.raises(PlanError, match=r"YYYY-MM-DD, such as \"2027-12-31\""):
        read_settings(path)


def test_a_day_that_has_passed_is_told_and_no_other():
    agreed = Consent(keep_until="2027-01-31")
    assert passed_words(agreed, date(2027, 1, 31)) == []
    assert "2027-01-31, which has passed" in passed_words(agreed, date(2027, 2, 1))[0]
    assert passed_words(Consent(), date(2027, 2, 1)) == []
