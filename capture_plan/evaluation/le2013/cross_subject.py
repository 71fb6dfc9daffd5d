"""Do layouts pass from person to person: Le et al. 2013, sections 4.7 and 6.2, Figs. 8 and 10.

Data       subjects d = 1..D, each on a mesh of its own; map_d, a vertex of d for each of the first or none
Sites      vertices of the first that every map gives a vertex of its own that may carry a marker
Numbering  each mesh with its vertices of the sites first, in one order, and as many vertices as the largest: a strip
           beside the face, held still, that counts nothing fills it up
Model      min over H of sum_d E_d(map_d(H)): each subject on its own shell, E_d its mean over frames and vertices
Left out   a layout from all others, put onto d by map_d, beside one of d's own and one from all
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from msgspec import Struct
from scipy.spatial import KDTree

from capture_plan.errors import RigError
from capture_plan.evaluation.le2013.methods import METHODS, RANDOM_NAME, motion_error, optimised, tail_of
from capture_plan.progress import track
from capture_plan.registration.correspondence import correspond
from capture_plan.shell.model import Shell
from capture_plan.shell.motion import Motion
from capture_plan.shell.optimise import MarkerProblem, optimise
from capture_plan.shell.subjects import Subject
from capture_plan.shell.take import Take

EXTENT_MM = 10.0  # a vertex that lies further from the skin of a subject has no partner there
STRIP = 3  # vertices of the smallest strip


class LeftOut(Struct, frozen=True):
    """A subject rebuilt from a layout of the others, of its own, of all, and from random ones; millimetres.

    `fewer` markers of the others' layout have no place where the subject moves.
    """

    subject: str
    markers: int
    others_mm: float
    own_mm: float
    all_mm: float
    random_mm: float
    fewer: int


class Shared(Struct, frozen=True):
    """A layout from all subjects, by vertices of the first one's rig; `rmse_mm` over all of them."""

    markers: int
    vertices: tuple[int, ...]
    rmse_mm: float


class CrossSubject(Struct, frozen=True):
    """What was measured between subjects."""

    left_out: tuple[LeftOut, ...]
    shared: tuple[Shared, ...]


@dataclass(frozen=True, eq=False)
class OnFirst:
    """A subject's take, and its vertex for each of the first subject's shell; -1 where it has none."""

    take: Take
    map: Int[np.ndarray, " v"]


def on_first(first: Take, other: Take) -> OnFirst:
    """A subject, each vertex of the first laid onto the nearest of the subject's shell.

    Subjects on one mesh share its vertices; otherwise the first's head is laid onto the other's.

    Raises:
        RigError: the two heads cannot be laid onto each other.
    """
    apart, nearest = KDTree(other.shell.vertices).query(laid(first, other))
    return OnFirst(other, np.where(apart < EXTENT_MM, nearest, -1))


def laid(first: Take, other: Take) -> Float[np.ndarray, "v 3"]:
    """Where the first's shell lies on the other head, millimetres."""
    if np.array_equal(first.rig.triangles, other.rig.triangles):
        return other.rig.neutral[first.at]
    at, places = correspond(first.rig, other.rig).head
    # skin that is no part of the laid surface goes where the nearest that is goes
    return places[KDTree(first.rig.neutral[at]).query(first.shell.vertices)[1]]


def cross_subject(takes: Sequence[Take], counts: Sequence[int]) -> CrossSubject:
    """Every subject left out once, and the layouts from all, on the first one.

    Raises:
        RigError: there is one subject alone, or two heads cannot be laid onto each other.
        InfeasibleError: there is no room for so many markers that all share.
    """
    subjects = [on_first(takes[0], take) for take in takes]
    if len(subjects) < 2:
        raise RigError(f"{len(subjects)} subject: give at least two to leave one out")
    shared, left_out = [], []
    for count in counts:
        H, rmse_mm = layout_of(subjects, count)
        shared.append(Shared(count, tuple(takes[0].at[H].tolist()), rmse_mm))
        each = track(range(len(subjects)), f"Subjects left out, {count} markers")
        left_out += [_leave_out(subjects, d, count, H) for d in each]
    return CrossSubject(tuple(left_out), tuple(shared))


def _leave_out(subjects: Sequence[OnFirst], d: int, count: int, of_all: Int[np.ndarray, " m"]) -> LeftOut:
    """Subject d under a layout from all others."""
    tested = subjects[d]
    H, _ = layout_of([one for n, one in enumerate(subjects) if n != d], count)
    there = _placed(tested, H)
    take = tested.take
    draws = METHODS[RANDOM_NAME](take, take.motion, count)
    own = optimised(take.shell, take, count)
    return LeftOut(
        subject=take.rig.name,
        markers=count,
        others_mm=motion_error(take.shell, take.motion, there),
        own_mm=own.rmse_mm,
        all_mm=motion_error(take.shell, take.motion, _placed(tested, of_all)),
        random_mm=float(np.mean([motion_error(take.shell, take.motion, one) for one in draws])),
        fewer=count - len(there),
    )


def _placed(subject: OnFirst, markers: Int[np.ndarray, " m"]) -> Int[np.ndarray, " n"]:
    """The subject's vertices of markers on the first that may carry one, each once."""
    there = np.unique(subject.map[markers])
    return there[(there >= 0) & subject.take.candidates[there]]


def layout_of(subjects: Sequence[OnFirst], count: int) -> tuple[Int[np.ndarray, " m"], float]:
    """The layout that leaves these subjects the least error together, on the first's shell, and its RMSE (mm)."""
    sites = sites_of_all(subjects)
    size = max(len(one.take.at) for one in subjects) + STRIP
    group = [renumbered(one.take, one.map[sites], size) for one in subjects]
    tail_mm = min(tail_of(one.take.motion) for one in subjects)
    found = optimise(MarkerProblem(group, np.arange(size) < len(sites), tail_mm=tail_mm), count)
    return sites[list(found.markers)], found.rmse_mm


def sites_of_all(subjects: Sequence[OnFirst]) -> Int[np.ndarray, " n"]:
    """Vertices of the first that stand for one vertex of each subject, where it may carry a marker."""
    may = np.ones(len(subjects[0].map), dtype=bool)
    for one in subjects:
        once = np.zeros(len(may), dtype=bool)
        once[np.unique(one.map, return_index=True)[1]] = True
        may &= once & (one.map >= 0) & one.take.candidates[one.map]
    return np.flatnonzero(may)


def renumbered(take: Take, leading: Int[np.ndarray, " n"], size: int) -> Subject:
    """Shell and motion with some vertices first and `size` in all."""
    v = len(take.at)
    order = np.concatenate([leading, np.setdiff1d(np.arange(v), leading)])
    n, more = np.argsort(order), size - v
    i = np.arange(more, dtype=float)
    strip = take.shell.vertices.max(axis=0) + np.stack([i, i % 2, np.zeros(more)], axis=1)
    of_strip = v + np.arange(more - 2)[:, None] + np.arange(3)
    shell = Shell(
        np.vstack([take.shell.vertices[order], strip]),
        np.vstack([n[take.shell.triangles], of_strip]),
        np.r_[take.shell.fixed[order], np.ones(more, dtype=bool)],
    )
    rows = np.vstack([take.motion.rows[order], np.zeros((more, take.motion.rows.shape[1]))])
    return shell, Motion(rows, np.r_[np.full(v, 1 / v), np.zeros(more)])
