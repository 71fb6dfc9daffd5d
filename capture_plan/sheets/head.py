"""The head as it is shown: parts with materials, smooth outlines, baked shade; lengths in millimetres.

A rig's triangles are split into four, as often as `SHOWN_TRIANGLES` allows, with each new vertex lifted onto the curved
surface that the normals at the two ends of its edge suggest (Phong tessellation: Boubekeur & Alexa 2008, eq. 3-4). The
rig's own vertices stay where they are, so a landmark lies on what is drawn. Lash strips are too thin for that.

Letters: v vertices of the rig, u vertices shown, f triangles before and g after splitting, e edges.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial import KDTree

from capture_plan.face.blocking import opaque_triangles
from capture_plan.mesh import edges, half_edges, pieces, vertex_normals
from capture_plan.rig import Rig
from capture_plan.rig.parts import PartKind, part_kind
from capture_plan.visibility import hemisphere_visibility
from capture_plan.visibility.occluder import Occluder

SHOWN_TRIANGLES = 60_000  # outlines of a head are smooth to 0.1 mm long before
PULL = 0.75  # alpha of Boubekeur & Alexa 2008, their recommended value
SHADE_RAYS = 32
STILL_MM, FAR_MM, AROUND_MM, FEW = (
    0.2,
    3.0,
    25.0,
    8,
)  # what moves more, and what lies near what moves far, is shaded anew
OUTSIDE = 0.15  # share of the hemisphere that sees the outside of the skin; the lining of the mouth is seen by less
OUT_MM, BEHIND_MM = 12.0, 0.6  # teeth stand no further before a lip; how far behind it they are put
HIDDEN, INSIDE_SHARE = 0.05, 0.7
LASH_MM = 4.5  # where a lash strip has faded away
IRIS_DEGREES, PUPIL_DEGREES = 27.0, 10.5  # half angles of a human iris (12 mm) and pupil (4.6 mm) on a 12 mm ball


class Material(NamedTuple):
    """How a kind of part looks when it is drawn."""

    colour: tuple[float, float, float]  # linear, 0 to 1
    gloss: float
    sharp: float  # exponent of the gloss: large is a small highlight
    splits: int | None  # how often its triangles are split; none: as often as allowed


SKIN = Material((0.86, 0.84, 0.815), 0.035, 14.0, None)
LASH = Material((0.03, 0.028, 0.026), 0.0, 1.0, 0)
EYE = Material((0.95, 0.95, 0.95), 0.8, 220.0, 3)
IRIS = Material((0.17, 0.215, 0.235), 0.8, 220.0, 1)
TEETH = Material((0.92, 0.90, 0.85), 0.08, 30.0, 1)
TONGUE = Material((0.58, 0.33, 0.32), 0.05, 12.0, 1)
PUPIL_COLOUR = (0.02, 0.02, 0.02)
INSIDE_COLOUR = (0.46, 0.37, 0.36)  # of mouth and nostrils, which hang together with the skin
BY_KIND: dict[
    PartKind, Material | None
] = {  # the rest is of clay; nothing of None is drawn: it hides the eye it lies on
    "clear": None,
    "lash": None,
    "eye line": LASH,
    "brow": LASH,
    "hair": LASH,
    "teeth": TEETH,
    "tongue": TONGUE,
    "gums": TONGUE,
    "iris": IRIS,
    "eye": EYE,
}


class Split(NamedTuple):
    """One subdivision: a new vertex in the middle of every edge, four triangles for one."""

    edges: Int[np.ndarray, "e 2"]
    triangles: Int[np.ndarray, "g 3"]


@dataclass(frozen=True, eq=False)
class _Piece:
    """One material's share of the head: which vertices of the rig it uses and how they are split."""

    material: Material
    vertices: Int[np.ndarray, " v"]
    triangles: Int[np.ndarray, "f 3"]
    splits: tuple[Split, ...]
    colours: Float[np.ndarray, "u 3"]
    opacity: Float[np.ndarray, " u"]


@dataclass(frozen=True, eq=False)
class Head:
    """A rig made ready for drawing; `opaque` are the triangles that cast shade, `outside` those of the skin that are
    seen on the neutral, which the linings of mouth and nose are not."""

    rig: Rig
    pieces: tuple[_Piece, ...]
    opaque: Int[np.ndarray, "f 3"]
    outside: Int[np.ndarray, "g 3"]

    @cached_property
    def openness(self) -> Float[np.ndarray, " v"]:
        """How open each vertex of the neutral lies (ambient occlusion)."""
        used, openness = np.unique(self.opaque), np.ones(len(self.rig.neutral))
        openness[used] = hemisphere_visibility(self.rig.neutral, self.opaque, used, rays=SHADE_RAYS)
        return openness


@dataclass(frozen=True, eq=False)
class Shown:
    """A piece in one pose, fine enough to draw; `openness` is the share of the hemisphere that sees a vertex."""

    material: Material
    vertices: Float[np.ndarray, "u 3"]
    normals: Float[np.ndarray, "u 3"]
    triangles: Int[np.ndarray, "f 3"]
    colours: Float[np.ndarray, "u 3"]
    opacity: Float[np.ndarray, " u"]
    openness: Float[np.ndarray, " u"]


@dataclass(frozen=True, eq=False)
class Posed:
    """A head in one pose, in the rig's own axes."""

    vertices: Float[np.ndarray, "v 3"]
    normals: Float[np.ndarray, "v 3"]
    pieces: tuple[Shown, ...]


def make_head(rig: Rig) -> Head:
    """Sort the rig's triangles by material and split them."""
    materials = [BY_KIND.get(part_kind(name), SKIN) for name in rig.part_names]
    on_skin = np.isin(rig.triangles, np.flatnonzero(rig.skin)).any(axis=1)
    part = rig.parts[rig.triangles[:, 0]]
    share = {m: np.isin(part, [i for i, one in enumerate(materials) if one == m]) & ~on_skin for m in materials if m}
    share[SKIN] = np.logical_or(share.get(SKIN, np.zeros_like(on_skin)), on_skin)
    made = tuple(_piece(rig, m, rig.triangles[of_m]) for m, of_m in share.items() if of_m.any())
    opaque, skin = opaque_triangles(rig), np.flatnonzero(rig.skin)
    seen = np.zeros(len(rig.neutral), dtype=bool)
    seen[skin] = hemisphere_visibility(rig.neutral, opaque, skin, rays=SHADE_RAYS) > OUTSIDE
    return Head(rig, made, opaque, rig.triangles[seen[rig.triangles].all(axis=1)])


def pose(head: Head, vertices: Float[np.ndarray, "v 3"]) -> Posed:
    """The head with its vertices at `vertices`, shaded by how open each vertex lies (ambient occlusion)."""
    openness, anew = head.openness.copy(), changed_light(head, vertices)
    openness[anew] = hemisphere_visibility(vertices, head.opaque, anew, rays=SHADE_RAYS)
    openness = softened(openness, head.opaque)
    normals = vertex_normals(vertices, head.opaque)
    x = behind_lips(head, vertices)
    return Posed(vertices, normals, tuple(_shown(piece, x, openness) for piece in head.pieces))


def changed_light(head: Head, vertices: Float[np.ndarray, "v 3"]) -> Int[np.ndarray, " n"]:
    """Vertices that cast or catch another shadow than in the neutral: those that moved, and those around what moved
    far, as the throat below a jaw."""
    used = np.unique(head.opaque)
    moved = np.linalg.norm(vertices[used] - head.rig.neutral[used], axis=1)
    anew, far = moved > STILL_MM, used[moved > FAR_MM][::FEW]
    if len(far) and not anew.all():
        sources = np.concatenate([vertices[far], head.rig.neutral[far]])
        still = np.flatnonzero(~anew)
        away, _ = KDTree(sources).query(vertices[used[still]], distance_upper_bound=AROUND_MM)
        anew[still] = np.isfinite(away)
    return used[anew]


def softened(openness: Float[np.ndarray, " v"], triangles: Int[np.ndarray, "f 3"]) -> Float[np.ndarray, " v"]:
    """Openness without teeth of shadow: where lips run into each other, every other vertex lies inside and is dark, and
    triangles half in the light would fade to it. Half of each vertex is its neighbours' mean, of hidden ones all."""
    a, b = edges(triangles).T
    count = np.bincount(np.r_[a, b], minlength=len(openness))

    def around(values: Float[np.ndarray, " v"]) -> Float[np.ndarray, " v"]:
        total = np.bincount(np.r_[a, b], np.r_[values[b], values[a]], minlength=len(values))
        return np.where(count > 0, total / np.maximum(count, 1), values)

    lifted = np.where(openness < HIDDEN, np.maximum(openness, INSIDE_SHARE * around(openness)), openness)
    return (lifted + around(lifted)) / 2


def behind_lips(head: Head, vertices: Float[np.ndarray, "v 3"]) -> Float[np.ndarray, "v 3"]:
    """The vertices, those of teeth and tongue that came out through the skin put back below it: no actor can show them
    with the lips shut."""
    inner = [p.vertices for p in head.pieces if p.material in (TEETH, TONGUE)]
    if not inner or not len(head.outside):
        return vertices
    at, x = np.concatenate(inner), vertices.copy()
    back = Occluder(vertices, head.outside).distance(x[at], np.tile([0.0, 0.0, -1.0], (len(at), 1)))
    out = back < OUT_MM  # there is skin close behind it
    x[at[out], 2] -= back[out] + BEHIND_MM
    return x


def split_triangles(triangles: Int[np.ndarray, "f 3"], v: int) -> Split:
    """Edges, whose middles become vertices v, v + 1, ..., and the triangles between old and new vertices."""
    sides = np.sort(half_edges(triangles), axis=1)
    edges, middle = np.unique(sides, axis=0, return_inverse=True)
    ab, bc, ca = v + middle.reshape(3, -1)
    a, b, c = triangles.T
    finer = np.concatenate(
        [np.stack(corner, axis=1) for corner in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))]
    )
    return Split(edges, finer)


def curved_middles(
    vertices: Float[np.ndarray, "v 3"], normals: Float[np.ndarray, "v 3"], edges: Int[np.ndarray, "e 2"]
) -> Float[np.ndarray, "e 3"]:
    """m + alpha/2 sum over both ends p of ((p - m) . n_p) n_p: m's mean projection on both tangent planes."""
    middle = vertices[edges].mean(axis=1)
    lift = np.zeros_like(middle)
    for end in edges.T:
        away = np.einsum("ex,ex->e", vertices[end] - middle, normals[end])
        lift += away[:, None] * normals[end]
    return middle + PULL / 2 * lift


def _piece(rig: Rig, material: Material, triangles: Int[np.ndarray, "f 3"]) -> _Piece:
    vertices, local = np.unique(triangles, return_inverse=True)
    local = local.reshape(-1, 3)
    first, v, splits = local, len(vertices), []
    wanted = 3 if material.splits is None else material.splits
    while len(splits) < wanted and len(local) * 4 <= SHOWN_TRIANGLES:
        splits.append(split_triangles(local, v))
        v, local = v + len(splits[-1].edges), splits[-1].triangles
    colours = np.tile(material.colour, (v, 1))
    if material is SKIN:
        inside = ~rig.skin[vertices]
        for sides, _ in splits:
            inside = np.concatenate([inside, inside[sides].all(axis=1)])
        colours[inside] = INSIDE_COLOUR
    elif material is EYE:
        _paint_irises(colours, rig.neutral[vertices], first, tuple(splits))
    opacity = _lash_opacity(rig, vertices) if material is LASH else np.ones(v)
    return _Piece(material, vertices, first, tuple(splits), colours, opacity)


def _lash_opacity(rig: Rig, vertices: Int[np.ndarray, " v"]) -> Float[np.ndarray, " v"]:
    """Lashes are strips meant for a texture of hairs: dark at the lid, gone at their tips."""
    away, _ = KDTree(rig.neutral[rig.skin]).query(rig.neutral[vertices])
    return np.clip(0.6 * (1 - away / LASH_MM), 0.0, 0.6)


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
) -> tuple[Float[np.ndarray, "u 3"], Int[np.ndarray, "g 3"]]:
    for sides, finer in splits:
        middles = curved_middles(vertices, vertex_normals(vertices, triangles), sides)
        vertices, triangles = np.concatenate([vertices, middles]), finer
    return vertices, triangles


def _shown(piece: _Piece, vertices: Float[np.ndarray, "v 3"], openness: Float[np.ndarray, " v"]) -> Shown:
    shown, triangles = _refine(vertices[piece.vertices], piece.triangles, piece.splits)
    return Shown(
        piece.material,
        shown,
        vertex_normals(shown, triangles),
        triangles,
        piece.colours,
        piece.opacity,
        spread_over(piece, openness),
    )


def spread_over(piece: _Piece, values: Float[np.ndarray, " v"]) -> Float[np.ndarray, " u"]:
    """Values at the rig's vertices, averaged to the vertices shown."""
    values = values[piece.vertices]
    for sides, _ in piece.splits:
        values = np.concatenate([values, values[sides].mean(axis=1)])
    return values
