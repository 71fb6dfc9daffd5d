"""The closed forms of the thin-shell optimiser against computing everything anew."""

import numpy as np
import pytest

from capture_plan.shell.model import Shell
from capture_plan.shell.motion import Motion
from capture_plan.shell.scores import (
    add_pair_scores,
    add_scores,
    drop_score,
    open_vertices,
    swap_scores,
    two_scores,
)
from capture_plan.shell.state import State
from capture_plan.shell.updates import add, drop, swap
from tests.solids import sphere, together

CLOSE = 1e-9


def bumpy(seed=0, rings=18, around=24):
    """An irregular closed surface of a few hundred vertices."""
    vertices, triangles = sphere(rings, around)
    return vertices * [1, 1.2, 0.8] + np.random.default_rng(seed).normal(0, 1, vertices.shape), triangles


def shell_of(boundary):
    vertices, triangles = bumpy()
    return Shell(vertices, triangles, vertices[:, 2] < -50 if boundary else np.zeros(len(vertices), dtype=bool))


def two_pieces():
    """One ball held at the back, one loose."""
    held, loose = bumpy(0, 12, 16), bumpy(1, 10, 14)
    vertices, triangles = together(held, (loose[0] + [400, 0, 0], loose[1]))
    fixed = vertices[:, 2] < -50
    fixed[len(held[0]) :] = False
    return Shell(vertices, triangles, fixed)


SHELLS = {"boundary": lambda: shell_of(True), "no boundary": lambda: shell_of(False), "two pieces": two_pieces}


@pytest.fixture(params=[(name, weighted) for name in SHELLS for weighted in (False, True)], ids=str)
def state(request):
    name, weighted = request.param
    shell, rng = SHELLS[name](), np.random.default_rng(1)
    v = len(shell.vertices)
    motion = Motion(rng.normal(0, 1, (v, 7)), rng.uniform(0.1, 3, v) if weighted else np.ones(v))
    free = np.flatnonzero(~shell.fixed)
    loose = free[shell.piece[free] == shell.piece.max()]
    markers = np.unique(np.concatenate([rng.choice(free, 6, replace=False), rng.choice(loose, 3, replace=False)]))
    partner = np.arange(v)[::-1].copy()
    return State(shell, motion, markers.tolist(), partner=partner)


def anew(state, markers):
    return State(state.shell, state.motion, markers, partner=state.partner)


def exact_error(state, markers):
    """From the weights alone."""
    H = np.array(markers)
    return state.motion.squared_error(state.shell.weights(H), H)


def some(state, count=6):
    return np.random.default_rng(3).choice(np.flatnonzero(open_vertices(state)), count, replace=False).tolist()


def assert_same(state, other):
    order = [other.markers.index(h) for h in state.markers]
    for name in ("R", "Z", "gamma", "nu", "gamma_partner", "nu_partner"):
        a, b = getattr(state, name), getattr(other, name)
        assert abs(a - b).max() <= CLOSE * abs(b).max(), name
    for name in ("W", "T"):
        a, b = getattr(state, name), getattr(other, name)[:, order]
        assert abs(a - b).max() <= CLOSE * abs(b).max(), name


def test_the_error_is_that_of_the_weights(state):
    assert state.error == pytest.approx(exact_error(state, state.markers), rel=CLOSE)


def test_scores_of_adding_are_errors_with_one_more_marker(state):
    scores = add_scores(state)
    for v in some(state):
        assert scores[v] == pytest.approx(exact_error(state, [*state.markers, v]), rel=CLOSE)
    assert np.isinf(scores[state.markers]).all()
    assert np.isinf(scores[state.shell.fixed]).all()


def test_scores_of_dropping_are_errors_with_one_less(state):
    for j in range(len(state.markers)):
        left = state.markers[:j] + state.markers[j + 1 :]
        assert drop_score(state, j) == pytest.approx(exact_error(state, left), rel=CLOSE)


def test_scores_of_swapping_are_errors_after_the_swap(state):
    at = np.array(some(state))
    for j in range(len(state.markers)):
        left = state.markers[:j] + state.markers[j + 1 :]
        for v, score in zip(at.tolist(), swap_scores(state, j, at), strict=True):
            assert score == pytest.approx(exact_error(state, [*left, v]), rel=CLOSE)
    assert np.isinf(swap_scores(state, 0, np.array(state.markers))).all()


def test_scores_of_pairs_are_errors_with_both(state):
    scores = add_pair_scores(state)
    pairs = np.flatnonzero(np.isfinite(scores))
    for v in np.random.default_rng(4).choice(pairs, 6, replace=False).tolist():
        both = [*state.markers, v, int(state.partner[v])]
        assert scores[v] == pytest.approx(exact_error(state, both), rel=CLOSE)


def test_scores_of_any_two_are_errors_with_both(state):
    a, b = np.split(np.array(some(state)), 2)
    scores = two_scores(state, a, b)
    for i, u in enumerate(a.tolist()):
        for j, v in enumerate(b.tolist()):
            assert scores[i, j] == pytest.approx(exact_error(state, [*state.markers, u, v]), rel=CLOSE)
    assert np.isinf(np.diag(two_scores(state, a, a))).all()
    assert np.isinf(two_scores(state, a, np.array(state.markers))).all()


def test_adding_gives_the_state_of_the_longer_layout(state):
    v = some(state)[0]
    add(state, v)
    assert_same(state, anew(state, state.markers))
    assert v in state.markers


def test_dropping_gives_the_state_of_the_shorter_layout(state):
    gone = state.markers[2]
    drop(state, 2)
    assert_same(state, anew(state, state.markers))
    assert gone not in state.markers


def test_dropping_what_was_added_changes_nothing(state):
    before = anew(state, state.markers)
    add(state, some(state)[1])
    drop(state, len(state.markers) - 1)
    assert_same(state, before)


def test_many_swaps_leave_the_state_right(state):
    for v in some(state, 12):
        swap(state, 0, v)
    assert_same(state, anew(state, state.markers))


def test_the_first_markers_are_scored_as_exactly_as_later_ones():
    shell, rng = two_pieces(), np.random.default_rng(5)
    v = len(shell.vertices)
    state = State(shell, Motion(rng.normal(0, 1, (v, 4)), np.ones(v)))
    held, loose = (rng.choice(np.flatnonzero((shell.piece == c) & ~shell.fixed), 4) for c in (-1, 0))
    scores = add_scores(state)
    add(state, int(loose[0]))
    assert state.error == pytest.approx(scores[loose[0]], rel=CLOSE)
    scores = add_scores(state)
    for h in [*held, *loose[1:]]:
        assert scores[h] == pytest.approx(exact_error(state, [*state.markers, int(h)]), rel=CLOSE)


def test_the_last_marker_of_a_floating_piece_stays():
    shell, rng = two_pieces(), np.random.default_rng(6)
    v = len(shell.vertices)
    loose = int(np.flatnonzero(shell.piece == 0)[5])
    held = np.flatnonzero(~shell.fixed & (shell.piece < 0))[[3, 30]].tolist()
    state = State(shell, Motion(rng.normal(0, 1, (v, 4)), np.ones(v)), [loose, *held])
    assert np.isinf(drop_score(state, 0))
    assert np.isinf(swap_scores(state, 0, np.arange(v))).all()
    assert np.isfinite(drop_score(state, 1))


@pytest.mark.parametrize("name", ["boundary", "two pieces"])
def test_the_first_marker_is_added_as_any_other(name):
    shell = SHELLS[name]()
    v = len(shell.vertices)
    state = State(shell, Motion(np.random.default_rng(0).normal(0, 1, (v, 5)), np.ones(v)))
    first = int(np.flatnonzero(~shell.fixed & (shell.piece == shell.piece[~shell.fixed][0]))[0])
    add(state, first)
    assert_same(state, anew(state, [first]))
