"""Damaged files of one format through the whole tool, for as long as one has patience (`tests/fuzzing.py`).

    python -m tests.benchmarks.fuzz_tool FORMAT SECONDS [FIRST]

Each damaged input is taken by a child with 1 GB for itself; an exception that is not ours, a signal or more than
SLOW processor seconds is shown with its number and its traceback, and the input is kept in the folder that is named.
"""

import os
import random
import resource
import shutil
import signal
import sys
import tempfile
import time
import traceback
from collections import Counter
from pathlib import Path

from tests.fuzz_damage import damage
from tests.fuzz_seeds import small_rig
from tests.fuzzing import SEEDS, make_seed, outcome

ROOM = 1 << 30
SLOW, HANGS = 5.0, 120  # processor seconds; seconds on a clock after which a child is ended


def run(kind: str, whole: Path, n: int) -> tuple[str, float]:
    """What becomes of damage number `n`, in this process, and processor seconds with those of its children."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for file in whole.parent.iterdir():
            (shutil.copytree if file.is_dir() else shutil.copy)(file, folder / file.name)
        path = folder / whole.name
        damage(path, kind, random.Random(f"{kind} {n}"))
        start = sum(os.times()[:4])
        return outcome(kind, path, n), sum(os.times()[:4]) - start


def child(kind: str, whole: Path, first: int, stop: float, pipe: int) -> None:
    """Damage after damage, a line of each into the pipe: its number, then seconds and what came of it."""
    size = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    vast = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize() + ROOM
    resource.setrlimit(resource.RLIMIT_AS, (max(vast, size + ROOM), resource.RLIM_INFINITY))
    n = first
    while time.monotonic() < stop:
        os.write(pipe, f"{n} ".encode())
        signal.alarm(HANGS)
        try:
            said, seconds = run(kind, whole, n)
        except BaseException:
            said, seconds = "TRACEBACK " + traceback.format_exc().replace("\n", "\x1e"), 0.0
        os.write(pipe, f"{seconds:.2f} {said[:4000]}\n".encode(errors="replace"))
        n += 1


def main(kind: str, seconds: float, first: int = 0) -> int:
    """How many inputs ended in neither success nor one of our errors."""
    counts, wrong, slowest, causes = Counter(), 0, (0.0, 0), Counter()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "seed"
        folder.mkdir()
        whole = make_seed(kind, folder)
        small_rig(folder)
        assert (said := outcome(kind, whole, 0)) == "success", said
        stop, n = time.monotonic() + seconds, first
        while time.monotonic() < stop:
            read, write = os.pipe()
            pid = os.fork()
            if pid == 0:
                os.close(read)
                child(kind, whole, n, stop, write)
                os._exit(0)
            os.close(write)
            last = n
            with os.fdopen(read, errors="replace") as lines:
                for line in lines:
                    number, _, rest = line.partition(" ")
                    taken, _, said = rest.strip().partition(" ")
                    last = int(number)
                    if not taken:
                        break
                    n = last + 1
                    slowest = max(slowest, (float(taken), last))
                    if said.startswith("TRACEBACK"):
                        wrong += 1
                        cause = said.replace("\x1e", "\n").strip()
                        where = " ".join(line.strip() for line in cause.splitlines()[-4:])[:300]
                        causes[where] += 1
                        if causes[where] == 1:
                            print(f"--- {kind} {last}\n{cause[-1500:]}", flush=True)
                    counts[
                        "success" if said == "success" else "traceback" if said.startswith("TRACE") else "refused"
                    ] += 1
            _, status = os.waitpid(pid, 0)
            if os.waitstatus_to_exitcode(status) != 0:
                wrong, n = wrong + 1, n + 1
                counts["signal"] += 1
                print(f"--- {kind} {last}: ended with {os.waitstatus_to_exitcode(status)}", flush=True)
    runs = counts.total()
    print(
        f"{kind}: {runs:,} runs, {counts['success']:,} plans, {counts['refused']:,} refused, "
        f"{counts['traceback']:,} tracebacks, {counts['signal']:,} signals; "
        f"slowest {slowest[0]:.1f} s (input {slowest[1]})"
    )
    for cause, count in causes.most_common():
        print(f"    {count} x {cause}")
    return wrong + (slowest[0] > SLOW)


if __name__ == "__main__":
    format_, seconds_, *first_ = sys.argv[1:]
    kinds = sorted(SEEDS) if format_ == "all" else [format_]
    sys.exit(any([main(one, float(seconds_), *map(int, first_)) for one in kinds]))
