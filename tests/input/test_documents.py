"""Files that a person writes by hand are read within bounds, whatever they hold."""

import os
import time

import pytest

from capture_plan.errors import PlanError
from capture_plan.input.documents import DEEPEST, MOST_BYTES, read_plain, read_toml

HOSTILE = {
    "dotted": "a" + ".a" * 50_000 + " = 1",
    "spaced": "a" + " . a" * 50_000 + " = 1",
    "quoted": '"a"' + '."a"' * 50_000 + " = 1",
    "header": "[a" + ".a" * 50_000 + "]",
    "inline": "x = {a" + ".a" * 50_000 + " = 1}",
    "arrays": "x = " + "[" * 50_000,
    "tables": "x = " + "{a=" * 50_000,
    "digits": "x = " + "9" * 5_000,
    "word": "a" * 3_000_000,
    "string": 'x = "' + "a. " * 1_000_000,
}


@pytest.mark.parametrize("kind", HOSTILE)
def test_hostile_documents_are_refused_at_once_in_one_line(tmp_path, kind):
    (tmp_path / "x.toml").write_text(HOSTILE[kind])
    start = time.process_time()
    with pytest.raises(PlanError, match=r"^[^\n]*x\.toml is not TOML[^\n]*: write it$"):
        read_toml(tmp_path / "x.toml", PlanError, "write it")
    assert time.process_time() - start < 2


def test_what_is_no_plain_file_or_too_large_is_not_read(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with (tmp_path / "large").open("wb") as file:
        file.truncate(MOST_BYTES + 1)
    for path in (tmp_path, tmp_path / "pipe", tmp_path / "large", tmp_path / "none", "/dev/zero"):
        with pytest.raises(PlanError, match=r"give another$"):
            read_plain(tmp_path / path, PlanError, "give another")


def test_tables_as_people_nest_them_are_read(tmp_path):
    (tmp_path / "x.toml").write_text("\ufeff" + ".".join(["a"] * DEEPEST) + " = [[1, 2], [3]]", encoding="utf-8")
    found = read_toml(tmp_path / "x.toml", PlanError, "")
    for _ in range(DEEPEST):
        found = found["a"]
    assert found == [[1, 2], [3]]
