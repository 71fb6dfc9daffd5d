"""How symmetric a rig is, and where names and geometry disagree about left and right.

Data     plane n . x = c    found, not assumed (`mesh/mirror.py`)
         m                  partner map: vertex m[v] is the mirror image of vertex v in that plane; skin has skin
         near               on a lopsided neutral what is as near to the reflection as 95 % of the skin is
         D[j]               mirrored delta: D[j, v] = d[j, m[v]] - 2 (n . d[j, m[v]]) n
         judged             skin, and what else has a vertex at its reflection: a highlight or a strand of hair on one
                            side has no mirror image, and what comes nearest to it instead tells nothing
Figures  neutral            |reflection of v - m[v]|, millimetres, over the skin
         blendshape i       |d[i] - D[j]| / sqrt((|d[i]|^2 + |D[j]|^2) / 2) in per cent, over what is judged, for
                            the j that is its partner; without one the nearest that has none either, or itself where it
                            moves both sides alike; and at the worst vertex of the skin, max |d[i] - D[j]| / max |d[i]|
           |d[i] - D[j]| takes the vertex of `near` that differs least: what a lopsided neutral explains is no fault
           of the blendshape
0 % is an exact mirror image, 141 % is unrelated, 200 % is the opposite. Beyond `NO_IMAGE` there is none.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.spatial import KDTree

from capture_plan.anatomy.blendshape_pairs import UNLIKE, blendshape_pairs, laterality, other_names
from capture_plan.mesh.mirror import Plane, find_mirror_plane, partner_map
from capture_plan.names.arkit import Side, side_of
from capture_plan.rig.record import Rig

TIE_MM = 0.02  # two vertices this close to the reflection are equally good: seams and closed lips are that exact
LOPSIDED_MM = 0.5  # 95 % of the skin: up to there the vertex nearest to the reflection is the partner
TWINS = 4  # vertices of one place: both sides of a seam, where pieces meet
NEAREST = 48  # candidates: skin within 6 mm where vertices are 1.5 mm apart
NO_IMAGE = 100 * float(np.sqrt(2 * UNLIKE))  # per cent; the same bound as that of partners


@dataclass(frozen=True)
class MirrorImage:
    """`partner` is the other half of `blendshape`; of what has none, that without a half (or itself) whose mirror image
    it comes nearest to; none where nothing comes near. They differ by `percent` of their length, and at the worst
    vertex by `worst_percent` of its largest displacement.
    """

    blendshape: str
    partner: str | None
    percent: float
    worst_percent: float


@dataclass(frozen=True, eq=False)
class SymmetryReport:
    """`tilt_degrees` is how far the plane is turned from x = c; the neutral's figures are of the skin, millimetres."""

    plane: Plane
    tilt_degrees: float
    partners: Int[np.ndarray, " v"]
    neutral_median_mm: float
    neutral_p95_mm: float
    neutral_max_mm: float
    blendshapes: tuple[MirrorImage, ...]

    def text(self) -> str:
        """The report as lines to read."""
        messages = [image for image in self.blendshapes if image.partner is not None]
        off = sorted((image.percent for image in messages), reverse=True)
        lines = [
            f"neutral: skin {self.neutral_median_mm:.2f} mm from its mirror image (median), 95 % within "
            f"{self.neutral_p95_mm:.2f} mm, at most {self.neutral_max_mm:.1f} mm; "
            f"plane turned by {self.tilt_degrees:.1f} degrees"
        ]
        if off:
            lines.append(f"blendshapes: {np.median(off):.0f} % off their mirror image (median), at most {off[0]:.0f} %")
        for image in sorted(messages, key=lambda image: -image.percent)[:5]:
            whose = "its own" if image.partner == image.blendshape else f"{image.partner}'s"
            worst = f"{image.worst_percent:.0f} % at the worst vertex"
            lines.append(f"  {image.blendshape} is {image.percent:.0f} % off {whose} mirror image, {worst}")
        alone = [image.blendshape for image in self.blendshapes if image.partner is None]
        if alone:
            lines.append(f"without mirror image: {', '.join(alone)}")
        return "\n".join(lines) + "\n"


@dataclass(frozen=True)
class Disagreement:
    """Names pair `blendshape` with `by_name`, geometry with `by_geometry` (None: with nothing); geometry is heeded."""

    blendshape: str
    by_name: str | None
    by_geometry: str | None
    words: str


def symmetry_report(rig: Rig) -> SymmetryReport:
    """How symmetric the neutral and each blendshape are about the plane that mirrors the neutral best."""
    plane = find_mirror_plane(rig.neutral[rig.skin])
    partners = skin_partners(rig, plane)
    every = np.linalg.norm(plane.reflect(rig.neutral) - rig.neutral[partners], axis=1)
    apart = every[rig.skin]
    p95 = float(np.percentile(apart, 95))
    judged = rig.skin | (every <= max(p95, LOPSIDED_MM))
    return SymmetryReport(
        plane=plane,
        tilt_degrees=float(np.degrees(np.arccos(min(1.0, abs(plane.normal[0]))))),
        partners=partners,
        neutral_median_mm=float(np.median(apart)),
        neutral_p95_mm=p95,
        neutral_max_mm=float(apart.max()),
        blendshapes=mirror_images(rig, plane, partners, possible_partners(rig, plane, partners, p95), judged),
    )


def skin_partners(rig: Rig, plane: Plane) -> Int[np.ndarray, " v"]:
    """The mirror image of each vertex: of skin among the skin, of what else there is among the rest, since hair that
    lies on a brow is no brow."""
    partners = np.arange(len(rig.neutral))
    for some in (rig.skin, ~rig.skin):
        at = np.flatnonzero(some)
        if len(at):
            partners[at] = at[partner_map(rig.neutral[at], plane, tie=TIE_MM)]
    return partners


def possible_partners(
    rig: Rig, plane: Plane, partners: Int[np.ndarray, " v"], p95: float
) -> tuple[Int[np.ndarray, "v n"], Bool[np.ndarray, "v n"]]:
    """Vertices that may be the mirror image of each vertex, and which of them are: the partner alone on a symmetric
    neutral with what lies in one place with it, else all of its kind within `p95` millimetres of the reflection."""
    if p95 <= LOPSIDED_MM:
        away, twins = KDTree(rig.neutral).query(rig.neutral[partners], k=min(TWINS, len(partners)))
        near = np.column_stack([partners, twins])
        twin = (away <= TIE_MM) & (rig.skin[twins] == rig.skin[partners][:, None])
        return near, np.column_stack([np.ones(len(near), dtype=bool), twin])
    near = np.repeat(partners[:, None], 1 + NEAREST, axis=1)
    allowed = np.zeros(near.shape, dtype=bool)
    allowed[:, 0] = True
    for some in (rig.skin, ~rig.skin):
        at = np.flatnonzero(some)
        if len(at) > NEAREST:
            away, found = KDTree(rig.neutral[at]).query(plane.reflect(rig.neutral[at]), k=NEAREST)
            near[at, 1:], allowed[at, 1:] = at[found], away <= p95
    return near, allowed


def mirror_images(
    rig: Rig,
    plane: Plane,
    partners: Int[np.ndarray, " v"],
    possible: tuple[Int[np.ndarray, "v n"], Bool[np.ndarray, "v n"]],
    judged: Bool[np.ndarray, " v"],
) -> tuple[MirrorImage, ...]:
    """For each blendshape its partner, else the one whose mirror image it comes nearest to, and how far off it is."""
    k = len(rig.names)
    d = rig.deltas[:, judged].reshape(k, -1)
    D = plane.turn(rig.deltas[:, partners[judged]]).reshape(k, -1)
    # |d - D|^2 = |d|^2 + |D|^2 - 2 <d, D>
    squares = (d.astype(float) ** 2).sum(axis=1)[:, None] + (D.astype(float) ** 2).sum(axis=1)
    off = np.sqrt(np.clip(2 * (squares - 2 * (d @ D.T).astype(float)) / np.where(squares > 0, squares, 1), 0, None))
    other_half = halves(rig)
    single = np.array([name not in other_half for name in rig.names])
    images = []
    for i, name in enumerate(rig.names):
        if name in other_half:
            j = rig.names.index(other_half[name])
        else:
            j = int(np.argmin(np.where(single, off[i], np.inf)))
            j = i if off[i, i] <= off[i, j] + 1e-6 else j
        largest = np.linalg.norm(rig.deltas[i], axis=1).max()
        if largest == 0:
            images.append(MirrorImage(name, name, 0.0, 0.0))
            continue
        missing = least_difference(rig.deltas[i], rig.deltas[j], plane, possible)
        percent = round(
            percent_off(missing[judged], d[i], D[j]), 2
        )  # `off` is a difference of large numbers, in single precision
        worst = float(np.linalg.norm(missing, axis=1)[rig.skin].max() / largest)
        partner = rig.names[j] if percent < NO_IMAGE else None
        images.append(MirrorImage(name, partner, percent, round(100 * worst, 1)))
    return tuple(images)


def least_difference(
    d: Float[np.ndarray, "v 3"],
    other: Float[np.ndarray, "v 3"],
    plane: Plane,
    possible: tuple[Int[np.ndarray, "v n"], Bool[np.ndarray, "v n"]],
) -> Float[np.ndarray, "v 3"]:
    """d[v] less the mirrored delta of the possible partner of v that comes nearest to it."""
    near, allowed = possible
    apart = d[:, None].astype(float) - plane.turn(other.astype(float)[near])
    best = np.where(allowed, (apart**2).sum(axis=2), np.inf).argmin(axis=1)
    return apart[np.arange(len(d)), best]


def halves(rig: Rig) -> dict[str, str]:
    """The partner of each half of a movement."""
    return {name: partner for pair in blendshape_pairs(rig) for name, partner in (pair, pair[::-1])}


def percent_off(missing: Float[np.ndarray, "v 3"], a: Float[np.ndarray, " n"], b: Float[np.ndarray, " n"]) -> float:
    """|missing| of the root mean square length of a and b."""
    a, b = a.astype(float), b.astype(float)
    length = np.sqrt((a @ a + b @ b) / 2)
    return float(100 * np.linalg.norm(missing) / length) if length > 0 else 0.0


def pair_disagreements(rig: Rig, images: tuple[MirrorImage, ...]) -> tuple[Disagreement, ...]:
    """Where the names of a rig say other partners or other sides than its geometry, in the rig's order; `images` are
    the mirror images of all its blendshapes.

    MetaHuman's eyeLookLeftL shows why geometry comes first: its mirror image is eyeLookRightR, not eyeLookLeftR.
    """
    geometry = halves(rig)
    lateral = dict(zip(rig.names, laterality(rig).tolist(), strict=True))
    found = []
    for name, image in zip(rig.names, images, strict=True):
        named = [other for other in rig.names if other != name and other in other_names(name)]
        own = geometry.get(name)
        if named and own not in named and side_of(name) is not None:
            found.append(Disagreement(name, named[0], own, _other_partner(image, named)))
        elif own is not None and not named and side_of(name) != side_of(own):
            words = f"{name} and {own} are mirror images by shape; their names do not say so"
            found.append(Disagreement(name, None, own, words))
        side: Side | None = side_of(name)
        moves: Side = "left" if lateral[name] > 0 else "right"
        if own is not None and side is not None and side != moves:
            words = f"{name} is called {side} and moves the subject's {moves}"
            found.append(Disagreement(name, named[0] if named else None, own, words))
    return tuple(found)


def _other_partner(image: MirrorImage, named: list[str]) -> str:
    """How the partner by name of a blendshape differs from the one by shape, in words."""
    name, other = image.blendshape, image.partner
    message = f"{name} and {named[0]} are partners by name"
    if other in named:
        return f"{message}; they mirror each other, and are no halves of one movement by shape"
    shape = "none" if other is None else "its own" if other == name else other
    return f"{message}; by shape the mirror image of {name} is {shape}"
