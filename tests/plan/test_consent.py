"""What was agreed about a likeness: as it was written, on page one and nowhere else."""

import json

import pytest

from capture_plan.errors import PlanError
from capture_plan.plan.consent import Consent, consent_lines
from capture_plan.plan.files import read_settings
from capture_plan.plan.settings import Settings


def test_only_what_was_given_is_said():
    assert consent_lines(Settings().consent) == ()
    assert consent_lines(Consent(holder="Studio", keep_until="2027")) == ("Held by: Studio", "Keep until: 2027")


@pytest.mark.parametrize("words", ["x" * 61, "two\nlines"])
def test_more_than_a_line_is_refused(tmp_path, words):
    path = tmp_path / "s.toml"
    path.write_text(f"[consent]\npurpose = {json.dumps(words)}")
    with pytest.raises(PlanError, match="purpose"):
        read_settings(path)
