"""The axis of a hole, fitted to the triangles of a printed file, by code that knows nothing of how it was made."""

import numpy as np
from scipy.optimize import least_squares


def fitted_axis(vertices, triangles, dot, outward):
    """Distance of a dot from the axis of the cylinder around it, and the cylinder's radius, millimetres.

    `outward` is roughly the normal of the skin there. The wall of the hole are triangles near the dot that look at a
    line through it and are about parallel to that line."""
    corners = vertices[triangles]
    near = np.linalg.norm(corners.mean(axis=1) - dot, axis=1) < 6.0
    corners = corners[near]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(cross, axis=1)
    corners, cross, area = corners[area > 1e-6], cross[area > 1e-6], area[area > 1e-6]
    normal, middle = cross / area[:, None], corners.mean(axis=1)
    axis, centre = outward / np.linalg.norm(outward), np.array(dot, dtype=float)
    for steep, wide in ((0.5, 0.9), (0.25, 0.6), (0.1, 0.4), (0.05, 0.3)):
        off = middle - centre
        beside = off - (off @ axis)[:, None] * axis
        radius = np.linalg.norm(beside, axis=1)
        looks = np.einsum("fx,fx->f", normal, -beside) / np.maximum(radius, 1e-9)
        wall = (np.abs(normal @ axis) < steep) & (looks > 0.8) & (np.abs(radius - 1.7) < wide)
        axis, centre, fit = _cylinder(corners[wall].reshape(-1, 3), np.repeat(area[wall], 3), axis, centre)
    off = dot - centre
    return float(np.linalg.norm(off - (off @ axis) * axis)), float(fit), axis


def _cylinder(points, weights, axis, centre):
    e = np.eye(3)[np.abs(axis).argmin()]
    u = np.cross(axis, e) / np.linalg.norm(np.cross(axis, e))
    v = np.cross(axis, u)
    w = np.sqrt(weights / weights.sum())

    def at(x):
        a = axis + x[2] * u + x[3] * v
        return a / np.linalg.norm(a), centre + x[0] * u + x[1] * v

    def residual(x):
        a, c = at(x)
        off = points - c
        return w * (np.linalg.norm(off - (off @ a)[:, None] * a, axis=1) - x[4])

    x = least_squares(residual, [0, 0, 0, 0, 1.7], loss="soft_l1", f_scale=0.01).x
    return *at(x), x[4]
