"""Landmarks for a recorded take, under the wishes of the settings (Le et al. 2013).

Data       a take, the sites that wishes leave open, pins, spacing, mirrored pairs, M
Model      min RMSE of the thin shell that M landmarks bend (`take`), by `shell.optimise`
Caps       a region with too many keeps its most telling landmarks and is closed to others; then all are placed anew
The order of the answer begins with the landmark, or pair, that tells most of the take.
"""

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.sparse import csr_array

from capture_plan.errors import InfeasibleError
from capture_plan.layout.limits import Limit
from capture_plan.layout.record import MotionFit
from capture_plan.layout.shell.motion import TAIL_MM
from capture_plan.layout.shell.optimise import Result, optimise
from capture_plan.layout.take import Skin, Take, skin_of
from capture_plan.layout.task import Task
from capture_plan.rig import Rig


def sites_for(task: Task, take: Take) -> Int[np.ndarray, " n"]:
    """The sites of the landmarks that leave the least error of the take, the most telling first.

    Raises:
        InfeasibleError: there is no room for so many under the wishes.
    """
    pinned = pinned_sites(task)
    skin = skin_of(task.face.rig, take, task.sites.members(pinned))
    open_ = np.isin(np.arange(len(task.sites.size)), task.open_)
    caps = [limit for limit in task.limits if limit.most]
    while True:
        chosen = place(task, skin, pinned, open_)
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
    task: Task, skin: Skin, pinned: Int[np.ndarray, " p"], open_: Bool[np.ndarray, " s"]
) -> Int[np.ndarray, " n"]:
    """The optimiser's answer as sites."""
    face, settings, sites = task.face, task.settings, task.sites
    count = settings.number or settings.budget
    assert count is not None, "settings of this method carry a number"
    may = np.zeros(len(face.rig.neutral), dtype=bool)
    may[sites.vertices[open_]] = True
    result = optimise(
        skin.shell,
        skin.motion,
        count,
        candidates=skin.marks(may),
        kept=skin.places(sites.members(pinned)).tolist(),
        spacing=near_of(face.near(settings.spacing_mm), skin.at, settings.spacing_mm) if settings.spacing_mm else None,
        mirror=mirror_of(face.mirror, skin.at) if settings.symmetric else None,
    )
    return in_sites(task, skin.at[list(result.order)], result)


def in_sites(task: Task, order: Int[np.ndarray, " m"], result: Result) -> Int[np.ndarray, " n"]:
    """The sites of vertices, in their order."""
    site_of = {int(v): s for s, pair in enumerate(task.sites.vertices.tolist()) for v in pair}
    assert len(order) == len(result.markers), "the order names every marker"
    return np.array(list(dict.fromkeys(site_of[v] for v in order.tolist())), dtype=int)


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


def fit_of(rig: Rig, take: Take, vertices: Int[np.ndarray, " m"], *, ordered: bool) -> MotionFit:
    """What a take loses when only landmarks at `vertices` are recorded; with the first 1, 2, ... where they are
    `ordered`."""
    skin = skin_of(rig, take, vertices)
    markers = skin.places(vertices)
    counts = range(1, len(markers) + 1) if ordered else (len(markers),)
    errors = skin.errors(markers, counts)
    return MotionFit(
        frames=take.frames,
        vertices=int((skin.motion.weights > 0).sum()),
        rank=skin.motion.compressed(TAIL_MM).rows.shape[1],
        tail_mm=TAIL_MM,
        rmse_mm=round(errors[-1], 5),
        curve_mm=rounded(np.array(errors)) if ordered else (),
        boundary=int(skin.shell.fixed.sum()),
        stretching=skin.shell.stretching,
        bending=skin.shell.bending,
        missing=take.missing,
    )


def error_of(rig: Rig, take: Take, vertices: Int[np.ndarray, " m"]) -> float:
    """What a take loses when only landmarks at `vertices` are recorded, RMSE in millimetres."""
    skin = skin_of(rig, take, vertices)
    markers = skin.places(np.unique(vertices))
    return round(skin.errors(markers, (len(markers),))[0], 5)


def rounded(errors: Float[np.ndarray, " m"]) -> tuple[float, ...]:
    """As they stand in a plan, millimetres."""
    return tuple(np.round(errors, 5).tolist())
