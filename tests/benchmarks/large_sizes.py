"""Whole commands on sizes that nobody planned for: how long, how much memory, is progress told, does Ctrl-C end it.

    python -m tests.benchmarks.large_sizes [NAME …]

A head of any size is the bundled one with finer triangles, and any number of blendshapes are its own through windows.
Each command runs twice: to its end, and interrupted at half of the time that this took. What was found stands in
NOTES.md.
"""

import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import trimesh

from capture_plan.mesh.decimate import decimate
from capture_plan.sample import sample_rig

TOOL = [sys.executable, "-c", "from capture_plan.cli import main; main()"]
PLAN = ("plan", "head.npz", "-o", "plan.json")
CASES = {  # name: vertices, blendshapes, frames, what is done before, what is measured
    "237 blendshapes": (25_000, 237, 0, (), PLAN),
    "200,000 vertices": (200_000, 100, 0, (), PLAN),
    "1,000 blendshapes": (4_900, 1_000, 0, (), PLAN),
    "20,000 frames": (4_900, 52, 20_000, (), (*PLAN, "--sequence", "take.npz")),
    "20,000 frames, method motion": (4_900, 52, 20_000, (), (*PLAN, "--sequence", "take.npz", "--method", "motion")),
    "200 landmarks, 60 expressions": (
        4_900,
        237,
        0,
        (*PLAN, "--budget", "200", "--spacing-mm", "4", "--dot-mm", "2", "--mu", "0.02"),
        ("render", "plan.json", "-o", "sheets"),
    ),
}


def head(vertices: int, blendshapes: int) -> dict[str, np.ndarray]:
    """Arrays of an NPZ rig: the bundled head with so many vertices or up to twice as many, and blendshapes."""
    rig, rng = sample_rig(), np.random.default_rng(0)
    x, triangles, deltas = rig.neutral, rig.triangles, rig.deltas
    while len(x) < vertices:
        every = trimesh.remesh.subdivide(np.hstack([x, *deltas]), triangles, vertex_attributes=None)
        x, deltas, triangles = every[0][:, :3], every[0][:, 3:].reshape(len(every[0]), -1, 3).swapaxes(0, 1), every[1]
    if len(x) > 2 * vertices:
        retained, triangles = decimate(x, triangles, 2 * vertices)
        x, deltas = x[retained], deltas[:, retained]
    deltas = list(deltas[:blendshapes])
    names = list(rig.names[:blendshapes])
    for number in range(blendshapes - len(deltas)):
        whole = deltas[number % len(rig.names)]
        far = np.linalg.norm(whole, axis=1)
        centre = x[rng.choice(len(x), p=far / far.sum())]
        window = np.exp(-((x - centre) ** 2).sum(axis=1) / (2 * rng.uniform(6, 20) ** 2))
        deltas.append(whole * window[:, None] * min(4.0, 3.0 / (far * window).max()))
        names.append(f"{rig.names[number % len(rig.names)]}_part{number:04d}")
    arrays = {"vertices": x.astype(np.float32), "faces": triangles, "deltas": np.array(deltas, np.float32)}
    return arrays | {"names": np.array(names), "units": np.array("mm")}


def take(frames: int) -> dict[str, np.ndarray]:
    """Weights of every blendshape that come and go, 60 frames a second."""
    rng, names = np.random.default_rng(0), sample_rig().names
    rate, phase = rng.uniform(0.01, 0.1, len(names)), rng.uniform(0, 6, len(names))
    weights = np.clip(np.sin(np.arange(frames)[:, None] * rate + phase) - 0.3, 0, 1)
    return {"weights": weights, "names": np.array(names), "fps": np.array(60.0)}


def ran(command: tuple[str, ...], folder: Path, stop_s: float = 0.0) -> tuple[int, float, float, list[str], float]:
    """Exit code, seconds, peak memory (GB), lines on standard error, seconds from an interrupt to the end."""
    if command[0] == "plan":
        (folder / "plan.json").unlink(missing_ok=True)
    shutil.rmtree(folder / "sheets", ignore_errors=True)
    env = os.environ | {"XDG_CACHE_HOME": str(folder / f"cache {time.monotonic()}")}
    start = time.monotonic()
    with (folder / "said").open("w+") as said:
        child = subprocess.Popen([*TOOL, *command], cwd=folder, env=env, stdout=subprocess.DEVNULL, stderr=said)
        if stop_s:
            time.sleep(stop_s)
            child.send_signal(signal.SIGINT)
        asked = time.monotonic()
        _, status, used = os.wait4(child.pid, 0)
        end = time.monotonic()
        said.seek(0)
        lines = said.read().splitlines()
    return os.waitstatus_to_exitcode(status), end - start, used.ru_maxrss / 2**20, lines, end - asked


def main(names: list[str]) -> None:
    """A line of a table for each case."""
    for name in names or CASES:
        vertices, blendshapes, frames, before, command = CASES[name]
        with tempfile.TemporaryDirectory() as place:
            folder = Path(place)
            np.savez(folder / "head.npz", **head(vertices, blendshapes))
            if frames:
                np.savez(folder / "take.npz", **take(frames))
            if before:
                code, *_, lines, _ = ran(before, folder)
                assert code == 0, lines
            code, seconds, memory, lines, _ = ran(command, folder)
            message = sum("%" in line for line in lines)
            stopped, *_, last, after = ran(command, folder, seconds / 2)
            print(
                f"| {name} | exit {code}, {seconds:.0f} s | {memory:.2f} GB | {message} lines |"
                f" exit {stopped} after {after:.1f} s: {last[-1] if last else ''} |",
                flush=True,
            )
            if code:
                print("\n".join(lines[-5:]))


if __name__ == "__main__":
    main(sys.argv[1:])
