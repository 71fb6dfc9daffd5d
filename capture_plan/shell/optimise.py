"""Marker optimisation: the few vertices whose motion bends a thin shell into all the others (Le et al. 2013).

Data       shell, motion of one or several subjects (`Subject`); M markers; pinned vertices; near[u, v] vertices too
           close along the skin for two markers; candidates
Variables  H, M vertices
Model      min E(H) = sum_v s_v |Y_v - W_v Y_H|^2,   pinned in H in candidates,  no two of H near
Method     add the vertex that leaves the least error until there are M, then move one marker at a time to its best
           place until no move of one marker gains (`search`). Every score is exact and no step goes uphill

    problem = MarkerProblem([(shell, motion)], candidates=moving)     of several subjects a pair each
    result = optimise(problem, 80)                                    -> Result
    results = nested(problem, (40, 60, 80, 100))
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Int
from scipy.sparse import csr_array

from capture_plan.shell.elimination_order import order_of, summary_of
from capture_plan.shell.motion import TAIL_MM
from capture_plan.shell.search import MarkerSearch
from capture_plan.shell.sites import MarkerSites
from capture_plan.shell.subjects import Subject


@dataclass(frozen=True)
class Result:
    """A layout: `markers` as placed, pinned ones first; in `order` the least needed ones are last.

    All errors are root mean squares over all vertices and frames of the motion as given, millimetres: `rmse_mm` of the
    layout, `curve_mm[m - 1]` of the first m of `order`, `greedy_mm` of the layout before any of its `swaps`, the moves
    of a marker. `seen_mm` alone is over the strongest rows, which the search saw: `rmse_mm` is at most 1 % above it.
    `rmse_mm` is never above `greedy_mm`. More markers are better on recorded motion, not by law: each holds its vertex
    to that vertex's own track and takes the neighbours along, which hurts where neighbours move apart.
    """

    markers: tuple[int, ...]
    rmse_mm: float
    seen_mm: float
    order: tuple[int, ...]
    curve_mm: tuple[float, ...]
    greedy_mm: float
    swaps: int


@dataclass(frozen=True, eq=False)
class MarkerProblem:
    """Motions of one or several subjects on one topology, each with its own shell, and where markers may stand.

    `candidates` may carry one, `pinned` do in any case. `spacing` is `near_table` of the skin at the least distance
    between two markers, `mirror` the mirror image of each vertex where the layout is to be symmetric, and
    `with_mirror_image` the motion for that. The search begins on rows that leave out `tail_mm`, millimetres.
    """

    subjects: Sequence[Subject]
    candidates: Bool[np.ndarray, " v"]
    pinned: Sequence[int] = ()
    spacing: csr_array | None = None
    mirror: Int[np.ndarray, " v"] | None = None
    tail_mm: float = TAIL_MM

    def search(self) -> MarkerSearch:
        """A layout of the pinned markers alone, to be grown."""
        return MarkerSearch(
            self.subjects, MarkerSites(self.candidates, self.spacing, self.mirror), self.pinned, self.tail_mm
        )


def optimise(problem: MarkerProblem, count: int, *, joint: bool = False) -> Result:
    """`count` markers, the pinned ones among them, none of which alone could be moved for the better; `joint` moves
    neighbouring markers in twos at last.

    Raises:
        InfeasibleError: there is no room for so many.

    Example:
        >>> rig = sample_rig()
        >>> take = face_take(rig, read_sequence("take.csv", rig=rig))
        >>> found = optimise(MarkerProblem([(take.shell, take.motion)], take.candidates), 6)
        >>> len(found.markers), found.rmse_mm <= found.greedy_mm
        (6, True)
    """
    search = problem.search()
    search.grow(count)
    search.finish(joint=joint)
    return _result(search)


def nested(problem: MarkerProblem, counts: Sequence[int]) -> tuple[Result, ...]:
    """One layout for each count, each a part of the next (Le et al. 2013, section 4.6): only new markers are moved."""
    search = problem.search()
    results = []
    for count in sorted(counts):
        search.grow(count)
        search.finish(joint=False)
        results.append(_result(search))
        search.pinned = count
    return tuple(results)


def _result(search: MarkerSearch) -> Result:
    """The layout as it stands, its errors on all that was given."""
    markers, total = search.state.markers, sum(motion.weights.sum() for _, motion in search.given)
    H = np.array(markers, dtype=int)
    parts = [summary_of(shell, motion, H) for shell, motion in search.given]
    order, errors = order_of(parts, np.arange(len(H)) < search.pinned)
    curve = np.sqrt(np.maximum(errors, 0) / total)
    return Result(
        markers=tuple(markers),
        rmse_mm=float(curve[-1]),
        seen_mm=search.state.rmse_mm,
        order=tuple(H[order].tolist()),
        curve_mm=tuple(curve.tolist()),
        greedy_mm=search.greedy_mm,
        swaps=search.swaps,
    )
