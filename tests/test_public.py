"""What `capture_plan` exports: seen by `dir`, loaded when first used, with errors that a user can catch."""

import subprocess
import sys

import pytest

import capture_plan
from capture_plan import LayoutSettings, PackingSettings, PlanError, RigError, Settings, make_plan, read_rig, sample_rig


def test_dir_shows_what_is_exported_and_nothing_else():
    assert dir(capture_plan) == sorted(capture_plan.__all__)


@pytest.mark.parametrize("name", capture_plan.__all__)
def test_every_export_is_there_and_says_what_it_is(name):
    assert len((getattr(capture_plan, name).__doc__ or "").split()) >= 5


def test_no_room_hides_an_export():
    code = "import capture_plan, capture_plan.cli\nimport capture_plan.audit.audit\n"
    code += "print(*(type(getattr(capture_plan, n)).__name__ for n in capture_plan.__all__))"
    message = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert "module" not in message.split()


def test_a_rig_that_is_not_there_is_a_rig_error(tmp_path):
    with pytest.raises(RigError, match="nowhere"):
        read_rig(tmp_path / "nowhere.obj")


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        (lambda: Settings(landmarks=LayoutSettings(epsilon=5)), "epsilon"),
        (lambda: Settings(landmarks=LayoutSettings(method="budget")), "needs a budget"),
        (lambda: Settings(expressions=PackingSettings(mu=-1)), "mu"),
    ],
)
def test_wrong_settings_written_in_python_are_plan_errors(wrong, says):
    with pytest.raises(PlanError, match=says):
        make_plan(sample_rig(), wrong())
