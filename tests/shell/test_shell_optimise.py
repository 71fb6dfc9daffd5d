"""Laws of the thin-shell optimiser."""

import numpy as np
import pytest
from scipy.sparse import csr_array

from capture_plan.errors import InfeasibleError
from capture_plan.mesh import near_table, surface_graph
from capture_plan.shell import MarkerProblem, Motion, Shell, nested, optimise
from capture_plan.shell.motion import TAIL_MM
from capture_plan.shell.search import MarkerSearch
from capture_plan.shell.sites import MarkerSites
from tests.shell.test_shell_state import SHELLS, shell_of
from tests.solids import sphere


def smooth_motion(shell, rows=9, seed=0):
    """Bumps in random directions."""
    rng = np.random.default_rng(seed)
    centre = shell.vertices[rng.choice(np.flatnonzero(~shell.fixed), rows)]
    near = np.exp(-np.square(shell.vertices[:, None] - centre).sum(axis=2) / (2 * 30.0**2))
    return Motion(near * rng.uniform(2, 6, rows), np.ones(len(shell.vertices)))


@pytest.fixture(params=SHELLS)
def shell(request):
    return SHELLS[request.param]()


def exact(shell, motion, markers):
    """E, from the weights alone."""
    H = np.array(markers)
    return motion.squared_error(shell.weights(H), H)


def rmse(shell, motion, markers):
    H = np.array(markers)
    return motion.rmse_mm(shell.weights(H), H)


def test_no_single_move_gains(shell):
    motion = smooth_motion(shell)
    result = optimise(MarkerProblem([(shell, motion)], candidates=~shell.fixed, tail_mm=0.0), 6)
    rng = np.random.default_rng(1)
    for j in range(6):
        for v in np.setdiff1d(rng.choice(np.flatnonzero(~shell.fixed), 20), result.markers).tolist():
            moved = [*result.markers[:j], v, *result.markers[j + 1 :]]
            if set(shell.piece[moved]) == set(shell.piece):
                assert rmse(shell, motion, moved) >= result.rmse_mm * (1 - 1e-9)


def test_greedy_takes_the_best_vertex_of_all(shell):
    motion = smooth_motion(shell)
    first = optimise(MarkerProblem([(shell, motion)], candidates=~shell.fixed, tail_mm=0.0), 2)
    third = optimise(MarkerProblem([(shell, motion)], candidates=~shell.fixed, tail_mm=0.0, pinned=first.markers), 3)
    rest = np.setdiff1d(np.flatnonzero(~shell.fixed), first.markers)[::7]
    assert third.rmse_mm <= min(rmse(shell, motion, [*first.markers, int(v)]) for v in rest) * (1 + 1e-9)


def test_every_stated_error_is_on_all_that_was_given(shell):
    """Also where the search saw a part of it alone."""
    motion = smooth_motion(shell, 40)
    search = MarkerSearch([(shell, motion)], MarkerSites(~shell.fixed), (), 1.0)
    search.grow(9)
    greedy_mm = rmse(shell, motion, search.state.markers)
    assert search.state.rmse_mm < greedy_mm * (1 - 1e-3)
    result = optimise(MarkerProblem([(shell, motion)], candidates=~shell.fixed, tail_mm=1.0), 9)
    assert result.greedy_mm == pytest.approx(greedy_mm, rel=1e-9)
    assert result.rmse_mm == pytest.approx(rmse(shell, motion, result.markers), rel=1e-9)
    assert result.curve_mm[5] == pytest.approx(rmse(shell, motion, result.order[:6]), rel=1e-9)
    assert len(set(result.markers)) == 9


@pytest.mark.parametrize("tail_mm", [0.1, 1.0, 10.0])
def test_rows_that_the_search_left_out_make_up_one_percent_at_most(shell, tail_mm):
    motion = smooth_motion(shell, 60)
    result = optimise(MarkerProblem([(shell, motion)], candidates=~shell.fixed, tail_mm=tail_mm), 12)
    assert result.seen_mm <= result.rmse_mm * (1 + 1e-9)
    assert result.rmse_mm <= 1.01 * result.seen_mm


@pytest.mark.parametrize("tail_mm", [1.0, 10.0])
def test_no_single_move_gains_on_the_rows_that_were_seen_last(shell, tail_mm):
    search = MarkerSearch([(shell, smooth_motion(shell, 60))], MarkerSites(~shell.fixed), (), tail_mm)
    search.grow(12)
    search.finish(joint=False)
    assert search.tail_mm < tail_mm
    scores = [search.state.swap_scores(j, np.flatnonzero(~shell.fixed)).min() for j in range(12)]
    assert min(scores) >= search.state.error * (1 - 1e-9)


def test_compression_loses_less_than_one_percent_of_the_error():
    """Of the layout that a search on all rows finds."""
    shell = shell_of(True)
    motion = smooth_motion(shell, 60)
    quick, whole = (
        optimise(MarkerProblem([(shell, motion)], candidates=~shell.fixed, tail_mm=tail), 20) for tail in (TAIL_MM, 0.0)
    )
    assert whole.seen_mm == pytest.approx(whole.rmse_mm, rel=1e-6)
    assert quick.rmse_mm == pytest.approx(whole.rmse_mm, rel=0.01)


def test_moves_never_go_uphill_and_more_markers_never_hurt(shell):
    motion = smooth_motion(shell)
    results = nested(MarkerProblem([(shell, motion)], candidates=~shell.fixed, tail_mm=0.0), (4, 6, 9))
    assert all(one.rmse_mm <= one.greedy_mm * (1 + 1e-9) for one in results)
    assert results[0].rmse_mm >= results[1].rmse_mm >= results[2].rmse_mm
    assert set(results[0].markers) < set(results[1].markers) < set(results[2].markers)


def test_one_more_marker_can_hurt_where_neighbours_move_apart():
    """It holds its vertex to the vertex's own track and takes the neighbours along; no placement is free of that."""
    shell = shell_of(True)
    noise = Motion(np.random.default_rng(0).normal(0, 1, (len(shell.vertices), 30)), np.ones(len(shell.vertices)))
    one, two = (optimise(MarkerProblem([(shell, noise)], candidates=~shell.fixed), n) for n in (1, 2))
    assert one.rmse_mm < two.rmse_mm


def test_the_order_is_a_curve_that_falls_to_the_layout(shell):
    motion = smooth_motion(shell)
    result = optimise(MarkerProblem([(shell, motion)], candidates=~shell.fixed, tail_mm=0.0), 7)
    assert sorted(result.order) == sorted(result.markers)
    assert (np.diff([c for c in result.curve_mm if np.isfinite(c)]) <= 1e-12).all()
    for m in (4, 5, 7):
        assert result.curve_mm[m - 1] == pytest.approx(rmse(shell, motion, result.order[:m]), rel=1e-9)


def test_kept_markers_stay_and_come_first():
    shell = shell_of(True)
    retained = tuple(np.flatnonzero(~shell.fixed)[[10, 100]].tolist())
    for joint in (False, True):
        result = optimise(
            MarkerProblem([(shell, smooth_motion(shell))], candidates=~shell.fixed, pinned=retained), 6, joint=joint
        )
        assert result.markers[:2] == retained
        assert set(result.order[:2]) == set(retained)


def test_only_candidates_carry_markers():
    shell = shell_of(True)
    candidates = shell.vertices[:, 1] > 0
    result = optimise(MarkerProblem([(shell, smooth_motion(shell))], candidates=candidates), 6)
    assert candidates[list(result.markers)].all()


def test_markers_keep_their_distance_along_the_skin():
    shell, far = shell_of(True), 45.0
    near = near_table(surface_graph(shell.vertices, shell.triangles), shell.vertices, far)
    motion = smooth_motion(shell)
    result = optimise(MarkerProblem([(shell, motion)], candidates=~shell.fixed, spacing=near), 8, joint=True)
    subset = near[list(result.markers)][:, list(result.markers)]
    assert subset.nnz == len(result.markers)
    with pytest.raises(InfeasibleError, match="room for"):
        optimise(MarkerProblem([(shell, motion)], candidates=~shell.fixed, spacing=near), 300)


def symmetric_shell():
    vertices, triangles = sphere(12, 24)
    mirror = np.array([int(np.square(vertices - v * [-1, 1, 1]).sum(axis=1).argmin()) for v in vertices])
    return Shell(vertices, triangles, vertices[:, 2] < -55), mirror


@pytest.mark.parametrize("count", [6, 7])
def test_a_symmetric_layout_is_its_own_mirror_image(count):
    shell, mirror = symmetric_shell()
    result = optimise(
        MarkerProblem([(shell, smooth_motion(shell))], candidates=~shell.fixed, mirror=mirror, tail_mm=0.0), count
    )
    assert set(mirror[list(result.markers)].tolist()) == set(result.markers)
    assert len(result.markers) == count
    assert result.rmse_mm == pytest.approx(rmse(shell, smooth_motion(shell), result.markers), rel=1e-9)


@pytest.mark.parametrize("seed", range(6))
def test_a_pair_counts_for_two_markers(seed):
    """It is placed where it gains more for each of its two than the best single marker of the middle does."""
    shell, mirror = symmetric_shell()
    motion, sites = smooth_motion(shell, 3, seed), MarkerSites(~shell.fixed, mirror=mirror)
    search = MarkerSearch([(shell, motion)], sites, (), 0.0)
    search.grow(4)
    H, E = tuple(search.state.markers), search.state.error
    free = np.setdiff1d(np.flatnonzero(~shell.fixed), H)
    singles = free[mirror[free] == free]
    pairs = free[(mirror[free] > free) & ~shell.fixed[mirror[free]]]
    gains = [(E - exact(shell, motion, [*H, h]), (h,)) for h in singles.tolist()]
    gains += [((E - exact(shell, motion, [*H, h, int(mirror[h])])) / 2, (h, int(mirror[h]))) for h in pairs.tolist()]
    best = max(gains)[1]
    search.grow(6)
    assert set(search.state.markers[4 : 4 + len(best)]) == set(best)


def test_a_symmetric_layout_keeps_to_its_candidates_and_distances():
    """Also where a candidate's mirror image is none, and where a vertex is too close to its own."""
    shell, mirror = symmetric_shell()
    candidates, far = ~shell.fixed & ~((shell.vertices[:, 0] > 0) & (shell.vertices[:, 1] > 0)), 40.0
    near = near_table(surface_graph(shell.vertices, shell.triangles), shell.vertices, far)
    motion = smooth_motion(shell, 30)
    H = list(optimise(MarkerProblem([(shell, motion)], candidates=candidates, mirror=mirror, spacing=near), 8).markers)
    assert candidates[H].all()
    assert set(mirror[H].tolist()) == set(H)
    assert near[H][:, H].nnz == len(H)


def test_two_vertices_in_one_place_are_too_close():
    """Their distance in the table is 0, and stored."""
    near = csr_array((np.zeros(4), ([0, 1, 1, 2], [1, 0, 2, 1])), shape=(4, 4))
    sites = MarkerSites(np.ones(4, dtype=bool), near)
    assert sites.clear_of([1]).tolist() == [False, True, False, True]
    assert sites.too_close(np.array([0, 3]), np.array([1, 2])).tolist() == [[True, False], [False, False]]


def test_no_pair_has_a_better_place():
    shell, mirror = symmetric_shell()
    motion = smooth_motion(shell)
    candidates = ~shell.fixed & (mirror != np.arange(len(mirror)))
    result = optimise(MarkerProblem([(shell, motion)], candidates=candidates, mirror=mirror, tail_mm=0.0), 6)
    left = [h for h in result.markers if h not in (result.markers[0], mirror[result.markers[0]])]
    for v in np.setdiff1d(np.flatnonzero(candidates), result.markers)[::5].tolist():
        assert rmse(shell, motion, [*left, v, int(mirror[v])]) >= result.rmse_mm * (1 - 1e-9)


def test_joint_moves_never_hurt():
    shell = shell_of(True)
    motion = smooth_motion(shell)
    single = optimise(MarkerProblem([(shell, motion)], candidates=~shell.fixed, tail_mm=0.0), 8)
    joint = optimise(MarkerProblem([(shell, motion)], candidates=~shell.fixed, tail_mm=0.0), 8, joint=True)
    assert joint.rmse_mm <= single.rmse_mm * (1 + 1e-9)


def test_a_subject_given_twice_is_one_subject():
    shell = shell_of(True)
    motion = smooth_motion(shell)
    one = optimise(MarkerProblem([(shell, motion)], candidates=~shell.fixed), 5)
    two = optimise(MarkerProblem([(shell, motion)] * 2, candidates=~shell.fixed), 5)
    assert two.rmse_mm == pytest.approx(one.rmse_mm, rel=1e-6)


def test_a_shared_layout_serves_both_better_than_either_own_one():
    """In the sum of both errors; each layout is at most as good as the one made for both at this start."""
    a, b = shell_of(True), shell_of(True)
    motions = smooth_motion(a, seed=1), smooth_motion(b, seed=2)
    shared = optimise(MarkerProblem(list(zip((a, b), motions, strict=True)), candidates=~a.fixed, tail_mm=0.0), 6)
    own = optimise(MarkerProblem([(a, motions[0])], candidates=~a.fixed, tail_mm=0.0), 6)

    def both(markers):
        return np.hypot(rmse(a, motions[0], markers), rmse(b, motions[1], markers))

    assert both(shared.markers) < both(own.markers)
    assert both(shared.markers) / np.sqrt(2) == pytest.approx(shared.rmse_mm, rel=1e-9)


def test_weights_draw_markers_to_where_errors_count():
    shell = shell_of(True)
    motion, top = smooth_motion(shell, 20), shell.vertices[:, 1] > 20
    drawn = optimise(MarkerProblem([(shell, motion.weighted(np.where(top, 100.0, 1.0)))], candidates=~shell.fixed), 6)
    plain = optimise(MarkerProblem([(shell, motion)], candidates=~shell.fixed), 6)
    only_top = motion.weighted(top.astype(float))
    assert rmse(shell, only_top, drawn.markers) < rmse(shell, only_top, plain.markers)
