"""How many landmarks fit on a face: never more than fit, nearly as many as can, and a budget beyond refused at once."""

import numpy as np
import pytest
from scipy.sparse import csr_array

from capture_plan.errors import InfeasibleError
from capture_plan.layout.capacity import fitting_sites
from capture_plan.layout.constraint_rows import Limit
from capture_plan.layout.design import design_layout
from capture_plan.layout.dot_contact import NO_POSES
from capture_plan.layout.problem import task_of
from capture_plan.layout.settings import LayoutSettings
from capture_plan.layout.sites import Sites
from capture_plan.layout.spacing import Spacing


def grid(n, spacing_mm):
    """Places of an n by n grid, 1 mm apart, and which are nearer than a spacing."""
    points = np.stack(np.meshgrid(np.arange(n), np.arange(n)), axis=-1).reshape(-1, 2)
    apart = np.linalg.norm(points[:, None] - points, axis=2)
    near = csr_array(np.where((apart < spacing_mm) & (apart > 0), apart, 0))
    v = np.arange(n * n)
    sites = Sites(np.stack([v, v], axis=1), np.ones((1, n * n)), np.ones(n * n))
    return sites, Spacing(near, sites, spacing_mm), apart


@pytest.mark.parametrize("n", [5, 8, 11])
def test_as_many_as_fit_on_a_grid_stand_at_the_spacing(n):
    sites, spacing, apart = grid(n, 2.0)
    chosen = fitting_sites(sites, spacing)
    subset = apart[np.ix_(chosen, chosen)]
    assert subset[subset > 0].min() >= 2.0
    assert len(chosen) == ((n + 1) // 2) ** 2  # neighbours, also across corners, are too close


def test_a_site_is_too_close_to_itself_also_where_no_distance_of_it_is_stored():
    _, spacing, apart = grid(3, 1.2)
    np.testing.assert_array_equal(spacing.close(np.arange(9)), apart < 1.2)


def test_without_a_spacing_all_fit_and_caps_are_kept():
    sites, _, _ = grid(4, 2.0)
    cap = Limit("at most 3 on a side", (np.arange(16) < 8).astype(int), most=3)
    assert len(fitting_sites(sites, None)) == 16
    assert len(fitting_sites(sites, None, (cap,))) == 11


def test_a_budget_beyond_the_room_is_refused_with_how_many_fit(face):
    task = task_of(face, LayoutSettings(method="budget", budget=5000)).apart_in(NO_POSES)
    room = int(task.sites.size[fitting_sites(task.sites, task.spacing, task.limits)].sum())
    for method in ("budget", "motion"):
        with pytest.raises(InfeasibleError, match=f"no room was found for 5,000 landmarks on this face: {room} fit"):
            design_layout(face, LayoutSettings(method=method, budget=5000))


def test_the_default_asks_for_less_than_a_budget_that_nobody_can_glue(face, studio):
    assert len(design_layout(face, LayoutSettings(budget=5000)).landmarks) == len(studio.landmarks)
