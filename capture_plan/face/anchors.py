"""Where eyes, mouth, nose, chin and ears are on a face, exactly: the places found by all signs, drawn onto its mesh.

Data     eyes, mouth  as found from names, motion and shape (`face/points.py`), which also says whether they are sure
         surface      of the face with its border loops. A skin that a person narrowed has borders of its own, which
                      are no openings: the surface is that skin and what the rig itself shows to be skin around it
Eyes     the lid openings where they were found, but at the eyeballs where these lie nearer to each other; else the
         fronts of eyeballs there, else the places themselves
Mouth    its opening where it was found, else where blendshapes stretch the midline near it, else the place itself
Others   nose tip: most forward on the midline between eyes and mouth; chin: most forward and low below the mouth;
         ears: furthest to the side, between brow and mouth, behind the eyes, standing out over the cheek before them,
         with more of the head behind
Unit     the pupil distance; where nothing is found, proportions of four human heads stand in, and `found` says so
"""

from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from jaxtyping import Bool, Float, Int

from capture_plan.face.lids import NEAR_OPENING, against_eyes, around, before_the_balls, lid_gaps, shut
from capture_plan.face.lips import against_mouth
from capture_plan.face.moving import NOISE_MM
from capture_plan.face.of_rig import rig_channels, rig_points, rig_shape
from capture_plan.face.place import face_place
from capture_plan.face.points import Found, Points
from capture_plan.face.profile import chin_agrees, find_chin
from capture_plan.face.shape import border_loops, compact, middle_of_box
from capture_plan.face.skin import find_skin, is_ball
from capture_plan.face.votes import names_agree
from capture_plan.mesh import edges, piece_areas, pieces
from capture_plan.mesh.mirror import mirror_plane
from capture_plan.once import once
from capture_plan.rig import Rig
from capture_plan.rig.understood import Sign

EYE_SPREAD = 0.42  # pupil distance over the breadth of the moving face
MOUTH_BELOW_EYES, MOUTH_WIDTH = 1.1, 0.8  # of the pupil distance
EARS_WITHIN = 1.9  # pupil distances from the midline: four human heads have 1.4, a fox's whiskers 2.2
SAME_FACE = 0.5  # of the given skin; where less is found to be skin, the search went astray and the person is right
ASTRAY = 0.5  # pupil distances between the mouth found and the skin before it
SMALL_PIECE = 0.05  # of the area of the largest: drawn lids 0.01, a face of three meshes 0.2 and more each
ASKEW = 0.15  # rho between the mirror planes of the skin and of the head
OPENING = 0.4  # pupil distances from an eye to the middle of its opening, if none is as near as NEAR_OPENING
MOUTH_OPENING = 0.25  # the same from the mouth to its opening
LIPS_EXTENT = 0.3  # pupil distances from the mouth to its border: 25 faces 0.25 at most, a muzzle 0.29; hairlines more
GAPING, WIDE_OPEN = 0.1, 0.9  # pupil distances between the lips of a mouth that stands open; a mask's rim is larger
MIDDLE_OF_LIPS = 0.12  # pupil distances from the midline
CHIN_GOES_BACK = 0.5  # pupil distances: the chin of a mouth that gapes further lies behind the lip, as a throat does
AHEAD = (0.2, 0.35, 0.6)  # pupil distances from an ear, in height, and in depth from and to, where a cheek is
LOOKS = ("gaze up", "gaze down", "gaze left", "gaze right", "gaze in", "gaze out")
TURNED = 0.6  # of the largest displacement off the skin: the ball, not what hangs on it
BALL_OFF = 0.13  # pupil distances from an eye, seen from the front: on 16 faces 0.07 at most, under lids of another 0.2
STANDS_OUT = (
    0.095  # pupil distances that an ear reaches further than that: 24 faces 0.11 to 0.28, a racoon's cheeks 0.05
)
UNLIKE_EARS = 0.3  # pupil distances from the mirror image: an ear on one side and hair on the other 0.7
UNLIKE_EYES = 0.06  # pupil distances from the mirror image: 12 faces 0.02 at most
BEHIND_EARS = 0.4  # pupil distances that a head goes on; a mask ends with what is furthest to its side


Openings = tuple[list[Int[np.ndarray, " _"]], list[Int[np.ndarray, " _"]]]  # borders of large and of small pieces
Border = tuple[Float[np.ndarray, "_ 3"], Int[np.ndarray, " _"]]  # places and numbers of the vertices of a border


@dataclass(frozen=True, eq=False)
class Anchors:
    """Points of the face in millimetres, the subject's own sides; `lids` and `lips` are border vertices of the surface.

    `found` names the anchors that geometry gave; the others are human proportions. `gape_mm` is the height of the open
    mouth, 0 where no opening was found. `chin_sure` says whether the chin was found where faces have it, goes down with
    the jaw and lies below a mouth that does not gape. `against_eyes` and `against_mouth` are what speaks
    against the eyes and the mouth.
    """

    midline: float
    eye_left: Float[np.ndarray, " 3"]
    eye_right: Float[np.ndarray, " 3"]
    mouth: Float[np.ndarray, " 3"]
    corner_left: Float[np.ndarray, " 3"]
    corner_right: Float[np.ndarray, " 3"]
    nose_tip: Float[np.ndarray, " 3"]
    chin: Float[np.ndarray, " 3"]
    ear_left: Float[np.ndarray, " 3"]
    ear_right: Float[np.ndarray, " 3"]
    lids: Int[np.ndarray, " a"]
    lips: Int[np.ndarray, " b"]
    found: tuple[str, ...]
    gape_mm: float = 0.0
    chin_sure: bool = False
    against_eyes: tuple[Sign, ...] = ()
    against_mouth: tuple[Sign, ...] = ()

    @property
    def pupils(self) -> float:
        """Distance between the eye centres, millimetres: the unit of all proportions."""
        return float(np.linalg.norm(self.eye_left - self.eye_right))

    @property
    def between_y(self) -> float:
        """Height half way between the eyes and the mouth, millimetres: below it mouth and jaw move, above it lids."""
        return float((self.eye_left[1] + self.eye_right[1]) / 4 + self.mouth[1] / 2)


@once
def face_surface(rig: Rig) -> Bool[np.ndarray, " v"]:
    """The skin of a rig and, where a person narrowed it, the skin around it: what borders and shapes are read from."""
    channels = rig_channels(rig)
    place = face_place(rig_points(rig), channels)
    found = find_skin(rig.neutral, rig.triangles, rig.deltas[channels.facial], rig.parts, rig.part_names, place)
    surface = rig.skin | found if found[rig.skin].mean() >= SAME_FACE else rig.skin.copy()
    surface.flags.writeable = False
    return surface


@once
def face_anchors(rig: Rig) -> Anchors:
    """The anchors of a rig's face; proportions fill in what its mesh does not show."""
    return surface_anchors(replace(rig, skin=face_surface(rig)), rig_points(rig))


def surface_anchors(rig: Rig, points: Points) -> Anchors:
    """The anchors of a face whose skin is all of its surface, near the points that were found."""
    x0 = mirror_plane(rig.neutral[rig.skin])
    if abs(x0 - points.x0) > ASKEW * rig_channels(rig).rho:  # a skin of one side only
        x0 = points.x0
    openings = _openings(rig)
    eyes, lids = _eyes(rig, openings, x0, points.eyes)
    doubt = () if points.eyes.places is None else against_eyes(eyes, points.eyes.places)
    doubt += looks_elsewhere(rig, eyes, x0)
    if not any(map(shut, lid_gaps(rig.neutral, lids, x0).values())):  # the middle of closed lids lies lower
        doubt += unlike_eyes(eyes, x0)
    found = ("eyes",) if points.eyes.sure and not doubt else ()
    unit = float(np.linalg.norm(eyes[0] - eyes[1]))
    mouth, corners, lips = _mouth(rig, openings, eyes.mean(axis=0), unit, x0, points.mouth)
    skin = rig.neutral[rig.skin]
    against = (
        ()
        if points.mouth.places is None
        else against_mouth(skin, mouth, rig.neutral[lips], points.mouth.places[0], unit)
    )
    how = ("mouth",) if points.mouth.sure and not against else ()
    middle = skin[np.abs(skin[:, 0] - x0) < 0.15 * unit]
    drop = eyes[0, 1] - mouth[1]
    between = middle[(middle[:, 1] < eyes[0, 1] - 0.1 * drop) & (middle[:, 1] > mouth[1] + 0.2 * drop)]
    nose = _furthest(between, (0, 0, 1), mouth + np.array([0, 0.5 * drop, 0.3 * unit]))
    found_chin = find_chin(middle, eyes.mean(axis=0), mouth, unit)
    chin = mouth - np.array([0, 0.65 * drop, 0]) if found_chin is None else found_chin
    nose, chin = (np.array([x0, *place[1:]]) for place in (nose, chin))  # of coarse meshes no vertex may lie there
    gape = _gape(rig.neutral[lips], x0, unit)
    sides = skin[
        (skin[:, 1] > mouth[1] + 0.2 * drop)
        & (skin[:, 1] < eyes[0, 1] + 0.5 * unit)
        & (skin[:, 2] < eyes[0, 2] - 0.5 * unit)
    ]
    aside = [eyes.mean(axis=0) + unit * np.array([side * 1.4, -0.3, -1.4]) for side in (1, -1)]
    ears = [_furthest(sides, (side, 0, 0), point) for side, point in zip((1, -1), aside, strict=True)]
    goes_on = skin[:, 2].min() < min(ear[2] for ear in ears) - BEHIND_EARS * unit
    if goes_on and max(abs(ear[0] - x0) for ear in ears) < EARS_WITHIN * unit and are_ears(skin, ears, x0, unit):
        how += ("ears",)
    else:
        ears = aside
    return Anchors(
        midline=x0,
        eye_left=eyes[0],
        eye_right=eyes[1],
        mouth=mouth,
        corner_left=corners[0],
        corner_right=corners[1],
        nose_tip=nose,
        chin=chin,
        ear_left=ears[0],
        ear_right=ears[1],
        lids=lids,
        lips=lips,
        found=found + how,
        against_eyes=doubt,
        against_mouth=against,
        gape_mm=gape,
        chin_sure=found_chin is not None
        and gape < CHIN_GOES_BACK * unit
        and chin_agrees(chin, eyes.mean(axis=0), mouth, _with_the_jaw(rig, chin)),
    )


def looks_elsewhere(rig: Rig, eyes: Float[np.ndarray, "2 3"], x0: float) -> tuple[Sign, ...]:
    """What speaks against the eyes: that the eyeballs, or the discs of drawn eyes, which looks turn lie elsewhere."""
    rows = rig_channels(rig).of(*LOOKS)
    if not rows or not names_agree(rig_channels(rig)):
        return ()
    unit = float(np.linalg.norm(eyes[0] - eyes[1]))
    turned = rig.displacement[rows].max(axis=0) * ~rig.skin
    for eye, side in zip(eyes, (1, -1), strict=True):
        own = turned * (side * (rig.neutral[:, 0] - x0) > 0)
        if own.max() <= NOISE_MM:
            return ()  # looks that move lids alone tell no ball
        ball = middle_of_box(rig.neutral[own > TURNED * own.max()])
        if np.linalg.norm((ball - eye)[:2]) < BALL_OFF * unit:
            return ()
    return (Sign("what looks turn", "elsewhere", -1.0),)


def unlike_eyes(eyes: Float[np.ndarray, "2 3"], x0: float) -> tuple[Sign, ...]:
    """What speaks against the eyes: that the one lies far from the mirror image of the other."""
    off = float(np.linalg.norm(eyes[0] * [-1, 1, 1] + [2 * x0, 0, 0] - eyes[1]))
    if off <= UNLIKE_EYES * float(np.linalg.norm(eyes[0] - eyes[1])):
        return ()
    return (Sign("their mirror images", f"{off:.0f} mm apart", -1.0),)


def are_ears(skin: Float[np.ndarray, "v 3"], ears: list[Float[np.ndarray, " 3"]], x0: float, unit: float) -> bool:
    """Whether what lies furthest to the sides stands out over the skin before it, as ears do and cheeks do not, and on
    both sides alike."""
    left, right = ears
    if np.linalg.norm(left - right * [-1, 1, 1] - [2 * x0, 0, 0]) > UNLIKE_EARS * unit:
        return False
    for ear in ears:
        off, side = (skin - ear) / unit, np.sign(ear[0] - x0)
        ahead = (np.abs(off[:, 1]) < AHEAD[0]) & (off[:, 2] > AHEAD[1]) & (off[:, 2] < AHEAD[2])
        if (side * off[ahead, 0]).max(initial=-np.inf) > -STANDS_OUT:
            return False
    return True


def _gape(lips: Float[np.ndarray, "n 3"], x0: float, unit: float) -> float:
    """Height of the border of the mouth on the midline, millimetres."""
    middle = lips[np.abs(lips[:, 0] - x0) < MIDDLE_OF_LIPS * unit, 1]
    return float(np.ptp(middle)) if len(middle) else 0.0


def _with_the_jaw(rig: Rig, place: Float[np.ndarray, " 3"]) -> Float[np.ndarray, " 3"] | None:
    """Displacement of a place of the skin, over the largest on the skin, as the blendshape named for an open jaw moves
    it; None without one."""
    channels = rig_channels(rig)
    named = channels.of("jaw open") if names_agree(channels) else []
    if not named:
        return None
    skin = np.flatnonzero(rig.skin)
    vertex = skin[np.linalg.norm(rig.neutral[skin] - place, axis=1).argmin()]
    return rig.deltas[named[0], vertex].astype(float) / max(float(rig.displacement[named[0], skin].max()), 1e-9)


def eyeballs(rig: Rig) -> list[Bool[np.ndarray, " v"]]:
    """Pieces outside the skin that are balls or half balls, the largest first."""
    piece = pieces(rig.triangles, len(rig.neutral))
    outside = np.unique(piece[rig.triangles[:, 0]][~rig.skin[rig.triangles[:, 0]]])
    found = [piece == i for i in outside if (piece == i).sum() >= 12]
    found = [
        eye for eye in found if not rig.skin[eye].any() and compact(rig.neutral[eye]) and is_ball(rig.neutral[eye])
    ]
    return sorted(found, key=lambda eye: -float(np.prod(np.ptp(rig.neutral[eye], axis=0))))


def _openings(rig: Rig) -> Openings:
    """The borders of the surface's large pieces, and those of its small ones: where a face has openings, the outline
    of a lid or lip drawn over it is none."""
    triangles = rig.triangles[rig.skin[rig.triangles].all(axis=1)]
    piece = pieces(triangles, len(rig.neutral))
    area = piece_areas(rig.neutral, triangles, piece)
    large = (area >= SMALL_PIECE * area.max())[piece]
    loops = border_loops(triangles)
    return [loop for loop in loops if large[loop[0]]], [loop for loop in loops if not large[loop[0]]]


def _eyes(
    rig: Rig, openings: Openings, x0: float, found: Found
) -> tuple[Float[np.ndarray, "2 3"], Int[np.ndarray, " a"]]:
    """Centres of the left and the right eye, and the border of the lids."""
    nothing = np.empty(0, dtype=np.int64)
    if found.places is not None:
        for loops, within in product(openings, (NEAR_OPENING, OPENING)):
            shapes = [(rig.neutral[loop], loop) for loop in loops if len(loop) >= 6]
            pair = _mirrored_pair(_at(shapes, found.places, within), x0)
            if pair and (within == NEAR_OPENING or around([points for points, _ in pair], found.places)):
                (left, a), (right, b) = pair
                middles = np.stack([middle_of_box(left), middle_of_box(right)])
                return before_the_balls(rig_shape(rig), middles), np.sort(np.r_[a, b])
        shapes = [(rig.neutral[eye], np.flatnonzero(eye)) for eye in eyeballs(rig)]
        if pair := _mirrored_pair(_at(shapes, found.places, OPENING), x0):
            front = [np.r_[middle_of_box(points)[:2], points[:, 2].max()] for points, _ in pair]
            return np.stack(front), nothing
        return found.places, nothing
    moving = rig.displacement.max(axis=0)
    face = rig.neutral[rig.skin & (moving > 0.05 * moving.max())] if moving.any() else rig.neutral[rig.skin]
    low, high = np.percentile(face, 1, axis=0), np.percentile(face, 99, axis=0)
    unit = EYE_SPREAD * (high[0] - low[0]) or EYE_SPREAD * float(np.ptp(rig.neutral, axis=0).max())
    y = low[1] + 0.66 * (high[1] - low[1])  # the moving face reaches from below the chin to the brows
    return np.array([[x0 + side * unit / 2, y, high[2] - 0.5 * unit] for side in (1, -1)]), nothing


def _at(shapes: list[Border], places: Float[np.ndarray, "2 3"], within: float) -> list[Border]:
    """The sets of points whose middle lies within so many pupil distances of one of the eyes."""
    p = float(np.linalg.norm(places[0] - places[1]))
    return [
        (points, index)
        for points, index in shapes
        if np.linalg.norm((middle_of_box(points) - places) * [1, 1, 0.5], axis=1).min() < within * p
    ]


def _mirrored_pair(shapes: list[Border], x0: float) -> tuple[Border, Border] | None:
    """The widest (left, right) of two sets of points that mirror each other clear of the midline."""
    best, size = None, 0.0
    for left in shapes:
        for right in shapes:
            a, b = middle_of_box(left[0]), middle_of_box(right[0])
            width = min(np.ptp(left[0], axis=0).max(), np.ptp(right[0], axis=0).max())
            apart = a[0] - b[0]
            mirrored = np.linalg.norm(a - (b * [-1, 1, 1] + [2 * x0, 0, 0])) < 0.25 * width
            if mirrored and apart > width * 1.05 and width > size * 1.02:
                best, size = (left, right), float(width)
    return best


def _mouth(
    rig: Rig, openings: Openings, eyes: Float[np.ndarray, " 3"], unit: float, x0: float, found: Found
) -> tuple[Float[np.ndarray, " 3"], Float[np.ndarray, "2 3"], Int[np.ndarray, " b"]]:
    """Centre and corners (left, right) of the mouth, and the border of the lips."""
    place = None if found.places is None else found.places[0]
    near = [] if place is None else [[(_apart(rig.neutral[loop], place), loop) for loop in some] for some in openings]
    for apart, loop in [one for some in near for one in sorted(some, key=lambda one: one[0])]:
        points = rig.neutral[loop]
        centre, width = middle_of_box(points), np.ptp(points[:, 0])
        passes = np.linalg.norm((points - place)[:, 1:], axis=1).min() < LIPS_EXTENT * unit
        across = abs(centre[0] - x0) < 0.15 * unit and 0.1 * unit < width < 2.5 * unit
        if apart < _extent(points, unit) and passes and across:
            corners = points[[points[:, 0].argmax(), points[:, 0].argmin()]]
            front = points[np.argsort(np.abs(points[:, 0] - x0), kind="stable")[: max(2, len(points) // 5)]]
            return np.r_[x0, _between_lips(front[:, 1], unit), front[:, 2].max()], corners, loop
    y = eyes[1] - MOUTH_BELOW_EYES * unit if place is None else _tear(rig, place, unit, x0)
    skin = rig.neutral[rig.skin]

    def forward(x: float) -> Float[np.ndarray, " 3"]:
        away = np.hypot(skin[:, 0] - x, skin[:, 1] - y)
        nearest = away.argsort()[:12]
        on = skin[nearest[away[nearest] <= max(0.15 * unit, away[nearest[0]])]].max(axis=0)
        if place is not None and abs(on[2] - place[2]) > ASTRAY * unit:  # a skin that shows its inside
            return np.array([x, y, place[2]])
        return on

    half = MOUTH_WIDTH * unit / 2
    points = [np.r_[x, y, forward(x)[2]] for x in (x0, x0 + half, x0 - half)]
    return points[0], np.stack(points[1:]), np.empty(0, dtype=np.int64)


def _extent(points: Float[np.ndarray, "n 3"], unit: float) -> float:
    """How far from the place that was found a mouth's opening may have its middle: further where its lips gape."""
    gape = float(np.ptp(points[:, 1]))
    return MOUTH_OPENING * unit + (gape / 2 if GAPING * unit < gape < WIDE_OPEN * unit else 0.0)


def _between_lips(y: Float[np.ndarray, " n"], unit: float) -> float:
    """Height of the middle of the lips by those of their border beside the midline: half way where they gape, however
    many vertices either lip has."""
    middle = (y.min() + y.max()) / 2
    if np.ptp(y) < GAPING * unit:
        return float(y.mean())
    return float((y[y > middle].mean() + y[y <= middle].mean()) / 2)


def _apart(points: Float[np.ndarray, "n 3"], place: Float[np.ndarray, " 3"]) -> float:
    """From a place to the middle of an opening, across the midline; depth counts half."""
    return float(np.linalg.norm((middle_of_box(points) - place)[1:] * [1, 0.5]))


def _tear(rig: Rig, place: Float[np.ndarray, " 3"], unit: float, x0: float) -> float:
    """Height at which blendshapes stretch the midline near a place, by squared stretch; its own where none does."""
    edge = edges(rig.triangles[rig.skin[rig.triangles].all(axis=1)])
    middle = rig.neutral[edge].mean(axis=1)
    fits = (np.abs(middle[:, 0] - x0) < 0.2 * unit) & (np.abs(middle[:, 1] - place[1]) < OPENING * unit)
    fits &= middle[:, 2] > place[2] - unit
    edge, middle = edge[fits], middle[fits]
    stretch = np.zeros(len(edge))
    for delta in rig.deltas[rig_channels(rig).facial]:
        stretch = np.maximum(stretch, np.linalg.norm(delta[edge[:, 0]] - delta[edge[:, 1]], axis=1))
    if len(edge) == 0 or stretch.max() < 0.05 * unit:
        return float(place[1])
    return float(np.average(middle[:, 1], weights=stretch**2))


def _furthest(
    points: Float[np.ndarray, "v 3"], direction: tuple[int, int, int], otherwise: Float[np.ndarray, " 3"]
) -> Float[np.ndarray, " 3"]:
    return points[(points @ np.array(direction, dtype=float)).argmax()] if len(points) else otherwise


def interpupillary(rig: Rig) -> float | None:
    """Millimetres between the eyes as they were found; None where no sign speaks of any."""
    return None if rig_points(rig).eyes.places is None else face_anchors(rig).pupils
