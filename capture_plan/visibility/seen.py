"""Why a camera does not read a dot, and visibility from known cameras (Zell & McDonnell 2022, section 3.1.2).

Data      v, n      a vertex and its normal on one shape;  o, a  place and optical axis of a camera;  D a dot's diameter
Reads     a camera reads the dot unless, in this order,
          OUTSIDE     it projects beyond the image, or lies behind the camera
          TURNED      the skin faces away: (o - v) n <= 0
          HIDDEN      something lies between v and o
          EDGE_ON     the way to the camera is more than `MOST_DEGREES` off n: paint and skin foreshorten to a line
          SMALL       its smaller diameter in the image is below `FEWEST_PIXELS`
          BLURRED     it is out of focus by more than its smaller diameter
Seen      a camera sees what is not OUTSIDE, TURNED or HIDDEN, however badly
Slip      where the head may slip, all this holds in each of the camera's `stances`; the first that fails tells why not
Answer    l_i = min over the shapes of (cameras that see i) / (cameras), 0 to 1
"""

from collections.abc import Sequence
from enum import IntEnum

import numpy as np
from jaxtyping import Bool, Float, Int, UInt8

from capture_plan.camera import Camera
from capture_plan.visibility.hemisphere import tangent_frames
from capture_plan.visibility.occluder import Occluder
from capture_plan.visibility.shapes import least_over_shapes, remembered

FEWEST_PIXELS = 3.0  # a marker that spans fewer no longer looks round (Carleton University motion capture lab, Markers)
MOST_DEGREES = 75.0  # at which a disc is a quarter as wide as long


class Sight(IntEnum):
    """Whether a camera reads a dot, or the first reason why it does not."""

    READ = 0
    OUTSIDE = 1
    TURNED = 2
    HIDDEN = 3
    EDGE_ON = 4
    SMALL = 5
    BLURRED = 6


WORDS = {
    Sight.READ: "read",
    Sight.OUTSIDE: "out of the picture",
    Sight.TURNED: "turned away",
    Sight.HIDDEN: "hidden",
    Sight.EDGE_ON: "edge-on",
    Sight.SMALL: "too small",
    Sight.BLURRED: "out of focus",
}
SEEN = (Sight.READ, Sight.EDGE_ON, Sight.SMALL, Sight.BLURRED)


def seen_by(
    camera: Camera, occluder: Occluder, vertices: Float[np.ndarray, "v 3"], at: Int[np.ndarray, " m"]
) -> Bool[np.ndarray, " m"]:
    """Whether the camera sees each vertex `at` of the shape that `occluder` was made from."""
    seen = np.ones(len(at), dtype=bool)
    for stance in camera.stances:
        some = at[seen]
        way = stance.position - vertices[some]
        sees = (np.einsum("mx,mx->m", way, occluder.normals[some]) > 0) & stance.in_image(vertices[some])
        sees[sees] = ~_hidden(stance, occluder, vertices, some[sees])
        seen[seen] = sees
    return seen


def sights(
    camera: Camera,
    occluder: Occluder,
    vertices: Float[np.ndarray, "v 3"],
    at: Int[np.ndarray, " m"],
    *,
    dot_mm: float,
) -> tuple[UInt8[np.ndarray, " m"], Float[np.ndarray, " m"]]:
    """The `Sight` of a dot at each vertex of the shape that `occluder` was made from, and its smaller diameter in
    pixels, 0 where the camera does not see it; where the head may slip, the least."""
    still, *slipped = camera.stances
    found, pixels = _sights(still, occluder, vertices, at, dot_mm)
    for stance in slipped:
        read = np.flatnonzero(found == Sight.READ)
        found[read], least = _sights(stance, occluder, vertices, at[read], dot_mm)
        pixels[read] = np.where(np.isin(found[read], SEEN), np.minimum(pixels[read], least), pixels[read])
    return found, pixels


def _sights(
    camera: Camera,
    occluder: Occluder,
    vertices: Float[np.ndarray, "v 3"],
    at: Int[np.ndarray, " m"],
    dot_mm: float,
) -> tuple[UInt8[np.ndarray, " m"], Float[np.ndarray, " m"]]:
    """`sights` of a head that keeps its place."""
    points, normals = vertices[at], occluder.normals[at]
    way = camera.position - points
    towards = np.einsum("mx,mx->m", way, normals) / np.linalg.norm(way, axis=1)
    found = np.full(len(at), Sight.READ, dtype=np.uint8)
    found[towards <= 0] = Sight.TURNED
    found[~camera.in_image(points)] = Sight.OUTSIDE
    open_ = np.flatnonzero(found == Sight.READ)
    found[open_[_hidden(camera, occluder, vertices, at[open_])]] = Sight.HIDDEN
    pixels, blur = np.zeros(len(at)), np.zeros(len(at))
    seen = np.flatnonzero(found == Sight.READ)
    pixels[seen] = smaller_diameter(camera, points[seen], normals[seen], dot_mm)
    blur[seen] = camera.blur_px(points[seen])
    found[seen[blur[seen] > pixels[seen]]] = Sight.BLURRED
    found[seen[pixels[seen] < FEWEST_PIXELS]] = Sight.SMALL
    found[seen[towards[seen] < np.cos(np.radians(MOST_DEGREES))]] = Sight.EDGE_ON
    return found, pixels


def smaller_diameter(
    camera: Camera, points: Float[np.ndarray, "n 3"], normals: Float[np.ndarray, "n 3"], dot_mm: float
) -> Float[np.ndarray, " n"]:
    """Smaller diameter in pixels of the image of a disc of `dot_mm` at each point; 0 where the lens model ends.

    The lesser singular value of A = [P(p + D/2 t) - P(p - D/2 t), P(p + D/2 b) - P(p - D/2 b)] for tangents t, b of the
    skin and the projection P: the image is an ellipse (before the camera: D f / depth cos(incidence)).
    """
    frames = tangent_frames(normals)
    across = dot_mm / 2 * frames[:, :2]
    a, b = (camera.project(points + across[:, i]) - camera.project(points - across[:, i]) for i in range(2))
    # singular values of A = [a b]: s1 s2 = |det A|, s1² + s2² = |a|² + |b|²
    product = np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
    squares = (a**2 + b**2).sum(axis=1)
    larger = np.sqrt((squares + np.sqrt(np.maximum(squares**2 - 4 * product**2, 0))) / 2)
    return np.nan_to_num(product / np.where(larger > 0, larger, 1))


def camera_visibility(
    neutral: Float[np.ndarray, "v 3"],
    deltas: Float[np.ndarray, "k v 3"],
    triangles: Int[np.ndarray, "f 3"],
    at: Int[np.ndarray, " m"],
    cameras: Sequence[Camera],
) -> Float[np.ndarray, " m"]:
    """Share of the cameras that see each vertex `at`, the least over the neutral and every blendshape at full weight.

    Cached on disk by content, like the global visibility.
    """

    def share(vertices: Float[np.ndarray, "v 3"], some: Int[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
        occluder = Occluder(vertices, triangles)
        return np.mean([seen_by(camera, occluder, vertices, some) for camera in cameras], axis=0)

    lenses = [camera.numbers for camera in cameras]
    return remembered(
        lambda: least_over_shapes(share, neutral, deltas, at), "cameras", neutral, deltas, triangles, at, *lenses
    )


def _hidden(
    camera: Camera, occluder: Occluder, vertices: Float[np.ndarray, "v 3"], at: Int[np.ndarray, " m"]
) -> Bool[np.ndarray, " m"]:
    origins = occluder.above_skin(vertices, at)
    ends = (camera.position - occluder.centre).astype(np.float32)
    return occluder.blocked(origins, ends - origins, extent=1.0)
