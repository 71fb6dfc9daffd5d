"""Laws of the thin shell: its stiffness, its inverse, the weights of its markers."""

import weakref

import numpy as np
import pytest
from scipy.sparse import csc_array

from capture_plan.errors import InfeasibleError, RigError
from capture_plan.shell.model import Shell, held_shell
from capture_plan.shell.selected_inverse import inverse_entries
from tests.shell.test_shell_state import SHELLS, bumpy, shell_of
from tests.solids import sphere, together


def inverse(shell):
    """G, by dense algebra."""
    G, inside = np.zeros((len(shell.vertices),) * 2), np.ix_(shell.free, shell.free)
    G[inside] = np.linalg.inv(shell.stiffness.toarray()[inside])
    return G


def some_markers(shell, count=12, seed=0):
    """At least three on each piece."""
    rng, free = np.random.default_rng(seed), np.flatnonzero(~shell.fixed)
    groups = [free[shell.piece[free] == c] for c in np.unique(shell.piece[free])]
    return np.concatenate([rng.choice(group, count // len(groups), replace=False) for group in groups])


@pytest.fixture(params=SHELLS)
def shell(request):
    return SHELLS[request.param]()


def test_stiffness_is_symmetric_never_negative_and_leaves_constants_alone(shell):
    A = shell.stiffness.toarray()
    assert np.allclose(A, A.T, atol=1e-12 * abs(A).max())
    assert np.linalg.eigvalsh(A).min() > -1e-9 * abs(A).max()
    assert abs(A.sum(axis=1)).max() < 1e-9 * abs(A).max()


def test_bending_is_ten_times_stiffer_in_a_tenth_of_the_unit():
    """kB has one more squared length than kS: the same shell in centimetres needs kB / 100."""
    mm = shell_of(True)
    cm = Shell(mm.vertices / 10, mm.triangles, mm.fixed, bending=mm.bending / 100)
    H = some_markers(mm)
    assert np.allclose(mm.weights(H), cm.weights(H), atol=1e-9)


def test_weights_are_those_of_hard_constraints(shell):
    H = some_markers(shell)
    W, A = shell.weights(H), shell.stiffness.toarray()
    rest = np.setdiff1d(np.flatnonzero(~shell.fixed), H)
    direct = np.linalg.solve(A[np.ix_(rest, rest)], -A[np.ix_(rest, H)])
    assert abs(W[rest] - direct).max() < 1e-8
    assert np.allclose(W[H], np.eye(len(H)), atol=1e-8)
    assert not W[shell.fixed].any()


def test_weights_sum_to_one_where_nothing_is_fixed():
    shell = shell_of(False)
    assert np.allclose(shell.weights(some_markers(shell)).sum(axis=1), 1, atol=1e-9)


def test_weights_do_not_depend_on_which_vertex_is_grounded():
    shell = shell_of(False)
    v = len(shell.vertices)
    back = Shell(shell.vertices[::-1].copy(), v - 1 - shell.triangles, shell.fixed)
    H = some_markers(shell)
    assert set(np.setdiff1d(np.arange(v), shell.free)) != set(v - 1 - np.setdiff1d(np.arange(v), back.free))
    assert abs(shell.weights(H) - back.weights(v - 1 - H)[::-1]).max() < 1e-8


def test_a_grounded_vertex_can_carry_a_marker():
    shell = shell_of(False)
    grounded = np.setdiff1d(np.arange(len(shell.vertices)), shell.free)
    H = np.concatenate([grounded, np.setdiff1d(some_markers(shell), grounded)])
    assert np.allclose(shell.weights(H)[H], np.eye(len(H)), atol=1e-8)


def test_columns_and_diagonals_are_those_of_the_inverse(shell):
    G = inverse(shell)
    H = some_markers(shell)
    assert abs(shell.columns(H) - G[:, H]).max() < 1e-9 * G.max()
    assert abs(shell.gamma - np.diag(G)).max() < 1e-9 * G.max()
    assert abs(shell.nu - np.diag(G @ G)).max() < 1e-9 * np.diag(G @ G).max()


def test_entries_of_vertices_that_do_not_move_are_zero(shell):
    G, rng = inverse(shell), np.random.default_rng(0)
    pairs = rng.integers(0, len(G), (300, 2))
    pairs[:20] = np.setdiff1d(np.arange(len(G)), shell.free)[:1]
    pairs[:10, 1] = shell.free[:10]
    g, gsg = shell.entries(np.ones(len(G)), pairs)
    assert not g[:20].any()
    assert not gsg[:20].any()
    assert abs(g - G[tuple(pairs.T)]).max() < 1e-9 * G.max()
    assert abs(gsg - (G @ G)[tuple(pairs.T)]).max() < 1e-9 * (G @ G).max()


@pytest.mark.parametrize("part", [20, 60, 10_000])
def test_entries_of_the_inverse_hold_however_the_mesh_is_cut(part):
    shell, rng = shell_of(True), np.random.default_rng(0)
    f = shell.free
    A, s, pairs = csc_array(shell.stiffness[f][:, f]), rng.uniform(0, 2, len(f)), rng.integers(0, len(f), (2000, 2))
    G = np.linalg.inv(A.toarray())
    GSG = G @ np.diag(s) @ G
    g, gsg = inverse_entries(A, shell.vertices[f], s, pairs, part=part)
    assert abs(g - G[tuple(pairs.T)]).max() < 1e-9 * G.max()
    assert abs(gsg - GSG[tuple(pairs.T)]).max() < 1e-9 * GSG.max()


def test_entries_that_are_remembered_are_those_of_the_question():
    """Of the weights and pairs asked for, however many others were asked for between."""
    shell, rng = shell_of(True), np.random.default_rng(0)
    v = len(shell.vertices)
    asked = [(rng.uniform(0, 2, v), rng.integers(0, v, (50, 2))) for _ in range(3)]
    questions = [(s, pairs) for s, _ in asked for _, pairs in asked]
    for s, pairs in [*questions, *questions[::-1]]:
        new = Shell(shell.vertices, shell.triangles, shell.fixed).entries(s, pairs)
        assert all(np.array_equal(x, y) for x, y in zip(shell.entries(s, pairs), new, strict=True))


def test_a_second_search_on_a_shell_does_not_invert_it_again():
    shell = shell_of(True)
    pairs = np.stack([np.arange(len(shell.vertices))] * 2, axis=1)
    first = shell.entries(np.ones(len(pairs)), pairs)
    assert shell.entries(np.ones(len(pairs)), pairs.copy())[0] is first[0]


def test_a_shell_that_is_held_is_found_again_and_only_by_its_like():
    vertices, triangles = bumpy()
    fixed = vertices[:, 2] < 0
    held = held_shell(vertices, triangles, fixed)
    assert held_shell(vertices.copy(), triangles.copy(), fixed.copy()) is held
    for other in (
        held_shell(vertices + 1.0, triangles, fixed),
        held_shell(vertices, triangles[1:], fixed),
        held_shell(vertices, triangles, ~fixed),
    ):
        assert other is not held
    gone = weakref.ref(held)
    del held, other
    assert gone() is None


def test_a_triangle_without_area_changes_nothing():
    shell = shell_of(True)
    a, b = shell.triangles[5, :2]
    flat = np.concatenate([shell.triangles, [[a, b, b], [a, a, a]]])
    H = some_markers(shell)
    assert np.array_equal(Shell(shell.vertices, flat, shell.fixed).weights(H), shell.weights(H))


def test_what_no_shell_is_is_refused():
    vertices, triangles = together(bumpy(), sphere(3, 4))
    nothing = np.zeros(len(vertices), dtype=bool)
    with pytest.raises(InfeasibleError, match="no marker"):
        Shell(vertices, triangles, nothing).weights(np.array([3, 30]))
    with pytest.raises(InfeasibleError, match="another marker"):
        shell_of(False).weights(np.array([3, 3]))
    with pytest.raises(RigError, match="no triangle with an area"):
        _ = Shell(np.vstack([vertices, [[0, 0, 0]]]), triangles, np.append(nothing, False)).stiffness
    with pytest.raises(RigError, match="bending"):
        Shell(vertices, triangles, nothing, bending=0.0)
    with pytest.raises(RigError, match="stretching"):
        Shell(vertices, triangles, nothing, stretching=-1.0)
