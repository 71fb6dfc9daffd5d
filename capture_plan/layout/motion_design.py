"""Landmarks for a recorded take, under the constraints of the settings (Le et al. 2013).

Data       takes of one or several people, the sites that constraints leave open, pins, spacing, mirrored pairs, M
Model      min RMSE of the thin shell that M landmarks bend (`shell.takes`), by `shell.optimise`
Mirror     a symmetric layout is chosen for every frame and its mirror image (section 4.6), on the skin that either
           moves; what is stated of it is the error of the take as recorded
Caps       a region with too many keeps its most telling landmarks and is closed to others; then all are placed anew
Unlike     as many landmarks as stand too near another layout lose their places, the least telling first; then likewise
The order of the answer begins with the landmark, or pair, that tells most of the take; pins where it does not bend the
shell come last.
"""

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.sparse import csr_array

from capture_plan.errors import InfeasibleError
from capture_plan.layout.constraint_rows import Limit
from capture_plan.layout.constraints import touching
from capture_plan.layout.problem import Task
from capture_plan.layout.record import MotionFit, SubjectFit
from capture_plan.shell.elimination_order import order_of
from capture_plan.shell.motion import TAIL_MM
from capture_plan.shell.optimise import MarkerProblem, optimise
from capture_plan.shell.takes import Takes


def sites_for(task: Task, takes: Takes) -> Int[np.ndarray, " n"]:
    """The sites of the landmarks that leave the least error of the take, the most telling first.

    Raises:
        InfeasibleError: there is no room for so many under the constraints.
    """
    pinned = pinned_sites(task)
    seen = takes.mirrored(task.face.mirror) if task.settings.symmetric else takes
    open_ = np.isin(np.arange(len(task.sites.size)), task.open_)
    caps, unlike = [limit for limit in task.limits if limit.most], [one for one in task.limits if one.most is None]
    while True:
        chosen = most_telling(task, takes, _place(task, seen, pinned, open_), pinned)
        over = [limit for limit in caps if limit.shortfall(chosen) and limit.amount[chosen].sum() > (limit.most or 0)]
        closed = [near_idle(task, limit, chosen, pinned) for limit in unlike if limit.shortfall(chosen)]
        if not over and not np.any(closed):
            break
        for limit in over:
            open_ &= (limit.amount == 0) | within_limits(limit, chosen)
        for sites in closed:
            open_ &= ~sites
    for limit in task.limits:
        if limit.shortfall(chosen):
            raise InfeasibleError(f"{limit.name}: the take's layout cannot keep it: ask for less, or another method")
    return chosen


def pinned_sites(task: Task) -> Int[np.ndarray, " p"]:
    """The site of each pin."""
    pins = task.face.pinned(task.settings)
    return np.flatnonzero(np.isin(task.sites.vertices, pins).any(axis=1))


def within_limits(limit: Limit, chosen: Int[np.ndarray, " n"]) -> Bool[np.ndarray, " s"]:
    """The first of the chosen sites, as many as the limit allows."""
    within = np.cumsum(limit.amount[chosen]) <= (limit.most or 0)
    return np.isin(np.arange(len(limit.amount)), chosen[within])


def near_idle(
    task: Task, limit: Limit, chosen: Int[np.ndarray, " n"], pinned: Int[np.ndarray, " p"]
) -> Bool[np.ndarray, " s"]:
    """Candidate sites around the least informative landmarks, of which none counts for a constraint, where that
    constraint needs more landmarks."""
    idle = chosen[(limit.amount[chosen] == 0) & ~np.isin(chosen, pinned)][::-1]
    enough = np.cumsum(task.sites.size[idle]) - task.sites.size[idle] < limit.shortfall(chosen)
    spared, settings = task.sites.members(idle[enough]), task.settings
    near = task.face.around(spared, max(settings.spacing_mm, settings.dot_mm))
    return touching(task.sites, near) & (limit.amount == 0)


def _place(
    task: Task, takes: Takes, pinned: Int[np.ndarray, " p"], open_: Bool[np.ndarray, " s"]
) -> Int[np.ndarray, " m"]:
    """The optimiser's answer as vertices of the rig, with all pins."""
    face, settings, pins, first = task.face, task.settings, task.sites.members(pinned), takes.first
    count = settings.number or settings.budget
    assert count is not None, "settings of this method carry a number"
    may = np.zeros(len(face.rig.neutral), dtype=bool)
    may[task.sites.vertices[open_]] = True
    bending, near = first.places(pins), None
    if task.spacing:
        near = near_of(task.spacing.near, first.at, settings.spacing_mm)
        may &= ~face.around(pins, settings.spacing_mm)
        if task.met is not None:
            near = near + csr_array(task.met[first.at][:, first.at])
            may[task.met[pins].indices] = False
    problem = MarkerProblem(
        [(one.shell, one.motion) for one in takes.subjects],
        candidates=may[first.at] & first.candidates,
        pinned=bending.tolist(),
        spacing=near,
        mirror=mirror_of(face.mirror, first.at) if settings.symmetric else None,
    )
    result = optimise(problem, count - len(pins) + len(bending))
    return np.union1d(first.at[list(result.markers)], pins)


def most_telling(
    task: Task, takes: Takes, vertices: Int[np.ndarray, " m"], pinned: Int[np.ndarray, " p"]
) -> Int[np.ndarray, " n"]:
    """The sites of vertices, the first to be spared last and pinned ones first; last those that bend nothing."""
    at, bending = takes.first.at, takes.first.places(vertices)
    order, _ = order_of(takes.summaries(bending), np.isin(at[bending], task.sites.members(pinned)))
    site_of = {int(v): s for s, pair in enumerate(task.sites.vertices.tolist()) for v in pair}
    messages = [*at[bending[order]].tolist(), *vertices.tolist()]
    return np.array(list(dict.fromkeys(site_of[v] for v in messages)), dtype=int)


def near_of(near: csr_array, at: Int[np.ndarray, " n"], radius_mm: float) -> csr_array:
    """Pairs of the vertices `at` that are nearer to each other than a radius."""
    some = csr_array(near[at][:, at])
    row = np.repeat(np.arange(len(at)), np.diff(some.indptr))
    close = some.data < radius_mm
    return csr_array((some.data[close], (row[close], some.indices[close])), shape=some.shape)


def mirror_of(mirror: Int[np.ndarray, " v"], at: Int[np.ndarray, " n"]) -> Int[np.ndarray, " n"]:
    """The mirror image of each vertex of `at`; where that lies elsewhere, a vertex whose image is another."""
    place = np.full(len(mirror), -1)
    place[at] = np.arange(len(at))
    image = place[mirror[at]]
    lost = image < 0
    image[lost] = (np.flatnonzero(lost) + 1) % len(at)
    return image


def fit_of(takes: Takes, used: tuple[str, ...], vertices: Int[np.ndarray, " m"], *, ordered: bool) -> MotionFit:
    """What takes of `used` blendshapes lose when only landmarks at `vertices` are recorded; with the first 1, 2, ...
    where they are `ordered`."""
    errors = takes.errors(vertices, range(1, len(vertices) + 1) if ordered else (len(vertices),))
    shell, weights = takes.first.shell, takes.first.motion.weights
    return MotionFit(
        frames=takes.frames,
        vertices=int((weights > 0).sum()),
        rank=max(one.motion.compressed(TAIL_MM).rows.shape[1] for one in takes.subjects),
        tail_mm=TAIL_MM,
        rmse_mm=round(errors[-1], 5),
        curve_mm=rounded(np.array(errors)) if ordered else (),
        boundary=int(shell.fixed.sum()),
        stretching=shell.stretching,
        bending=shell.bending,
        missing=takes.missing(used),
        subjects=subject_fits(takes, vertices),
        notes=takes.notes,
    )


def subject_fits(takes: Takes, vertices: Int[np.ndarray, " m"]) -> tuple[SubjectFit, ...]:
    """The error of each person, where there are several."""
    if len(takes.subjects) == 1:
        return ()
    H = takes.first.places(vertices)
    return tuple(
        SubjectFit(
            sequences=tuple(recording.sequence.name for recording in one.recordings),
            frames=one.frames,
            rmse_mm=round(float(np.sqrt(one.squared_error(H) / one.motion.weights.sum())), 5),
        )
        for one in takes.subjects
    )


def rounded(errors: Float[np.ndarray, " m"]) -> tuple[float, ...]:
    """As they stand in a plan, millimetres."""
    return tuple(np.round(errors, 5).tolist())
