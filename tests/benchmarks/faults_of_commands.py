"""Whole commands on a disk that fails and under SIGKILL, for as long as one has patience.

    python -m tests.benchmarks.faults_of_commands faults COMMAND      every call to the disk fails once, then from it on
    python -m tests.benchmarks.faults_of_commands kills COUNT         SIGKILL at random moments of an export
    python -m tests.benchmarks.faults_of_commands writers SECONDS     two writers on one path, one reader

After each there are the old files or the new ones, nothing else, and one line. What was found stands in NOTES.md.
"""

import os
import random
import signal
import sys
import tempfile
import time
from contextlib import AbstractContextManager, nullcontext, suppress
from importlib import import_module
from pathlib import Path
from unittest.mock import patch

from capture_plan.errors import PlanError
from capture_plan.output import leavings, sweep, together, whole, write_whole
from tests.command import run
from tests.faults import FailingDisk, tree

QUICK = ("--method", "cover", "--expressions", "greedy")
COMMANDS = {
    "plan": ("plan", "sample", *QUICK, "-o", "here/plan.json"),
    "edit": ("edit", "here/plan.json", "--drop", "jawForward"),
    "export": ("export", "plan.json", "-o", "here", "--only", "csv", "--only", "json", "--only", "meshes"),
    "html": ("export", "plan.json", "-o", "here", "--only", "html"),
    "render": ("render", "plan.json", "-o", "here", "--dpi", "72"),
    "audit": ("audit", "sample", "-o", "here/audit.txt"),
    "settings": ("settings", "-o", "here/settings.toml"),
}
DRAWN = {"html": "capture_plan.report.page.page_html", "render": "capture_plan.sheets.write.draw_sheets"}


def prepared(folder: Path, plan: bytes, command: str) -> Path:
    """A folder with a plan beside the place that is written to, and in it where it may be replaced, and a file of a
    person's there."""
    (folder / "here").mkdir(parents=True)
    (folder / "plan.json").write_bytes(plan)
    if command in ("plan", "edit"):
        (folder / "here" / "plan.json").write_bytes(plan)
    (folder / "here" / "notes.txt").write_text("mine")
    return folder


def shown(folder: Path) -> dict[str, bytes]:
    """The files that are not kept answers and not being made."""
    return {name: text for name, text in tree(folder).items() if leavings.OURS not in name}


def drawn_once(command: str) -> AbstractContextManager[object]:
    """Let a command that draws find on every further run what it drew on the first: only its writing is tried."""
    if command not in DRAWN:
        return nullcontext()
    room, name = DRAWN[command].rsplit(".", 1)
    draw, drawn = getattr(import_module(room), name), []

    def recalled(*arguments: object, **options: object) -> object:
        if not drawn:
            drawn.append(draw(*arguments, **options))
        return drawn[0]

    return patch(DRAWN[command], recalled)


def every_fault(command: str) -> None:
    """Let every call of a command to the disk fail, once, and from it on."""
    with tempfile.TemporaryDirectory() as place, drawn_once(command):
        root, arguments = Path(place), COMMANDS[command]
        run("plan", "sample", *QUICK, "-o", "made.json", cwd=root)
        plan = (root / "made.json").read_bytes()
        old = shown(prepared(root / "old", plan, command))
        run(*arguments, cwd=prepared(root / "new", plan, command))
        new, tried = shown(root / "new"), 0
        assert new != old, "the command is refused: nothing is tried"
        for ever in (False, True):
            disk, n = FailingDisk(), 1
            while disk.calls >= n - 1:
                folder = prepared(root / f"{ever}{n}", plan, command)
                disk = FailingDisk(n, ever=ever)
                with (
                    patch.object(leavings, "os", disk),
                    patch.object(together, "os", disk),
                    patch.object(whole, "os", disk),
                ):
                    done = run(*arguments, cwd=folder)
                sweep(folder / "here")
                found = shown(folder)
                retained = {name: text for name, text in found.items() if "~" not in name}
                assert retained in (old, {name: text for name, text in new.items() if "~" not in name}), (n, ever)
                assert "Traceback" not in done.stderr, done.stderr
                tried, n = tried + 1, n + 1
        print(f"{command}: {tried} faults, 0 torn, 0 lost, 0 left over")


def kills(count: int) -> None:
    """Kill an export at random moments; what is there is whole, and the next one works."""
    seed, torn, killed = random.Random(7), 0, 0
    with tempfile.TemporaryDirectory() as place:
        root = Path(place)
        run("plan", "sample", *QUICK, "-o", "plan.json", cwd=root)
        command = COMMANDS["export"]
        run(*command, cwd=root)  # answers are kept from here on, so that writing is a large part of it
        start = time.monotonic()
        run(*command, cwd=root)
        takes_s, whole_set = time.monotonic() - start, tree(root / "here")
        for _ in range(count):
            if not (child := os.fork()):
                run(*command, cwd=root)
                os._exit(0)
            time.sleep(seed.uniform(0, 1.2 * takes_s))
            os.kill(child, signal.SIGKILL)
            killed += os.WIFSIGNALED(os.waitpid(child, 0)[1])
            torn += shown(root / "here") != whole_set
        run(*command, cwd=root)
        left = [name for name in tree(root / "here") if leavings.OURS in name]
        print(f"{killed} kills: {torn} torn or lost, {len(left)} left over after the next run")


def writers(seconds: float) -> None:
    """Two processes write one path while this one reads."""
    with tempfile.TemporaryDirectory() as place:
        path, children = Path(place) / "plan.json", []
        for letter in b"ab":
            if not (child := os.fork()):
                while True:
                    with suppress(PlanError):
                        write_whole(path, bytes([letter]) * 60_000)
            children.append(child)
        while not path.exists():
            time.sleep(0.01)
        reads = torn = 0
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            text = path.read_bytes()
            reads, torn = reads + 1, torn + (len(text) != 60_000 or text.count(text[:1]) != 60_000)
        for child in children:
            os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)
        sweep(path.parent)
        print(f"{reads:,} reads: {torn} torn, {len(list(path.parent.iterdir())) - 1} left over")


if __name__ == "__main__":
    what, value = sys.argv[1:3]
    {"faults": every_fault, "kills": lambda n: kills(int(n)), "writers": lambda s: writers(float(s))}[what](value)
