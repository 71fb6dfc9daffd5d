"""The number of landmarks against epsilon (Zell & McDonnell 2022, section 3.2 and fig. 3, right).

Epsilon is what decides how many landmarks a cover has: the higher it is, the fewer vertices can stand for a blendshape.
For each epsilon, three covers of the same sites, spacing left aside:

    fewest       min sum_s n[s] f[s]                       with its proven lower bound
    paper        min sum_s f[s] sum_k c w                  eq. 5a: the number is what comes out
    best places  the fewest, and among those the best mean quality
"""

from collections.abc import Sequence

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from capture_plan.layout.face import Face
from capture_plan.layout.multicover import best_cover
from capture_plan.layout.settings import LayoutSettings
from capture_plan.progress import track

EPSILONS = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)


class EpsilonRow(Struct, frozen=True, forbid_unknown_fields=True):
    """Landmarks of the three covers at one epsilon; `bound`: no cover has fewer. `vertices` are those of the best
    places, `paper_vertices` those of the paper's sum. `uncovered` blendshapes have no candidate at this epsilon."""

    epsilon: float
    fewest: int
    bound: int
    proven_optimal: bool
    vertices: tuple[int, ...]
    paper_vertices: tuple[int, ...]
    uncovered: tuple[str, ...]


def epsilon_sweep(face: Face, settings: LayoutSettings, epsilons: Sequence[float] = EPSILONS) -> tuple[EpsilonRow, ...]:
    """One row an epsilon, in ascending order; `settings` say the rest.

    Raises:
        InfeasibleError: no skin is seen well enough.

    Example:
        >>> rows = epsilon_sweep(see_face(sample_rig()), LayoutSettings(), (0.3, 0.5))
        >>> [(row.fewest, row.bound, row.proven_optimal) for row in rows]
        [(9, 9, True), (12, 12, True)]
    """
    sites = face.sites(replace(settings, method="cover"))
    everywhere, rows = np.arange(len(sites.visibility)), []
    for epsilon in track(sorted(epsilons), "Covering for every epsilon"):
        covered = sites.covers(epsilon).any(axis=1)
        at = np.flatnonzero(covered)
        fewest, best, paper = (
            best_cover(sites, replace(settings, epsilon=epsilon, weights=weights), at, everywhere, None)
            for weights in ("count", "lexicographic", "paper")
        )
        rows.append(
            EpsilonRow(
                epsilon=epsilon,
                fewest=int(sites.size[fewest.chosen].sum()),
                bound=int(np.ceil(fewest.bound - 1e-9)),
                proven_optimal=fewest.proven_optimal,
                vertices=tuple(sites.members(best.chosen).tolist()),
                paper_vertices=tuple(sites.members(paper.chosen).tolist()),
                uncovered=tuple(face.used[k] for k in np.flatnonzero(~covered)),
            )
        )
    return tuple(rows)
