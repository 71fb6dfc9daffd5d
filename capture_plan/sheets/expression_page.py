"""Reference-expression pages: what the actor is asked for, how it looks, and where the face moves.

Letters: v vertices, e expressions; millimetres.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from capture_plan.expressions.active_sets import vertex_kinds
from capture_plan.expressions.record import Expression
from capture_plan.face.anchors import Anchors
from capture_plan.rig import Rig
from capture_plan.rig.parts import part_kind
from capture_plan.sheets.head import Head, Posed, pose, spread_over
from capture_plan.sheets.view import FRONT, LEFT, Picture, PictureFrame, Viewpoint, picture

SIDED = 0.6  # eight tenths of the squared movement on one side
ABOVE, BELOW, WIDE, FADE = 1.15, 0.75, 2.3, 0.18  # pupil distances: over the eyes, under the chin, across, of fading
ASIDE = 0.75  # pupil distances, seen from the side
SIDE_BLANK = 0.01  # what makes a picture fade at its sides too
LEAST_ARROW_MM, ALIKE, APART, SEEN = 1.5, 0.9, 0.25, 0.15
DEEP, TWIN_MM = 1.5, 6.0  # times as far forward or back as across; from the mirror image
EYES, STRAIGHT = ("eye", "iris"), 0.9  # of a ball what faces the viewer goes where it looks
HEAT_STOPS = (0.0, 0.25, 0.5, 0.75, 1.0)
HEAT_COLOURS = ((0.86, 0.86, 0.85), (0.98, 0.83, 0.45), (0.95, 0.52, 0.22), (0.78, 0.16, 0.20), (0.36, 0.04, 0.22))


KIND_NAMES = ("still", "smoothing", "active")
KIND_COLOURS = (
    (0.90, 0.90, 0.89),
    (0.98, 0.76, 0.32),
    (0.12, 0.24, 0.55),
)  # light, middle, dark: distinguished in grey


@dataclass(frozen=True, eq=False)
class Shot:
    """One expression's pictures: from the front, three-quarter, how far each place moves up to `scale_mm`, and `kinds`,
    where the skin is still, smoothing or active (Carrigan et al. 2020, Fig. 2). `arrows` are the movements of its
    blendshapes in the front view, from where to where, millimetres of view space, `side_arrows` those forward or back
    in the three-quarter view.
    """

    expression: Expression
    front: Picture
    three_quarter: Picture
    heat: Picture
    kinds: Picture
    scale_mm: float
    side: str | None
    arrows: Float[np.ndarray, "a 2 2"]
    side_arrows: Float[np.ndarray, "b 2 2"]


def close_up(anchors: Anchors, view: Viewpoint, aspect: float) -> PictureFrame:
    """The face as in a mirror at arm's length, brow to open jaw, in a frame of width = `aspect` x height."""
    u = anchors.pupils
    top, bottom = float(anchors.eye_left[1]) + ABOVE * u, float(anchors.chin[1]) - BELOW * u
    middles = view.project(np.stack([anchors.eye_left, anchors.eye_right, anchors.corner_left, anchors.corner_right]))
    height = max(top - bottom, WIDE * u / aspect)
    top, bottom = top + 0.4 * (height - top + bottom), bottom - 0.6 * (height - top + bottom)
    aside = ASIDE * u * float(np.sin(np.radians(view.azimuth)))  # the cheek lies there
    middle, width = float(middles[:, 0].mean()) + aside, aspect * height
    edge = FADE * u
    return PictureFrame(middle - width / 2, middle + width / 2, bottom, top, edge, SIDE_BLANK, SIDE_BLANK, edge)


def arrows_of(
    rig: Rig,
    expression: Expression,
    vertices: Float[np.ndarray, "v 3"],
    normals: Float[np.ndarray, "v 3"],
    anchors: Anchors,
    view: Viewpoint = FRONT,
) -> Float[np.ndarray, "a 2 2"]:
    """For each blendshape where it moves the skin or the eyes that are seen from the front most, and to where the whole
    expression takes it; with the mirror image, where it moves that as far. None within APART pupil distances of a
    longer one. What moves forward or back above all is shown in `view` from the side, and no other way."""
    eyes = np.array([part_kind(name) in EYES for name in rig.part_names])[rig.parts]
    seen, found = (rig.skin & (normals[:, 2] > SEEN)) | (eyes & (normals[:, 2] > STRAIGHT)), []
    for name in expression.blendshapes:
        delta = rig.deltas[rig.names.index(name)] * seen[:, None]
        own = np.linalg.norm(delta, axis=1)
        most = np.flatnonzero((own > ALIKE * own.max()) & (own > 0))
        if not len(most):
            continue
        v = int(most[np.abs(rig.neutral[most, 0] - anchors.midline).argmin()])
        deep = abs(delta[v, 2]) > DEEP * np.hypot(*delta[v, :2])
        if deep == (view == FRONT):
            continue
        ends = [np.stack([rig.neutral[at], vertices[at]]) for at in both_sides(rig, anchors, v, own)]
        found += [view.project(both)[:, :2] for both in ends]
    found.sort(key=lambda arrow: -float(np.linalg.norm(arrow[1] - arrow[0])))
    kept: list[Float[np.ndarray, "2 2"]] = []
    for arrow in found:
        clear = all(np.linalg.norm(arrow[0] - other[0]) > APART * anchors.pupils for other in kept)
        if clear and np.linalg.norm(arrow[1] - arrow[0]) >= LEAST_ARROW_MM:
            kept.append(arrow)
    return np.stack(kept) if kept else np.zeros((0, 2, 2))


def both_sides(rig: Rig, anchors: Anchors, v: int, own: Float[np.ndarray, " v"]) -> list[int]:
    """A vertex that moves `own` far, and that of its mirror image where it lies aside and moves about as far."""
    aside = rig.neutral[v, 0] - anchors.midline
    if abs(aside) < APART * anchors.pupils / 2:
        return [v]
    image = rig.neutral[v] - [2 * aside, 0, 0]
    far = np.flatnonzero(own > ALIKE * ALIKE * own[v])
    twin = int(far[np.linalg.norm(rig.neutral[far] - image, axis=1).argmin()])
    return [v, twin] if np.linalg.norm(rig.neutral[twin] - image) < TWIN_MM else [v]


def portrait(rig: Rig, anchors: Anchors, view: Viewpoint, aspect: float) -> PictureFrame:
    """Head and some neck in a frame of width = `aspect` x height, ears included, seen from the front or the side."""
    head, u = view.project(rig.neutral[rig.skin]), anchors.pupils
    chin, eyes = float(anchors.chin[1]), float(anchors.eye_left[1])
    top = min(head[:, 1].max(), eyes + 3.5 * u) + 0.05 * u
    bottom = chin - 0.62 * u  # an open jaw is about 0.5 u lower
    on = head[head[:, 1] > chin]
    left, right = on[:, 0].min() - 0.05 * u, on[:, 0].max() + 0.05 * u
    height = max(top - bottom, (right - left) / aspect)
    spare = height - (top - bottom)
    bottom, top = bottom - 0.25 * spare, top + 0.75 * spare
    middle, width = (left + right) / 2, aspect * height
    return PictureFrame(middle - width / 2, middle + width / 2, bottom, top, 0.42 * u)


def movement(rig: Rig, expression: Expression) -> tuple[Float[np.ndarray, "v 3"], Float[np.ndarray, " v"]]:
    """Where the expression puts every vertex, and how far that is from the neutral."""
    weights = np.zeros(len(rig.names))
    number = {name: k for k, name in enumerate(rig.names)}
    for name, weight in expression.pose.items():
        weights[number[name]] = weight
    posed = rig.pose(weights)
    return posed, np.linalg.norm(posed - rig.neutral, axis=1)


def moved_side(rig: Rig, anchors: Anchors, moved: Float[np.ndarray, " v"]) -> str | None:
    """'left' or 'right' where nearly all movement of the skin is on that side of the actor."""
    squared = np.where(rig.skin, moved, 0) ** 2
    share = float(squared @ np.sign(rig.neutral[:, 0] - anchors.midline)) / max(float(squared.sum()), 1e-12)
    return "left" if share > SIDED else "right" if share < -SIDED else None


def heat_scale(rig: Rig, moved: Float[np.ndarray, " v"]) -> float:
    """The end of the colour scale: the largest movement of the skin, rounded up to a readable number of millimetres."""
    largest = max(float(moved[rig.skin].max()), 0.1)
    step = 10.0 ** np.floor(np.log10(largest))
    return float(next(m * step for m in (1, 1.5, 2, 3, 4, 5, 6, 8, 10) if m * step >= largest - 1e-9))


def heat_colours(share: Float[np.ndarray, " v"]) -> Float[np.ndarray, "v 3"]:
    """Display colours 0 to 1 for shares of the scale: clay where nothing moves, then yellow, red, dark."""
    return np.stack([np.interp(share, HEAT_STOPS, channel) for channel in zip(*HEAT_COLOURS, strict=True)], axis=1)


class Sizes(NamedTuple):
    """Width and height in pixels of the front view, of the three-quarter view, and of the two coloured ones."""

    large: tuple[int, int]
    small: tuple[int, int]
    narrow: tuple[int, int]


def shoot(head: Head, anchors: Anchors, expression: Expression, *, mu: float, sizes: Sizes) -> Shot:
    """Draw an expression; `mu` is the share of its largest movement from which a vertex is active."""
    rig = head.rig
    vertices, moved = movement(rig, expression)
    posed = pose(head, vertices)
    scale = heat_scale(rig, moved)
    kinds = vertex_kinds(rig, tuple(expression.pose), mu).max(axis=0)
    heated = _coloured(head, posed, heat_colours(moved / scale))
    message = _coloured(head, posed, np.array(KIND_COLOURS)[kinds])

    def whole(shown: Posed) -> Picture:
        frame = portrait(rig, anchors, FRONT, sizes.narrow[0] / sizes.narrow[1])
        return picture(shown, FRONT, frame, size_px=sizes.narrow)

    return Shot(
        expression,
        near(posed, anchors, FRONT, sizes.large),
        near(posed, anchors, LEFT, sizes.small),
        whole(heated),
        whole(message),
        scale,
        moved_side(rig, anchors, moved),
        arrows_of(rig, expression, vertices, posed.normals, anchors),
        arrows_of(rig, expression, vertices, posed.normals, anchors, LEFT),
    )


def near(shown: Posed, anchors: Anchors, view: Viewpoint, size: tuple[int, int]) -> Picture:
    """A close-up of this many pixels, width and height."""
    return picture(shown, view, close_up(anchors, view, size[0] / size[1]), size_px=size)


def _coloured(head: Head, posed: Posed, colours: Float[np.ndarray, "v 3"]) -> Posed:
    """The same head with these display colours, 0 to 1, in place of those of its materials."""
    pieces = tuple(
        replace(shown, colours=np.stack([spread_over(piece, channel) for channel in colours.T], axis=1) ** 2.2)
        for piece, shown in zip(head.pieces, posed.pieces, strict=True)
    )
    return Posed(posed.vertices, posed.normals, pieces)
