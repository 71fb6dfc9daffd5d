"""How far every dot may stand from its place at once: rings within which 95 of 100 crews keep the error.

Data     A = C B^T / sigma^2 answers the solver gives to measurements,  E = A B - I;  D change of the rows of B (3m k)
Error    squared it grows by  tau^2 [2 tr(E^T G A D) + tr(G A D D^T A^T)],  exactly, where the solver takes every dot
         for one at its place; the limit is (GROWTH^2 - 1) error^2
Crew     every dot anywhere within its ring, each place of the disc as likely as any other
Alone    h_m(r)  mean growth over the disc of radius r while every other dot stands right, read off the skin itself:
         rows made linear at the place show two thirds of it
Strict   s_m(a)  the same growth at the ring itself, both ways along the axis at angle a; where one axis costs STRICT
         times as much as that across it, the dot has to be set most exactly along it
Rings    r_m = argmin 1/r + mu h_m(r) between LEAST_MM and MOST_MM: exact where exactness is dear, loose where it is
         cheap; mu is halved upon until KEEP of the seeded crews stay within the limit
Letters: m dots, c crews, d directions, r radii, k blendshapes. Lengths in millimetres.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial import KDTree

from capture_plan.anatomy.regions import mirrored_label
from capture_plan.cache import Arrays, cached, code_digest, digest
from capture_plan.camera import Camera
from capture_plan.evaluation.robustness import GROWTH
from capture_plan.evaluation.tangent_chart import Chart, flatten
from capture_plan.layout.face import Face
from capture_plan.layout.observation import PRIOR_SD, Observation
from capture_plan.layout.record import Landmark
from capture_plan.layout.settings import LayoutSettings
from capture_plan.mesh import vertex_normals
from capture_plan.rig import Rig

LEAST_MM, MOST_MM, STEP_MM = 0.5, 8.0, 0.25
EXACT_MM = 0.05  # to which a ring is told
DIRECTIONS = 16
PROMISED = 0.95  # of crews within their rings keep the error
CREWS, KEEP = 2000, 0.955  # a little more, so that other crews keep what is promised
HALVINGS = 18
AT_ONCE = 250  # crews whose rows are held together
SEED = 0
STRICT = 2.0
ROOMS = ("anatomy", "evaluation", "layout", "mesh")  # whose code an answer depends on
ENTRIES = 50

Direction = tuple[float, float, float]


class Rings(NamedTuple):
    """How far each marker may stand from its place, millimetres, by its name; of some the direction along the skin, a
    unit vector, in which it has to stand most exactly; the share of crews that keep the error."""

    mm: dict[str, float]
    strict: dict[str, Direction]
    kept: float


@dataclass(frozen=True, eq=False)
class Placing:
    """Dots on a face with the skin around each; `moved[m]` are changes of its rows at every direction and radius,
    directions counted in the plane of its `axes`."""

    observation: Observation
    vertices: Int[np.ndarray, " m"]
    moved: Float[np.ndarray, "m d r 3 k"]
    reach: Float[np.ndarray, " m"]
    axes: Float[np.ndarray, "m 2 3"]

    @property
    def radii(self) -> Float[np.ndarray, " r"]:
        """0, then every step to MOST_MM."""
        return STEP_MM * np.arange(self.moved.shape[2])

    @cached_property
    def _parts(self) -> tuple[Float[np.ndarray, "q k"], Float[np.ndarray, "q q"], float]:
        """A^T G E and A^T G A with the rows of all dots, and the squared error."""
        seen = self.observation
        B, C = seen.response(self.vertices), seen.covariance(self.vertices)
        A = C @ B.T / seen.noise_mm**2
        return A.T @ seen.gram @ (A @ B - np.eye(len(C))), A.T @ seen.gram @ A, seen.error(C) ** 2

    def growth(self, D: Float[np.ndarray, "c q k"]) -> Float[np.ndarray, " c"]:
        """The error's factor where the rows of all dots change by D."""
        linear, square, before = self._parts
        more = 2 * np.einsum("cqk,qk->c", D, linear) + np.einsum("cqk,qp,cpk->c", D, square, D, optimize=True)
        return np.sqrt(np.clip(before + PRIOR_SD**2 * more, 0, None) / before)

    def alone(self) -> Float[np.ndarray, "m r"]:
        """h: mean growth of the squared error over the disc of each radius, for each dot by itself."""
        linear, square, _ = self._parts
        M, steps = len(self.vertices), np.arange(self.moved.shape[2])
        own = linear.reshape(M, 3, -1)
        block = square.reshape(M, 3, M, 3)[np.arange(M), :, np.arange(M)]
        more = 2 * np.einsum("mdrxk,mxk->mr", self.moved, own)
        more += np.einsum("mdrxk,mxy,mdryk->mr", self.moved, block, self.moved, optimize=True)
        ring = PRIOR_SD**2 * more / self.moved.shape[1]
        share = np.maximum(2 * steps - 1, 0)  # of the disc of radius r, which ends between two steps
        return np.cumsum(share * ring, axis=1) / np.maximum(np.cumsum(share), 1)

    def along(self, rings: Float[np.ndarray, " m"]) -> Float[np.ndarray, "m d"]:
        """Growth of the squared error where a dot alone stands at its ring, in each direction."""
        linear, square, _ = self._parts
        M = len(self.vertices)
        own = linear.reshape(M, 3, -1)
        block = square.reshape(M, 3, M, 3)[np.arange(M), :, np.arange(M)]
        moved = self.moved[np.arange(M), :, np.rint(rings / STEP_MM).astype(int)]
        more = 2 * np.einsum("mdxk,mxk->md", moved, own)
        return more + np.einsum("mdxk,mxy,mdyk->md", moved, block, moved, optimize=True)

    def strictest(self, rings: Float[np.ndarray, " m"]) -> Float[np.ndarray, "m 3"]:
        """The axis along the skin in which each dot has to stand most exactly, unit vectors; 0 where none has."""
        growth = self.along(rings)
        half = growth.shape[1] // 2
        axis = np.maximum((growth[:, :half] + growth[:, half:]) / 2, 0)  # both ways along it
        most = axis.argmax(axis=1)
        across = np.take_along_axis(axis, (most[:, None] + half // 2) % half, axis=1)[:, 0]
        angle = np.pi * most / half
        found = np.cos(angle)[:, None] * self.axes[:, 0] + np.sin(angle)[:, None] * self.axes[:, 1]
        return np.where((axis.max(axis=1) > STRICT * across)[:, None], found, 0.0)

    def kept(self, rings: Float[np.ndarray, " m"], *, crews: int, seed: int) -> float:
        """Share of seeded crews within the rings whose error grows by no more than GROWTH."""
        rng, good = np.random.default_rng(seed), 0
        M, directions = len(self.vertices), self.moved.shape[1]
        each = np.arange(M)
        for first in range(0, crews, AT_ONCE):
            some = min(AT_ONCE, crews - first)
            way = rng.integers(directions, size=(some, M))
            at = rings * np.sqrt(rng.uniform(size=(some, M))) / STEP_MM
            low = np.minimum(at.astype(int), self.moved.shape[2] - 2)
            rest = (at - low)[..., None, None]
            D = (1 - rest) * self.moved[each, way, low] + rest * self.moved[each, way, low + 1]
            good += int((self.growth(D.reshape(some, 3 * M, -1)) <= GROWTH).sum())
        return good / crews


def placing_of(face: Face, settings: LayoutSettings, vertices: Int[np.ndarray, " m"]) -> Placing:
    """Dots at these vertices of a face."""
    normals = vertex_normals(face.rig.neutral, face.rig.triangles)
    charts = flatten(face.rig.neutral, normals, face.graph, vertices, extent_mm=MOST_MM)
    angle = 2 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
    ray = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    radii = STEP_MM * np.arange(round(MOST_MM / STEP_MM) + 1)
    places = radii[None, :, None] * ray[:, None]
    observation = face.observation(settings.noise_mm, settings.dot_mm)
    rows = observation.response(vertices).reshape(len(vertices), 3, -1)
    moved = np.stack(
        [
            chart.deltas(observation.measured, places.reshape(-1, 2)).reshape(*places.shape[:2], 3, -1) - row
            for chart, row in zip(charts, rows, strict=True)
        ]
    )
    reach = np.array([_reach(chart, places) for chart in charts])
    return Placing(observation, vertices, moved, reach, np.stack([chart.axes for chart in charts]))


def _reach(chart: Chart, places: Float[np.ndarray, "d r 2"]) -> float:
    """The largest radius at which there is skin in every direction."""
    bare = np.flatnonzero(~chart.on_skin(places.reshape(-1, 2)).reshape(places.shape[:2]).all(axis=0))
    return STEP_MM * float(max(bare[0] - 1, 0) if len(bare) else places.shape[1] - 1)


def rings(placing: Placing) -> Float[np.ndarray, " m"]:
    """The ring of every dot, multiples of EXACT_MM, LEAST_MM at least.

    Where even rings of LEAST_MM let the error grow in more than 5 of 100 crews, all are that small: then every dot has
    to be measured after it is placed, and the solver told.
    """
    radii = np.arange(round(LEAST_MM / EXACT_MM), round(MOST_MM / EXACT_MM) + 1) * EXACT_MM
    alone = np.stack([np.interp(radii, placing.radii, one) for one in placing.alone()])

    def at(mu: float) -> Float[np.ndarray, " m"]:
        price = 1 / radii + mu * alone
        return np.minimum(radii[price.argmin(axis=1)], np.maximum(placing.reach, LEAST_MM))

    low, high = 1e-6, 1e12  # of mu: all as loose as can be, all as strict
    if placing.kept(at(low), crews=CREWS, seed=SEED) >= KEEP:
        return at(low)
    for _ in range(HALVINGS):
        middle = float(np.sqrt(low * high))
        if placing.kept(at(middle), crews=CREWS // 4, seed=SEED) >= KEEP:
            high = middle
        else:
            low = middle
    while high < 1e12 and placing.kept(at(high), crews=CREWS, seed=SEED) < KEEP:
        high *= 1.05
    return at(high)


def rings_of(
    rig: Rig,
    used: tuple[str, ...],
    settings: LayoutSettings,
    landmarks: tuple[Landmark, ...],
    cameras: tuple[Camera, ...] = (),
) -> Rings:
    """The rings of these landmarks for the `used` blendshapes and the noise of the settings, or what known cameras
    measure, as pages print them.

    Example:
        >>> plan = read_plan("hero.plan.json")
        >>> found = rings_of(sample_rig(), plan.audit.used, plan.settings.landmarks, plan.layout.landmarks)
        >>> len(found.mm) == len(plan.layout.landmarks), min(found.mm.values()) >= 0.5
        (True, True)
    """
    if not landmarks:
        return Rings({}, {}, 1.0)
    vertices, names = np.array([landmark.vertex for landmark in landmarks]), [one.name for one in landmarks]
    labels = [landmark.label for landmark in landmarks]
    lenses = [camera.numbers for camera in cameras]
    key = digest([code_digest(*ROOMS), rig.fingerprint, rig.skin, *used, repr(settings), vertices, *labels, *lenses])

    def compute() -> Arrays:
        placing = placing_for(rig, used, settings, vertices, cameras)
        found = alike_on_both_sides(rings(placing), labels)
        kept, strict = placing.kept(found, crews=CREWS, seed=SEED), placing.strictest(found)
        return {
            "mm": found,
            "strict": axes_alike(strict, labels) if settings.symmetric else strict,
            "kept": np.array(kept),
        }

    answer = cached(compute, "rings", key, entries=ENTRIES)
    axes = zip(names, answer["strict"].tolist(), strict=True)
    return Rings(
        dict(zip(names, answer["mm"].round(2).tolist(), strict=True)),
        {name: (x, y, z) for name, (x, y, z) in axes if x or y or z},
        float(answer["kept"]),
    )


def placing_for(
    rig: Rig,
    used: tuple[str, ...],
    settings: LayoutSettings,
    vertices: Int[np.ndarray, " m"],
    cameras: tuple[Camera, ...] = (),
) -> Placing:
    """Dots at these vertices of a rig, none of which may touch another, wherever they stand."""
    placing = placing_of(Face(rig, used, np.zeros(len(rig.neutral)), cameras), settings, vertices)
    near = KDTree(rig.neutral[vertices]).query(rig.neutral[vertices], k=2)[0][:, 1] if len(vertices) > 1 else np.inf
    clear = np.floor((near - settings.dot_mm) / 2 / EXACT_MM) * EXACT_MM
    return replace(placing, reach=np.minimum(placing.reach, clear))


def alike_on_both_sides(found: Float[np.ndarray, " m"], labels: Sequence[str]) -> Float[np.ndarray, " m"]:
    """Nobody learns two rings for one place: the smaller one for both sides."""
    ring = dict(zip(labels, found.tolist(), strict=True))
    return np.array(
        [min(mm, ring.get(mirrored_label(label), mm)) for label, mm in zip(labels, found.tolist(), strict=True)]
    )


def axes_alike(axes: Float[np.ndarray, "m 3"], labels: Sequence[str]) -> Float[np.ndarray, "m 3"]:
    """Strict axes that mirror each other: for a dot and its mirror image the mean of the axes found for both, or the
    only one that was found. Nobody learns two rings for one place."""
    mirror = np.array([-1.0, 1.0, 1.0])
    of = dict(zip(labels, axes, strict=True))
    alike = []
    for label, axis in zip(labels, axes, strict=True):
        image = mirror * of.get(mirrored_label(label), mirror * axis)
        total = axis + image * (-1 if axis @ image < 0 else 1)  # an axis has no direction: either end may lead
        alike.append(total / max(float(np.linalg.norm(total)), 1e-12))
    return np.array(alike)
