"""What hides skin from a camera on set: a rig's triangles without the thin layers that it holds beside the actor's.

Thin     no marker is lost behind lashes, lines and cards drawn on the skin, tear lines and other clear shells over an
         eye: they are thinner than a dot, or light goes through them, or the actor has none
Name     a part called so, and hair made of cards: at least `CARDS` open sheets that hold most of its area
Shape    where a name says nothing, an open sheet of at most `SMALL` of the skin's area that begins within `NEAR` radii
         of the centre of an eyeball and ends within `REACH`, and is no ball itself
Blocks   all other triangles: skin whatever its name, eyeballs, teeth, tongue, gums, hair of one piece, what is worn
"""

import numpy as np
from jaxtyping import Bool, Int

from capture_plan.face.anchors import eyeballs
from capture_plan.mesh import boundary_vertices, pieces, triangle_areas
from capture_plan.once import once
from capture_plan.rig.parts import PartKind, part_kind
from capture_plan.rig.record import Rig

THIN: frozenset[PartKind] = frozenset({"clear", "lash", "eye line", "brow"})
UNTOLD: frozenset[PartKind] = frozenset({"skin", "body", "other"})  # names that say nothing of lashes in a head
CARDS = 8  # a cap of hair and a beard are one sheet each
SMALL = 0.02  # strips of lashes 0.3 % of the skin, tear lines less
NEAR, REACH = 1.2, 2.0  # lashes of three heads: 1.0 and 1.7; the teeth of a cartoon with large eyes: 1.6 and 2.5


@once
def opaque_triangles(rig: Rig) -> Int[np.ndarray, "o 3"]:
    """The triangles that hide what lies behind them, from a camera as from light, in the rig's order.

    Example:
        >>> rig = sample_rig()
        >>> hidden_by = {rig.part_names[part] for part in rig.parts[opaque_triangles(rig)[:, 0]]}
        >>> sorted(set(rig.part_names) - hidden_by)
        ['lashes_L', 'lashes_R']
    """
    return rig.triangles[~thin(rig)[rig.triangles].all(axis=1)]


@once
def thin(rig: Rig) -> Bool[np.ndarray, " v"]:
    """Vertices of thin layers; a part by whose name it is one, and a strip by shape, hold no skin."""
    piece = pieces(rig.triangles, len(rig.neutral))
    kinds = np.array([part_kind(name) for name in rig.part_names])[rig.parts]
    named = np.isin(kinds, list(THIN)) | _cards(rig, piece, kinds == "hair")
    strips = np.isin(kinds, list(UNTOLD)) & _strips(rig, piece)
    return (named & _without_skin(rig, rig.parts)) | (strips & _without_skin(rig, piece))


def _without_skin(rig: Rig, group: Int[np.ndarray, " v"]) -> Bool[np.ndarray, " v"]:
    """Vertices of parts or pieces none of whose vertices is skin."""
    return ~np.isin(group, np.unique(group[rig.skin]))


def _open(rig: Rig, piece: Int[np.ndarray, " v"]) -> Bool[np.ndarray, " p"]:
    """Which pieces are sheets with a border."""
    has_border = np.zeros(piece.max() + 1, dtype=bool)
    has_border[piece[boundary_vertices(rig.triangles)]] = True
    return has_border


def _cards(rig: Rig, piece: Int[np.ndarray, " v"], hair: Bool[np.ndarray, " v"]) -> Bool[np.ndarray, " v"]:
    """Vertices of the hairy parts that are made of cards."""
    found, sheet = np.zeros(len(hair), dtype=bool), _open(rig, piece)[piece]
    area, corner = triangle_areas(rig.neutral, rig.triangles), rig.triangles[:, 0]
    for part in np.unique(rig.parts[hair]):
        own = rig.parts[corner] == part
        if len(np.unique(piece[corner[own & sheet[corner]]])) >= CARDS:
            found |= (rig.parts == part) & (area[own & sheet[corner]].sum() > area[own].sum() / 2)
    return found


def _strips(rig: Rig, piece: Int[np.ndarray, " v"]) -> Bool[np.ndarray, " v"]:
    """Vertices of small open sheets at an eyeball."""
    found, balls = np.zeros(len(piece), dtype=bool), eyeballs(rig)
    area = np.bincount(piece[rig.triangles[:, 0]], triangle_areas(rig.neutral, rig.triangles), piece.max() + 1)
    skin = area[np.unique(piece[rig.skin])].sum()
    small = _open(rig, piece) & (area <= SMALL * skin)
    for ball in balls:
        x = rig.neutral[ball]
        centre, radius = (x.min(axis=0) + x.max(axis=0)) / 2, np.ptp(x, axis=0).max() / 2
        far = np.linalg.norm(rig.neutral - centre, axis=1) / radius
        first, last = np.full(len(area), np.inf), np.zeros(len(area))
        np.minimum.at(first, piece, far)
        np.maximum.at(last, piece, far)
        found |= (small & (first <= NEAR) & (last <= REACH))[piece]
    return found & ~np.any([np.zeros(len(piece), dtype=bool), *balls], axis=0)
