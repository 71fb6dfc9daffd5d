"""Regions that agree with what moves: a place beside the line of its region, moved by another's movement, is of that.

Data       of_vertex[v] region by lines between anchors, u the pupil distance
Letters    r[g, v]  displacement over the largest of its blendshape, the most over those that names call movements of
                    the group g: brows, lids, smile
Clear      r[g, v] is at least MOVED, and RATIO times that of every other group
Chin       under a jaw that opens, what goes along with the chin by at least ALONG of it, near it, is chin or jaw and no
           neck; the blendshape is the one that moves the chin furthest and leaves the face above the eyes STILL, by
           whatever name
Both signs are asked: a vertex changes its region only where its motion is clear and its place is one that the other
region has on faces. Where names contradict each other or say nothing, the lines decide alone.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from capture_plan.face.anchors import Anchors
from capture_plan.face.of_rig import rig_channels
from capture_plan.face.votes import names_agree
from capture_plan.rig.record import Rig

GROUPS = {
    "brows": ("brow up", "brow down"),
    "lids": ("blink",),
    "smile": ("smile",),
    "jaw": ("jaw open",),
    "nose": ("nose",),
}
MOVED, RATIO = 0.3, 1.5
BROW_Y = (0.1, 0.6)  # u above the eyes, and no further to the side than BROW_X
BROW_X = 0.95
LID = 0.45  # u from an eye's middle
FOREHEAD_Y = 1.4
ALONG, STILL = 0.6, 0.3  # of the chin's own way: more than skin half way to a neck that rests
# Of the largest motion a chin goes so much: with its bone 0.76 to 0.97, with drawn mouths 0.27 to 0.31, funnels 0.2.
MOST = 0.25
DOWN = 0.25  # of the chin's way: jaws that open 0.3 to 0.7, jaws pushed forward 0.14
CHIN_X = 0.42  # u from the midline
UNDER = 0.5  # u below the chin
LIP_CORNER = 0.4  # u from the midline: corners of the mouths of four human heads 0.35 to 0.4
NARROW = 0.32  # u: an opening narrower than that ends inside the lips
MARGIN = 0.16  # u around the corner


class Places(NamedTuple):
    """Vertices where brows, lids, foreheads and corners of the mouth may be."""

    brow: Bool[np.ndarray, " v"]
    lid: Bool[np.ndarray, " v"]
    forehead: Bool[np.ndarray, " v"]
    corner: Bool[np.ndarray, " v"]


def moved_together(
    rig: Rig, of_vertex: Int[np.ndarray, " v"], names: tuple[str, ...], anchors: Anchors
) -> Int[np.ndarray, " v"]:
    """The regions with those vertices exchanged whose motion and place both speak for a neighbour."""
    clear, place = clearly_moved(rig), _places_of(rig.neutral, anchors)
    still = np.zeros(len(of_vertex), dtype=bool)
    changes = (
        ("upper eyelid", "brow", clear.get("brows", still) & place.brow),
        ("brow", "upper eyelid", clear.get("lids", still) & place.lid),
        ("scalp", "forehead", clear.get("brows", still) & place.forehead),
        ("cheek", "mouth corner", clear.get("smile", still) & place.corner),
    )
    found = of_vertex.copy()
    for region, other, moves in changes:
        found[(of_vertex == names.index(region)) & moves] = names.index(other)
    along = (found == names.index("neck")) & with_the_chin(rig, found == names.index("chin"), anchors)
    middle = np.abs(rig.neutral[:, 0] - anchors.midline) < CHIN_X * anchors.pupils
    found[along] = np.where(middle, names.index("chin"), names.index("jaw"))[along]
    return found


def with_the_chin(rig: Rig, chin: Bool[np.ndarray, " v"], anchors: Anchors) -> Bool[np.ndarray, " v"]:
    """Skin not far below the chin that goes where the chin goes when the jaw opens; none where no blendshape opens it.

    `chin` are the vertices known to be of the chin.
    """
    low = rig.neutral[:, 1] > anchors.chin[1] - UNDER * anchors.pupils
    upper = rig.skin & (rig.neutral[:, 1] > max(anchors.eye_left[1], anchors.eye_right[1]))
    facial = np.flatnonzero(rig_channels(rig).facial)
    nothing = np.zeros(len(rig.neutral), dtype=bool)
    if not chin.any() or len(facial) == 0:
        return nothing
    far = np.median(rig.displacement[facial][:, chin], axis=1)
    stays = rig.displacement[facial][:, upper].max(axis=1, initial=0) < STILL * far
    down = rig.deltas[facial][:, chin, 1].mean(axis=1) < -DOWN * far
    opens = stays & down & (far >= MOST * rig.displacement[facial][:, rig.skin].max(axis=1))
    if not opens.any():
        return nothing
    k = int(np.where(opens, far, -1).argmax())
    way = rig.deltas[facial[k], chin].mean(axis=0)
    # d . way / |way|^2: how much of the chin's own way a vertex goes
    return rig.skin & low & (rig.deltas[facial[k]] @ way >= ALONG * (way @ way))


def clearly_moved(rig: Rig) -> dict[str, Bool[np.ndarray, " v"]]:
    """For each group that names speak of, which vertices it moves clearly more than the others do."""
    channels = rig_channels(rig)
    if not names_agree(channels):
        return {}
    rows = {group: found for group, kinds in GROUPS.items() if (found := channels.of(*kinds))}
    r: dict[str, Float[np.ndarray, " v"]] = {}
    for group, found in rows.items():
        largest = rig.displacement[found][:, rig.skin].max(axis=1, keepdims=True)
        r[group] = (rig.displacement[found] / np.where(largest > 0, largest, np.inf)).max(axis=0)
    nothing = np.zeros(len(rig.neutral))
    return {
        group: (own >= MOVED) & (own >= RATIO * np.max([nothing, *(r[g] for g in r if g != group)], axis=0))
        for group, own in r.items()
    }


def _places_of(neutral: Float[np.ndarray, "v 3"], anchors: Anchors) -> Places:
    """Where on a face with these anchors each region may be."""
    u, eyes = anchors.pupils, (anchors.eye_left + anchors.eye_right) / 2
    x, y = np.abs(neutral[:, 0] - anchors.midline) / u, (neutral[:, 1] - eyes[1]) / u
    front = neutral[:, 2] > eyes[2] - u
    to_eye = np.min([np.linalg.norm(neutral - eye, axis=1) for eye in (anchors.eye_left, anchors.eye_right)], axis=0)
    corners = np.array([anchors.corner_left, anchors.corner_right])
    half = float(np.abs(corners[:, 0] - anchors.midline).mean()) / u
    outwards, level = x - half, np.abs(neutral[:, 1] - corners[:, 1].mean()) / u
    depth = neutral[:, 2] > corners[:, 2].mean() - u / 2
    extent = LIP_CORNER - half + MARGIN
    return Places(
        brow=front & (y > BROW_Y[0]) & (y < BROW_Y[1]) & (x < BROW_X),
        lid=to_eye < LID * u,
        forehead=front & (y > BROW_Y[0]) & (y < FOREHEAD_Y),
        corner=depth & (half < NARROW) & (np.hypot(outwards / extent, level / MARGIN) < 1),
    )
