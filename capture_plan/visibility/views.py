"""What known cameras make of a physical dot on the skin: which of them read it, in which expressions, how wide it is.

Data     v[n]        vertices that may carry a dot; shapes e: the neutral, then each blendshape at full weight
Sight    how[e, c, n]   whether camera c reads a dot at n on shape e, or why not (`seen.Sight`)

Over the shapes the worst counts: fewest cameras that read the dot at once, fewest pixels among the shapes that show it.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from importlib.metadata import version

import numpy as np
from jaxtyping import Bool, Float, Int, UInt8

from capture_plan.cache import Arrays, cached, digest
from capture_plan.camera import Camera
from capture_plan.progress import track_in_threads
from capture_plan.visibility.occluder import Occluder
from capture_plan.visibility.seen import SEEN, Sight, sights
from capture_plan.visibility.shapes import ENTRIES, METHOD


@dataclass(frozen=True, eq=False)
class Views:
    """How cameras see a dot at each of n vertices on e shapes: the neutral first, then the deltas in their order.

    `how[e, c, n]`: the `Sight` of camera c. `pixels[c, n]`: least of the dot's smaller diameter, pixels, over the
    shapes on which c sees it; 0 where c never does.
    """

    cameras: tuple[str, ...]
    how: UInt8[np.ndarray, "e c n"]
    pixels: Float[np.ndarray, "c n"]

    def __post_init__(self) -> None:
        for array in (self.how, self.pixels):
            array.flags.writeable = False

    def at(self, some: Int[np.ndarray, " m"]) -> "Views":
        """The views of some of the vertices, each as often as it is named."""
        return Views(self.cameras, self.how[:, :, some], self.pixels[:, some])

    @cached_property
    def readable(self) -> Bool[np.ndarray, "c n"]:
        """Where a camera reads the dot on every shape."""
        return (self.how == Sight.READ).all(axis=0)

    @cached_property
    def share(self) -> Float[np.ndarray, "c n"]:
        """Share of the shapes on which a camera reads the dot."""
        return (self.how == Sight.READ).mean(axis=0)

    @cached_property
    def at_once(self) -> Int[np.ndarray, "e n"]:
        """How many cameras read the dot on each shape."""
        return (self.how == Sight.READ).sum(axis=1)

    @property
    def views(self) -> Int[np.ndarray, " n"]:
        """Fewest cameras that read the dot on any one shape."""
        return self.at_once.min(axis=0)

    def first_unread(self, c: int, n: int) -> tuple[Sight, int] | None:
        """Why camera c does not read the dot at n, and the first shape on which that is so; None where it always
        does."""
        unread = np.flatnonzero(self.how[:, c, n] != Sight.READ)
        return (Sight(int(self.how[unread[0], c, n])), int(unread[0])) if len(unread) else None


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
    key = digest(
        [METHOD, version("embreex"), "sights", neutral, deltas, triangles, vertices, *lenses, np.array(dot_mm)]
    )

    def compute() -> Arrays:
        return _over_shapes(neutral, deltas, triangles, vertices, cameras, dot_mm)

    found = cached(compute, "views", key, entries=ENTRIES)
    return Views(tuple(camera.name for camera in cameras), found["how"], found["pixels"])


def _over_shapes(
    neutral: Float[np.ndarray, "v 3"],
    deltas: Float[np.ndarray, "k v 3"],
    triangles: Int[np.ndarray, "f 3"],
    at: Int[np.ndarray, " n"],
    cameras: Sequence[Camera],
    dot_mm: float,
) -> Arrays:
    def look(shape: Float[np.ndarray, "v 3"]) -> tuple[UInt8[np.ndarray, "c n"], Float[np.ndarray, "c n"]]:
        occluder = Occluder(shape, triangles)
        found = [sights(camera, occluder, shape, at, dot_mm=dot_mm) for camera in cameras]
        return np.stack([how for how, _ in found]), np.stack([pixels for _, pixels in found])

    looks = [look(neutral)]
    looks += track_in_threads(lambda delta: look(neutral + delta), list(deltas), "Looking through the cameras")
    how = np.stack([each for each, _ in looks])
    spans = np.stack([np.where(np.isin(each, SEEN), pixels, np.inf) for each, pixels in looks]).min(axis=0)
    return {"how": how, "pixels": np.where(np.isfinite(spans), spans, 0.0)}
