"""Example-based rigging: what scans add to deformation transfer."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from capture_plan.errors import RigError
from capture_plan.sample import sample_rig
from capture_plan.transfer.example import best_gradients, energy, rebuild, rebuild_and_weigh
from capture_plan.transfer.prior import STIR, cells, per_cell, transfer_prior
from tests.solids import BOX, BOX_SIDES, sphere, together

RIG = sample_rig()
NAMES = ("jawOpen", "eyeBlinkLeft", "browInnerUp", "mouthSmileLeft", "eyeLookUpLeft")
SOURCE = RIG.deltas[[RIG.names.index(name) for name in NAMES]].astype(float)
TARGET = RIG.neutral * [1.1, 0.6, 1]
TRUTH = SOURCE * [1.1, 0.6, 1]
PRIOR = transfer_prior(RIG.neutral, RIG.triangles, SOURCE, TARGET)
STRICT = 1e-9  # hardly any trust in the prior


def scans(weights, truth=TRUTH, target=TARGET):
    return target + np.einsum("jk,kvx->jvx", weights, truth)


def ball(seed, k=4):
    """A ball with a loose box, random blendshapes of which some vertices are still, and a squashed target."""
    rng = np.random.default_rng(seed)
    vertices, triangles = together(sphere(5, 6, 10.0), (3 * BOX, BOX_SIDES))
    deltas = rng.normal(0, 1, (k, *vertices.shape)) * rng.integers(0, 2, (k, len(vertices), 1))
    deltas[:, :4] = 0
    target = vertices * [1, 0.6, 1.2]
    return transfer_prior(vertices, triangles, deltas, target), deltas * [1, 0.6, 1.2], rng


def test_every_blendshape_scanned_alone_gives_the_truth():
    W = np.eye(len(NAMES))
    assert np.abs(PRIOR.deltas - TRUTH).max() > 0.1
    for hard in (False, True):
        assert np.abs(rebuild(PRIOR, scans(W), W, beta=STRICT, hard=hard) - TRUTH).max() < 1e-4


def test_without_a_scan_it_is_deformation_transfer():
    assert rebuild(PRIOR, scans(np.zeros((0, 5))), np.zeros((0, 5))) is PRIOR.deltas


def test_blendshapes_in_no_scan_stay_as_transferred():
    W = np.array([[1.0, 0, 1, 0, 0]])
    deltas = rebuild(PRIOR, scans(W), W)
    assert (deltas[[1, 3, 4]] == PRIOR.deltas[[1, 3, 4]]).all()
    assert np.abs(deltas[[0, 2]] - TRUTH[[0, 2]]).max() < np.abs(PRIOR.deltas[[0, 2]] - TRUTH[[0, 2]]).max()


def test_a_scan_is_reproduced():
    W = np.array([[1.0, 1, 1, 0, 0], [0, 0, 0, 1, 1]])
    deltas = rebuild(PRIOR, scans(W), W, beta=STRICT, hard=False)
    assert np.abs(scans(W, deltas) - scans(W)).max() < 1e-3


def test_gradients_minimise_the_energy_by_a_second_way():
    """The least squares problem of each cell, written out row by row."""
    prior, truth, rng = ball(3)
    W = rng.uniform(0, 1, (2, 4))
    Y, u, beta = (
        cells(prior.surface, scans(W, truth, prior.surface.neutral) - prior.surface.neutral),
        prior.freedom(hard=False),
        0.3,
    )
    X, start = best_gradients(prior, Y, W, u, beta), 0
    for t, size in enumerate(prior.surface.cell_sizes):
        own = slice(start, start + size)
        keep = np.sqrt(beta / u[:, t])[:, None]
        rows, right = np.vstack([W, keep * np.eye(4)]), np.vstack([Y[:, own], keep * prior.cells[:, own]])
        assert np.allclose(X[:, own], np.linalg.lstsq(rows, right, rcond=None)[0])
        start += size


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10_000))
def test_one_more_disjoint_scan_never_leads_further_from_the_truth(seed):
    """Distance in the energy's own norm: gradients over the freedom to change them."""
    prior, truth, rng = ball(seed, k=6)
    of = rng.integers(0, 3, 6)
    W = np.array([of == j for j in range(3)], dtype=float)
    exact, u, a = cells(prior.surface, truth), prior.freedom(hard=False), prior.surface.shares
    distances = []
    for j in range(4):
        X = best_gradients(prior, W[:j] @ exact, W[:j], u, 0.05) if j else prior.cells
        distances.append(float((per_cell(prior.surface, np.square(X - exact)) / u @ a).sum()))
    assert (np.diff(distances) <= 1e-9 * distances[0]).all()


@pytest.mark.parametrize("hard", [False, True])
@pytest.mark.parametrize("seed", range(3))
def test_turns_never_raise_the_energy(seed, hard):
    prior, truth, rng = ball(seed)
    shown, asked = rng.uniform(0, 1, (3, 4)), np.round(rng.uniform(0, 1, (3, 4)))
    found = rebuild_and_weigh(prior, scans(shown, truth, prior.surface.neutral), asked, beta=0.1, hard=hard)
    assert (np.diff(found.energies) <= 1e-9 * found.energies[0]).all()
    assert found.energies[-1] < found.energies[0]
    assert ((found.weights >= 0) & (found.weights <= 1)).all()


def test_weights_are_the_best_there_are():
    prior, _, rng = ball(1)
    shown = rng.uniform(0.2, 0.8, (2, 4))
    found = rebuild_and_weigh(
        prior, scans(shown, prior.deltas, prior.surface.neutral), np.round(shown), beta=10.0, gamma=1e-6
    )
    assert np.abs(found.weights - shown).max() < 0.01


def test_what_nobody_asked_for_keeps_its_shape_however_much_of_it_a_scan_shows():
    prior, truth, rng = ball(2)
    shown, asked = np.array([[1.0, 1.0, 0.02, 0.4]]), np.array([[1.0, 1.0, 0.0, 0.0]])
    noise = rng.normal(0, 0.3, prior.surface.neutral.shape)
    found = rebuild_and_weigh(prior, scans(shown, truth, prior.surface.neutral) + noise, asked, beta=1e-4)
    assert found.weights[0, 2:].max() > 0.01
    assert np.array_equal(found.deltas[2:], prior.deltas[2:])
    assert not np.allclose(found.deltas[:2], prior.deltas[:2])


def test_a_scan_tells_nothing_of_the_shape_of_what_it_was_not_asked_to_show():
    """Of two scans in which one blendshape each was asked for, it is corrected as by its own scan alone."""
    prior, truth, _ = ball(2, k=2)
    asked, shown = np.eye(2), np.array([[1.0, 0.2], [0.2, 1.0]])
    both = scans(shown, truth, prior.surface.neutral)
    found = rebuild_and_weigh(prior, both, asked, beta=1e-4, gamma=1e6)
    alone = [rebuild(prior, both[[j]], asked[[j]], beta=1e-4)[j] for j in (0, 1)]
    assert np.allclose(found.weights, asked, atol=1e-3)
    assert np.allclose(found.deltas, alone, atol=1e-2)


def test_hard_keeps_still_vertices_still():
    W = np.ones((1, len(NAMES)))
    still = np.linalg.norm(SOURCE, axis=2) == 0
    assert not rebuild(PRIOR, scans(W), W)[still].any()
    assert rebuild(PRIOR, scans(W), W, hard=False)[still].any()


def test_freedom_grows_with_the_square_of_the_movement_and_ends_where_all_is_still():
    once, twice = (transfer_prior(RIG.neutral, RIG.triangles, k * SOURCE, RIG.neutral) for k in (1, 2))
    moves = ~once.still[:, RIG.triangles].all(axis=2)
    f = len(RIG.triangles)
    soft, doubled, hard = once.freedom(hard=False), twice.freedom(hard=False), once.freedom(hard=True)
    assert np.allclose(doubled - STIR**2, 4 * (soft - STIR**2))
    assert (hard[:, :f] == np.where(moves, soft[:, :f], 0)).all()


def test_a_part_carried_without_stretching_may_change_too():
    shift = np.ones((1, *RIG.neutral.shape)) * [0, 0, 5.0]
    assert (transfer_prior(RIG.neutral, RIG.triangles, shift, RIG.neutral).freedom(hard=False) > 2 * STIR**2).all()


def test_the_same_face_is_rebuilt_exactly():
    prior = transfer_prior(RIG.neutral, RIG.triangles, SOURCE, RIG.neutral)
    W = np.array([[1.0, 1, 0, 0, 0], [0, 1, 1, 1, 1]])
    shown = scans(W, SOURCE, RIG.neutral)
    assert np.abs(rebuild(prior, shown, W) - SOURCE).max() < 1e-6
    assert (
        energy(prior, prior.cells, cells(prior.surface, shown - RIG.neutral), W, prior.freedom(hard=False), 1.0) < 1e-12
    )


def test_scans_must_fit_rig_and_weights():
    with pytest.raises(RigError, match="1 scans but 2 rows of weights"):
        rebuild(PRIOR, scans(np.ones((1, 5))), np.ones((2, 5)))
    with pytest.raises(RigError, match="the scans have 8 vertices, the rig has 4,939"):
        rebuild(PRIOR, BOX[None], np.ones((1, 5)))
