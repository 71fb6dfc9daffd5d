"""Where no dot may go: lash line, inner eye corner, wet lip, nostril rim, hair, helmet straps, what a person painted.

Data     h[v]     hemisphere visibility in the neutral, 0 to 1, of skin and eyeballs alone: lashes hide no skin
         u        distance between the pupils, the unit of proportions
         margin   how far a zone reaches along the skin beyond what it is named for, millimetres
Opening  of an eye, the mouth or a nostril: the border of the skin there, and skin with h <= DIM that hangs together
         with it (where the border lies far inside, or there is none); without a border skin with h <= HIDDEN alone
Zone     lash line, wet lip, nostril rim = opening + margin;  inner eye corner, hairline = corner, scalp + margin;
         helmet strap = skin within the margin of a line over temple, cheek and jaw, seen from the side
Sides    a zone of one side is a zone of the other

No public source gives these margins: they are assumptions of ours, and a person may set their own.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import KDTree

from capture_plan.anatomy.eye_corners import eye_corners
from capture_plan.anatomy.regions import FaceRegions, face_regions
from capture_plan.errors import RigError
from capture_plan.face.anchors import eyeballs
from capture_plan.face.shape import border_loops
from capture_plan.mesh import boundary_vertices, pieces, surface_graph, vertex_normals
from capture_plan.mesh.mirror import mirror_map
from capture_plan.once import once
from capture_plan.rig import Rig
from capture_plan.visibility import hemisphere_visibility

MARGINS_MM = {
    "lash line": 2.0,  # as thick as the edge of a lid: a dot there touches lashes or the eye
    "inner eye corner": 5.0,  # tears loosen dots, and the skin beside it folds as soon as eyes close or a nose wrinkles
    "wet lip": 2.5,  # paint and glue do not hold where lips are moist
    "nostril rim": 2.0,  # breath and wiping take dots off the edge
    "hairline": 5.0,  # single hairs grow in front of the hairline
    "helmet strap": 10.0,  # half of a strap 20 mm wide
}
ZONES = tuple(MARGINS_MM)
CLEAR_ZONES = ("lash line", "inner eye corner", "wet lip", "nostril rim")  # where no dot holds on anybody
DOT_MM = 3.0  # diameter of a marker, unless a person says otherwise
CORNER = 0.5  # skin at a right angle to a wall, as the edge of a lid is to the eyeball, sees half of its hemisphere
DIM, HIDDEN = 0.35, 0.1  # five heads: inside an opening below the first, creases of lids and nose above the second
STRAP_BEFORE_EAR = 0.55  # of u, from where the ear sticks out furthest: 35 mm, clear of the ear
DOWN = -0.5  # vertical part of the normal of a nostril that is no more than a dent
EYE, LIP = 0.34, 0.25  # of u: how far skin of an opening lies from eye centre and border, from mouth line and border


@dataclass(frozen=True, eq=False)
class Zone:
    """Skin where no dot may go. `note` says what was assumed, or why nothing was found."""

    name: str
    mask: Bool[np.ndarray, " v"]
    note: str

    def __post_init__(self) -> None:
        self.mask.flags.writeable = False


def zone_mask(rig: Rig, name: str, margin_mm: float | None = None) -> Bool[np.ndarray, " v"]:
    """True where a named zone of `ZONES` lies; without a margin that of `MARGINS_MM`.

    Raises:
        RigError: there is no such zone, or the margin is not a length.
    """
    return find_zones(rig, {name: MARGINS_MM.get(name, 0.0) if margin_mm is None else margin_mm})[0].mask


def find_zones(rig: Rig, margins_mm: Mapping[str, float] = MARGINS_MM) -> tuple[Zone, ...]:
    """The zones of these names with these margins, in their order.

    Raises:
        RigError: there is no such zone, or a margin is not a length.
    """
    for name, margin in margins_mm.items():
        check_zone(name, margin)
    ground = ground_of(rig)
    return tuple(ground.zone(name, margin) for name, margin in margins_mm.items())


def check_zone(name: str, margin_mm: float) -> None:
    """RigError unless there is a zone of this name and the margin is a length."""
    if name not in ZONES:
        raise RigError(f"no keep-out zone is called '{name}': known are {', '.join(ZONES)}, or a file that marks one")
    if not 0 <= margin_mm < np.inf:
        raise RigError(f"keep-out zone '{name}': its margin is {margin_mm} mm: give 0 mm or more")


@dataclass(frozen=True, eq=False)
class Ground:
    """What all zones of a rig are found from."""

    rig: Rig

    @cached_property
    def regions(self) -> FaceRegions:
        """Names for places on the face."""
        return face_regions(self.rig)

    @cached_property
    def skin_triangles(self) -> Int[np.ndarray, "f 3"]:
        """Triangles whose corners are all skin."""
        return self.rig.triangles[self.rig.skin[self.rig.triangles].all(axis=1)]

    @cached_property
    def is_edge(self) -> Bool[np.ndarray, " v"]:
        """Where the mesh itself ends, and not only its skin."""
        edge = np.zeros(len(self.rig.neutral), dtype=bool)
        edge[boundary_vertices(self.rig.triangles)] = True
        return edge

    @cached_property
    def graph(self) -> csr_array:
        """The `surface_graph` of the skin alone, edges in millimetres."""
        return surface_graph(self.rig.neutral, self.skin_triangles)

    @cached_property
    def seen(self) -> Float[np.ndarray, " v"]:
        """h: how much of the hemisphere sees each skin vertex past skin, what hangs together with it, and eyeballs."""
        rig = self.rig
        piece = pieces(rig.triangles, len(rig.neutral))
        solid = np.isin(piece, np.unique(piece[rig.skin])) | np.any([rig.skin, *eyeballs(rig)], axis=0)
        at, h = np.flatnonzero(rig.skin), np.zeros(len(rig.neutral))
        h[at] = hemisphere_visibility(rig.neutral, rig.triangles[solid[rig.triangles].all(axis=1)], at)
        return h

    def zone(self, name: str, margin_mm: float) -> Zone:
        """One zone, the same on both sides."""
        if name == "helmet strap":
            mask, note = self._strap(margin_mm), "where straps and pads sit is assumed from the proportions of the face"
        else:
            if name not in self._cores:
                self._cores[name] = self._core(name)
            core, note = self._cores[name]
            mask = self.within(core, margin_mm)
        partners = self.mirror[self.mirror] == np.arange(len(mask))
        return Zone(name, self.rig.skin & (mask | (mask[self.mirror] & partners)), note)

    @cached_property
    def mirror(self) -> Int[np.ndarray, " v"]:
        """The mirror image of every vertex."""
        return mirror_map(self.rig.neutral)

    @cached_property
    def _cores(self) -> dict[str, tuple[Bool[np.ndarray, " v"], str]]:
        return {}

    def within(self, core: Bool[np.ndarray, " v"], margin_mm: float) -> Bool[np.ndarray, " v"]:
        """Skin within the margin of the core along the skin."""
        if not core.any():
            return core
        away = dijkstra(self.graph, directed=False, indices=np.flatnonzero(core), min_only=True, limit=margin_mm)
        return np.isfinite(away)

    def _core(self, name: str) -> tuple[Bool[np.ndarray, " v"], str]:
        """What a zone is named for, before its margin, and what was assumed of it."""
        anchors, neutral = self.regions.anchors, self.rig.neutral
        u = anchors.pupils
        if name == "hairline":
            return self._is("scalp"), "where hair begins is assumed from the proportions of the face"
        if name == "lash line":
            eyes = np.stack([anchors.eye_left, anchors.eye_right])
            near = self._near(np.concatenate([neutral[anchors.lids], eyes]), EYE * u)
            return self._opening("eyes", anchors.lids, near & (self.seen <= CORNER), near & (self.seen <= HIDDEN))
        if name == "inner eye corner":
            found = eye_corners(self.rig, anchors)
            core = np.zeros(len(neutral), dtype=bool)
            core[[corner for (end, _), corner in found.items() if end == "inner"]] = True
            return core, "" if found else "no corner of an eye was found: paint this zone by hand"
        if name == "wet lip":
            line = np.linspace(anchors.corner_left, anchors.corner_right, 9)
            near = self._near(np.concatenate([neutral[anchors.lips], line]), LIP * u)
            return self._opening("mouth", anchors.lips, near & (self.seen <= DIM), near & (self.seen <= HIDDEN))
        nose = self._is("nose") & (neutral[:, 1] < anchors.nose_tip[1])
        loops = [loop for loop in border_loops(self.skin_triangles) if nose[loop].mean() > 0.5]
        dented = nose & (self.seen <= CORNER) & (vertex_normals(neutral, self.skin_triangles)[:, 1] < DOWN)
        border = np.concatenate([np.empty(0, dtype=int), *loops])
        return self._opening("nostrils", border, dented | (nose & (self.seen <= DIM)), dented)

    def _opening(
        self, what: str, border: Int[np.ndarray, " b"], dim: Bool[np.ndarray, " v"], deep: Bool[np.ndarray, " v"]
    ) -> tuple[Bool[np.ndarray, " v"], str]:
        """The border, or where there is none the deep skin, and dim skin that hangs together with it."""
        core = np.zeros_like(dim)
        core[border] = self.is_edge[border] | (self.seen[border] <= CORNER)  # a cut may stray onto visible skin
        core |= deep & self.rig.skin & (len(border) == 0)
        dim = (dim & self.rig.skin) | core
        piece = pieces(self.skin_triangles[dim[self.skin_triangles].all(axis=1)], len(dim))
        inside = dim & np.isin(piece, piece[core])
        if not inside.any():
            return inside, f"no opening of the {what} was found: paint this zone by hand"
        return inside, "" if len(border) else f"the {what} have no border in this mesh: found by where skin is hidden"

    def _is(self, region: str) -> Bool[np.ndarray, " v"]:
        return self.regions.of_vertex == self.regions.names.index(region)

    def _near(self, points: Float[np.ndarray, "p 3"], extent: float) -> Bool[np.ndarray, " v"]:
        return KDTree(points).query(self.rig.neutral)[0] <= extent

    def _strap(self, margin_mm: float) -> Bool[np.ndarray, " v"]:
        """Skin near the line of a strap in the side view (z, y): over the temple, before the ear, under the chin."""
        a = self.regions.anchors
        u, ear = a.pupils, (a.ear_left + a.ear_right) / 2
        front = ear[2] + STRAP_BEFORE_EAR * u
        corners = np.array(
            [
                [front, a.eye_left[1] + 0.8 * u],
                [front, a.mouth[1] + 0.1 * u],
                [a.chin[2] - 0.55 * u, a.chin[1] - 0.1 * u],
            ]
        )
        line = np.concatenate([np.linspace(start, end, 200) for start, end in pairwise(corners)])
        away = KDTree(line).query(self.rig.neutral[:, [2, 1]])[0]
        return (away <= margin_mm) & ~self._is("ear")


@once
def ground_of(rig: Rig) -> Ground:
    """What all zones of a rig are found from, found once."""
    return Ground(rig)
