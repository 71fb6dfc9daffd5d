"""The exact programs against trying every list there is: limits, exclusions, difficulty, edits and pairs."""

from itertools import combinations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from capture_plan.errors import InfeasibleError
from capture_plan.expressions import PackingSettings, packing_faults
from capture_plan.expressions.compatibility import groups
from capture_plan.expressions.conflicts import conflict_graph, maximal_sets
from capture_plan.expressions.instance import FREE, Instance, PlaceError, locked_apart
from capture_plan.expressions.minimum import fewest_colours, heaviest_first, minimum, shortest
from capture_plan.expressions.ordered import order_refuted
from capture_plan.expressions.pack import pack
from capture_plan.expressions.problem import state_problem
from capture_plan.expressions.revise import repack
from capture_plan.expressions.sequential import sequential
from capture_plan.expressions.settings import Edits
from capture_plan.rig import Rig

few = settings(max_examples=40, deadline=None)
many = settings(max_examples=200, deadline=None)  # one in four has a cost that cannot be avoided
seeds = st.integers(0, 100_000)


def partitions(items):
    """Every way of sharing items out to expressions."""
    if not items:
        yield []
        return
    first, *rest = items
    for parts in partitions(rest):
        yield [[first], *parts]
        for n in range(len(parts)):
            yield [*parts[:n], [first, *parts[n]], *parts[n + 1 :]]


def random_instance(seed, largest=7):
    """Items with overlaps, one or two movements each, a limit on them, some locked, some hard together."""
    rng = np.random.default_rng(seed)
    g = int(rng.integers(1, largest + 1))
    active = rng.random((g, 7)) < rng.uniform(0.05, 0.35)
    things, most = rng.integers(1, 3, g), int(rng.integers(2, 6))
    place = np.where(rng.random(g) < 0.2, rng.integers(0, 3, g), FREE)
    often = rng.choice([0.0, 0.3, 0.9])  # where nearly everything is hard, no shortest list is free of cost
    hard = [pair for pair in combinations(range(g), 2) if rng.random() < often]
    free = Instance(maximal_sets(active), things, most, place).apart(locked_apart(place))
    clash = conflict_graph(free.sets)
    costs = tuple((i, j, int(rng.integers(1, 4))) for i, j in hard if not clash[i, j])
    return Instance(free.sets, things, most, place, costs), rng.uniform(0.1, 1, g).round(6)


def merged(instance):
    """Locked to one expression is together: only such instances are stated."""
    locked = instance.place[instance.place != FREE]
    return len(set(locked.tolist())) == len(locked)


def fits(instance, block):
    separate = (instance.sets[block].sum(axis=0) <= 1).all()
    return separate and instance.things[block].sum() <= instance.most


def keeps_every_limit(instance, order):
    """Whether each item is in one expression, where it is locked, and every expression fits."""
    each_once = sorted(i for e in order.expressions for i in e.tolist()) == list(range(len(instance)))
    in_place = all(instance.place[i] in (FREE, n) for n, e in enumerate(order.expressions) for i in e)
    return each_once and in_place and all(fits(instance, e.tolist()) for e in order.expressions)


def in_order(instance, parts, weights):
    """Expressions of a list where locks put them, the rest by weight; None where a lock is beyond the end."""
    at = {int(max(instance.place[part])): part for part in parts if max(instance.place[part]) != FREE}
    rest = sorted((part for part in parts if part not in at.values()), key=lambda part: weights[part].sum())
    if at and max(at) >= len(parts):
        return None
    return [at[e] if e in at else rest.pop() for e in range(len(parts))]


def best_by_trying(instance, weights):
    """Fewest expressions, least cost, and of these lists the weights of the one whose prefixes weigh most."""
    lists = [parts for parts in partitions(list(range(len(instance)))) if all(fits(instance, part) for part in parts)]
    fewest = min(len(parts) for parts in lists)
    reached = [o for parts in lists if len(parts) == fewest and (o := in_order(instance, parts, weights))]
    if not reached:
        return fewest, None, None
    cost = min(sum(instance.cost(part) for part in parts) for parts in reached)
    easiest = [parts for parts in reached if sum(instance.cost(part) for part in parts) == cost]
    return fewest, cost, max([weights[part].sum().round(5) for part in parts] for parts in easiest)


@few
@given(seeds)
def test_where_only_counting_limits_a_list_it_is_as_short_as_the_count_says(seed):
    """Movements of one each, nothing apart: full expressions and one of the rest."""
    rng = np.random.default_rng(seed)
    g, most = int(rng.integers(1, 7)), int(rng.integers(1, 5))
    instance = Instance(np.zeros((g, 0), dtype=bool), np.ones(g, dtype=int), most, np.full(g, FREE))
    assert instance.least == min(len(p) for p in partitions(list(range(g))) if all(len(part) <= most for part in p))


@many
@given(seeds)
def test_the_shortest_easiest_and_best_ordered_list_is_found(seed):
    instance, weights = random_instance(seed)
    assume(merged(instance))
    fewest, cost, gains = best_by_trying(instance, weights)
    if gains is None:
        with pytest.raises(PlaceError):
            minimum(instance, lambda packed: weights)
        return
    order, bound = minimum(instance, lambda packed: weights)
    assert order.proven
    assert len(order.expressions) == bound == fewest
    assert sum(instance.cost(e.tolist()) for e in order.expressions) == cost
    assert [weights[e].sum() for e in order.expressions] == pytest.approx(gains, abs=1e-4)


@few
@given(seeds)
def test_an_order_that_no_work_is_left_for_is_as_short_and_as_easy_and_not_called_proved(seed):
    instance, weights = random_instance(seed)
    assume(merged(instance))
    try:
        found = shortest(instance)
    except PlaceError:
        return
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("capture_plan.expressions.minimum.ORDER_WORK", 0.0)
        order = heaviest_first(found, lambda packed: weights)
    assert not order.proven
    assert len(order.expressions) <= found.bound
    assert sum(instance.cost(e.tolist()) for e in order.expressions) <= found.budget
    assert keeps_every_limit(instance, order)


@few
@given(seeds)
def test_sequential_lists_keep_every_limit(seed):
    instance, weights = random_instance(seed)
    assume(merged(instance))
    try:
        order = sequential(instance, lambda packed: weights)
    except PlaceError:
        return
    assert keeps_every_limit(instance, order)


@few
@given(seeds, st.integers(1, 4))
def test_a_smaller_limit_never_makes_a_list_shorter(seed, most):
    instance, _ = random_instance(seed)
    most += int(instance.things.max())
    numbers = []
    for limit in (most, most - 1):
        colours, bound = fewest_colours(Instance(instance.sets, instance.things, limit, instance.place))
        assert bound == colours.max() + 1
        numbers.append(bound)
    assert numbers == sorted(numbers)


def small_face(seed):
    """A flat mirror-symmetric face of 9 x 9 vertices; halves of movements with their mirror images, and whole ones."""
    rng = np.random.default_rng(seed)
    x, y = (axis.ravel() for axis in np.meshgrid(np.arange(-4, 5) * 10.0, np.arange(-4, 5) * 10.0))
    neutral = np.stack([x, y, 0 * x], axis=1)
    corner = np.array([9 * row + column for row in range(8) for column in range(8)])
    mirror = np.arange(81).reshape(9, 9)[:, ::-1].ravel()

    def spot(centre, extent):
        return (np.hypot(x - centre[0], y - centre[1]) <= extent).astype(np.float32)

    moved = []
    for _ in range(int(rng.integers(1, 4))):
        half = spot((rng.uniform(8, 35), rng.uniform(-40, 40)), rng.uniform(9, 18))
        moved += [half, half[mirror]]
    for _ in range(int(rng.integers(1, 4))):
        whole = spot((rng.uniform(-8, 8), rng.uniform(-40, 40)), rng.uniform(9, 20))
        moved.append(whole)
    deltas = np.zeros((len(moved), 81, 3), dtype=np.float32)
    deltas[:, :, 2] = np.array(moved) * rng.uniform(1, 5, (len(moved), 1))
    return Rig(
        name="face",
        neutral=neutral,
        triangles=np.concatenate([corner[:, None] + [0, 1, 9], corner[:, None] + [1, 10, 9]]),
        deltas=deltas,
        names=tuple(f"shape{k}" for k in range(len(moved))),
        skin=np.ones(81, dtype=bool),
        parts=np.zeros(81, dtype=np.int32),
        part_names=("skin",),
        source_index=np.arange(81),
    )


def random_edits(rng, names):
    """One or two of everything that a person may ask for."""
    pick = [tuple(rng.choice(names, 2, replace=False).tolist()) for _ in range(2)]
    kind = int(rng.integers(4))
    if kind == 0:
        return Edits(together=(pick[0],))
    if kind == 1:
        return Edits(apart=tuple(pick))
    if kind == 2:
        return Edits(locked={pick[0][0]: int(rng.integers(1, 4)), pick[0][1]: int(rng.integers(1, 4))})
    return Edits(dropped=(pick[0][0],))


def possible(rig, packing, colliding, most):
    """Every list of whole blendshapes that keeps pairs, edits and limits, by the letter of the record alone."""
    names = tuple(name for name in rig.names if name not in packing.edits.dropped)
    active = dict(zip(rig.names, rig.displacement > 0, strict=True))
    retained = [pair for pair in packing.pairs if pair not in packing.relaxed]
    items = groups(names, [*retained, *packing.edits.companions])
    apart = {frozenset(pair) for pair in (*colliding, *packing.edits.apart)}
    partners = {frozenset(pair) for pair in packing.pairs}
    numbers = packing.edits.numbers

    def clash(a, b):
        if frozenset((a, b)) in apart or (a in numbers and b in numbers and numbers[a] != numbers[b]):
            return True
        return frozenset((a, b)) not in partners and bool((active[a] & active[b]).any())

    for parts in partitions(items):
        blocks = [tuple(name for item in part for name in item) for part in parts]
        if any(clash(a, b) for block in blocks for a, b in combinations(block, 2)):
            continue
        if max(len(groups(block, list(packing.pairs))) for block in blocks) <= most:
            yield blocks


@few
@given(seeds)
def test_lists_of_a_face_with_pairs_and_edits_are_shortest_and_change_least(seed):
    rng = np.random.default_rng(seed)
    rig, most = small_face(seed), int(rng.integers(1, 4))
    edits = random_edits(rng, rig.names)
    colliding = (tuple(rng.choice(rig.names, 2, replace=False).tolist()),)
    plain = PackingSettings(mu=0.5, poseable=False, most_things=most)
    former = pack(rig, rig.names, plain)
    try:
        edited = repack(rig, rig.names, plain, former, edits, apart=colliding)
    except InfeasibleError:
        return
    lists = list(possible(rig, edited, colliding, most))
    fewest = min(len(blocks) for blocks in lists)
    assert edited.objective == edited.solver_bound == fewest
    assert packing_faults(rig, rig.names, edited, 0.5) == ()
    was = [set(e.blendshapes) for e in former.expressions]
    if fewest == len(was) and not edits.numbers:
        most_kept = max(_retained(blocks, was) for blocks in lists if len(blocks) == fewest)
        assert edited.unmoved == most_kept
    else:
        assert edited.unmoved is not None


def _retained(blocks, was):
    """Most blendshapes that stay when expressions are numbered as is best."""
    if not blocks:
        return 0
    first, *rest = blocks
    return max(len(was[n] & set(first)) + _retained(rest, [*was[:n], *was[n + 1 :]]) for n in range(len(was)))


@few
@given(seeds)
def test_pairs_are_split_only_where_they_block(seed):
    rng = np.random.default_rng(seed)
    rig = small_face(seed)
    plain = PackingSettings(mu=0.5, poseable=False)
    pairs = state_problem(rig, rig.names, plain, None, ()).pairs
    assume(pairs)
    blocked = pairs[int(rng.integers(len(pairs)))]
    problem = state_problem(rig, rig.names, plain, None, (blocked,))
    assert problem.relaxed == (blocked,)
    assert state_problem(rig, rig.names, plain, None, ()).relaxed == ()


def test_an_order_is_judged_by_what_things_are_worth_once_the_expressions_before_are_done():
    """Three items that exclude each other; what is done is worth nothing more."""
    instance, information, seen = Instance.free(np.ones((3, 1), dtype=bool)), np.array([3.0, 2.0, 1.0]), []

    def weigh(packed):
        seen.append(packed.tolist())
        return np.where(packed, 0, information)

    down, up = [[frozenset({i}) for i in order] for order in ((0, 1, 2), (2, 1, 0))]
    assert not order_refuted(instance, weigh, "minimum", down)
    assert seen == [[False, False, False], [True, False, False], [True, True, False]]
    assert order_refuted(instance, weigh, "minimum", up)
