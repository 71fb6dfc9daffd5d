"""Reading a long take beside NumPy's own parser on the same text in the same run.

`pytest tests/benchmarks --benchmark-enable` reads half an hour at 60 frames a second (108,000 rows), and five minutes
as a row for each weight (a million rows); without it, one round on a short take shows that the benchmark still runs.
"""

import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from capture_plan.sample import sample_rig
from capture_plan.sequence import read_sequence

MOST_RATIO = 3.0  # measured 2.0: names, timecodes, lost rows and the rig's weights beside the parsing
MOST_RATIO_LONG = 8.0  # measured 5.8: names and times are texts, which NumPy's parser passes over
MOST_OF_FILE = 9.0  # bytes of memory for each of the file, measured 6.7
PEAK = """
import sys
from pathlib import Path
from capture_plan.sequence.read import read_take
def peak():
    return next(int(line.split()[1]) for line in open("/proc/self/status") if line.startswith("VmHWM"))
before = peak()
read_take(Path(sys.argv[1]))
print(peak() - before)
"""


def peak_kilobytes(path: Path) -> int:
    """Memory that reading a take needs at most, beside the program itself."""
    return int(subprocess.run([sys.executable, "-c", PEAK, path], check=True, capture_output=True, text=True).stdout)


@pytest.mark.benchmark(group="takes")
def test_a_row_for_each_weight_is_read_in_a_few_times_what_its_numbers_take(benchmark, tmp_path):
    rig, frames = sample_rig(), 19_230 if benchmark.enabled else 60
    x = np.round(np.random.default_rng(0).uniform(0, 1, (frames, len(rig.names))) ** 3, 6)
    path = tmp_path / "take.csv"
    with path.open("w") as file:
        file.write("frame,time,blendshape,weight\n")
        for t, row in enumerate(x.tolist()):
            file.writelines(f"{t},{t / 60:.6f},{n},{w}\n" for n, w in zip(rig.names, row, strict=True))
    start = time.process_time()
    np.loadtxt(path, delimiter=",", skiprows=1, usecols=(0, 1, 3))
    raw = time.process_time() - start
    start = time.process_time()
    take = benchmark.pedantic(read_sequence, args=(path,), kwargs={"rig": rig}, rounds=1)
    spent = time.process_time() - start
    assert take.frames.weights == pytest.approx(x)
    assert take.fps == 60
    if benchmark.enabled:
        memory = 1024 * peak_kilobytes(path) / path.stat().st_size
        message = f"{spent:.2f} CPU s, {spent / raw:.2f} times NumPy's parser alone"
        print(f"\n{x.size:,} rows of one weight: {message}, memory {memory:.1f} times the file")
        assert spent < MOST_RATIO_LONG * raw
        assert memory < MOST_OF_FILE


@pytest.mark.benchmark(group="takes")
def test_a_take_is_read_in_a_few_times_what_its_numbers_take(benchmark, tmp_path):
    rig, frames = sample_rig(), 108_000 if benchmark.enabled else 600
    x = np.round(np.random.default_rng(0).uniform(0, 1, (frames, len(rig.names))) ** 3, 6)
    path = tmp_path / "take.csv"
    with path.open("w") as file:
        file.write(",".join(["Timecode", *rig.names]) + "\n")
        for t, row in enumerate(x.tolist()):
            s = t // 60
            file.write(
                f"{s // 3600:02d}:{s // 60 % 60:02d}:{s % 60:02d}:{t % 60:02d}," + ",".join(map(str, row)) + "\n"
            )
    start = time.process_time()
    np.loadtxt(path, delimiter=",", skiprows=1, usecols=range(1, len(rig.names) + 1))
    raw = time.process_time() - start
    start = time.process_time()
    take = benchmark.pedantic(read_sequence, args=(path,), kwargs={"rig": rig}, rounds=1)
    spent = time.process_time() - start
    assert len(take) == frames
    assert take.frames.weights == pytest.approx(x)
    if benchmark.enabled:
        print(f"\n{frames:,} rows: {spent:.2f} CPU s, {spent / raw:.2f} times NumPy's parser alone")
        assert spent < MOST_RATIO * raw
