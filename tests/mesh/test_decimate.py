"""Decimation: vertices of the scan, a surface of the same kind, flat parts for nothing, closer with more triangles."""

import numpy as np
import pytest
import trimesh
from scipy.spatial import KDTree

from capture_plan.errors import RigError
from capture_plan.mesh import boundary_vertices, pieces, triangle_areas
from capture_plan.mesh.decimate import _Surface, decimate
from capture_plan.mesh.geometry import triangle_cross
from capture_plan.sample import sample_rig


@pytest.fixture(scope="module")
def face():
    rig = sample_rig()
    skin = rig.triangles[rig.skin[rig.triangles].all(axis=1)]
    used, places = np.unique(skin, return_inverse=True)
    return rig.neutral[used], places.reshape(-1, 3)


def sheet(n=13):
    """A flat square with sides of n - 1 mm."""
    x, y = np.meshgrid(np.arange(float(n)), np.arange(float(n)))
    corner = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    quads = np.stack([corner, corner + 1, corner + n + 1, corner + n], axis=1)
    return np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], axis=1), np.concatenate([quads[:, :3], quads[:, [0, 2, 3]]])


def distance(x, coarse, triangles):
    """Mean distance from points to a mesh, millimetres, by points spread over its triangles."""
    shares = np.random.default_rng(0).dirichlet(np.ones(3), size=80)
    spread = np.einsum("sc,fcx->fsx", shares, coarse[triangles]).reshape(-1, 3)
    return KDTree(np.vstack([coarse, spread])).query(x)[0].mean()


def euler(vertices, triangles):
    return trimesh.Trimesh(vertices, triangles, process=False).euler_number


def test_a_flat_sheet_loses_triangles_for_nothing():
    x, triangles = sheet()
    retained, coarse = decimate(x, triangles, 24)
    assert len(coarse) <= 24
    assert triangle_areas(x[retained], coarse).sum() == pytest.approx(144)
    assert (triangle_cross(x[retained], coarse)[:, 2] > 0).all()
    assert {0, 12, 156, 168} <= set(retained.tolist())


def test_a_collapse_costs_the_squared_distances_from_the_planes_around_both_ends_then_the_squared_length():
    x, triangles = sheet(7)
    x = x * [1, 2, 0] + np.random.default_rng(0).normal(0, 0.3, x.shape)
    surface, cross = _Surface(x, triangles), triangle_cross(x, triangles)
    area = np.linalg.norm(cross, axis=1) / 2
    for u, v in ((16, 17), (17, 16), (24, 32), (30, 23)):  # inside: no border planes
        off = np.einsum("fx,fx->f", x[v] - x[triangles[:, 0]], cross / (2 * area[:, None]))
        around = (triangles == u).any(axis=1) * 1.0 + (triangles == v).any(axis=1)
        cost, length = surface.cost(u, v)
        assert cost == pytest.approx(around @ (area * off**2), abs=1e-8)
        assert length == pytest.approx(np.square(x[u] - x[v]).sum())


def test_no_triangle_of_a_bumpy_sheet_turns_over():
    x, triangles = sheet(21)
    x[:, 2] = 0.4 * np.sin(x[:, 0]) * np.cos(x[:, 1])
    retained, coarse = decimate(x, triangles, 150)
    assert (triangle_cross(x[retained], coarse)[:, 2] > 0).all()
    assert triangle_areas(x[retained] * [1, 1, 0], coarse).sum() == pytest.approx(400)


@pytest.mark.parametrize("share", [0.8, 0.4, 0.15])
def test_the_surface_stays_the_kind_of_surface_it_was(face, share):
    x, triangles = face
    retained, coarse = decimate(x, triangles, int(share * len(triangles)))
    mesh = trimesh.Trimesh(x[retained], coarse, process=False)
    assert euler(x[retained], coarse) == euler(x, triangles)
    assert mesh.is_winding_consistent
    assert len({tuple(sorted(t)) for t in coarse.tolist()}) == len(coarse) <= share * len(triangles)
    assert set(retained[boundary_vertices(coarse)].tolist()) <= set(boundary_vertices(triangles).tolist())


def test_a_closed_ball_stays_closed():
    ball = trimesh.creation.icosphere(subdivisions=3, radius=50.0)
    retained, coarse = decimate(np.array(ball.vertices), np.array(ball.faces), 200)
    mesh = trimesh.Trimesh(ball.vertices[retained], coarse, process=False)
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(ball.volume, rel=0.1)


def test_more_triangles_come_closer_to_the_scan(face):
    x, triangles = face
    off = []
    for wanted in (300, 1000, 2500):
        retained, coarse = decimate(x, triangles, wanted)
        off.append(distance(x, x[retained], coarse))
    assert off[0] > off[1] > off[2]


def test_what_is_coarse_enough_stays_as_it_is(face):
    x, triangles = face
    retained, coarse = decimate(x, triangles, len(triangles))
    assert (retained == np.arange(len(x))).all()
    assert (coarse == triangles).all()


def test_a_triangle_by_itself_is_never_taken_out():
    x, triangles = sheet()
    x = np.vstack([x, [[20, 0, 0], [20.1, 0, 0], [20, 0.1, 0]]])
    retained, coarse = decimate(x, np.vstack([triangles, [[169, 170, 171]]]), 1)
    assert {169, 170, 171} <= set(retained.tolist())
    assert pieces(coarse, len(retained)).max() == 1


def test_the_same_scan_gives_the_same_mesh(face):
    first, second = (decimate(*face, 900) for _ in range(2))
    assert all((a == b).all() for a, b in zip(first, second, strict=True))


def test_no_triangle_at_all_is_refused(face):
    with pytest.raises(RigError, match="0 triangles wanted"):
        decimate(*face, 0)
