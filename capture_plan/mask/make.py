"""From a head and its dots to a mask that can be printed.

skin -> axes of the holes -> cover -> pads -> solid -> pieces on the bed -> what it measures
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.spatial import KDTree

from capture_plan.errors import PlanError
from capture_plan.face.anchors import Anchors, face_anchors
from capture_plan.mask.cover import Opening, cover, openings, outline
from capture_plan.mask.holes import holes_for
from capture_plan.mask.labels import labels_for
from capture_plan.mask.measure import Wall, gap_of, open_share, wall_of
from capture_plan.mask.parts import Part, parts_of
from capture_plan.mask.record import Dot, Hole, Label, MaskSettings, Mesh
from capture_plan.mask.skin import Skin, sample_skin
from capture_plan.mask.solid import as_mesh, manifold3d, solid
from capture_plan.rig import Rig

BEYOND_MM = 15.0  # of skin around the outline, so that its edge disturbs nothing
SEAT = (0.11, 0.15)  # half width and half height of the seat on the bridge of the nose, of the pupil distance
BRIDGE = -0.06  # its middle, below the eyes
OPEN = 0.2  # of the places along an opening, seen out from
HELD = 0.25  # of the skin under a ring that the shell covers
MOST_PUPILS_MM = 200.0  # no person has 80, and a mask of such a head would take minutes and fit no printer
ASTRAY_MM = 15.0  # from the nearest vertex of the skin: a dot of another head
BESIDE_EAR = 0.35  # of the pupil distance: in front of the ears the mask ends


@dataclass(frozen=True, eq=False)
class Mask:
    """A finished mask in the head's frame, its pieces, its holes and numbers, what it measures, and what to know.

    `without` says why a dot has no hole, `notes` what was not found on this head."""

    mesh: Mesh
    parts: tuple[Part, ...]
    holes: tuple[Hole, ...]
    labels: tuple[Label, ...]
    without: dict[str, str]
    notes: tuple[str, ...]
    wall: Wall
    gap_mm: Float[np.ndarray, " 3"]
    settings: MaskSettings


def make_mask(head: Rig, dots: tuple[Dot, ...], *, dot_mm: float, settings: MaskSettings | None = None) -> Mask:
    """A shell over the head's neutral with a hole for every dot that can have one; `dot_mm` is a dot's diameter.

    Raises:
        PlanError: no dot can have a hole, or manifold3d or scikit-image is missing.
    """
    settings = settings or MaskSettings()
    manifold3d()
    anchors = face_anchors(head)
    refuse_giants(head, anchors)
    ears = float(anchors.ear_left[2] + anchors.ear_right[2]) / 2 + BESIDE_EAR * anchors.pupils
    beyond = _out_of_reach(dots, ears)
    reached = tuple(dot for dot in dots if dot.name not in beyond)
    if not reached:
        raise PlanError(f"no dot of {head.name} can have a hole: {next(iter(beyond.values()), 'there are none')}")
    skin, inside = _skin(head, anchors, reached, ears)
    holes, without = holes_for(reached, skin, dot_mm, settings)
    cut, notes = openings(head)
    c = cover(inside, cut, skin, holes, settings.gap_mm + settings.wall_mm)
    alone = [hole.dot.name for hole in holes if not _held(hole, skin, c)]
    without |= beyond | dict.fromkeys(alone, "its ring would hang alone in an opening")
    holes = tuple(hole for hole in holes if hole.dot.name not in alone)
    if not holes:
        raise PlanError(f"no dot of {head.name} can have a hole: {next(iter(without.values()))}")
    labels = labels_for(holes, skin, c, settings)
    gap = settings.gap_mm * (1 - seat(skin, anchors))
    mask = solid(skin, c, gap, holes, labels, settings)
    mesh = as_mesh(mask)
    beneath = (c > 2.0) & (gap > 0.98 * settings.gap_mm)
    return Mask(
        mesh,
        parts_of(mask, holes, labels, anchors.midline, settings),
        holes,
        labels,
        without,
        (*notes, *shut(mesh, cut)),
        wall_of(mesh, skin, gap),
        gap_of(mesh, skin.points[beneath], skin.normals[beneath]),
        settings,
    )


def refuse_giants(head: Rig, anchors: Anchors) -> None:
    """PlanError where the face is far larger than any person's."""
    if anchors.pupils > MOST_PUPILS_MM:
        raise PlanError(
            f"{head.name} has {anchors.pupils:,.0f} mm between the pupils, a person 60 to 66: nobody could wear its "
            "mask: correct the unit (plan with --unit-mm), or carry the plan onto the actor's scan"
        )


def shut(mesh: Mesh, cut: tuple[Opening, ...]) -> list[str]:
    """Openings that the finished mask covers, in words."""
    ways = {"nostrils": np.array([0.0, -1.0, 1.0])}
    covered = [o.name for o in cut if open_share(mesh, o.core, ways.get(o.name, np.array([0.0, 0.0, 1.0]))) < OPEN]
    return [f"the mask covers the {name}: cut them open before anybody wears it" for name in covered]


def _out_of_reach(dots: tuple[Dot, ...], ears: float) -> dict[str, str]:
    """Why a mask that ends in front of the ears, at this depth, does not reach a dot, by name."""
    behind = {dot.name: "it lies beside the ear or behind it" for dot in dots if dot.position[2] < ears}
    return behind | {dot.name: "it lies on the neck, which moves against the head" for dot in dots if dot.on_neck}


def _skin(head: Rig, anchors: Anchors, dots: tuple[Dot, ...], ears: float) -> tuple[Skin, Float[np.ndarray, " n"]]:
    """The skin around all that the mask may cover, and how far each of its points is inside the outline."""
    own = KDTree(head.neutral[head.skin])
    places = np.array([dot.position for dot in dots if own.query(dot.position)[0] < ASTRAY_MM]).reshape(-1, 3)
    triangles = head.triangles[head.skin[head.triangles].all(axis=1)]
    around = outline(anchors, places, head.neutral) > -BEYOND_MM
    skin = sample_skin(head.neutral, triangles[around[triangles].all(axis=1)])
    return skin, np.minimum(outline(anchors, places, skin.points), skin.points[:, 2] - ears)


def _held(hole: Hole, skin: Skin, c: Float[np.ndarray, " n"]) -> bool:
    """Whether enough of the shell lies under the ring of a hole to hold it."""
    under = skin.tree.query_ball_point(hole.dot.position, hole.ring_mm)
    return bool(np.mean(c[under] > 0) > HELD)


def seat(skin: Skin, anchors: Anchors) -> Float[np.ndarray, " n"]:
    """How much each point of the skin carries the mask: 1 on the bridge of the nose, where there is no gap, falling to
    0 around it."""
    u = anchors.pupils
    middle = (anchors.eye_left + anchors.eye_right) / 2 + [0, BRIDGE * u, 0]
    off = np.hypot(*((skin.points - middle)[:, :2] / (np.array(SEAT) * u)).T)
    t = np.clip(1.6 - off, 0, 1)
    return np.where(skin.normals[:, 2] > 0, t * t * (3 - 2 * t), 0.0)
