"""The test files of what was changed since the last commit, or by it where nothing was: `python -m tests.changed`.

A test file that is called like a changed module comes first, then those of its room.
"""

import subprocess
from pathlib import Path

ROOT = Path(__file__).parents[1]


def changed_files() -> list[Path]:
    """Files that differ from the last commit, new ones too; those of the last commit where none does."""
    now = [*_git("diff", "--name-only", "HEAD"), *_git("ls-files", "--others", "--exclude-standard")]
    return [Path(name) for name in now or _git("show", "--name-only", "--format=", "HEAD")]


def _git(*words: str) -> list[str]:
    return subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=True).stdout.splitlines()


def files_that_test(changed: list[Path]) -> list[Path]:
    """Test files of changed ones, each once: those called like it, then those of its room."""
    named, near = [], []
    for path in (path for path in changed if path.suffix == ".py"):
        if path.parts[0] == "tests":
            named += [path] if path.name.startswith("test_") and (ROOT / path).exists() else []
            continue
        room = Path("tests", *path.parts[1:-1])
        beside = sorted(one.relative_to(ROOT) for one in (ROOT / room).glob("test_*.py"))
        named += [one for one in beside if path.stem in one.stem]
        near += beside
    return list(dict.fromkeys([*named, *near]))


if __name__ == "__main__":
    print(*files_that_test(changed_files()) or ["tests/test_rooms.py"])
