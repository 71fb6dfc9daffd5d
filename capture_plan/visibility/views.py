"""What known cameras make of a physical dot on the skin: how many see it, and how many pixels it spans.

Data     p, n        a vertex and its normal on one shape: the neutral, or one blendshape at full weight
         D           diameter of the dot, millimetres
         P           projection of a camera, lens included, millimetres to pixels
Seen     s[c, n]     camera c sees the dot: it faces c, lies in the image, and nothing lies in between
Spread   A = [P(p + D/2 t) - P(p - D/2 t), P(p + D/2 b) - P(p - D/2 b)]    for tangents t, b of the skin
Pixels   the lesser singular value of A: the dot is an ellipse in the image, this its smaller diameter
         (before the camera: D f / depth cos(incidence))

Over the shapes the worst counts: fewest cameras that see the dot at once, fewest pixels among the shapes that show it.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import version

import numpy as np
from jaxtyping import Bool, Float, Int

from capture_plan.cache import Arrays, cached, digest
from capture_plan.camera import Camera
from capture_plan.progress import track_in_threads
from capture_plan.visibility.hemisphere import tangent_frames
from capture_plan.visibility.occluder import Occluder
from capture_plan.visibility.seen import seen_by
from capture_plan.visibility.shapes import ENTRIES, METHOD

FEWEST_PIXELS = 3.0  # a marker that spans fewer no longer looks round (Carleton University motion capture lab, Markers)


@dataclass(frozen=True, eq=False)
class Views:
    """How cameras see a dot at each of n vertices, the worst over all expressions.

    `seen[c, n]`: camera c sees it in every expression. `views[n]`: fewest cameras that see it in any one expression.
    `pixels[c, n]`: least of its smaller diameter over the expressions in which c sees it, pixels; 0 where c never does.
    `at_once[e, n]`: how many cameras see it in each expression, the neutral first, then the deltas in their order.
    """

    cameras: tuple[str, ...]
    seen: Bool[np.ndarray, "c n"]
    views: Int[np.ndarray, " n"]
    pixels: Float[np.ndarray, "c n"]
    at_once: Int[np.ndarray, "e n"]

    def __post_init__(self) -> None:
        for array in (self.seen, self.views, self.pixels, self.at_once):
            array.flags.writeable = False

    def at(self, some: Int[np.ndarray, " m"]) -> "Views":
        """The views of some of the vertices, each as often as it is named."""
        return Views(self.cameras, self.seen[:, some], self.views[some], self.pixels[:, some], self.at_once[:, some])

    @property
    def readable(self) -> Bool[np.ndarray, "c n"]:
        """Where a camera sees the dot in every expression, and never smaller than `FEWEST_PIXELS`."""
        return self.seen & (self.pixels >= FEWEST_PIXELS)


def camera_views(
    neutral: Float[np.ndarray, "v 3"],
    deltas: Float[np.ndarray, "k v 3"],
    triangles: Int[np.ndarray, "f 3"],
    vertices: Int[np.ndarray, " n"],
    cameras: Sequence[Camera],
    *,
    dot_mm: float,
) -> Views:
    """What the cameras see of a dot of `dot_mm` at each of `vertices`, in the neutral and every blendshape in full.

    Cached on disk by content, like the global visibility.
    """
    lenses = [camera.numbers for camera in cameras]
    key = digest([METHOD, version("embreex"), "dots", neutral, deltas, triangles, vertices, *lenses, np.array(dot_mm)])

    def compute() -> Arrays:
        return _worst(neutral, deltas, triangles, vertices, cameras, dot_mm)

    found = cached(compute, "views", key, entries=ENTRIES)
    return Views(
        cameras=tuple(camera.name for camera in cameras),
        seen=found["seen"],
        views=found["at_once"].min(axis=0),
        pixels=found["pixels"],
        at_once=found["at_once"],
    )


def smaller_diameter(
    camera: Camera, points: Float[np.ndarray, "n 3"], normals: Float[np.ndarray, "n 3"], dot_mm: float
) -> Float[np.ndarray, " n"]:
    """Smaller diameter in pixels of the image of a disc of `dot_mm` at each point; 0 where the lens model ends."""
    frames = tangent_frames(normals)
    across = dot_mm / 2 * frames[:, :2]
    a, b = (camera.project(points + across[:, i]) - camera.project(points - across[:, i]) for i in range(2))
    # singular values of A = [a b]: s1 s2 = |det A|, s1² + s2² = |a|² + |b|²
    product = np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
    squares = (a**2 + b**2).sum(axis=1)
    larger = np.sqrt((squares + np.sqrt(np.maximum(squares**2 - 4 * product**2, 0))) / 2)
    return np.nan_to_num(product / np.where(larger > 0, larger, 1))


def _worst(
    neutral: Float[np.ndarray, "v 3"],
    deltas: Float[np.ndarray, "k v 3"],
    triangles: Int[np.ndarray, "f 3"],
    at: Int[np.ndarray, " n"],
    cameras: Sequence[Camera],
    dot_mm: float,
) -> Arrays:
    def look(shape: Float[np.ndarray, "v 3"]) -> tuple[Bool[np.ndarray, "c n"], Float[np.ndarray, "c n"]]:
        occluder = Occluder(shape, triangles)
        seen = np.stack([seen_by(camera, occluder, shape, at) for camera in cameras])
        pixels = np.full(seen.shape, np.inf)
        for camera, sees, spans in zip(cameras, seen, pixels, strict=True):
            spans[sees] = smaller_diameter(camera, shape[at[sees]], occluder.normals[at[sees]], dot_mm)
        return seen, pixels

    always, pixels = look(neutral)
    at_once = [always.sum(axis=0)]
    looks = track_in_threads(lambda delta: look(neutral + delta), list(deltas), "Looking through the cameras")
    for seen, spans in looks:
        always &= seen
        at_once.append(seen.sum(axis=0))
        pixels = np.minimum(pixels, spans)
    return {"seen": always, "at_once": np.stack(at_once), "pixels": np.where(np.isfinite(pixels), pixels, 0.0)}
