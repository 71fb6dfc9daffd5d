"""Layouts side by side: the same face, the same candidates, the same performance, the same noise, the same solver.

Candidates every vertex of moving skin, hidden or not, as 68 points stand on lip rims too; ours worn, studio and
           Zell22 keep to skin that is seen well enough
Ours       at every budget M the least upper estimate, designed for every noise (any candidate, as the others); the
           best of these polished for the settings' noise on mixes of seeds of its own (`polish`): error-driven, free;
           and as a crew wears it (what a plan gives: mirrored, at the spacing, every blendshape on a landmark); the
           studio layout at the number of landmarks that it settles on itself
Bound      the upper estimate that no layout of M candidates is below (`relaxation`)
Zell22     single set cover of Zell & McDonnell 2022 over epsilon, the paper's weights and fewest landmarks first
Others     `baselines` at every budget M
Empirical  the layouts that studios use (`empirical`), placed on this face, and layouts given by vertex number
Measured   weights and skin that come back (`reconstruct`) from random mixes, from every blendshape alone, and from a
           recorded take where one is given
Take       ours as a crew wears it, chosen for the take (`by_motion`); what every layout loses of it (`shell.takes`)
"""

from collections.abc import Sequence
from itertools import product

import numpy as np
from jaxtyping import Float, Int
from msgspec import Struct
from msgspec.structs import replace

from capture_plan.curves.random_mixes import random_mixes
from capture_plan.errors import InfeasibleError, RigError
from capture_plan.evaluation.baselines import BASELINES, choose_baseline, must_have
from capture_plan.evaluation.identifiability import blind_spots
from capture_plan.layout.budget import spend_budget
from capture_plan.layout.design import design_layout
from capture_plan.layout.exchange import Search
from capture_plan.layout.face import Face
from capture_plan.layout.farthest import candidates
from capture_plan.layout.lower_bound import error_bound
from capture_plan.layout.methods import within_budget
from capture_plan.layout.motion_design import sites_for
from capture_plan.layout.multicover import best_cover
from capture_plan.layout.polish import polish
from capture_plan.layout.problem import task_of
from capture_plan.layout.settings import LayoutSettings
from capture_plan.layout.sites import Sites, single_sites
from capture_plan.layout.weight_recovery import Score, reconstruct, single_blendshapes
from capture_plan.progress import track
from capture_plan.registration.empirical_layouts import empirical_layout, place_layout
from capture_plan.registration.known import EMPIRICAL
from capture_plan.shell.takes import Takes

BUDGETS = (12, 18, 28, 34, 40, 68)
NOISES_MM = (0.0, 0.2, 0.5, 1.0)
EPSILONS = (0.3, 0.5, 0.7, 0.9)
FRAMES = 300
APART = 10_000  # seeds of what ours are polished on lie this far from the seed of what all are measured by
FREE, WORN, STUDIO = "ours: error-driven, free", "ours: error-driven, worn", "ours: studio"
FOR_TAKE = "ours: for the take, worn"
PLACED = ", placed"  # after the name of an empirical layout: we laid its points onto this face
MIXES, SINGLES, TAKE = "random mixes", "single blendshapes", "take"


class Row(Struct, frozen=True, forbid_unknown_fields=True):
    """One layout: its vertices, what they distinguish, the upper estimate (`Observation.error`, weights of any size) at
    the noise that ours are designed for, the blendshapes that move none of them by epsilon, and for each performance
    one score a noise, of weights solved between 0 and 1 and, beside it, of any size; `lost_mm` is what a
    thin shell that they bend misses of the take, root mean square."""

    method: str
    vertices: tuple[int, ...]
    rank: int
    condition: float
    upper_mm: float
    blind: tuple[str, ...]
    scores: dict[str, tuple[Score, ...]]
    lost_mm: float | None = None

    @property
    def landmarks(self) -> int:
        """How many landmarks the layout has."""
        return len(self.vertices)


class Comparison(Struct, frozen=True, forbid_unknown_fields=True):
    """All layouts of one rig, by number of landmarks; `frames` of every performance; `left_out`: what could not be
    compared, and why; ours are designed for noise `designed_mm`; `lost_mm` is over `take_frames`. No layout of a
    budget's candidates has an upper estimate below its bound in `least_mm`, millimetres."""

    rig: str
    blendshapes: int
    designed_mm: float
    epsilon: float
    budgets: tuple[int, ...]
    least_mm: tuple[float, ...]
    full_rank: int
    candidates: int
    noises_mm: tuple[float, ...]
    frames: dict[str, int]
    rows: tuple[Row, ...]
    left_out: tuple[str, ...]
    take_frames: int = 0


def compare_layouts(
    face: Face,
    settings: LayoutSettings,
    *,
    budgets: Sequence[int] = BUDGETS,
    noises_mm: Sequence[float] = NOISES_MM,
    given: dict[str, np.ndarray] | None = None,
    take: Float[np.ndarray, "t k"] | None = None,
    takes: Takes | None = None,
    seed: int = 0,
) -> Comparison:
    """Every layout under every noise. `given` are layouts by vertex of the rig, `take` weights of the used blendshapes,
    `takes` the same or meshes as a thin shell is held against them.

    Raises:
        InfeasibleError: no skin is seen well enough, or a budget is larger than the number of candidates.

    Example:
        >>> rig = sample_rig()
        >>> face = see_face(rig, rig.names[:6])
        >>> found = compare_layouts(face, LayoutSettings(), budgets=(6,), noises_mm=(0.2,))
        >>> max(found.rows, key=lambda row: len(row.vertices)).method
        '72 points (MPEG-4), placed'
    """
    observation, subset = face.observation(settings.noise_mm, settings.dot_mm), candidates(face)
    must_have(subset, max(budgets))
    k = len(face.used)
    performances = {MIXES: random_mixes(k, frames=FRAMES, seed=seed), SINGLES: single_blendshapes(k)}
    if take is not None:
        performances[TAKE] = take
    layouts, left_out = fixed_layouts(face, settings, given or {})
    sites = every_site(face)
    for budget in track(sorted(budgets), "Designing for every budget"):
        layouts += _ours(face, settings, sites, budget, noises_mm=noises_mm, seed=seed)
        layouts += for_take(face, settings, budget, takes) if takes else []
    for name, budget in track(tuple(product(BASELINES, sorted(budgets))), "Laying out the baselines"):
        layouts.append((name, choose_baseline(name, subset, budget, seed)))

    rows = []
    for method, vertices in track(sorted(layouts, key=lambda one: len(one[1])), "Measuring every layout"):
        information, blind = observation.information(vertices), blind_spots(face, settings, vertices)
        scores = {
            name: tuple(
                reconstruct(observation, face.used, vertices, truth, noise_mm=noise, seed=seed) for noise in noises_mm
            )
            for name, truth in performances.items()
        }
        lost = round(takes.error(vertices), 5) if takes else None
        at = tuple(vertices.tolist())
        rows.append(Row(method, at, information.rank, information.condition, information.error_mm, blind, scores, lost))
    return Comparison(
        rig=face.rig.name,
        blendshapes=k,
        designed_mm=settings.noise_mm,
        epsilon=settings.epsilon,
        budgets=tuple(sorted(budgets)),
        least_mm=tuple(error_bound(observation, sites, budget=budget).error_mm for budget in sorted(budgets)),
        full_rank=observation.full_rank,
        candidates=len(subset.vertices),
        noises_mm=tuple(noises_mm),
        frames={name: len(truth) for name, truth in performances.items()},
        rows=tuple(rows),
        left_out=tuple(left_out),
        take_frames=takes.frames if takes else 0,
    )


Named = tuple[str, Int[np.ndarray, " m"]]


def fixed_layouts(face: Face, settings: LayoutSettings, given: dict[str, np.ndarray]) -> tuple[list[Named], list[str]]:
    """Layouts that settle their own number of landmarks, and why others are missing."""
    studio = design_layout(face, replace(settings, method="studio"))
    layouts = [(STUDIO, np.array([one.vertex for one in studio.landmarks])), *given.items()]
    for epsilon, weights in product(EPSILONS, ("paper", "lexicographic")):
        one = replace(settings, method="cover", symmetric=False, epsilon=epsilon, weights=weights)
        sites = face.sites(one)
        rows = np.flatnonzero(sites.covers(epsilon).any(axis=1))
        cover = best_cover(sites, one, rows, np.arange(len(sites.visibility)), None)
        name = "paper's weights" if weights == "paper" else "fewest first"
        layouts.append((f"Zell22: {name}, epsilon {epsilon:g}", sites.members(cover.chosen)))
    left_out = []
    for key in EMPIRICAL:
        title = empirical_layout(key).title
        try:
            layouts.append((f"{title}{PLACED}", np.unique(place_layout(face.rig, key).vertices)))
        except RigError as error:
            left_out.append(f"{title}: {error}")
    return layouts, left_out


def least_upper(noise_mm: float) -> str:
    """The name of the layouts that were designed for a noise and nothing else."""
    return f"ours: least upper estimate at {noise_mm:g} mm"


def every_site(face: Face) -> Sites:
    """All moving skin, seen or not, one landmark a site; no blendshape must be covered."""
    return single_sites(np.zeros((len(face.used), len(face.moving_skin))), face.visibility, face.moving_skin)


def _ours(
    face: Face, settings: LayoutSettings, sites: Sites, budget: int, *, noises_mm: Sequence[float], seed: int
) -> list[Named]:
    """The error-driven layouts of a budget; worn ones only where pairs and spacing allow.

    Raises:
        InfeasibleError: there are fewer candidates.
    """
    nothing, nobody = np.zeros((0, len(sites.size)), dtype=bool), np.empty(0, dtype=int)
    search = Search(face.observation(settings.noise_mm, settings.dot_mm), sites, nothing, None, budget)
    designed = {
        noise: spend_budget(face.observation(noise), sites, nothing, nobody, budget=budget, spacing=None)
        for noise in sorted({*noises_mm, settings.noise_mm} - {0.0})
    }
    polished = polish(search, [tuple(one.tolist()) for one in designed.values()], seed=seed + APART)
    layouts = [(FREE, sites.members(np.array(polished, dtype=int)))]
    layouts += [(least_upper(noise), sites.members(chosen)) for noise, chosen in designed.items()]
    try:
        return [*layouts, (WORN, error_driven(face, settings, budget))]
    except InfeasibleError:
        return layouts


def for_take(face: Face, settings: LayoutSettings, budget: int, takes: Takes) -> list[Named]:
    """The layout of a budget that loses least of a take; none where pairs and spacing have no room for so many."""
    try:
        task = task_of(face, replace(settings, method="motion", number=budget))
        return [(FOR_TAKE, task.sites.members(sites_for(task, takes)))]
    except InfeasibleError:
        return []


def error_driven(face: Face, settings: LayoutSettings, budget: int) -> Int[np.ndarray, " m"]:
    """At most `budget` vertices with the least upper estimate found at `settings.noise_mm`, all constraints kept."""
    task = task_of(face, replace(settings, method="budget", budget=budget))
    return task.sites.members(within_budget(task, None)[1])
