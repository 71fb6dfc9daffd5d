"""What lies in front of the skin: lashes, tear and occlusion shells, brows, glasses, hair.

Data     u        directions from which a face is filmed: the front and AROUND_DEGREES around it
         open     directions from which a vertex of the skin, facing them, is seen past the rest of the skin
Covered  more than half of the open directions are stopped by a part that holds no skin and is no eyeball
The plan traces visibility past every part, so that markers keep off such skin.
"""

import numpy as np
from jaxtyping import Bool, Float
from scipy.spatial import KDTree

from capture_plan.anatomy.delta_relations import Finding
from capture_plan.face.anchors import eyeballs
from capture_plan.mesh import pieces, vertex_areas
from capture_plan.rig.record import Rig
from capture_plan.visibility.occluder import Occluder

AROUND_DEGREES = 30.0
FACING = 0.2  # cosine: skin that is turned away further shows a dot as a line
NEAR_MM = 40.0  # what is further in front of the skin than that, a person would not take for worn
MUCH = 0.05  # of the moving skin: worth an export without it
LEAST_CM2 = 0.5  # a dot and its rim; less is no place for one


def covers(rig: Rig) -> list[Finding]:
    """Parts without skin that hide skin from the front."""
    bare = np.unique(pieces(rig.triangles, len(rig.neutral))[rig.skin])
    piece = pieces(rig.triangles, len(rig.neutral))[rig.triangles[:, 0]]
    on_skin = np.isin(piece, bare)
    if on_skin.all():
        return []
    eyes = np.any([np.zeros(len(rig.neutral), dtype=bool), *eyeballs(rig)], axis=0)[rig.triangles[:, 0]]
    face = Occluder(rig.neutral, rig.triangles[on_skin])
    at = np.flatnonzero(rig.skin & (rig.displacement.max(axis=0) > 0))
    if len(at) == 0:
        return []
    origins, directions = face.above_skin(rig.neutral, at), filmed_from()
    seen = (face.normals[at] @ directions.T > FACING) & ~_blocked(face, origins, directions)
    area = vertex_areas(rig.neutral, rig.triangles[rig.skin[rig.triangles].all(axis=1)])[at] / 100
    covered, hidden = [], np.zeros(len(at), dtype=bool)
    for part, name in enumerate(rig.part_names):
        layer = rig.triangles[~on_skin & ~eyes & (rig.parts[rig.triangles[:, 0]] == part)]
        if len(layer) == 0:
            continue
        near = KDTree(rig.neutral[np.unique(layer)]).query(rig.neutral[at], distance_upper_bound=NEAR_MM)[0] < NEAR_MM
        near &= seen.any(axis=1)
        stopped = _blocked(Occluder(rig.neutral, layer), origins[near], directions) & seen[near]
        behind = np.zeros(len(at), dtype=bool)
        behind[near] = 2 * stopped.sum(axis=1) > seen[near].sum(axis=1)
        if area[behind].sum() >= LEAST_CM2:
            covered.append((float(area[behind].sum()), name if len(rig.part_names) > 1 else "loose pieces"))
            hidden |= behind
    if not covered:
        return []
    whole = area[seen.any(axis=1)].sum()
    share = float(area[hidden].sum() / whole)
    listing = ", ".join(f"{name} ({cm2:.1f} cm²)" for cm2, name in sorted(covered, reverse=True))
    message = f"{100 * share:.2g} % of the skin that a camera in front sees lies behind {listing}: "
    message += "markers stand there only where they are still seen past it"
    much = share > MUCH
    advice = "Export the head without what the actor does not wear." if much else "Nothing to do, unless it is needed."
    return [Finding("cover", (), message, advice, False, "rigger" if much else "know")]


def filmed_from() -> Float[np.ndarray, "u 3"]:
    """Unit vectors towards cameras in front, to both sides, above and below."""
    a = np.radians(AROUND_DEGREES)
    aside, ahead = np.sin(a), np.cos(a)
    return np.array([[0, 0, 1], [aside, 0, ahead], [-aside, 0, ahead], [0, aside, ahead], [0, -aside, ahead]])


def _blocked(
    occluder: Occluder, origins: Float[np.ndarray, "m 3"], directions: Float[np.ndarray, "u 3"]
) -> Bool[np.ndarray, "m u"]:
    starts = np.repeat(origins, len(directions), axis=0)
    ways = np.tile(directions.astype(np.float32), (len(origins), 1))
    return occluder.blocked(starts, ways).reshape(len(origins), len(directions))
