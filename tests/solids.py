"""Small meshes with known answers, for the tests."""

import numpy as np

BOX = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
BOX_SIDES = np.array(
    [
        *([0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1]),
        *([2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]),
    ]
)


def sphere(rings=24, around=48, radius=100.0):
    """A closed sphere, its triangles counter-clockwise from outside."""
    theta = np.pi * np.arange(1, rings) / rings
    phi = 2 * np.pi * np.arange(around) / around
    body = np.stack(
        [
            np.outer(np.sin(theta), np.cos(phi)),
            np.outer(np.cos(theta), np.ones(around)),
            np.outer(np.sin(theta), np.sin(phi)),
        ],
        axis=-1,
    ).reshape(-1, 3)
    grid = np.arange(len(body)).reshape(rings - 1, around)
    a, b, c, d = grid[:-1], np.roll(grid[:-1], -1, axis=1), grid[1:], np.roll(grid[1:], -1, axis=1)
    top, bottom = len(body), len(body) + 1
    triangles = [np.stack([a, b, c], -1).reshape(-1, 3), np.stack([b, d, c], -1).reshape(-1, 3)]
    triangles.append(np.stack([np.full(around, top), np.roll(grid[0], -1), grid[0]], -1))
    triangles.append(np.stack([np.full(around, bottom), grid[-1], np.roll(grid[-1], -1)], -1))
    return radius * np.vstack([body, [[0, 1, 0], [0, -1, 0]]]), np.concatenate(triangles)


def square(centre, u, v):
    """Two triangles over centre ± u ± v, facing u x v."""
    centre, u, v = (np.array(x, dtype=float) for x in (centre, u, v))
    return np.array([centre - u - v, centre + u - v, centre + u + v, centre - u + v]), np.array([[0, 1, 2], [0, 2, 3]])


def together(*meshes):
    vertices = np.concatenate([mesh[0] for mesh in meshes])
    starts = np.cumsum([0] + [len(mesh[0]) for mesh in meshes])
    return vertices, np.concatenate([mesh[1] + start for mesh, start in zip(meshes, starts, strict=False)])


def patch(size=1.0):
    """A small square facing +y with a vertex, number 0, in the middle of it."""
    corners = size * np.array([[0, 0, 0], [-1, 0, 1], [1, 0, 1], [1, 0, -1], [-1, 0, -1.0]])
    return corners, np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 1]])
