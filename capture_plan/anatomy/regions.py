"""Names for places on a face that a make-up artist would say: left brow, nose, right mouth corner.

Data       anchors   eyes, mouth, nose tip, chin, ears; u their unit, the distance between the pupils
Letters    x, y, z   place of a vertex from the midline, the eye line and the eyes, in units of u; |x| is meant
           s         height between mouth (0) and eye line (1), going on above and below
Rule       lids and lips are told into upper and lower by the shorter way along the skin, since closed lips touch, and
           lids beside the corners of an eye by the line through both corners, since no opening parts them there;
           everything else by lines between anchors, the first region that fits in the order of REGIONS; what clearly
           moves with brows, lids or a smile beside such a line belongs to them (`region_motion.py`)
Doubt      where eyes or mouth are not certain, a place has a side and no region; where the axes are not, neither
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import KDTree

from capture_plan.anatomy.eye_corners import eye_corners
from capture_plan.anatomy.region_motion import moved_together
from capture_plan.face.anchors import Anchors, face_anchors
from capture_plan.face.reading import face_reading
from capture_plan.face.sense import contradicted
from capture_plan.mesh import surface_graph
from capture_plan.mesh.mirror import mirror_map
from capture_plan.rig.record import Rig

REGIONS = (
    "ear",
    "mouth corner",
    "nose",
    "upper eyelid",
    "lower eyelid",
    "upper lip",
    "lower lip",
    "neck",
    "chin",
    "brow",
    "jaw",
    "temple",
    "cheek",
    "forehead",
    "scalp",
)
MIDDLE = 0.06  # of u: 4 mm to either side of the midline have no side
CORNER, CORNER_OF_HALF = 0.16, 0.46  # of u; of half the mouth, whose lips lie between: human ones have 0.35 u
EYE_CORNER, LIDS, ENDS = 0.1, ("upper eyelid", "lower eyelid"), ("inner", "outer")  # of u
NO_REGION = -1
UNNAMED = "face"  # where a place is whose region is not certain
SIDE_WORDS = {1: "left side", 0: "middle", -1: "right side"}
SIDELESS = "marker"
OTHER_SIDE = {"left": "right", "right": "left"}


@dataclass(frozen=True, eq=False)
class FaceRegions:
    """`names[of_vertex[v]]` is the region of vertex v, -1 no skin; `side[v]` is 1 left, 0 middle, -1 right.

    `aside[v]` is how far v lies from the midline, millimetres, on either side. `eye_corner[v]` is 1 or 2 on a lid at
    the inner or outer corner of an eye, where a make-up artist says so; else 0.
    `known` says whether eyes and mouth are certain enough to call places by these names, `sided` whether the axes are
    certain enough to tell left from right.
    """

    names: tuple[str, ...]
    of_vertex: Int[np.ndarray, " v"]
    side: Int[np.ndarray, " v"]
    aside: Float[np.ndarray, " v"]
    eye_corner: Int[np.ndarray, " v"]
    anchors: Anchors
    known: bool = True
    sided: bool = True

    def region(self, vertex: int) -> str:
        """The region of a skin vertex; `UNNAMED` where regions are not certain."""
        return self.names[self.of_vertex[vertex]] if self.known else UNNAMED

    def label(self, vertex: int) -> str:
        """What to call the place of a vertex: 'left brow', 'nose', 'left side' where regions are not certain, 'marker'
        where sides are not; 'not skin' where it is none."""
        region, side = int(self.of_vertex[vertex]), int(self.side[vertex])
        if region == NO_REGION:
            return "not skin"
        if not self.sided:
            return SIDELESS
        end = int(self.eye_corner[vertex])
        name = f"{ENDS[end - 1]} eye corner" if end else self.names[region]
        return region_label(name, side) if self.known else SIDE_WORDS[side]


def region_label(region: str, side: int) -> str:
    """Plain words for a region on a side (1 the subject's left, 0 the middle, -1 the right)."""
    return {1: "left ", 0: "", -1: "right "}[side] + region


def mirrored_label(label: str) -> str:
    """What the mirror image of a place is called: 'left brow 2' for 'right brow 2', 'chin' for 'chin'."""
    side, _, rest = label.partition(" ")
    return f"{OTHER_SIDE.get(side, side)} {rest}".strip()


def face_regions(rig: Rig) -> FaceRegions:
    """The region and the side of every skin vertex of any rig, named or not.

    Example:
        >>> regions = face_regions(sample_rig())
        >>> regions.known, "nose" in regions.names
        (True, True)
    """
    anchors = face_anchors(rig)
    u = anchors.pupils
    at = np.flatnonzero(rig.skin)
    graph = surface_graph(rig.neutral, rig.triangles[rig.skin[rig.triangles].all(axis=1)])
    fits = _fits(rig.neutral, graph, at, anchors)
    beside, above = _past_the_corners(rig, at, anchors)
    fits["upper eyelid"] = fits["lower eyelid"] & np.where(beside, above, fits["upper eyelid"])
    of_vertex = np.full(len(rig.neutral), NO_REGION)
    of_vertex[at] = np.stack([fits[name] for name in REGIONS]).argmax(axis=0)
    of_vertex = moved_together(rig, of_vertex, REGIONS, anchors)
    x = _aside(rig.neutral, anchors.midline)
    side = np.where(np.abs(x) <= MIDDLE * u, 0, np.sign(x)).astype(int)
    known, sided = names_known(rig)
    return FaceRegions(
        REGIONS, of_vertex, side, np.abs(x), _at_eye_corners(rig, anchors, of_vertex), anchors, known, sided
    )


def _at_eye_corners(rig: Rig, anchors: Anchors, of_vertex: Int[np.ndarray, " v"]) -> Int[np.ndarray, " v"]:
    """Which vertices of the lids lie at an inner (1) or outer (2) corner of an eye."""
    found = np.zeros(len(of_vertex), dtype=int)
    lid = np.isin(of_vertex, [REGIONS.index(name) for name in LIDS])
    for (end, _), corner in eye_corners(rig, anchors).items():
        near = np.linalg.norm(rig.neutral - rig.neutral[corner], axis=1) < EYE_CORNER * anchors.pupils
        found[lid & near] = 1 + ENDS.index(end)
    return found


def _aside(neutral: Float[np.ndarray, "v 3"], midline: float) -> Float[np.ndarray, " v"]:
    """How far each vertex lies from the midline, positive to the subject's left: of two that are each other's mirror
    image the mean, so that on a lopsided face both lie beside the middle or neither does."""
    x, image = neutral[:, 0], mirror_map(neutral)
    pair = (image[image] == np.arange(len(x))) & (image != np.arange(len(x)))
    return np.where(pair, (x - x[image]) / 2, x - midline)


def names_known(rig: Rig) -> tuple[bool, bool]:
    """Whether places of a face may be called by their regions, and whether by their sides: the one switch for both."""
    read = face_reading(rig)
    lies = read.axes.sure and not contradicted(rig)
    return lies and read.eyes.sure and read.mouth.sure, lies


def _fits(
    neutral: Float[np.ndarray, "v 3"], graph: csr_array, at: Int[np.ndarray, " n"], anchors: Anchors
) -> dict[str, Bool[np.ndarray, " n"]]:
    """For each region, which of the skin vertices `at` lie inside its lines; the scalp takes what is left."""
    u, points = anchors.pupils, neutral[at]
    eyes = (anchors.eye_left + anchors.eye_right) / 2
    x = np.abs(points[:, 0] - anchors.midline) / u
    y, z = (points[:, 1] - eyes[1]) / u, (points[:, 2] - eyes[2]) / u
    drop = (eyes[1] - anchors.mouth[1]) / u
    s = y / drop + 1
    half_mouth = np.abs(np.array([anchors.corner_left[0], anchors.corner_right[0]]) - anchors.midline).mean() / u
    tip = (anchors.nose_tip[1] - anchors.mouth[1]) / u / drop
    nose_base = 0.6 * tip  # the base of the nose lies lower than its tip
    ear = (np.array([anchors.ear_left, anchors.ear_right])[:, 1:].mean(axis=0) - eyes[1:]) / u
    has_ears = "ears" in anchors.found
    chin = (anchors.chin[1:] - eyes[1:]) / u

    to_eye, upper_lid = _ring(neutral, graph, at, anchors.lids, np.stack([anchors.eye_left, anchors.eye_right]))
    mouth = np.stack([anchors.mouth, anchors.corner_left, anchors.corner_right])
    _, upper_lip = _ring(neutral, graph, at, anchors.lips, mouth)
    to_eye, z_ear = to_eye / u, ear[1]
    front = z > z_ear + 0.45
    corners = KDTree(np.stack([anchors.corner_left, anchors.corner_right])).query(points)[0] / u

    # side view: the line under jaw and skull, from the chin over the angle of the jaw to the nape
    angle = (z_ear + 0.15, -drop * 1.05)
    nape = np.interp(z, [z_ear - 1.2, angle[0], chin[1]], [ear[0] - 0.75, angle[1], chin[0] - 0.02])
    lid = to_eye < 0.17
    nose_half = np.interp(s, [nose_base, tip, 0.95, 1.15], [0.30, 0.30, 0.19, 0.19])
    jaw_line = np.interp(z, [z_ear + 0.2, z_ear + 1.2], [-drop * 0.55, -drop * 1.1])
    return {
        "ear": (np.hypot((y - ear[0] + 0.12) / 0.6, (z - z_ear - 0.1) / 0.36) < 1) & (x > 0.8) & has_ears,
        "mouth corner": corners < min(CORNER, CORNER_OF_HALF * half_mouth),
        "nose": front & (x < nose_half) & (s > nose_base) & (s < 1.12),
        "upper eyelid": lid & upper_lid,
        "lower eyelid": lid,
        "upper lip": front & (x < half_mouth + 0.05) & (s < nose_base + 0.06) & (s > -0.5) & upper_lip,
        "lower lip": front & (x < half_mouth + 0.05) & (s > -0.24) & (s < 0.4) & ~upper_lip,
        "neck": y < nape,
        "chin": front & (x < 0.42) & (s < 0),
        "brow": front & (y > 0.1) & (y < 0.52) & (x < 0.95),
        "jaw": front & (y < jaw_line),
        "temple": (z > z_ear + 0.2) & (y > -0.08) & (y < 0.95) & (x > 0.8),
        "cheek": (z > z_ear + 0.2) & (y < 0.1),
        "forehead": front & (y < 1.2),
        "scalp": np.ones(len(at), dtype=bool),
    }


def _past_the_corners(
    rig: Rig, at: Int[np.ndarray, " n"], anchors: Anchors
) -> tuple[Bool[np.ndarray, " n"], Bool[np.ndarray, " n"]]:
    """Which of the vertices `at` lie beside the opening of the eye on their side, past its inner or outer corner, and
    which of those lie above the line through both corners."""
    corners, points = eye_corners(rig, anchors), rig.neutral[at]
    beside, above = np.zeros(len(at), dtype=bool), np.zeros(len(at), dtype=bool)
    for side, sign in (("left", 1), ("right", -1)):
        if ("inner", side) not in corners:
            continue
        inner, outer = rig.neutral[[corners["inner", side], corners["outer", side]]]
        of_side = sign * (points[:, 0] - anchors.midline) > 0
        along = (points[:, 0] - inner[0]) / (outer[0] - inner[0])  # 0 at the inner corner, 1 at the outer one
        beside |= of_side & ((along < 0) | (along > 1))
        above |= of_side & (points[:, 1] > inner[1] + along * (outer[1] - inner[1]))
    return beside, above


def _ring(
    neutral: Float[np.ndarray, "v 3"],
    graph: csr_array,
    at: Int[np.ndarray, " n"],
    border: Int[np.ndarray, " b"],
    centres: Float[np.ndarray, "c 3"],
) -> tuple[Float[np.ndarray, " n"], Bool[np.ndarray, " n"]]:
    """Distance of the vertices `at` to an opening of the skin (its border, else its centres), and who is above it."""
    edge = neutral[border] if len(border) else centres
    away = KDTree(edge).query(neutral[at])[0]
    centre = centres[KDTree(centres).query(neutral[at])[1]]
    extent = 0.35 * np.linalg.norm(centres[0] - centres[1])
    offset = neutral[at] - centre
    above, below = (
        at[(sign * offset[:, 1] > extent / 2) & (np.abs(offset) < extent * 2).all(axis=1)] for sign in (1, -1)
    )
    if len(border) == 0 or len(above) == 0 or len(below) == 0:
        return away, offset[:, 1] > 0
    up, down = (dijkstra(graph, directed=False, indices=side, min_only=True)[at] for side in (above, below))
    return away, up < down
