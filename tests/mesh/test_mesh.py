"""The mesh room: identities of areas, normals and distances."""

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from capture_plan.layout.spacing import nearest_two
from capture_plan.mesh import (
    boundary_vertices,
    edges,
    geodesic_distance,
    near_table,
    piece_areas,
    pieces,
    straight_table,
    surface_graph,
    triangle_areas,
    vertex_areas,
    vertex_normals,
)
from capture_plan.mesh.geodesic import _crossings


@pytest.fixture(scope="module")
def ball():
    mesh = trimesh.creation.icosphere(subdivisions=4, radius=50.0)
    return np.array(mesh.vertices), np.array(mesh.faces)


@pytest.fixture(scope="module")
def sheet():
    """A flat 11 x 11 grid with 1 mm squares in the plane z = 0."""
    x, y = np.meshgrid(np.arange(11.0), np.arange(11.0))
    vertices = np.stack([x.ravel(), y.ravel(), np.zeros(121)], axis=1)
    corner = (np.arange(10)[:, None] * 11 + np.arange(10)).ravel()
    quads = np.stack([corner, corner + 1, corner + 12, corner + 11], axis=1)
    return vertices, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def test_vertex_areas_add_up_to_the_area_of_the_triangles(ball):
    assert vertex_areas(*ball).sum() == pytest.approx(triangle_areas(*ball).sum())


def test_the_area_of_a_fine_ball_is_that_of_the_sphere(ball):
    assert triangle_areas(*ball).sum() == pytest.approx(4 * np.pi * 50**2, rel=0.01)


def test_normals_of_a_ball_point_outwards(ball):
    vertices, _ = ball
    np.testing.assert_allclose(vertex_normals(*ball), vertices / 50, atol=0.01)


def test_a_closed_ball_has_no_boundary_and_obeys_euler(ball):
    vertices, triangles = ball
    assert len(boundary_vertices(triangles)) == 0
    assert len(vertices) - len(edges(triangles)) + len(triangles) == 2


def test_the_boundary_of_a_sheet_is_its_rim(sheet):
    vertices, triangles = sheet
    rim = np.flatnonzero(np.isin(vertices[:, :2], [0, 10]).any(axis=1))
    np.testing.assert_array_equal(boundary_vertices(triangles), rim)


def test_two_balls_are_two_pieces(ball):
    vertices, triangles = ball
    both = np.concatenate([triangles, triangles + len(vertices)])
    piece = pieces(both, 2 * len(vertices))
    assert set(piece[: len(vertices)]) == {0}
    assert set(piece[len(vertices) :]) == {1}


def test_every_piece_has_an_area_also_one_of_a_single_vertex(sheet):
    vertices, triangles = sheet
    apart = np.concatenate([triangles, triangles + 122])  # number 121 and the last are in no triangle
    piece = pieces(apart, 244)
    areas = piece_areas(np.vstack([vertices, [[0, 0, 9]]] * 2), apart, piece)
    assert len(areas) == piece.max() + 1 == 4
    assert areas[piece[[0, 121, 122, 243]]] == pytest.approx([100, 0, 100, 0])


def test_distances_on_a_ball_are_great_circles(ball):
    vertices, _ = ball
    found = geodesic_distance(surface_graph(*ball), np.array([0]))[0]
    true = 50 * np.arccos(np.clip(vertices @ vertices[0] / 2500, -1, 1))
    far = true > 5
    assert (found[far] / true[far]).min() > 0.999
    assert (found[far] / true[far]).max() < 1.06


def test_a_knight_s_move_over_an_edge_is_unfolded(sheet):
    vertices, triangles = sheet
    found = geodesic_distance(surface_graph(vertices, triangles), np.array([0]))[0]
    assert found[12] == pytest.approx(np.sqrt(2))  # along the diagonal edge
    assert found[13] == pytest.approx(np.sqrt(5))  # across one edge
    assert found[10] == pytest.approx(10)  # along the rim


def folded_pair(seed):
    """A quadrilateral a, c, b, d in the plane with its diagonal a b, and the same folded along that and turned."""
    rng = np.random.default_rng(seed)
    a, b = np.zeros(3), np.array([rng.uniform(1, 9), 0, 0])
    c, d = (np.array([rng.uniform(-9, 15), side * rng.uniform(0.5, 9), 0]) for side in (1, -1))
    fold, turn = Rotation.from_rotvec([rng.uniform(-3, 3), 0, 0]), Rotation.random(rng=rng)
    return np.stack([a, b, c, d]), turn.apply(np.stack([a, b, c, fold.apply(d)])) + rng.uniform(-50, 50, 3)


@pytest.mark.parametrize("seed", range(50))
def test_the_way_over_an_edge_is_straight_where_the_unfolded_triangles_are_convex_and_elsewhere_there_is_none(seed):
    flat, folded = folded_pair(seed)
    (ax, _), (bx, _), (cx, cy), (dx, dy) = flat[:, :2]
    meets = cx + (dx - cx) * cy / (cy - dy)  # where the line from c to d meets that of the edge
    pairs, lengths = _crossings(folded, np.array([[0, 1, 2], [1, 0, 3]]))
    if ax < meets < bx:
        assert set(pairs.ravel().tolist()) == {2, 3}
        assert lengths == pytest.approx([np.hypot(cx - dx, cy - dy)])
    else:
        assert len(pairs) == 0


def test_distances_keep_the_triangle_inequality_and_are_symmetric(sheet):
    graph = surface_graph(*sheet)
    d = geodesic_distance(graph, np.arange(121))
    np.testing.assert_allclose(d, d.T)
    assert (d[:, :, None] <= d[:, None, :] + d.T[None] + 1e-9).all()


def test_the_nearest_two_of_some_vertices_are_two_of_them_and_never_one_alone(sheet):
    graph = surface_graph(*sheet)
    assert nearest_two(graph, np.array([0, 10, 13])) == pytest.approx(np.sqrt(5))
    assert nearest_two(graph, np.array([13])) == np.inf


def test_beyond_the_limit_distances_are_infinite(sheet):
    d = geodesic_distance(surface_graph(*sheet), np.array([0]), limit=3.0)[0]
    assert np.isinf(d[120])
    assert d[2] == pytest.approx(2)


def test_the_near_table_holds_every_distance_below_its_radius_and_no_other(ball):
    vertices, triangles = ball
    graph = surface_graph(vertices, triangles)
    whole = geodesic_distance(graph, np.arange(len(vertices)))
    table = near_table(graph, vertices, 7.0)  # several blocks of sources
    expected = np.where(whole < 7.0, whole, 0)
    np.testing.assert_allclose(table.toarray(), expected, atol=1e-12)
    assert table.nnz == (whole < 7.0).sum()


def test_tables_hold_nothing_at_exactly_their_radius(sheet):
    vertices, triangles = sheet
    for table in (
        straight_table(vertices, np.arange(121), 1.0),
        near_table(surface_graph(vertices, triangles), vertices, 1.0),
    ):
        np.testing.assert_array_equal(table.toarray(), np.zeros((121, 121)))
        assert table.nnz == 121


def test_a_surface_of_no_triangle_has_no_edges():
    assert surface_graph(np.zeros((3, 3)), np.empty((0, 3), dtype=int)).nnz == 0
