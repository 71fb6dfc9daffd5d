"""A few damaged files of every format through the whole tool; the fuzzer in `benchmarks` takes thousands."""

import random
import time

import numpy as np
import pytest

from capture_plan.reader.read import read_raw
from tests.fuzz_damage import damage
from tests.fuzz_seeds import small, small_rig
from tests.fuzzing import SEEDS, make_seed, outcome

NUMBER = 1
SLOW = 5.0  # processor seconds


@pytest.mark.parametrize("kind", SEEDS)
def test_damage_ends_in_a_plan_or_in_one_line(tmp_path, kind):
    small_rig(tmp_path)
    path = make_seed(kind, tmp_path)
    damage(path, kind, random.Random(f"{kind} {NUMBER}"))
    start = time.process_time()
    outcome(kind, path, NUMBER)
    assert time.process_time() - start < SLOW


@pytest.mark.parametrize("kind", [kind for kind, (_, _, through) in SEEDS.items() if through.__name__ == "through_rig"])
def test_every_format_of_one_head_is_the_same_rig(tmp_path, kind):
    """Folder and archive, text and binary, GLB and glTF: the same vertices, faces and named movements."""
    raw, head = read_raw(make_seed(kind, tmp_path)), small()
    scale = raw.unit_mm or 1.0
    rounded = 2e-3  # millimetres, by which texts differ
    np.testing.assert_allclose(raw.neutral * scale, head["vertices"][raw.source_index], atol=rounded)
    np.testing.assert_array_equal(raw.triangles, head["faces"])
    for name, delta in zip(raw.names, raw.deltas, strict=True):
        moves = head["deltas"][list(head["names"]).index(name)][raw.source_index]
        np.testing.assert_allclose(delta * scale, moves, atol=rounded)
    assert set(raw.names) <= set(head["names"])
    assert len(raw.names) >= 4
