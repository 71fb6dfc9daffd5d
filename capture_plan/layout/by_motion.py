"""Landmarks for a recorded take, under the wishes of the settings (Le et al. 2013).

Data       a take, the sites that wishes leave open, pins, spacing, mirrored pairs, M
Model      min RMSE of the thin shell that M landmarks bend (`shell.take`), by `shell.optimise`
Mirror     a symmetric layout is chosen for every frame and its mirror image (section 4.6), on the skin that either
           moves; what is stated of it is the error of the take as recorded
Caps       a region with too many keeps its most telling landmarks and is closed to others; then all are placed anew
The order of the answer begins with the landmark, or pair, that tells most of the take; pins where it does not bend the
shell come last.
"""

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.sparse import csr_array

from capture_plan.errors import InfeasibleError
from capture_plan.layout.limits import Limit
from capture_plan.layout.record import MotionFit
from capture_plan.layout.shell.importance import spare_order, summary
from capture_plan.layout.shell.motion import TAIL_MM
from capture_plan.layout.shell.optimise import optimise
from capture_plan.layout.shell.take import Take
from capture_plan.layout.task import Task


def sites_for(task: Task, take: Take) -> Int[np.ndarray, " n"]:
    """The sites of the landmarks that leave the least error of the take, the most telling first.

    Raises:
        InfeasibleError: there is no room for so many under the wishes.
    """
    pinned = pinned_sites(task)
    seen = take.mirrored(task.face.mirror) if task.settings.symmetric else take
    open_ = np.isin(np.arange(len(task.sites.size)), task.open_)
    caps = [limit for limit in task.limits if limit.most]
    while True:
        chosen = most_telling(task, take, place(task, seen, pinned, open_), pinned)
        over = [limit for limit in caps if limit.shortfall(chosen) and limit.amount[chosen].sum() > (limit.most or 0)]
        if not over:
            break
        for limit in over:
            open_ &= (limit.amount == 0) | kept_under(limit, chosen)
    for limit in task.limits:
        if limit.shortfall(chosen):
            raise InfeasibleError(f"{limit.name}: the take's layout cannot keep it: ask for less, or another method")
    return chosen


def pinned_sites(task: Task) -> Int[np.ndarray, " p"]:
    """The site of each pin."""
    pins = task.face.pinned(task.settings)
    return np.flatnonzero(np.isin(task.sites.vertices, pins).any(axis=1))


def kept_under(limit: Limit, chosen: Int[np.ndarray, " n"]) -> Bool[np.ndarray, " s"]:
    """The first of the chosen sites, as many as the limit allows."""
    within = np.cumsum(limit.amount[chosen]) <= (limit.most or 0)
    return np.isin(np.arange(len(limit.amount)), chosen[within])


def place(
    task: Task, take: Take, pinned: Int[np.ndarray, " p"], open_: Bool[np.ndarray, " s"]
) -> Int[np.ndarray, " m"]:
    """The optimiser's answer as vertices of the rig, with all pins."""
    face, settings, pins = task.face, task.settings, task.sites.members(pinned)
    count = settings.number or settings.budget
    assert count is not None, "settings of this method carry a number"
    may = np.zeros(len(face.rig.neutral), dtype=bool)
    may[task.sites.vertices[open_]] = True
    kept, near = take.places(pins), None
    if settings.spacing_mm:
        table = face.near(settings.spacing_mm)
        near = near_of(table, take.at, settings.spacing_mm)
        may[table[pins].indices[table[pins].data < settings.spacing_mm]] = False
    result = optimise(
        take.shell,
        take.motion,
        count - len(pins) + len(kept),
        candidates=may[take.at] & take.candidates,
        kept=kept.tolist(),
        spacing=near,
        mirror=mirror_of(face.mirror, take.at) if settings.symmetric else None,
    )
    return np.union1d(take.at[list(result.markers)], pins)


def most_telling(
    task: Task, take: Take, vertices: Int[np.ndarray, " m"], pinned: Int[np.ndarray, " p"]
) -> Int[np.ndarray, " n"]:
    """The sites of vertices, the first to be spared last and pinned ones first; last those that bend nothing."""
    bending = take.places(vertices)
    part, pins = summary(take.shell, take.motion, bending), task.sites.members(pinned)
    order, _ = spare_order([part], np.isin(take.at[bending], pins))
    site_of = {int(v): s for s, pair in enumerate(task.sites.vertices.tolist()) for v in pair}
    told = [*take.at[bending[order]].tolist(), *vertices.tolist()]
    return np.array(list(dict.fromkeys(site_of[v] for v in told)), dtype=int)


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


def fit_of(take: Take, used: tuple[str, ...], vertices: Int[np.ndarray, " m"], *, ordered: bool) -> MotionFit:
    """What a take of `used` blendshapes loses when only landmarks at `vertices` are recorded; with the first 1, 2, ...
    where they are `ordered`."""
    counts = range(1, len(vertices) + 1) if ordered else (len(vertices),)
    errors = take.errors(vertices, counts)
    return MotionFit(
        frames=take.frames,
        vertices=int((take.motion.weights > 0).sum()),
        rank=take.motion.compressed(TAIL_MM).rows.shape[1],
        tail_mm=TAIL_MM,
        rmse_mm=round(errors[-1], 5),
        curve_mm=rounded(np.array(errors)) if ordered else (),
        boundary=int(take.shell.fixed.sum()),
        stretching=take.shell.stretching,
        bending=take.shell.bending,
        missing=take.missing(used),
    )


def rounded(errors: Float[np.ndarray, " m"]) -> tuple[float, ...]:
    """As they stand in a plan, millimetres."""
    return tuple(np.round(errors, 5).tolist())
