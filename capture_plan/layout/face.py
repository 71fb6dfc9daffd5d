"""The face as landmarks are chosen from it: which skin moves, how well it is seen, where landmarks may stand."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.sparse import csr_array
from scipy.spatial import KDTree

from capture_plan.anatomy.performed_deltas import performed_deltas
from capture_plan.anatomy.regions import FaceRegions, face_regions
from capture_plan.anatomy.zones import DOT_MM, Ground, check_zone, ground_of
from capture_plan.audit.audit_cache import audit_once
from capture_plan.camera import Camera, root, told, why_blind
from capture_plan.errors import InfeasibleError, RigError
from capture_plan.face.blocking import opaque_triangles
from capture_plan.layout.contact_pairs import met_in
from capture_plan.layout.dot_contact import Poses
from capture_plan.layout.label_pairs import untold_in
from capture_plan.layout.observation import Observation
from capture_plan.layout.settings import LayoutSettings
from capture_plan.layout.site_sampling import places_on
from capture_plan.layout.sites import Sites, mirrored_sites, moving, single_sites
from capture_plan.layout.spacing import Spacing, check_density
from capture_plan.layout.unread import pose_deltas, vertex_views
from capture_plan.mesh import straight_table, surface_graph
from capture_plan.mesh.mirror import mirror_map
from capture_plan.once import once
from capture_plan.registration.empirical_layouts import place_ibug68, place_layout
from capture_plan.rig import Rig
from capture_plan.visibility import FEWEST_PIXELS, SEEN, Views, camera_views, camera_visibility, global_visibility

SIXTY_EIGHT = "68 points (iBUG)"
USUAL = 68  # points that people are used to


@dataclass(frozen=True, eq=False)
class Face:
    """What landmarks are chosen from: `used` blendshapes of a rig, how well each vertex is seen (0 to 1), and the skin
    of zones that a person painted, by their names."""

    rig: Rig
    used: tuple[str, ...]
    visibility: Float[np.ndarray, " v"]
    cameras: tuple[Camera, ...] = ()
    painted: Mapping[str, Bool[np.ndarray, " v"]] = field(default_factory=dict)

    @property
    def rows(self) -> list[int]:
        """Indices of the used blendshapes in the rig."""
        return self.rig.rows(self.used)

    @property
    def displacement(self) -> Float[np.ndarray, "k v"]:
        """Length of every used delta on the skin, 0 elsewhere, millimetres."""
        return np.where(self.rig.skin, self.rig.displacement[self.rows], 0)

    @cached_property
    def mirror(self) -> Int[np.ndarray, " v"]:
        """The mirror image of every vertex."""
        return mirror_map(self.rig.neutral)

    @cached_property
    def moving_skin(self) -> Bool[np.ndarray, " v"]:
        """Skin that some used blendshape moves."""
        return self.rig.skin & moving(self.displacement)

    @cached_property
    def markable(self) -> Bool[np.ndarray, " v"]:
        """Skin that may carry a landmark: what moves, and its mirror image, which may stay still on a lopsided rig."""
        return self.rig.skin & (self.moving_skin | self.moving_skin[self.mirror])

    @cached_property
    def places(self) -> Bool[np.ndarray, " v"]:
        """Skin that is asked whether a dot stands there: all of it, but of a fine mesh."""
        return places_on(self.rig, self.displacement, self.mirror)

    def dotted(self, settings: LayoutSettings) -> Int[np.ndarray, " n"]:
        """Vertices that may carry a dot: markable places, pins and their mirror images."""
        pins = self.pinned(settings)
        return np.union1d(np.flatnonzero(self.markable & self.places), [*pins, *self.mirror[pins]]).astype(int)

    def allowed(self, settings: LayoutSettings) -> Bool[np.ndarray, " v"]:
        """Markable places that are seen well enough in every expression, or where a known layout may stand anyway.

        Raises:
            InfeasibleError: there is none.
        """
        allowed = self.markable & self.places & ((self.visibility >= settings.min_visibility) | self.relaxed(settings))
        if not allowed.any() and self.cameras:
            raise InfeasibleError(why_blind(self.cameras, self.rig.neutral[self.markable]))
        if not allowed.any():
            raise InfeasibleError(
                f"no moving skin is seen from {settings.min_visibility:.0%} of the directions: lower min_visibility"
            )
        return allowed

    def free(self, settings: LayoutSettings) -> Bool[np.ndarray, " v"]:
        """What is `allowed` and read by as many cameras as the settings ask for.

        Raises:
            InfeasibleError: there is none.
        """
        free = self.allowed(settings)
        if self.cameras:
            free[self.rig.skin] &= self.views(settings.dot_mm).views >= settings.min_views
        return free

    def relative_displacement(self, settings: LayoutSettings) -> Float[np.ndarray, "k v"]:
        """r[k, v] among the vertices that may carry a landmark, 0 elsewhere and where the movement drowns in noise.

        The largest displacement is that of the seen skin: where a lip rolls out of sight, the skin beside it counts.
        """
        allowed = self.allowed(settings)
        largest = np.where(allowed, self.displacement, 0).max(axis=1, keepdims=True)
        may_carry = allowed | np.isin(np.arange(len(allowed)), self.pinned(settings))
        seen = np.where(may_carry & (largest > settings.noise_mm), self.displacement, 0)
        return np.minimum(seen / np.where(largest > 0, largest, 1), 1)

    def pinned(self, settings: LayoutSettings) -> Int[np.ndarray, " p"]:
        """Vertices that carry a landmark whatever else is decided, in the order of the settings.

        Raises:
            InfeasibleError: a vertex is not in the rig or not on its skin.
        """
        return np.array([self.skin_vertex(source, "pin") for source in settings.pins], dtype=int)

    def skin_vertex(self, source: int, what: str) -> int:
        """The rig's number of a skin vertex that a person named by its number in the artist's file."""
        vertex = self.rig.vertex_of.get(source)
        if vertex is None or not self.rig.skin[vertex]:
            lies = "is not in the rig" if vertex is None else "is not on the face skin"
            raise InfeasibleError(f"{what}: vertex {source:,} of {self.rig.name} {lies}: give a vertex of the skin")
        return vertex

    def sites(self, settings: LayoutSettings) -> Sites:
        """Where landmarks may stand under these settings: what is allowed, and the pins."""
        allowed, relative = self.allowed(settings), self.relative_displacement(settings)
        allowed[self.pinned(settings)] = True
        if not settings.symmetric:
            return single_sites(relative, self.visibility, allowed)
        allowed[self.mirror[self.pinned(settings)]] = True
        return mirrored_sites(
            relative,
            self.visibility,
            allowed,
            neutral=self.rig.neutral,
            mirror=self.mirror,
            spacing_mm=settings.spacing_mm,
        )

    @once
    def zone(self, name: str, margin_mm: float) -> Bool[np.ndarray, " v"]:
        """Skin that a keep-out covers: a zone of `anatomy.zones` or a painted one, by its name, with a margin.

        Raises:
            RigError: there is no such zone.
        """
        if name in self.painted:
            return self.ground.within(self.painted[name], margin_mm)
        check_zone(name, margin_mm)
        return self.ground.zone(name, margin_mm).mask

    def relaxed(self, settings: LayoutSettings) -> Bool[np.ndarray, " v"]:
        """Skin within a dot's diameter of the points of the layout that zones are relaxed for, or of their mirror
        images: none where there is no such layout.

        Raises:
            RigError: the points have no place on this face.
        """
        around = np.zeros(len(self.rig.neutral), dtype=bool)
        if settings.relaxed_for:
            points = place_layout(self.rig, settings.relaxed_for).vertices
            points = np.union1d(points, self.mirror[points])
            around = self.around(points, settings.dot_mm)
        return around & self.rig.skin

    @cached_property
    def ground(self) -> Ground:
        """What all named zones are found from."""
        return ground_of(self.rig)

    @cached_property
    def regions(self) -> FaceRegions:
        """Names for places on this face."""
        return face_regions(self.rig)

    @cached_property
    def points68(self) -> Int[np.ndarray, "68"] | None:
        """The 68 points of iBUG on this face; None where it has no eyes and mouth to lay them on."""
        try:
            return place_ibug68(self.rig)
        except RigError:
            return None

    @once
    def views(self, dot_mm: float) -> Views:
        """What every camera sees of a dot at every skin vertex, in the order of their numbers; at what is no place, of
        one at the nearest place."""
        rig, at = self.rig, np.flatnonzero(self.places)
        deltas = performed_deltas(rig, self.used)
        found = camera_views(rig.neutral, deltas, opaque_triangles(rig), at, self.cameras, dot_mm=dot_mm)
        return found.at(_nearest_of(rig.neutral, np.flatnonzero(rig.skin), at))

    def pose_views(self, poses: Poses, dot_mm: float) -> Views:
        """What every camera sees of a dot at every skin vertex in the neutral and in poses, as `views` has it."""
        rig, at = self.rig, np.flatnonzero(self.places)
        found = camera_views(
            rig.neutral, pose_deltas(rig, poses), opaque_triangles(rig), at, self.cameras, dot_mm=dot_mm
        )
        return found.at(_nearest_of(rig.neutral, np.flatnonzero(rig.skin), at))

    @cached_property
    def graph(self) -> csr_array:
        """The `surface_graph` of the skin alone."""
        skin = self.rig.triangles[self.rig.skin[self.rig.triangles].all(axis=1)]
        return surface_graph(self.rig.neutral, skin)

    @cached_property
    def on_skin(self) -> Bool[np.ndarray, " v"]:
        """Corners of triangles of the skin."""
        return np.diff(self.graph.indptr) > 0

    def around(self, vertices: Int[np.ndarray, " n"], radius_mm: float) -> Bool[np.ndarray, " v"]:
        """Skin straight nearer than a radius to one of the vertices, and these: lips and lids that lie far apart along
        the skin are neighbours."""
        x, around = self.rig.neutral, np.zeros(len(self.rig.neutral), dtype=bool)
        for vertex in vertices:
            around |= np.linalg.norm(x - x[vertex], axis=1) < radius_mm
        around &= self.on_skin
        around[vertices] = True
        return around

    def near(self, radius_mm: float, sites: Sites) -> csr_array:
        """`straight_table` of the places, and of what sites there are beside them. InfeasibleError where they are too
        many for it."""
        at = self.places & self.on_skin
        at[sites.vertices] = True
        return self._near(radius_mm, at)

    @once
    def _near(self, radius_mm: float, at: Bool[np.ndarray, " v"]) -> csr_array:
        check_density(self.rig, at, radius_mm)
        return straight_table(self.rig.neutral, np.flatnonzero(at), radius_mm)

    def met(self, settings: LayoutSettings) -> csr_array:
        """Pairs of `dotted` vertices at the spacing whose dots meet in a blendshape alone, a corrective with what it
        corrects. (v v) of 0 and 1."""
        return self._met(self.dotted(settings), dot_mm=settings.dot_mm, spacing_mm=settings.spacing_mm)

    @once
    def _met(self, at: Int[np.ndarray, " n"], *, dot_mm: float, spacing_mm: float) -> csr_array:
        poses = performed_deltas(self.rig, self.used)[:, at]
        return met_in(self.rig.neutral, at, poses, dot_mm=dot_mm, spacing_mm=spacing_mm)

    def untold(self, settings: LayoutSettings, poses: Poses) -> csr_array:
        """Pairs of `dotted` vertices at the spacing whose dots a tracker may take for each other on the way between
        poses, in their order, by the margin that the settings ask for. (v v) of 0 and 1."""
        names, weights = tuple(poses), np.array([[pose.get(k, 0.0) for k in self.rig.names] for pose in poses.values()])
        asked = settings.label_margin_mm or 0.0
        at = self.dotted(settings)
        return self._untold(at, names, weights, dot_mm=settings.dot_mm, spacing_mm=settings.spacing_mm, asked_mm=asked)

    @once
    def _untold(
        self,
        at: Int[np.ndarray, " n"],
        names: tuple[str, ...],
        weights: Float[np.ndarray, "e k"],
        *,
        dot_mm: float,
        spacing_mm: float,
        asked_mm: float,
    ) -> csr_array:
        rig = self.rig
        moved = np.tensordot(weights, rig.deltas[:, at].astype(float), 1)
        places = rig.neutral[at] + np.concatenate([np.zeros((1, len(at), 3)), moved])
        seen = np.ones((len(places), 1, len(at)), dtype=bool)
        if self.cameras:
            poses = {
                name: dict(zip(rig.names, row.tolist(), strict=True)) for name, row in zip(names, weights, strict=True)
            }
            seen = np.isin(vertex_views(rig, at, poses, self.cameras, dot_mm=dot_mm).how, SEEN)
        return untold_in(places, seen, at, len(rig.neutral), self.cameras, spacing_mm=spacing_mm, asked_mm=asked_mm)

    def spacing(self, sites: Sites, spacing_mm: float) -> Spacing | None:
        """Which of the sites stand too close to each other; None where any may."""
        return Spacing(self.near(spacing_mm, sites), sites, spacing_mm) if spacing_mm else None

    @once
    def told(self, dot_mm: float) -> Float[np.ndarray, "v 3 3"]:
        """What the cameras tell of the place of a dot at every skin vertex (`camera.precision`), over the neutral and
        every blendshape; 0 elsewhere. Per square millimetre."""
        L, at = np.zeros((len(self.rig.neutral), 3, 3)), np.flatnonzero(self.rig.skin)
        L[at] = told(self.cameras, self.rig.neutral[at], self.views(dot_mm).share, self.blur(dot_mm))
        return L

    def blur(self, dot_mm: float) -> Float[np.ndarray, "c n"]:
        """How many times its own smaller diameter a dot is blurred at every skin vertex of the neutral."""
        points = self.rig.neutral[self.rig.skin]
        pixels = np.maximum(self.views(dot_mm).pixels, FEWEST_PIXELS)
        return np.stack([one.blur_px(points) for one in self.cameras]) / pixels

    def observation(self, noise_mm: float, dot_mm: float = DOT_MM) -> Observation:
        """The face as a measuring problem: noise of a standard deviation in every coordinate or, where cameras are
        known, what these tell of a dot."""
        R = root(self.told(dot_mm)) if self.cameras else None
        return Observation(self.rig.deltas[self.rows], self.moving_skin, noise_mm, R)


def see_face(
    rig: Rig,
    used: tuple[str, ...] | None = None,
    cameras: tuple[Camera, ...] = (),
    painted: Mapping[str, Bool[np.ndarray, " v"]] | None = None,
) -> Face:
    """Visibility of every skin vertex in every expression, from anywhere or, where they are known, from the cameras;
    what is no place has that of the nearest place. `used` are the blendshapes that count, those that the audit plans
    for unless they are given. `painted` is the skin of zones that a person painted, by name.

    Example:
        >>> face = see_face(sample_rig())
        >>> len(face.used), bool((face.visibility >= 0).all() and (face.visibility <= 1).all())
        (51, True)
    """
    used = audit_once(rig).used if used is None else used
    face = Face(rig, used, np.zeros(len(rig.neutral)))
    at, deltas = np.flatnonzero(face.markable & face.places), performed_deltas(rig, used)
    visibility = np.zeros(len(rig.neutral))
    if cameras:
        visibility[at] = camera_visibility(rig.neutral, deltas, opaque_triangles(rig), at, cameras)
    else:
        visibility[at] = global_visibility(rig.neutral, deltas, opaque_triangles(rig), at)
    markable = np.flatnonzero(face.markable)
    if len(at):
        visibility[markable] = visibility[at][_nearest_of(rig.neutral, markable, at)]
    return Face(rig, used, visibility, cameras, painted or {})


def _nearest_of(
    points: Float[np.ndarray, "v 3"], vertices: Int[np.ndarray, " n"], subset: Int[np.ndarray, " m"]
) -> Int[np.ndarray, " n"]:
    """For every vertex the place in `subset` of the vertex nearest to it; its own where it is among them."""
    place = np.full(len(points), -1)
    place[subset] = np.arange(len(subset))
    found, rest = place[vertices], place[vertices] < 0
    if rest.any():
        found[rest] = KDTree(points[subset]).query(points[vertices[rest]])[1]
    return found
