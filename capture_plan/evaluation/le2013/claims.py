"""What Le et al. 2013 observe, held against the numbers of one take; where it does not hold, why, as far as we found.

Each line begins with "holds here" or "does not hold here" and carries the number that decides.
"""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from capture_plan.evaluation.le2013.evaluation import Evaluation
from capture_plan.evaluation.le2013.methods import METHODS, MIRRORED, NESTED, OURS, PAPER, RIG

CLOSE, LITTLE = (
    1.05,
    1.12,
)  # of the error: what we call close (Fig. 5) and a little (Fig. 7), where the paper has no number
SETTLED = 0.05  # of the whole descent
USUAL = 5  # iterations that the paper needs at most


def claims(found: Evaluation) -> list[str]:
    """One line for each observation, in the order of the figures."""
    parts = (descent, more_markers, rim, symmetry, _inside, recovery, between_people, rivals, in_use, unseen, skin)
    return [line for part in parts for line in part(found)]


def descent(found: Evaluation) -> list[str]:
    """What fig. 3 says of the descent, held against the evaluation."""
    rows, soon = [np.array(row) for row in found.descents.errors_mm], USUAL * found.descents.markers + 1
    late = max((row[:soon].min() - row.min()) / (row[0] - row.min()) for row in rows)
    after = np.concatenate([row[soon - 1 :] for row in rows])
    steps = np.concatenate([np.diff(row) for row in rows])
    uphill = np.mean(steps[steps != 0] > 0)
    ends = [row[-1] for row in rows]
    return [
        _claim(
            f"the published algorithm has come down within {USUAL} iterations (Fig. 3): {100 * late:.0f} % of a "
            f"start's descent came later at most; its starts end between {min(ends):.3f} and {max(ends):.3f} mm with "
            f"M = {found.descents.markers}, {100 * uphill:.0f} % of the moves go uphill",
            bool(late < SETTLED),
            f"it wanders between {after.min():.3f} and {after.max():.3f} mm from then on",
        )
    ]


def more_markers(found: Evaluation) -> list[str]:
    """What figs. 6 and 12 say of more markers, held against the evaluation."""
    lines = []
    for name in (OURS, PAPER):
        values = [found.rmse_mm(name, n) for n in found.counts]
        words = f"more markers leave less error (Figs. 6 and 12; {name}): {_listed(values)} mm"
        lines.append(_claim(words, all(a > b for a, b in pairwise(values))))
    return lines


def rim(found: Evaluation) -> list[str]:
    """What fig. 4 says of a held rim, held against the evaluation."""
    gains = [1 - one.held_mm / one.loose_mm for one in found.rims]
    return [
        _claim(
            f"holding the rim helps (Fig. 4): {_percents(gains)} less error",
            min(gains) > 0,
            f"most of the mesh moves: only {found.held} of {found.vertices:,} vertices are held",
        )
    ]


def symmetry(found: Evaluation) -> list[str]:
    """What fig. 5 says of symmetric layouts, held against the evaluation."""
    costs = [found.rmse_mm(MIRRORED, n) / found.rmse_mm(OURS, n) for n in found.counts]
    apart = max(one.apart_mm for one in found.symmetry)
    return [
        _claim(
            f"symmetry costs under {100 * (CLOSE - 1):.0f} % (Fig. 5: close): {_percents([c - 1 for c in costs])}; the "
            f"markers lie up to {apart:.1f} mm from the free ones on average",
            max(costs) < CLOSE,
            f"{100 * found.uneven:.0f} % of the movement is not that of its mirror image",
        )
    ]


def _inside(found: Evaluation) -> list[str]:
    """What fig. 7 says of layouts inside the next, held against the evaluation."""
    costs = [found.rmse_mm(NESTED, n) / found.rmse_mm(OURS, n) for n in found.counts]
    return [
        _claim(
            f"layouts inside the next cost a little (Fig. 7): {_percents([c - 1 for c in costs])}",
            min(costs) >= 1 - 1e-6 and max(costs) < LITTLE,
            "the search for free layouts ended in a worse one" if min(costs) < 1 else "",
        )
    ]


def recovery(found: Evaluation) -> list[str]:
    """What fig. 9 says of simulated layouts found again, held against the evaluation."""
    runs = found.recoveries
    exact = sum(one.hit == one.markers for one in runs)
    worst = max(one.rmse_mm for one in runs)
    return [
        _claim(
            f"simulated layouts are found again (Fig. 9: nearly): {exact} of {len(runs)} to the last marker, the worst "
            f"leaves {worst:.3f} mm",
            exact == len(runs),
            f"{max(one.markers - one.hit for one in runs)} markers of one layout stand beside their place, where "
            "neither one move nor two at once gain",
        )
    ]


def between_people(found: Evaluation) -> list[str]:
    """What fig. 10 says of layouts of other people, held against the evaluation."""
    if found.subjects is None:
        return []
    rows = found.subjects.left_out
    more = [one.others_mm / one.own_mm - 1 for one in rows]
    worse = [one for one in rows if one.others_mm >= one.random_mm]
    return [
        _claim(
            f"layouts from other people serve a person (Fig. 10): {100 * np.mean(more):.0f} % more error than with an "
            f"own layout on average, {100 * max(more):.0f} % at worst; random ones have "
            f"{100 * np.mean([one.random_mm / one.own_mm - 1 for one in rows]):.0f} % more",
            not worse,
            f"{worse[0].subject} does better with random layouts of {worse[0].markers} markers" if worse else "",
        )
    ]


def rivals(found: Evaluation) -> list[str]:
    """What figs. 11 and 12 say of other methods, held against the evaluation."""
    m = found.counts
    names = [name for name in METHODS if name not in (OURS, MIRRORED, PAPER)]
    best = [min((found.rmse_mm(name, n), name) for name in names) for n in m]
    lines = []
    for title, own in (("the published algorithm", PAPER), ("ours", OURS)):
        shares = [found.rmse_mm(own, n) / mm for n, (mm, _) in zip(m, best, strict=True)]
        words = f"{title} beats the baselines at every M (Figs. 11 and 12): {_percents(shares)} of the best one's error"
        lines.append(_claim(words, max(shares) < 1, f"{best[int(np.argmax(shares))][1]} is the better one"))
    shares = [found.rmse_mm(OURS, n) / found.rmse_mm(PAPER, n) for n in m]
    return [*lines, _claim(f"ours beats the published algorithm: {_percents(shares)} of its error", max(shares) < 1)]


def in_use(found: Evaluation) -> list[str]:
    """Fig. 12: each layout that people use beside ours of no more markers."""
    names = {*METHODS, NESTED, RIG}
    used = [one for one in found.scored if one.method not in names and one.markers >= found.counts[0]]
    if not used:
        return []
    no_more = {one: max(n for n in found.counts if n <= one.markers) for one in used}
    beaten = [one for one, n in no_more.items() if found.rmse_mm(OURS, n) >= one.rmse_mm]
    shares = [found.rmse_mm(OURS, n) / one.rmse_mm for one, n in no_more.items()]
    return [
        _claim(
            f"ours beats the layouts that people use, with no more markers (Fig. 12): {_percents(shares)} of "
            "their error",
            not beaten,
            f"{beaten[0].method} is the better one" if beaten else "",
        )
    ]


def unseen(found: Evaluation) -> list[str]:
    """What fig. 13 says of unseen frames, held against the evaluation."""
    best = {n: min((one for one in found.folds if one.markers == n), key=lambda one: one.mean_mm) for n in found.counts}
    own = {one.markers: one for one in found.folds if one.method == OURS}
    more = [own[n].mean_mm / float(np.mean(own[n].chosen_from_mm)) - 1 for n in found.counts]
    lost = [one.method for one in best.values() if one.method != OURS]
    return [
        _claim(
            f"on unseen frames ours beats the others (Fig. 13); it errs {_percents(more)} more there than on the "
            "frames it was chosen from",
            not lost,
            f"{lost[0]} carries over better" if lost else "",
        )
    ]


def skin(found: Evaluation) -> list[str]:
    """What table 4 says of stored takes, held against the evaluation."""
    lost = [one.markers for one in found.skinning if not one.corrected_mm < one.key_points_mm < one.markers_mm]
    ratios = [one for one in found.skinning if not one.markers_ratio > one.key_points_ratio > one.corrected_ratio]
    return [
        _claim(
            "fitted corrections beat fitted key points, and both beat markers alone (Table 4: compression of a known "
            "take, no prediction)",
            not lost,
            f"with M = {_listed(lost, 'd')} there are as many vectors as the take has movements: nothing is left",
        ),
        _claim("markers alone are the smallest, corrections the largest of the three (Table 4)", not ratios),
    ]


def _claim(words: str, holds: bool, because: str = "") -> str:
    reason = f" ({because})" if because and not holds else ""
    return f"{'holds' if holds else 'does not hold'} here: {words}{reason}"


def _percents(shares: Sequence[float]) -> str:
    return ", ".join(f"{100 * share:.0f}" for share in shares) + " %"


def _listed(values: Sequence[float], form: str = ".3f") -> str:
    return ", ".join(f"{value:{form}}" for value in values)
