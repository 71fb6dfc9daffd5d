"""The search's parts: several subjects as one, neighbouring markers, layouts inside layouts."""

import numpy as np
import pytest

from capture_plan.mesh import near_table, surface_graph
from capture_plan.shell import MarkerProblem, Shell, motion_of, nested, optimise
from capture_plan.shell.pair_exchange import NEAR, near_pairs
from capture_plan.shell.search import MarkerSearch
from capture_plan.shell.sites import MarkerSites
from capture_plan.shell.subjects import Subjects
from tests.shell.test_shell_optimise import exact, smooth_motion, symmetric_shell
from tests.shell.test_shell_state import shell_of, two_pieces


def two_subjects():
    """Two motions on two shapes of one mesh, held at different places."""
    one, mirror = symmetric_shell()
    other = Shell(one.vertices * [1, 0.8, 1.1], one.triangles, one.vertices[:, 2] < -75)
    return [(one, smooth_motion(one, seed=1)), (other, smooth_motion(other, seed=2))], mirror


def test_scores_of_subjects_are_the_sums_of_their_errors():
    subjects, mirror = two_subjects()
    both, rng = Subjects(subjects, mirror), np.random.default_rng(0)
    free = np.flatnonzero(~subjects[0][0].fixed & (mirror != np.arange(len(mirror))))
    H = rng.choice(free, 5, replace=False)
    both.refresh(H.tolist())
    a, b = np.split(rng.choice(np.setdiff1d(free, [*H, *mirror[H]]), 4, replace=False), 2)

    def total(*markers):
        return pytest.approx(sum(exact(shell, motion, markers) for shell, motion in subjects), rel=1e-9)

    assert both.error == total(*H)
    assert both.rmse_mm == pytest.approx(np.sqrt(both.error / (2 * len(mirror))))
    for v in a:
        assert both.add_scores()[v] == total(*H, v)
        assert both.add_pair_scores()[v] == total(*H, v, mirror[v])
        assert both.swap_scores(1, np.array([v]))[0] == total(H[0], *H[2:], v)
        assert both.two_scores(a, b)[0, 1] == total(*H, a[0], b[1])


def test_what_one_subject_cannot_move_carries_no_marker_and_what_one_leaves_loose_needs_one():
    held, loose = shell_of(True), shell_of(False)
    both = Subjects([(held, smooth_motion(held)), (loose, smooth_motion(held))], None)
    both.refresh([])
    assert np.array_equal(both.fixed, held.fixed)
    assert both.floating.all()


def test_each_marker_is_paired_once_with_the_nearest_others():
    places = np.random.default_rng(0).normal(0, 50, (12, 3))
    apart = np.linalg.norm(places[:, None] - places, axis=2)
    near = {tuple(sorted((i, int(j)))) for i in range(12) for j in np.argsort(apart[i])[1 : NEAR + 1]}
    assert sorted(near_pairs(places)) == sorted(near)
    assert near_pairs(places[:2]) == [(0, 1)]
    assert near_pairs(places[:1]) == []


def test_nested_layouts_keep_the_wishes_of_a_single_one():
    shell, mirror = symmetric_shell()
    near = near_table(surface_graph(shell.vertices, shell.triangles), shell.vertices, 40.0)
    retained = tuple(np.flatnonzero(~shell.fixed & (mirror == np.arange(len(mirror))))[:1].tolist())
    motion, constraints = smooth_motion(shell, 20), {"pinned": retained, "mirror": mirror, "spacing": near}
    for result in nested(MarkerProblem([(shell, motion)], candidates=~shell.fixed, **constraints), (3, 5, 8)):
        H = list(result.markers)
        assert H[0] == retained[0]
        assert set(mirror[H].tolist()) == set(H)
        assert near[H][:, H].nnz == len(H)


def test_a_pair_stands_where_both_may_and_not_too_close_to_each_other():
    shell, mirror = symmetric_shell()
    near = near_table(surface_graph(shell.vertices, shell.triangles), shell.vertices, 60.0)
    sites, rng = MarkerSites(~shell.fixed, near, mirror), np.random.default_rng(0)
    scores, free = rng.uniform(size=len(mirror)), rng.uniform(size=len(mirror)) < 0.8
    scores[mirror == np.arange(len(mirror))] = np.inf
    close = np.array([mirror[v] in near[[v]].indices for v in range(len(mirror))])
    scores[close] -= 1
    may = np.flatnonzero(free & free[mirror] & ~close & np.isfinite(scores))
    best = may[scores[may].argmin()]
    assert np.isfinite(scores[close]).any()
    assert sites.best_pair(scores, free)[1] == (best, mirror[best])


def test_a_piece_that_nothing_holds_gets_the_first_marker():
    shell = two_pieces()
    result = optimise(MarkerProblem([(shell, smooth_motion(shell))], candidates=~shell.fixed, tail_mm=0.0), 3)
    assert shell.piece[result.markers[0]] == 0


def planted_motion(shell, seed, count):
    """Le et al. 2013, section 6.1: markers moved up to 10 mm at random, and the shell they bend."""
    rng = np.random.default_rng(seed)
    planted = rng.choice(np.flatnonzero(~shell.fixed), count, replace=False)
    return planted, motion_of(np.einsum("vm,tmx->tvx", shell.weights(planted), rng.uniform(-10, 10, (30, count, 3))))


@pytest.mark.parametrize(("count", "seed"), [(20, 4), (30, 1)])
def test_two_markers_at_once_find_what_one_at_a_time_does_not(count, seed):
    """On rows as fine as that needs, whatever the search began with."""
    shell = shell_of(True)
    planted, motion = planted_motion(shell, seed, count)
    one, two = (
        optimise(MarkerProblem([(shell, motion)], candidates=~shell.fixed), count, joint=joint)
        for joint in (False, True)
    )
    assert one.rmse_mm > 0.1
    assert set(two.markers) == set(planted.tolist())
    assert two.rmse_mm < 1e-6


@pytest.mark.parametrize("seed", range(4))
def test_rows_grow_finer_until_no_move_gains(seed):
    """Also where moves take most of the error, so that what was left out of the first rows is all of the rest."""
    shell = shell_of(True)
    _, motion = planted_motion(shell, seed, 20)
    search = MarkerSearch([(shell, motion)], MarkerSites(~shell.fixed), (), 3.0)
    search.grow(20)
    search.finish(joint=False)
    scores = [search.state.swap_scores(j, np.flatnonzero(~shell.fixed)).min() for j in range(20)]
    assert search.state.rmse_mm < 1e-6 or min(scores) >= search.state.error * (1 - 1e-9)


@pytest.mark.parametrize("mirrored", [False, True])
def test_where_markers_keep_a_spacing_none_has_a_better_place_left_also_close_to_its_own(mirrored):
    shell, mirror = symmetric_shell()
    near = near_table(surface_graph(shell.vertices, shell.triangles), shell.vertices, 50.0)
    sites = MarkerSites(~shell.fixed, near, mirror if mirrored else None)
    search = MarkerSearch([(shell, smooth_motion(shell, 20))], sites, (), 0.0)
    search.grow(8)
    search.finish(joint=False)
    H = search.state.markers
    for h in H:
        if mirrored and mirror[h] != h:
            rest = [m for m in H if m not in (h, mirror[h])]
            others = [
                (v, mirror[v])
                for v in np.flatnonzero(sites.clear_of(rest) & sites.clear_of(rest)[mirror] & sites.apart)
            ]
        else:
            rest = [m for m in H if m != h]
            others = [(v,) for v in np.flatnonzero(sites.clear_of(rest)) if not mirrored or mirror[v] == v]
        errors = [exact(shell, search.given[0][1], [*rest, *other]) for other in others[:: 1 + len(others) // 40]]
        assert min(errors) >= search.state.error * (1 - 1e-9)


def test_finer_rows_are_taken_once_where_much_was_left_out_and_never_where_little_was():
    shell = shell_of(True)
    search = MarkerSearch([(shell, smooth_motion(shell, 60))], MarkerSites(~shell.fixed), (), 3.0)
    search.grow(10)
    rows, before = search.rows, search.rmse_mm
    assert search.refine()
    assert search.rows > rows
    assert search.rmse_mm == before <= 1.01 * search.state.rmse_mm
    assert not search.refine()


def test_a_layout_that_all_rows_find_worse_than_the_greedy_one_is_searched_again_on_all_of_them():
    shell = shell_of(True)
    motion = smooth_motion(shell, 60)
    seen, whole = (MarkerSearch([(shell, motion)], MarkerSites(~shell.fixed), (), tail) for tail in (3.0, 0.0))
    for search in (seen, whole):
        search.grow(10)
    whole.state.refresh(seen.state.markers)
    seen.greedy_mm = 0.0
    seen.finish(joint=False)
    whole.settle()
    assert set(seen.state.markers) == set(whole.state.markers)
    assert seen.state.rmse_mm == pytest.approx(seen.rmse_mm, rel=1e-6)


@pytest.mark.parametrize("seed", range(4))
def test_a_planted_layout_is_found_exactly(seed):
    shell = shell_of(True)
    planted, motion = planted_motion(shell, seed, 10)
    found = optimise(MarkerProblem([(shell, motion)], candidates=~shell.fixed, tail_mm=0.0), 10, joint=True)
    assert set(found.markers) == set(planted.tolist())
    assert found.rmse_mm < 1e-6
