"""Where the shell lies: how far every point of the skin is inside the outline of the mask, millimetres.

Outline   the support function s(t) = max over points p . (cos t, sin t) of dots, brows, bridge of the nose, cheekbones
          and chin in the azimuthal equidistant map around the face's axis, rounded, and `RIM_MM` around it
Openings  eyes, mouth and nostrils with their margins (`anatomy.zones`), and every open edge of the skin; the ring of a
          hole that reaches into one is no part of the cover: it is a flat washer (`solid`)
Eyelets   a disc around every hole, whatever opening is near, where the skin looks the same way
Regular   strips narrower than `STRIP_MM` are left out before the eyelets are added, notches narrower than
          `NOTCH_MM` are filled after (morphological opening and closing with balls): no sliver, no crack
Connected what does not hang together with the largest piece is left out

Letters: n points of the skin, m holes, t direction in the map.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.ndimage import gaussian_filter1d
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from capture_plan.anatomy.zones import ground_of
from capture_plan.face.anchors import Anchors
from capture_plan.mask.record import Hole
from capture_plan.mask.skin import Skin
from capture_plan.mesh import edges
from capture_plan.rig import Rig

OPENINGS = {"eyes": ("lash line", 3.5), "mouth": ("wet lip", 2.5), "nostrils": ("nostril rim", 2.0)}  # margins in mm
RIM_MM = 9.0  # of shell beyond the outermost dots
EDGE_MM = 0.8  # of skin left free along an open edge of the mesh, where nothing says how it goes on
EAR_MM = 6.0
STRIP_MM = 6.0
NOTCH_MM = 4.0
FAR_MM = 6.0
SLOT_MM = 1.7  # half of the least width of the mouth
CORNERS, NEAR_MOUTH = 0.9, 0.12  # share of half the mouth that is open; of the pupil distance: lips
FACING = 0.3  # cosine between a hole's axis and the normal of skin that its eyelet lies on
DIRECTIONS = 72
ROUND_DEGREES, GIVE_MM = 14.0, 3.0  # the outline's corners are rounded, and cut no more than that into its rim
FRAME = np.array(  # of the pupil distance from between the eyes, to either side: what every mask frames
    [[0.0, 0.25, 0.0], [0.45, 0.42, -0.05], [0.82, 0.05, -0.25], [0.75, -0.45, -0.2]]
)


@dataclass(frozen=True, eq=False)
class Axis:
    """The middle of the head and the map of the skin around the direction in which the face looks."""

    centre: Float[np.ndarray, " 3"]
    radius_mm: float

    def map(self, points: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 2"]:
        """Azimuthal equidistant: true distances, on a ball, from where the axis meets the face; millimetres."""
        d = points - self.centre
        aside = np.hypot(d[:, 0], d[:, 1])
        angle = np.arctan2(aside, d[:, 2])
        return d[:, :2] * (self.radius_mm * angle / np.maximum(aside, 1e-9))[:, None]


def axis_of(anchors: Anchors) -> Axis:
    """The axis of a face: level with the middle between eyes and mouth, between the ears."""
    ears = (anchors.ear_left + anchors.ear_right) / 2
    centre = np.array([anchors.midline, anchors.between_y, ears[2]])
    return Axis(centre, float(anchors.nose_tip[2] - ears[2]) * 0.85)


def outline(
    anchors: Anchors, dots: Float[np.ndarray, "m 3"], points: Float[np.ndarray, "n 3"]
) -> Float[np.ndarray, " n"]:
    """How far each point is inside the outline, in the map's millimetres."""
    axis, u = axis_of(anchors), anchors.pupils
    eyes = (anchors.eye_left + anchors.eye_right) / 2
    frame = np.concatenate([eyes + u * FRAME, eyes + u * FRAME * [-1, 1, 1], anchors.chin[None] + [0, 0.1 * u, 0]])
    angle = np.linspace(0, 2 * np.pi, DIRECTIONS, endpoint=False)
    out = np.stack([np.cos(angle), np.sin(angle)])
    s = (axis.map(np.concatenate([dots, frame])) @ out).max(axis=0)
    rounded = gaussian_filter1d(s, ROUND_DEGREES / 360 * DIRECTIONS, mode="wrap")
    rounded += max(0.0, float((s - rounded).max()) - GIVE_MM)
    return RIM_MM - np.max([axis.map(points) @ out[:, i] - rounded[i] for i in range(DIRECTIONS)], axis=0)


@dataclass(frozen=True, eq=False)
class Opening:
    """An opening that was found: points along it, and how far from them the shell ends."""

    name: str
    core: Float[np.ndarray, "b 3"]
    margin_mm: float

    def beside(self, points: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, " n"]:
        """Distance from the opening as seen from the front, millimetres; `FAR_MM` where it is further or far behind."""
        away, at = KDTree(self.core[:, :2]).query(points[:, :2], distance_upper_bound=FAR_MM)
        depth = np.abs(points[:, 2] - self.core[np.minimum(at, len(self.core) - 1), 2])
        return np.where((depth < 2 * FAR_MM) & (away < FAR_MM), away, FAR_MM)


def openings(head: Rig) -> tuple[tuple[Opening, ...], list[str]]:
    """The openings of a face; what was not found, in words."""
    ground, found, notes = ground_of(head), [], []
    for what, (zone, margin) in OPENINGS.items():
        core = ground.zone(zone, 0.0).mask
        points = along_edges(head.neutral, ground.skin_triangles, core)
        if what == "mouth":
            points = mouth_line(points, ground.regions.anchors)
        if len(points):
            found.append(Opening(what, points, margin))
        else:
            notes.append(f"no opening for the {what}: {ground.zone(zone, 0.0).note}")
    return tuple(found), notes


def along_edges(
    vertices: Float[np.ndarray, "v 3"], triangles: Int[np.ndarray, "f 3"], core: Bool[np.ndarray, " v"]
) -> Float[np.ndarray, "b 3"]:
    """Vertices of a core, and points along the edges between them: no wave where vertices lie far apart."""
    within = edges(triangles)
    ends = vertices[within[core[within].all(axis=1)]]
    along = np.linspace(0, 1, 6)[:, None, None]  # edges are 5 mm long at most where lids and lips are
    return np.concatenate([vertices[core], ((1 - along) * ends[:, 0] + along * ends[:, 1]).reshape(-1, 3)])


def mouth_line(points: Float[np.ndarray, "b 3"], anchors: Anchors) -> Float[np.ndarray, "b 3"]:
    """A line from corner to corner through the middle of the mouth, and what was found near it: the noise of a scan
    hides single places beside lips."""
    t = np.linspace(0, 1, 40)[:, None] * CORNERS
    middle = anchors.mouth
    line = np.concatenate([middle + t * (corner - middle) for corner in (anchors.corner_left, anchors.corner_right)])
    near = KDTree(line[:, :2]).query(points[:, :2])[0] < NEAR_MOUTH * anchors.pupils
    return np.concatenate([line, points[near]])


def cover(
    inside: Float[np.ndarray, " n"],
    cut: tuple[Opening, ...],
    skin: Skin,
    holes: tuple[Hole, ...],
    through_mm: float,
) -> Float[np.ndarray, " n"]:
    """Signed distance inside the cover of a shell whose outside is `through_mm` above the skin: the outline without
    openings and strips, with eyelets, without notches, in one piece."""
    own = [_facing(skin, hole) for hole in holes]
    opening = np.min([free_of(o, skin, through_mm) for o in cut], axis=0, initial=FAR_MM)
    covered = _grown(skin, _shrunk(skin, np.minimum(inside, opening) > 0, STRIP_MM / 2), STRIP_MM / 2)
    for hole, away in zip(holes, own, strict=True):
        covered |= away <= hole.eyelet_mm
    covered = _shrunk(skin, _grown(skin, covered, NOTCH_MM / 2), NOTCH_MM / 2)
    c = _to(skin, ~covered) - _to(skin, covered)
    for _ in range(3):
        c = c[skin.neighbours].mean(axis=1)
    c = np.minimum(c, opening)
    c = c[skin.neighbours].mean(axis=1)
    c = np.minimum(c, skin.to_border - EDGE_MM)
    return np.where((c <= 0) | largest_piece(skin, c > 0), c, -1.0)


def free_of(opening: Opening, skin: Skin, through_mm: float) -> Float[np.ndarray, " n"]:
    """How far each point of the skin is outside an opening. Lips bulge, and shells over them would meet in front of
    the mouth: there the outside of the shell, so far above the skin, stays clear of it too, as it is looked through."""
    free = KDTree(opening.core).query(skin.points)[0] - opening.margin_mm
    if opening.name != "mouth":
        return free
    ways = [opening.beside(skin.points + t * skin.normals) for t in np.linspace(0, through_mm, 5)]
    return np.minimum(free, np.min(ways, axis=0) - SLOT_MM)


def _facing(skin: Skin, hole: Hole) -> Float[np.ndarray, " n"]:
    """Distance of each point to a hole's dot; out of reach where the skin does not look the same way."""
    away = np.linalg.norm(skin.points - hole.dot.position, axis=1)
    return np.where(skin.normals @ hole.axis > FACING, away, FAR_MM + 1)


def largest_piece(skin: Skin, inside: Bool[np.ndarray, " n"]) -> Bool[np.ndarray, " n"]:
    """Of the points inside, those that hang together in the largest number."""
    at, to = np.repeat(np.arange(len(inside)), skin.neighbours.shape[1]), skin.neighbours.ravel()
    both = inside[at] & inside[to]
    graph = coo_array((np.ones(both.sum(), dtype=bool), (at[both], to[both])), shape=(len(inside),) * 2)
    piece = connected_components(graph, directed=False)[1]
    return inside & (piece == np.bincount(piece[inside]).argmax())


def _grown(skin: Skin, inside: Bool[np.ndarray, " n"], r: float) -> Bool[np.ndarray, " n"]:
    return _to(skin, inside) <= r


def _shrunk(skin: Skin, inside: Bool[np.ndarray, " n"], r: float) -> Bool[np.ndarray, " n"]:
    return _to(skin, ~inside) > r


def _to(skin: Skin, some: Bool[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
    """Distance of each point to the nearest of some, millimetres; `FAR_MM` where none is as near."""
    if not some.any():
        return np.full(len(some), FAR_MM)
    return np.minimum(KDTree(skin.points[some]).query(skin.points, distance_upper_bound=FAR_MM)[0], FAR_MM)
