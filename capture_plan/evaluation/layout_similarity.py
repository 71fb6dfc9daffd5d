"""How alike two layouts of one face are: by the nearest points, and by what share of them each region has.

Data     a_i, b_j     points of ours and of theirs on the neutral face, millimetres
         h[r], g[r]   share of our points, and of theirs, in region r of the face
Nearest  A = mean_i min_j |a_i - b_j|,  B = mean_j min_i |a_i - b_j|;  (A + B) / 2, straight through the skin
         A alone is small where ours are few of theirs, B alone where ours cover theirs
Overlap  sum_r min(h[r], g[r])        1 for the same shares, 0 where no region has both
"""

import numpy as np
from jaxtyping import Float, Int
from msgspec import Struct
from scipy.spatial import KDTree

from capture_plan.anatomy.regions import FaceRegions, face_regions
from capture_plan.registration.empirical_layouts import empirical_layout, place_layout
from capture_plan.registration.known import EMPIRICAL
from capture_plan.rig import Rig


class Similarity(Struct, frozen=True, forbid_unknown_fields=True):
    """A layout beside the one called `name`: mean distances to the nearest point of the other, millimetres.

    `mean_nearest_mm` is the mean of both ways; `region_overlap` is the share of points that stand in the same regions
    of the face, 0 to 1.
    """

    name: str
    mean_nearest_mm: float
    ours_to_theirs_mm: float
    theirs_to_ours_mm: float
    region_overlap: float


def similarity(rig: Rig, ours: Int[np.ndarray, " m"], name: str, theirs: Int[np.ndarray, " n"]) -> Similarity:
    """Our layout beside theirs, both by vertices of the rig's skin."""
    return _similarity(rig, face_regions(rig), ours, name, theirs)


def similarities(rig: Rig, ours: Int[np.ndarray, " m"]) -> tuple[Similarity, ...]:
    """Our layout beside every empirical one that the rig has room for, the most alike first.

    Raises:
        RigError: the skin has fewer vertices than one of them has points.
    """
    regions = face_regions(rig)
    found = (
        _similarity(rig, regions, ours, empirical_layout(key).title, place_layout(rig, key).vertices)
        for key in EMPIRICAL
    )
    return tuple(sorted(found, key=lambda one: one.mean_nearest_mm))


def _similarity(
    rig: Rig, regions: FaceRegions, ours: Int[np.ndarray, " m"], name: str, theirs: Int[np.ndarray, " n"]
) -> Similarity:
    a, b = rig.neutral[ours], rig.neutral[theirs]
    to_theirs, to_ours = float(KDTree(b).query(a)[0].mean()), float(KDTree(a).query(b)[0].mean())
    return Similarity(
        name=name,
        mean_nearest_mm=(to_theirs + to_ours) / 2,
        ours_to_theirs_mm=to_theirs,
        theirs_to_ours_mm=to_ours,
        region_overlap=float(np.minimum(_shares(regions, ours), _shares(regions, theirs)).sum()),
    )


def _shares(regions: FaceRegions, vertices: Int[np.ndarray, " m"]) -> Float[np.ndarray, " r"]:
    """h: the share of the vertices in each region."""
    return np.bincount(regions.of_vertex[vertices], minlength=len(regions.names)) / len(vertices)
