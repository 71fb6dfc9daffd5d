"""Where landmarks may stand, and what each place tells (Zell & McDonnell 2022, sections 3.1 and 3.3.1).

A *site* is one vertex, or a vertex together with its mirror image: choosing the site places both landmarks. On a site
the relative displacement is the larger of the two, which is the paper's symmetry pre-process, and the visibility the
smaller one. Everything after this module works on sites and never asks which kind they are.

Letters: s sites, k blendshapes, v vertices; reach r[k, s] and visibility l[s] are shares from 0 to 1.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

STILL = 0.01  # share of the largest displacement of the whole rig; the paper's 0.01 (section 4.1) has no unit


@dataclass(frozen=True, eq=False)
class Sites:
    """`vertices` are the one or two vertices of each site, the same one twice for a single."""

    vertices: Int[np.ndarray, "s 2"]
    relative_displacement: Float[np.ndarray, "k s"]
    visibility: Float[np.ndarray, " s"]

    @property
    def size(self) -> Int[np.ndarray, " s"]:
        """Landmarks that each site places: 1 or 2."""
        return 1 + (self.vertices[:, 0] != self.vertices[:, 1])

    def members(self, chosen: Int[np.ndarray, " n"]) -> Int[np.ndarray, " m"]:
        """The vertices of the chosen sites, in the sites' order, without repeats."""
        return np.array(list(dict.fromkeys(self.vertices[chosen].ravel().tolist())), dtype=int)

    def covers(self, epsilon: float) -> Bool[np.ndarray, "k s"]:
        """c[k, s]: site s is a candidate for blendshape k (eq. 3)."""
        return self.relative_displacement >= epsilon


def moving(displacement: Float[np.ndarray, "k v"]) -> Bool[np.ndarray, " v"]:
    """Vertices that some blendshape moves by more than `STILL` of the largest displacement."""
    return displacement.max(axis=0) > STILL * displacement.max()


def single_sites(
    relative: Float[np.ndarray, "k v"], visibility: Float[np.ndarray, " v"], allowed: Bool[np.ndarray, " v"]
) -> Sites:
    """Every allowed vertex is a site."""
    vertices = np.flatnonzero(allowed)
    return Sites(np.stack([vertices, vertices], axis=1), relative[:, vertices], visibility[vertices])


def mirrored_sites(
    relative: Float[np.ndarray, "k v"],
    visibility: Float[np.ndarray, " v"],
    allowed: Bool[np.ndarray, " v"],
    *,
    neutral: Float[np.ndarray, "v 3"],
    mirror: Int[np.ndarray, " v"],
    spacing_mm: float,
) -> Sites:
    """Every allowed vertex of the middle, and every allowed vertex with its mirror image, subject's right first.

    Two vertices are partners where each is the other's mirror image. Pairs closer than `spacing_mm` are no sites.
    """
    v = np.arange(len(mirror))
    mutual = allowed & allowed[mirror] & (mirror[mirror] == v)
    apart = np.linalg.norm(neutral - neutral[mirror], axis=1) >= spacing_mm
    right = neutral[:, 0] < neutral[mirror, 0]
    retained = np.flatnonzero(mutual & ((mirror == v) | (apart & right)))
    pairs = np.stack([retained, mirror[retained]], axis=1)
    return Sites(pairs, relative[:, pairs].max(axis=2), visibility[pairs].min(axis=1))
