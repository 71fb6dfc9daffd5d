"""Reading a long take beside NumPy's own parser on the same text in the same run.

`pytest tests/benchmarks --benchmark-enable` reads half an hour at 60 frames a second (108,000 rows); without it, one
round on a short take shows that the benchmark still runs.
"""

import time

import numpy as np
import pytest

from capture_plan.rig import sample_rig
from capture_plan.rig.sequence import read_sequence

MOST_RATIO = 3.0  # measured 2.0: names, timecodes, lost rows and the rig's weights beside the parsing


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
