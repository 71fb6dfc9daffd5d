"""How far the lips stand apart in a pose, whatever the names say.

Data     jaw    the delta of the open jaw, millimetres; pairs (i, j) of skin, near each other in the neutral, of which
                the jaw takes j along and leaves i behind: the two lips, since only there is the skin cut
Gap      median over the pairs of (u_j - u_i) . n, where u is the pose less the neutral and n the way in which the jaw
         parts a pair; above 0 where lips are open, below where one runs through the other; none without pairs
Unnamed  where no blendshape is known to open the jaw, the pairs are of the regions of the two lips, parted downwards
"""

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial import KDTree

from capture_plan.anatomy.meaning import arkit_by_motion
from capture_plan.anatomy.regions import face_regions
from capture_plan.once import once
from capture_plan.rig import Rig

NEAR_MM = 8.0  # lips at rest: 0 to 5 mm from rim to rim
BEHIND, ALONG = 0.25, 0.6  # of the jaw's largest motion: upper lips on four heads have 0.05, lower ones 0.7
OPEN_MM = 2.0  # less a scan cannot tell from lips that touch


def lips_apart(rig: Rig, blendshapes: tuple[str, ...]) -> float | None:
    """Millimetres between the lips when `blendshapes` are at full weight, beyond the neutral; None where not found."""
    found = _lips(rig)
    if found is None:
        return None
    pairs, n = found
    moved = rig.deltas[np.isin(rig.names, blendshapes)].sum(axis=0)
    return float(np.median(np.einsum("px,px->p", _parted(moved, pairs), n)))


def stays_open(rig: Rig, blendshapes: tuple[str, ...]) -> float | None:
    """Millimetres between lips that are asked to close over the open jaw; None where they close or none are asked."""
    if not any(arkit_by_motion(rig, name) == "mouthClose" for name in blendshapes):
        return None
    jaw = open_jaw(rig)
    gap = lips_apart(rig, blendshapes if jaw is None else (*blendshapes, rig.names[jaw]))
    return gap if gap is not None and gap >= OPEN_MM else None


def open_jaw(rig: Rig) -> int | None:
    """The blendshape that opens the jaw and does no more: the one that is named so before a vowel that opens it too."""
    found = [k for k, name in enumerate(rig.names) if arkit_by_motion(rig, name) == "jawOpen"]
    return min(found, key=lambda k: rig.arkit(rig.names[k]) != "jawOpen", default=None)


@once
def _lips(rig: Rig) -> tuple[Int[np.ndarray, "p 2"], Float[np.ndarray, "p 3"]] | None:
    """Pairs of (upper, lower) vertices that the open jaw parts, and which way; None where it parts none."""
    jaw = open_jaw(rig)
    if jaw is None:
        pairs = _lip_regions(rig)
        return None if pairs is None else (pairs, np.tile([0.0, -1.0, 0.0], (len(pairs), 1)))
    moved = rig.displacement[jaw] / max(float(rig.displacement[jaw, rig.skin].max()), 1e-9)
    upper, lower = np.flatnonzero(rig.skin & (moved < BEHIND)), np.flatnonzero(rig.skin & (moved > ALONG))
    pairs = _near(rig, upper, lower)
    if pairs is None:
        return None
    way = _parted(rig.deltas[jaw], pairs)
    return pairs, way / np.linalg.norm(way, axis=1, keepdims=True)


def _lip_regions(rig: Rig) -> Int[np.ndarray, "p 2"] | None:
    """Pairs of the upper and the lower lip that lie near each other, by the regions of the face; None without such."""
    regions = face_regions(rig)
    if not regions.known:
        return None
    upper, lower = (
        np.flatnonzero(rig.skin & (regions.of_vertex == regions.names.index(lip))) for lip in ("upper lip", "lower lip")
    )
    return _near(rig, upper, lower)


def _near(rig: Rig, upper: Int[np.ndarray, " a"], lower: Int[np.ndarray, " b"]) -> Int[np.ndarray, "p 2"] | None:
    """Every lower vertex that has an upper one near it, with the nearest; None where none has."""
    if len(upper) == 0 or len(lower) == 0:
        return None
    distance, near = KDTree(rig.neutral[upper]).query(rig.neutral[lower], distance_upper_bound=NEAR_MM)
    close = np.isfinite(distance)
    return np.column_stack([upper[np.asarray(near)[close]], lower[close]]) if close.any() else None


def _parted(moved: Float[np.ndarray, "v 3"], pairs: Int[np.ndarray, "p 2"]) -> Float[np.ndarray, "p 3"]:
    """How far the lower one of each pair moves from the upper one, millimetres."""
    return (moved[pairs[:, 1]] - moved[pairs[:, 0]]).astype(float)
