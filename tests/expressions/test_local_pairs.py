"""Upper and lower halves of one movement, found from geometry alone."""

from dataclasses import replace

import numpy as np
import pytest

from capture_plan.anatomy.regions import face_regions
from capture_plan.expressions import PackingSettings, active_sets, packing_faults
from capture_plan.expressions.local_pairs import local_pairs
from capture_plan.expressions.pack import pack
from capture_plan.sample import sample_rig


@pytest.fixture(scope="module")
def rig():
    """The sample with four movements more: each half of each lip drawn away from the other lip."""
    sample = sample_rig()
    regions = face_regions(sample)
    side = np.sign(sample.neutral[:, 0])
    added = []
    for half, way in (("upper lip", 4.0), ("lower lip", -4.0)):
        for sign in (1, -1):
            delta = np.zeros_like(sample.neutral, dtype=np.float32)
            lip = (regions.of_vertex == regions.names.index(half)) & (side == sign)
            delta[lip] = (sign, way, 1.5)
            added.append(delta)
    names = ("upper_L", "upper_R", "lower_L", "lower_R")
    return replace(sample, deltas=np.concatenate([sample.deltas, added]), names=(*sample.names, *names))


USED = ("browInnerUp", "jawOpen", "upper_L", "upper_R", "lower_L", "lower_R", "noseSneerLeft", "noseSneerRight")


def test_lips_that_part_are_halves_of_one_movement_on_each_side(rig):
    found = local_pairs(rig, USED, active_sets(rig, USED, 0.3))
    assert found == (("upper_L", "lower_L"), ("upper_R", "lower_R"))


def test_names_do_not_decide(rig):
    blind = replace(rig, names=tuple(f"shape{k}" for k in range(len(rig.names))))
    of = dict(zip(rig.names, blind.names, strict=True))
    used = tuple(of[name] for name in USED)
    found = local_pairs(blind, used, active_sets(blind, used, 0.3))
    assert found == tuple((of[a], of[b]) for a, b in local_pairs(rig, USED, active_sets(rig, USED, 0.3)))


def test_lips_that_move_alike_are_no_halves(rig):
    deltas = rig.deltas.copy()
    deltas[rig.names.index("lower_L")] *= [1, -1, 1]
    same = replace(rig, deltas=deltas)
    assert local_pairs(same, USED, active_sets(same, USED, 0.3)) == (("upper_R", "lower_R"),)


def test_what_a_lip_drags_along_beside_the_opening_does_not_make_it_another_movement(rig):
    regions, deltas = face_regions(rig), rig.deltas.copy()
    nose = (regions.of_vertex == regions.names.index("nose")) & (rig.neutral[:, 0] > 0)
    weaker = np.sqrt(np.square(deltas[rig.names.index("upper_L")]).sum() / nose.sum())
    deltas[rig.names.index("upper_L"), nose] = weaker * np.array([0, 0, 1.0])  # as much as the lip itself
    dragging = replace(rig, deltas=deltas)
    active = active_sets(dragging, USED, 0.3)
    assert active[USED.index("upper_L"), nose].any()
    assert local_pairs(dragging, USED, active) == (("upper_L", "lower_L"), ("upper_R", "lower_R"))


def test_all_four_of_a_loop_go_together_and_only_when_asked(rig):
    settings = PackingSettings(local_pairs=True)
    packing = pack(rig, USED, settings)
    place = {name: e.name for e in packing.expressions for name in e.blendshapes}
    assert len({place[name] for name in USED[2:6]}) == 1
    assert packing.local == (("upper_L", "lower_L"), ("upper_R", "lower_R"))
    assert packing_faults(rig, USED, packing, settings.mu) == ()
    assert pack(rig, USED, PackingSettings()).local == ()


def test_a_loop_that_asks_for_too_much_is_opened(rig):
    packing = pack(rig, USED, PackingSettings(local_pairs=True, most_things=1))
    assert set(packing.local) <= set(packing.relaxed)
    assert packing_faults(rig, USED, packing, 0.3) == ()
