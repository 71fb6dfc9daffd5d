"""What lies in front of the skin: glasses, hair, what is worn.

Data     u        directions from which a face is filmed: the front and AROUND_DEGREES around it
         open     directions from which a vertex of the skin, facing them, is seen past the rest of the skin
Covered  more than half of the open directions are stopped by a part that holds no skin and is no eyeball
The plan traces visibility past every part but thin layers (`face.blocking`), so that markers keep off such skin; where
these cover much, as hair of cards does, that is told too.
"""

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.spatial import KDTree

from capture_plan.anatomy.delta_relations import Finding
from capture_plan.face.anchors import eyeballs
from capture_plan.face.blocking import thin
from capture_plan.mesh import pieces, vertex_areas
from capture_plan.rig.record import Rig
from capture_plan.visibility.occluder import Occluder

AROUND_DEGREES = 30.0
FACING = 0.2  # cosine: skin that is turned away further shows a dot as a line
NEAR_MM = 40.0  # what is further in front of the skin than that, a person would not take for worn
MUCH = 0.05  # of the moving skin: worth an export without it
LEAST_CM2 = 0.5  # a dot and its rim; less is no place for one


def covers(rig: Rig) -> list[Finding]:
    """Parts without skin that hide skin from the front, and thin layers that cover much of it."""
    piece = pieces(rig.triangles, len(rig.neutral))
    on_skin = np.isin(piece, np.unique(piece[rig.skin]))[rig.triangles[:, 0]]
    at = np.flatnonzero(rig.skin & (rig.displacement.max(axis=0) > 0))
    if on_skin.all() or len(at) == 0:
        return []
    eyes = np.any([np.zeros(len(rig.neutral), dtype=bool), *eyeballs(rig)], axis=0)[rig.triangles[:, 0]]
    see_through = thin(rig)[rig.triangles].all(axis=1)
    front = _FilmedSkin(rig, at, rig.triangles[on_skin])
    found, share = front.behind(~on_skin & ~eyes & ~see_through)
    findings = []
    if found:
        message = f"{found}: markers stand there only where they are still seen past it"
        much = share > MUCH
        advice = "Export the head without what the actor does not wear."
        advice = advice if much else "Nothing to do, unless it is needed."
        findings.append(Finding("cover", (), message, advice, False, "rigger" if much else "know"))
    found, share = front.behind(~on_skin & ~eyes & see_through)
    if share > MUCH:
        message = f"{found}: the plan takes it for thin and looks through it"
        findings.append(Finding("cover", (), message, "Pin it back on set, or keep markers off it.", False, "know"))
    return findings


class _FilmedSkin:
    """Moving skin `at` and from where in front it is seen past the rest of the skin."""

    def __init__(self, rig: Rig, at: Int[np.ndarray, " n"], skin: Int[np.ndarray, "f 3"]) -> None:
        self.rig, self.at, self.directions = rig, at, filmed_from()
        face = Occluder(rig.neutral, skin)
        self.origins = face.above_skin(rig.neutral, at)
        self.seen = (face.normals[at] @ self.directions.T > FACING) & ~_blocked(face, self.origins, self.directions)
        area = vertex_areas(rig.neutral, rig.triangles[rig.skin[rig.triangles].all(axis=1)])
        self.cm2 = area[at] / 100

    def behind(self, layers: Bool[np.ndarray, " f"]) -> tuple[str, float]:
        """What lies behind these triangles in words, and its share of the skin that is seen; '' where it is little."""
        rig, covered, hidden = self.rig, [], np.zeros(len(self.at), dtype=bool)
        for part, name in enumerate(rig.part_names):
            layer = rig.triangles[layers & (rig.parts[rig.triangles[:, 0]] == part)]
            if len(layer) == 0:
                continue
            tree = KDTree(rig.neutral[np.unique(layer)])
            near = tree.query(rig.neutral[self.at], distance_upper_bound=NEAR_MM)[0] < NEAR_MM
            near &= self.seen.any(axis=1)
            stopped = _blocked(Occluder(rig.neutral, layer), self.origins[near], self.directions) & self.seen[near]
            behind = np.zeros(len(self.at), dtype=bool)
            behind[near] = 2 * stopped.sum(axis=1) > self.seen[near].sum(axis=1)
            if self.cm2[behind].sum() >= LEAST_CM2:
                covered.append((float(self.cm2[behind].sum()), name if len(rig.part_names) > 1 else "loose pieces"))
                hidden |= behind
        share = float(self.cm2[hidden].sum() / (self.cm2[self.seen.any(axis=1)].sum() or 1))
        listing = ", ".join(f"{name} ({cm2:.1f} cm²)" for cm2, name in sorted(covered, reverse=True))
        words = f"{100 * share:.2g} % of the skin that a camera in front sees lies behind {listing}"
        return (words if covered else "", share)


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
