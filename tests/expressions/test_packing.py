"""Packing: the fewest expressions, the heaviest first, checked by brute force and by code that knows no solver."""

import re
from dataclasses import replace
from functools import cache
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec.structs import replace as change

from capture_plan.errors import RigError
from capture_plan.expressions import Expression, PackingSettings, active_sets, packing_faults
from capture_plan.expressions.colouring import colour, greedy, largest_clique
from capture_plan.expressions.compatibility import never_together, performed_together
from capture_plan.expressions.conflicts import conflict_graph, core, edge_cover, maximal_sets
from capture_plan.expressions.instance import Instance
from capture_plan.expressions.minimum import _heaviest_colour, fewest_colours, minimum
from capture_plan.expressions.pack import pack
from capture_plan.expressions.sequential import heaviest, sequential

few = settings(max_examples=30, deadline=None)
RING = np.array([[i in (e, (e + 1) % 5) for e in range(5)] for i in range(5)])  # five items, each overlaps two others


def instance(seed, items=None):
    """Active sets of up to 8 items at 7 vertices, and importances no two sums of which are equal."""
    rng = np.random.default_rng(seed)
    g = items or int(rng.integers(1, 9))
    return rng.random((g, 7)) < rng.uniform(0.1, 0.4), rng.uniform(0.1, 1, g).round(6)


def free(active):
    return Instance.free(maximal_sets(active))


def fits(active, items):
    return (active[list(items)].sum(axis=0) <= 1).all()


def brute_number(active):
    """Fewest expressions for every subset of items, by trying them all."""

    @cache
    def number(left):
        if not left:
            return 0
        first, rest = left[0], left[1:]
        options = (c for n in range(len(rest) + 1) for c in combinations(rest, n) if fits(active, (first, *c)))
        return 1 + min(number(tuple(i for i in rest if i not in c)) for c in options)

    return number


def brute_order(active, weights):
    """Importance of each expression of the best shortest list: the heaviest first, then the heaviest second, ..."""
    number, left, gains = brute_number(active), tuple(range(len(active))), []
    while left:
        options = [c for n in range(1, len(left) + 1) for c in combinations(left, n) if fits(active, c)]
        after = {c: tuple(i for i in left if i not in c) for c in options}
        best = max((c for c in options if number(after[c]) < number(left)), key=lambda c: weights[list(c)].sum())
        gains.append(weights[list(best)].sum())
        left = after[best]
    return gains


@few
@given(st.integers(0, 100_000))
def test_minimum_agrees_with_trying_everything(seed):
    active, weights = instance(seed)
    order, bound = minimum(free(active), lambda packed: weights)
    assert len(order.expressions) == bound == brute_number(active)(tuple(range(len(active))))
    assert order.proven


@few
@given(st.integers(0, 100_000))
def test_prefixes_of_the_minimum_list_weigh_most(seed):
    active, weights = instance(seed)
    order, _ = minimum(free(active), lambda packed: weights)
    assert [weights[e].sum() for e in order.expressions] == pytest.approx(brute_order(active, weights), abs=1e-5)


@few
@given(st.integers(0, 100_000))
def test_no_two_items_of_an_expression_overlap_and_each_is_packed_once(seed):
    active, weights = instance(seed)
    for order in (minimum(free(active), lambda packed: weights)[0], sequential(free(active), lambda packed: weights)):
        assert all(fits(active, e) for e in order.expressions)
        assert sorted(i for e in order.expressions for i in e) == list(range(len(active)))


@few
@given(st.integers(0, 100_000))
def test_each_sequential_expression_is_the_heaviest_of_what_is_left(seed):
    active, weights = instance(seed)
    left = set(range(len(active)))
    for e in sequential(free(active), lambda packed: weights).expressions:
        options = (c for n in range(1, len(left) + 1) for c in combinations(sorted(left), n) if fits(active, c))
        assert weights[e].sum() == pytest.approx(max(weights[list(c)].sum() for c in options), abs=1e-5)
        left -= set(e.tolist())


@few
@given(st.integers(0, 100_000))
def test_maximal_sets_and_their_cover_name_the_same_conflicts(seed):
    active, _ = instance(seed, items=8)
    sets = maximal_sets(active)
    overlap = (active.astype(int) @ active.T.astype(int) > 0) & ~np.eye(8, dtype=bool)
    assert (conflict_graph(sets) == overlap).all()
    assert (conflict_graph(edge_cover(sets)) == overlap).all()
    assert not any((a <= b).all() for a in sets.T for b in sets.T if a is not b and (a != b).any())


def test_a_set_whose_conflicts_others_name_already_and_one_of_a_single_item_are_left_out():
    sets = np.array([np.isin(np.arange(6), one) for one in ((0, 1, 3), (1, 2, 4), (0, 2, 5), (0, 1, 2))]).T
    np.testing.assert_array_equal(edge_cover(sets), sets[:, :3])
    assert edge_cover(np.eye(3, dtype=bool)).shape == (3, 0)


@few
@given(st.integers(0, 100_000))
def test_the_clique_is_a_largest_one(seed):
    active, _ = instance(seed)
    graph = conflict_graph(maximal_sets(active))
    clique = largest_clique(maximal_sets(active))
    assert all(graph[i, j] for i, j in combinations(clique, 2))
    larger = combinations(range(len(active)), len(clique) + 1)
    assert not any(all(graph[i, j] for i, j in combinations(c, 2)) for c in larger)


@few
@given(st.integers(0, 100_000))
def test_colours_exist_exactly_from_the_fewest_on(seed):
    active, _ = instance(seed)
    sets, number = free(active), brute_number(active)(tuple(range(len(active))))
    assert number < 2 or colour(sets, number - 1) is None
    colours = colour(sets, number)
    assert colours is not None
    assert all(fits(active, np.flatnonzero(colours == e)) for e in range(number))


def test_a_ring_of_five_needs_three_although_no_three_conflict():
    assert len(largest_clique(maximal_sets(RING))) == 2
    assert colour(free(RING), 2) is None
    assert fewest_colours(free(RING))[1] == 3


def test_greedy_colours_never_clash():
    graph = conflict_graph(RING)
    colours = greedy(graph, free(RING))
    assert not (graph & (colours[:, None] == colours)).any()


def test_colours_that_greedy_misses_are_found():
    missed = 0
    for seed in range(25):
        sides = np.arange(24) % 3  # items of one side never conflict: three colours do, and a triangle needs them
        pairs = np.argwhere(np.triu(sides[:, None] != sides))
        pairs = pairs[np.random.default_rng(seed).random(len(pairs)) < 0.3]
        sets = np.zeros((24, len(pairs)), dtype=bool)
        sets[pairs.T, np.arange(len(pairs))] = True
        missed += greedy(conflict_graph(sets), Instance.free(sets)).max() > 2
        colours = colour(Instance.free(sets), 3)
        assert colours is not None
        assert (colours[pairs[:, 0]] != colours[pairs[:, 1]]).all()
    assert missed > 0


def test_the_core_keeps_what_has_enough_conflicts_among_itself():
    graph = np.zeros((6, 6), dtype=bool)
    graph[:5, :5] = conflict_graph(RING)
    graph[4, 5] = graph[5, 4] = True
    assert core(graph, 2).tolist() == [True] * 5 + [False]
    assert not core(graph, 3).any()


def test_the_heaviest_expression_hits_what_it_must():
    weights, everything = np.array([5.0, 1, 1, 1, 1]), np.ones(5, dtype=bool)
    sets = free(RING)
    assert 0 in heaviest(sets, weights, everything).items
    assert 1 in heaviest(sets, weights, everything, [np.array([1])]).items


def test_what_is_hard_is_paid_for_where_the_number_is_not_at_stake():
    free_of_clashes = free(np.eye(2, dtype=bool))
    everything, cost = np.ones(2, dtype=bool), ((0, 1, 1),)
    assert heaviest(free_of_clashes, np.array([1.0, 0.05]), everything, costs=cost).items.tolist() == [0]
    assert heaviest(free_of_clashes, np.array([1.0, 0.15]), everything, costs=cost).items.tolist() == [0, 1]


def test_without_a_proof_a_known_colour_is_filled_up():
    colours = np.array([0, 1, 0, 1, 2])
    chosen = _heaviest_colour(free(RING), np.array([1.0, 1, 1, 1, 9]), np.ones(5, dtype=bool), colours, 0)
    assert 4 in chosen
    assert len(chosen) == 2
    assert fits(RING, chosen)


@pytest.fixture(scope="module")
def used(rig):
    return tuple(name for name, moved in zip(rig.names, rig.displacement @ rig.skin, strict=True) if moved > 1)


@pytest.fixture(scope="module")
def packing(rig, used):
    return pack(rig, used, PackingSettings())


@pytest.mark.parametrize("method", ["minimum", "sequential"])
@pytest.mark.parametrize("paired", [True, False])
def test_a_packing_holds_for_code_that_knows_no_solver(rig, used, method, paired):
    packing = pack(rig, used, PackingSettings(method=method, paired=paired, mu=0.25))
    assert packing_faults(rig, used, packing, 0.25) == ()


def test_the_sample_list_is_proved_shortest_by_its_clique_alone(packing):
    assert packing.proven_optimal
    assert packing.order_proven
    assert packing.objective == len(packing.clique) == len(packing.expressions)


@pytest.mark.parametrize("mu", [0.25, 0.4])
def test_no_list_is_shorter_than_the_minimum_and_none_starts_better_than_the_sequence(rig, used, mu):
    least, sequence = (pack(rig, used, PackingSettings(method=m, mu=mu)) for m in ("minimum", "sequential"))
    assert least.objective <= sequence.objective
    assert least.bound == sequence.bound
    assert sequence.expressions[0].gain >= least.expressions[0].gain - 1e-6


def test_covered_adds_up_to_everything(packing):
    assert np.cumsum([e.gain for e in packing.expressions]) == pytest.approx(
        [e.covered for e in packing.expressions], abs=1e-4
    )
    assert packing.expressions[-1].covered == pytest.approx(1, abs=1e-4)


def test_a_limit_keeps_the_first_expressions_and_names_the_rest(rig, used, packing):
    short = pack(rig, used, PackingSettings(limit=5))
    assert short.expressions == packing.expressions[:5]
    assert set(short.left_out) == {name for e in packing.expressions[5:] for name in e.blendshapes}
    assert packing_faults(rig, used, short, 0.3) == ()


def test_partners_are_performed_together_and_both_eyes_look_one_way(packing):
    place = {name: e.name for e in packing.expressions for name in e.blendshapes}
    assert all(place[a] == place[b] for a, b in packing.pairs)
    assert place["eyeLookOutLeft"] == place["eyeLookInRight"]
    assert place["eyeLookInLeft"] == place["eyeLookOutRight"]


def test_eyes_that_would_part_are_no_partners_where_a_look_is_incomplete(rig, used):
    some = tuple(name for name in used if not name.startswith("eyeLookIn"))
    assert not {"eyeLookOutLeft", "eyeLookOutRight"} & {name for pair in performed_together(rig, some) for name in pair}


def test_no_expression_asks_for_what_no_face_can_do(rig, used, packing):
    never = never_together(rig, used)
    assert ("eyeBlinkLeft", "eyeWideLeft") in never
    assert ("jawOpen", "mouthClose") in never
    assert ("eyeLookInLeft", "eyeLookOutLeft") in never
    assert ("eyeLookInLeft", "eyeLookOutRight") not in never
    assert not any({a, b} <= set(e.blendshapes) for a, b in never for e in packing.expressions)
    assert packing.exclusive == never
    assert pack(rig, used, PackingSettings(method="minimum", poseable=False)).exclusive == ()


def test_a_corrective_is_performed_on_what_it_corrects(rig, used, packing):
    (shot,) = (e for e in packing.expressions if "mouthClose" in e.blendshapes)
    assert packing.drivers == (("mouthClose", "jawOpen"),)
    assert shot.drivers == ("jawOpen",)
    assert shot.pose["jawOpen"] == 1
    others = [name for name in shot.blendshapes if name != "mouthClose"]
    jaw, *active = active_sets(rig, ("jawOpen", *others), 0.3)
    assert not any((jaw & one).any() for one in active)
    assert pack(rig, used, PackingSettings(method="minimum", poseable=False)).drivers == ()


def test_the_same_input_gives_the_same_packing(rig, used, packing):
    assert pack(rig, used, PackingSettings()) == packing


def test_uniqueness_changes_the_order_and_not_the_number(rig, used, packing):
    unique = pack(rig, used, PackingSettings(method="minimum", uniqueness=1.0))
    assert unique.objective == packing.objective
    assert packing_faults(rig, used, unique, 0.3) == ()


def test_a_target_that_differs_at_the_eyes_brings_the_eyes_forward(rig, used, packing):
    lids = active_sets(rig, ("eyeBlinkLeft", "eyeBlinkRight"), 0.3).any(axis=0)
    target = rig.neutral.copy()
    target[lids] += np.random.default_rng(0).normal(size=(int(lids.sum()), 3))
    towards = pack(rig, used, PackingSettings(distortion=1.0), target=target)
    assert "eyeBlinkLeft" in towards.expressions[0].blendshapes
    assert towards.expressions[0].gain != packing.expressions[0].gain


def test_the_number_does_not_depend_on_the_unit_or_the_order_of_blendshapes(rig, used, packing):
    turned = tuple(reversed(used))
    quick = PackingSettings(method="minimum")
    assert pack(rig, turned, quick).objective == packing.objective
    large = replace(rig, neutral=10 * rig.neutral, deltas=10 * rig.deltas)
    assert pack(large, used, quick).objective == packing.objective


def test_a_target_on_another_mesh_is_refused(rig, used):
    with pytest.raises(RigError, match=r"target neutral has 3 vertices, .* has 4,939"):
        pack(rig, used, PackingSettings(), target=np.zeros((3, 3)))


def test_nothing_to_pack_is_refused(rig):
    with pytest.raises(RigError, match="no blendshape moves the skin"):
        pack(rig, (), PackingSettings())


def test_one_blendshape_is_one_expression(rig):
    packing = pack(rig, ("jawOpen",), PackingSettings())
    assert packing.objective == packing.bound == 1
    assert packing.expressions[0].covered == 1
    assert packing_faults(rig, ("jawOpen",), packing, 0.3) == ()


def _merge_first_two(packing):
    first, second, *rest = packing.expressions
    merged = change(first, blendshapes=first.blendshapes + second.blendshapes)
    return change(packing, expressions=(merged, *rest), objective=packing.objective - 1)


FORGERIES = [
    ("share .* active vertices", _merge_first_two),
    ("listed 0 times", lambda p: change(p, expressions=p.expressions[1:], objective=p.objective - 1)),
    ("expected together", lambda p: change(p, pairs=(*p.pairs, ("jawOpen", "jawLeft")))),
    ("are no partners", lambda p: change(p, pairs=(*p.pairs, ("jawOpen", "jawLeft")))),
    ("exclude each other", lambda p: change(p, exclusive=(*p.exclusive, ("browInnerUp", "jawOpen")))),
    ("do not conflict", lambda p: change(p, clique=("browInnerUp", *p.clique[1:]))),
    ("do not conflict", lambda p: change(p, clique=(p.clique[0], *p.clique[:-1]))),
    ("certificates prove", lambda p: change(p, bound=len(p.clique) - 1, proven_optimal=False)),
    ("proof is misstated", lambda p: change(p, proven_optimal=False)),
    ("expressions listed", lambda p: change(p, objective=p.objective + 1)),
    ("is no corrective", lambda p: change(p, drivers=(*p.drivers, ("browInnerUp", "jawOpen")))),
    ("its blendshapes need", lambda p: change(p, expressions=tuple(change(e, drivers=()) for e in p.expressions))),
    ("movements at once, expected at most 1", lambda p: change(p, most_things=1)),
    ("costs 0, not 3", lambda p: change(p, hard=(("jawOpen", "browInnerUp", 3),))),
    ("are split and no pair", lambda p: change(p, relaxed=(("jawOpen", "browInnerUp"),))),
    ("no halves of one movement", lambda p: change(p, local=(("jawOpen", "browInnerUp"),))),
    ("cannot be performed", lambda p: change(p, colliding=(p.expressions[0].blendshapes[:2],))),
    ("cannot be performed", lambda p: change(p, exclusive=(*p.exclusive, tuple(p.expressions[0].blendshapes[:2])))),
]


@pytest.mark.parametrize(("fault", "forge"), FORGERIES)
def test_a_false_packing_is_found_out(rig, used, packing, fault, forge):
    faults = packing_faults(rig, used, forge(packing), 0.3)
    assert any(re.search(fault, line) for line in faults), faults


def test_who_proves_the_number_is_told(packing):
    assert (packing.bound_from, packing.gap) == ("clique", 0)
    assert change(packing, clique=packing.clique[1:], things=0).bound_from == "solver"
    counted = change(packing, clique=packing.clique[1:], things=2 * packing.bound, most_things=2)
    assert counted.bound_from == "count"
    assert change(packing, bound=packing.bound - 2).gap == 2


def test_without_time_for_a_proof_the_list_holds_and_its_gap_is_told(monkeypatch):
    monkeypatch.setattr("capture_plan.solver.WORK_LIMIT", 0.0)
    order, bound = minimum(free(RING), lambda packed: np.arange(1.0, 6))
    assert (len(order.expressions), bound) == (3, 2)
    assert not order.proven
    assert sorted(i for e in order.expressions for i in e.tolist()) == list(range(5))
    assert all(fits(RING, e) for e in order.expressions)


def test_several_targets_are_weighed_and_each_must_fit(rig, used, packing):
    wide, long = rig.neutral * [1.3, 1, 1], rig.neutral * [1, 1.3, 1]
    asked = PackingSettings(method="minimum", distortion=1.0)
    one, two = (pack(rig, used, asked, target=t) for t in (wide, (wide, long)))
    assert [e.gain for e in one.expressions] != [e.gain for e in two.expressions]
    assert one == pack(rig, used, asked, target=(wide, wide))
    with pytest.raises(RigError, match=r"target neutral has 3 vertices"):
        pack(rig, used, PackingSettings(), target=(wide, np.zeros((3, 3))))


def test_partners_that_share_much_are_told(packing, rig, used):
    active = dict(zip(used, active_sets(rig, used, 0.3), strict=True))
    for a, b in packing.pairs:
        share = (active[a] & active[b]).sum() / min(active[a].sum(), active[b].sum())
        assert (share > 0.2) == any(overlap.names == (a, b) for overlap in packing.overlaps)


def test_expressions_are_numbered_in_the_order_of_shooting(packing):
    assert [e.name for e in packing.expressions[:2]] == ["E01", "E02"]
    assert all(isinstance(e, Expression) and set(e.weights) == {1.0} for e in packing.expressions)
