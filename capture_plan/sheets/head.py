"""The head as it is shown: parts with materials, smooth outlines, baked shade; lengths in millimetres.

A rig's triangles are split into four, as often as `SHOWN_TRIANGLES` allows, with each new vertex lifted onto the curved
surface that the normals at the two ends of its edge suggest (Phong tessellation: Boubekeur & Alexa 2008, eq. 3-4). The
rig's own vertices stay where they are, so a landmark lies on what is drawn. Lash strips are too thin for that.

Letters: v vertices of the rig, u vertices shown, f triangles.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from capture_plan.mesh import half_edges, pieces, vertex_normals
from capture_plan.rig import Rig
from capture_plan.sheets.gl import Surface
from capture_plan.visibility import hemisphere_visibility

SHOWN_TRIANGLES = 120_000  # beyond that a triangle is smaller than a printed dot
PULL = 0.75  # alpha of Boubekeur & Alexa 2008, their recommended value
SHADE_RAYS = 64
IRIS_DEGREES, PUPIL_DEGREES = 28.0, 11.0  # half angles of a human iris (12 mm) and pupil (4.6 mm) on a 12 mm ball


class Material(NamedTuple):
    colour: tuple[float, float, float]  # linear, 0 to 1
    roughness: float
    splits: int | None  # how often its triangles are split; none: as often as allowed


SKIN = Material((0.80, 0.785, 0.765), 0.62, None)
INSIDE = Material((0.52, 0.46, 0.45), 0.8, None)
LASH = Material((0.05, 0.05, 0.05), 0.9, 0)
EYE = Material((0.93, 0.93, 0.92), 0.28, 3)
IRIS = Material((0.16, 0.20, 0.22), 0.25, 1)
TEETH = Material((0.88, 0.86, 0.80), 0.4, 1)
TONGUE = Material((0.60, 0.36, 0.35), 0.6, 1)
PUPIL_COLOUR = (0.02, 0.02, 0.02)
# First word that a part's name contains decides; nothing of None is drawn: shells that hide the eye they lie on.
BY_NAME: tuple[tuple[tuple[str, ...], Material | None], ...] = (
    (("occlusion", "lacrimal", "eyeblend", "tear", "fluid", "wetness", "cornea", "eyeshell"), None),
    (("lash", "brow", "hair", "beard", "cilia"), LASH),
    (("teeth", "tooth", "dent"), TEETH),
    (("tongue", "gum"), TONGUE),
    (("iris", "pupil"), IRIS),
    (("eye", "sclera"), EYE),
)


class Split(NamedTuple):
    """One subdivision: a new vertex in the middle of every edge, four triangles for one."""

    edges: Int[np.ndarray, "e 2"]
    triangles: Int[np.ndarray, "f 3"]


@dataclass(frozen=True, eq=False)
class Piece:
    """One material's share of the head: which vertices of the rig it uses and how they are split."""

    material: Material
    vertices: Int[np.ndarray, " v"]
    triangles: Int[np.ndarray, "f 3"]
    splits: tuple[Split, ...]
    colours: Float[np.ndarray, "u 3"]


@dataclass(frozen=True, eq=False)
class Head:
    """A rig made ready for drawing; `opaque` are the triangles that cast shade."""

    rig: Rig
    pieces: tuple[Piece, ...]
    opaque: Int[np.ndarray, "f 3"]


class Posed(NamedTuple):
    """A head in one pose, in the rig's own axes."""

    vertices: Float[np.ndarray, "v 3"]
    normals: Float[np.ndarray, "v 3"]
    surfaces: tuple[Surface, ...]


def make_head(rig: Rig) -> Head:
    """Sort the rig's triangles by material and split them."""
    kinds = [_material(name) for name in rig.part_names]
    part = rig.parts[rig.triangles[:, 0]]
    skin = rig.skin[rig.triangles].all(axis=1)
    chosen = [SKIN if on_skin else kinds[p] for on_skin, p in zip(skin.tolist(), part.tolist(), strict=True)]
    materials = dict.fromkeys(material for material in chosen if material is not None)
    made = []
    for material in materials:
        triangles = rig.triangles[[each is material for each in chosen]]
        made.append(_piece(rig, material, triangles))
    opaque = rig.triangles[[each is not None and each is not LASH for each in chosen]]
    return Head(rig, tuple(made), opaque)


def pose(head: Head, vertices: Float[np.ndarray, "v 3"]) -> Posed:
    """The head with its vertices at `vertices`, shaded by how open each vertex lies (ambient occlusion)."""
    used = np.unique(head.opaque)
    openness = np.ones(len(vertices))
    openness[used] = hemisphere_visibility(vertices, head.opaque, used, rays=SHADE_RAYS)
    normals = vertex_normals(vertices, head.opaque)
    return Posed(vertices, normals, tuple(_surface(piece, vertices, openness) for piece in head.pieces))


def split(triangles: Int[np.ndarray, "f 3"], v: int) -> Split:
    """Edges, whose middles become vertices v, v + 1, ..., and the triangles between old and new vertices."""
    sides = np.sort(half_edges(triangles), axis=1)
    edges, middle = np.unique(sides, axis=0, return_inverse=True)
    ab, bc, ca = v + middle.reshape(3, -1)
    a, b, c = triangles.T
    finer = np.concatenate([np.stack(corner, axis=1) for corner in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])
    return Split(edges, finer)


def curved_middles(
    vertices: Float[np.ndarray, "v 3"], normals: Float[np.ndarray, "v 3"], edges: Int[np.ndarray, "e 2"]
) -> Float[np.ndarray, "e 3"]:
    """m + alpha/2 sum over both ends p of ((p - m) . n_p) n_p: the mean of m's projections on the two tangent planes."""
    middle = vertices[edges].mean(axis=1)
    lift = np.zeros_like(middle)
    for end in edges.T:
        away = np.einsum("ex,ex->e", vertices[end] - middle, normals[end])
        lift += away[:, None] * normals[end]
    return middle + PULL / 2 * lift


def _material(part_name: str) -> Material | None:
    plain = part_name.lower().replace("_", "").replace("-", "").replace(" ", "")
    for words, material in BY_NAME:
        if any(word in plain for word in words):
            return material
    return INSIDE


def _piece(rig: Rig, material: Material, triangles: Int[np.ndarray, "f 3"]) -> Piece:
    vertices, local = np.unique(triangles, return_inverse=True)
    local = local.reshape(-1, 3)
    first, v, splits = local, len(vertices), []
    wanted = 3 if material.splits is None else material.splits
    while len(splits) < wanted and len(local) * 4 <= SHOWN_TRIANGLES:
        splits.append(split(local, v))
        v, local = v + len(splits[-1].edges), splits[-1].triangles
    colours = np.tile(material.colour, (v, 1))
    if material is EYE:
        _paint_irises(colours, rig.neutral[vertices], first, tuple(splits))
    return Piece(material, vertices, first, tuple(splits), colours)


def _paint_irises(
    colours: Float[np.ndarray, "u 3"],
    neutral: Float[np.ndarray, "v 3"],
    triangles: Int[np.ndarray, "f 3"],
    splits: tuple[Split, ...],
) -> None:
    """Vertices that lie within the half angle of an iris around straight ahead from their ball's centre."""
    shown, last = _refine(neutral, triangles, splits)
    ball = pieces(last, len(shown))
    for number in np.unique(ball):
        on = np.flatnonzero(ball == number)
        low, high = shown[on].min(axis=0), shown[on].max(axis=0)
        radius = max(high[0] - low[0], high[1] - low[1]) / 2
        centre = np.array([(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, high[2] - radius])
        offset = shown[on] - centre
        angle = np.degrees(np.arctan2(np.hypot(offset[:, 0], offset[:, 1]), offset[:, 2]))
        colours[on[angle < IRIS_DEGREES]] = IRIS.colour
        colours[on[angle < PUPIL_DEGREES]] = PUPIL_COLOUR


def _refine(
    vertices: Float[np.ndarray, "v 3"], triangles: Int[np.ndarray, "f 3"], splits: tuple[Split, ...]
) -> tuple[Float[np.ndarray, "u 3"], Int[np.ndarray, "f 3"]]:
    for edges, finer in splits:
        middles = curved_middles(vertices, vertex_normals(vertices, triangles), edges)
        vertices, triangles = np.concatenate([vertices, middles]), finer
    return vertices, triangles


def _surface(piece: Piece, vertices: Float[np.ndarray, "v 3"], openness: Float[np.ndarray, " v"]) -> Surface:
    shown, triangles = _refine(vertices[piece.vertices], piece.triangles, piece.splits)
    shade = openness[piece.vertices]
    for edges, _ in piece.splits:
        shade = np.concatenate([shade, shade[edges].mean(axis=1)])
    colours = piece.colours * (0.25 + 0.75 * shade)[:, None]
    return Surface(shown, vertex_normals(shown, triangles), triangles, colours, piece.material.roughness)
