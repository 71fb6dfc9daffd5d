"""`capture-plan settings`: every key, as it is decided anyway."""

import re
import tomllib

import msgspec
import pytest

from capture_plan.errors import PlanError, SettingsError
from capture_plan.expressions.settings import PackingSettings
from capture_plan.layout.settings import LayoutSettings
from capture_plan.plan.files import change_settings, read_settings
from capture_plan.plan.settings import Settings
from tests.command import run

COMMENT = re.compile(r'^# (?=("[\w. ]+"|\w+) = )', re.MULTILINE)


def keys(settings, path=()):
    """Every name in a nested mapping, tables of a person's own names aside."""
    for name, value in settings.items():
        yield (*path, name)
        if isinstance(value, dict) and name not in ("keep_out", "caps", "locked"):
            yield from keys(value, (*path, name))


def test_the_file_decides_what_is_decided_without_it(tmp_path):
    said = run("settings", cwd=tmp_path)
    assert said.returncode == 0
    (tmp_path / "settings.toml").write_text(said.stdout)
    assert read_settings(tmp_path / "settings.toml") == Settings()


def test_the_file_explains_every_key_and_no_other(tmp_path):
    text = COMMENT.sub("", run("settings", cwd=tmp_path).stdout)
    assert set(keys(tomllib.loads(text))) == set(keys(msgspec.to_builtins(Settings())))
    for line in text.splitlines():
        assert not re.match(r"\w+ = ", line) or "  # " in line or line.startswith(("nose", "jawOpen")), line


def test_the_file_is_written_where_it_is_asked_for_and_nothing_lost(tmp_path):
    (tmp_path / "mine.toml").write_text("mine")
    assert run("settings", "-o", "mine.toml", cwd=tmp_path).returncode == 0
    assert (tmp_path / "mine.toml~").read_text() == "mine"
    assert read_settings(tmp_path / "mine.toml") == Settings()


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("[landmarks]\nepsilom = 0.3", "'epsilom' is no setting of [landmarks]; did you mean 'epsilon'?"),
        ("landmark = 3", "'landmark' is no setting; did you mean 'landmarks'?"),
        ('[landmarks]\nepsilon = "x"', "landmarks.epsilon: expected a number, found text in quotes"),
        ("[landmarks]\nspacing_mm = -1", "landmarks.spacing_mm: expected a number of at least 0"),
        ("[landmarks]\nbudget = 2.5", "landmarks.budget: expected a whole number"),
        ('[landmarks]\nmethod = "budget"', "method 'budget' needs a budget"),
        ('[expressions.edits]\napart = [["a"]]', "expressions.edits.apart: expected a list"),
    ],
)
def test_what_is_wrong_is_said_in_words_with_what_was_meant(tmp_path, text, says):
    (tmp_path / "s.toml").write_text(text)
    with pytest.raises(PlanError, match=re.escape(says)) as error:
        read_settings(tmp_path / "s.toml")
    assert "$" not in str(error.value)
    assert "`float`" not in str(error.value)


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("--epsilon", "0"), "--epsilon: expected a number above 0"),
        (("--spacing-mm", "-3"), "--spacing-mm: expected a number of at least 0"),
        (("--mu", "7"), "--mu: expected a number of at most 1"),
        (("--cap", "nose=-1"), "--cap: expected a whole number of at least 0"),
        (("--minutes", "0"), "--minutes: expected a number above 0"),
    ],
)
def test_options_are_named_as_they_are_written(tmp_path, arguments, says):
    done = run("plan", "sample", *arguments, cwd=tmp_path)
    assert done.returncode == 2
    assert says in done.stderr


def test_a_path_that_is_not_there_is_guessed(tmp_path):
    (tmp_path / "hero.plan.json").write_text("{}")
    assert "did you mean 'hero.plan.json'?" in run("check", "hero.plan.jsn", cwd=tmp_path).stderr
    assert "did you mean 'hero.plan.json'?" in run("plan", "hero_plan.json", cwd=tmp_path).stderr


@pytest.mark.parametrize(
    ("settings", "says"),
    [
        (
            Settings(landmarks=LayoutSettings(method="studios")),
            "landmarks.method: 'studios' is none of studio",
        ),
        (
            Settings(expressions=PackingSettings(importance="errors")),
            "expressions.importance: 'errors' is none of",
        ),
    ],
)
def test_a_word_that_is_no_choice_is_named_with_its_place_and_the_choices(settings, says):
    with pytest.raises(SettingsError, match=says):
        change_settings(settings, {})
