"""A comparison as lines to read: the table with the best of every budget marked, and who wins where."""

from collections.abc import Callable, Sequence

from capture_plan.evaluation.baselines import BASELINES
from capture_plan.evaluation.compare import MIXES, PLACED, SINGLES, TAKE, Comparison, Row, least_upper

LOST = "lost"


def comparison_text(found: Comparison) -> str:
    """The whole page. Stars mark the lowest number of each column among layouts of as many landmarks."""
    head = [
        f"{found.rig}: {found.blendshapes} blendshapes, {found.candidates:,} vertices of moving skin are "
        "everybody's candidates, hidden ones too; ours worn, studio and Zell22 keep to skin that is seen",
        "Root mean square error of the skin in millimetres that comes back when weights are solved between 0 and 1, by "
        f"noise of a landmark coordinate, over {found.frames[MIXES]} {MIXES}; single: each blendshape alone"
        + (f"; take: {found.frames[TAKE]:,} recorded frames" if TAKE in found.frames else ""),
        "upper: the estimate that search, budgets and bounds speak of, for weights of any size; unbounded: what comes "
        "back when weights of any size are solved for",
        f"upper, unbounded, largest, weights, single, take and worst (largest error of its weight) at "
        f"{design_noise(found):g} mm",
        *lost_head(found),
        "",
    ]
    left_out = [f"left out: {why}" for why in found.left_out]
    return "\n".join([*head, *_table(found), "", *verdicts(found), *left_out])


def lost_head(found: Comparison) -> list[str]:
    """What the last column is, where there is a take."""
    if not found.take_frames:
        return []
    return [
        f"lost: millimetres (root mean square) that a thin shell bent by the layout misses of the take's "
        f"{found.take_frames:,} frames"
    ]


def design_noise(found: Comparison) -> float:
    """The noise that single columns are given at: the one that ours are designed for, or the nearest."""
    return min(found.noises_mm, key=lambda noise: abs(noise - found.designed_mm))


def _columns(found: Comparison) -> dict[str, Callable[[Row], float]]:
    """Titles and numbers, the lower the better."""
    n = found.noises_mm.index(design_noise(found))

    def rmse(performance: str, i: int) -> Callable[[Row], float]:
        return lambda row: row.scores[performance][i].rmse_mm

    numbers = {f"{noise:g} mm": rmse(MIXES, i) for i, noise in enumerate(found.noises_mm)}
    numbers |= {
        "upper": lambda row: row.upper_mm,
        "unbounded": lambda row: row.scores[MIXES][n].unbounded.rmse_mm,
        "largest": lambda row: row.scores[MIXES][n].max_mm,
        "weights": lambda row: row.scores[MIXES][n].weight_mae,
        SINGLES.split()[0]: rmse(SINGLES, n),
    }
    numbers |= {TAKE: rmse(TAKE, n)} if TAKE in found.frames else {}
    return numbers | ({LOST: lost_of} if found.take_frames else {})


def lost_of(row: Row) -> float:
    """What a row loses of the take, millimetres."""
    assert row.lost_mm is not None, "there is a take"
    return row.lost_mm


def _table(found: Comparison) -> list[str]:
    """One line a layout, the budgets apart."""
    numbers, n = _columns(found), found.noises_mm.index(design_noise(found))
    wide = max(len(row.method) for row in found.rows)
    lines = [f"{'M':>3}  {'layout':<{wide}}  {'rank':>4} " + "".join(f"{title:>10}" for title in numbers) + "  worst"]
    before = 0
    for row in found.rows:
        peers = [peer for peer in found.rows if peer.landmarks == row.landmarks]
        cells = ""
        for value in numbers.values():
            best = len(peers) > 1 and value(row) == min(value(peer) for peer in peers)
            cells += f"{value(row):>9.3f}{'*' if best else ' '}"
        if row.landmarks != before and len(peers) > 1:
            lines.append("")
        before = row.landmarks
        worst = row.scores[MIXES][n].worst
        lines.append(f"{row.landmarks:>3}  {row.method:<{wide}}  {row.rank:>4} {cells}  {worst}")
    return [*lines, foot(found)]


def foot(found: Comparison) -> str:
    """What the ranks are of, and which layouts reach all that there is to reach."""
    short = sum(row.rank < found.full_rank for row in found.rows)
    all_of = f"all of the skin identifies {found.full_rank} of {found.blendshapes}"
    relative = f"{short} of {len(found.rows)} layouts do not reach that" if short else "every layout reaches that"
    return f"     rank: independent mixes of blendshapes that a layout identifies; {all_of}, {relative}"


def is_ours(row: Row) -> bool:
    """Whether we chose the layout."""
    return row.method.startswith("ours")


def verdicts(found: Comparison) -> list[str]:
    """Who wins where, in sentences."""
    known = [row for row in found.rows if not is_ours(row) and row.method not in BASELINES]
    lines = [duels(found, budget) for budget in found.budgets]
    lines += [from_the_best(found, budget, least) for budget, least in zip(found.budgets, found.least_mm, strict=True)]
    lines += [least_lost(found, budget) for budget in found.budgets]
    lines += [_fewest(found, row) for row in known if row.method.endswith(PLACED)]
    lines += [blind_to(found, row) for row in known]
    return [line for some in lines for line in some]


def duels(found: Comparison, budget: int) -> list[str]:
    """The best of ours against the best of the others of a budget, under each noise."""
    peers = [row for row in found.rows if row.landmarks == budget]
    if not any(map(is_ours, peers)):
        return []
    lines = []
    for i, noise in enumerate(found.noises_mm):
        if noise > 0:
            ranked = sorted(peers, key=lambda row: row.scores[MIXES][i].rmse_mm)
            mine, other = (next(row for row in ranked if is_ours(row) == own) for own in (True, False))
            lines.append(f"M = {budget}, {noise:g} mm: {duel(mine, other, i)}")
    return lines


def blind_to(found: Comparison, row: Row) -> list[str]:
    """The blendshapes that no landmark of a layout sees."""
    return [f"{row.method} is blind at epsilon {found.epsilon:g}: {', '.join(row.blind)}"] if row.blind else []


def least_lost(found: Comparison, budget: int) -> list[str]:
    """Which layout of a budget loses least of the take, and which of others."""
    peers = [row for row in found.rows if row.landmarks == budget]
    if not found.take_frames or not peers:
        return []
    best = min(peers, key=lost_of)
    other = min((row for row in peers if row.method != best.method), key=lost_of, default=None)
    after = f"; next {other.method}, {lost_of(other):.3f} mm" if other else ""
    return [f"M = {budget}: {best.method} loses least of the take, {lost_of(best):.3f} mm{after}"]


def from_the_best(found: Comparison, budget: int, least_mm: float) -> list[str]:
    """How far the least upper estimate of a budget can be from the best, by the proved bound."""
    name = least_upper(found.designed_mm)
    error = next((row.upper_mm for row in found.rows if (row.method, row.landmarks) == (name, budget)), None)
    if error is None or not least_mm:
        return []
    return [
        f"M = {budget}: no layout has an upper estimate below {least_mm:.3f} mm at {found.designed_mm:g} mm noise; "
        f"ours {error:.3f} mm, at most {error / least_mm - 1:.1%} from the best"
    ]


def duel(mine: Row, other: Row, i: int) -> str:
    """Ours against the best of the others at noise number `i`."""
    a, b = mine.scores[MIXES][i].rmse_mm, other.scores[MIXES][i].rmse_mm
    if a <= b:
        return f"{mine.method} is lowest, {a:.3f} mm; next {other.method}, {b:.3f} mm"
    return f"{other.method} is lower, {b:.3f} mm; {mine.method} {a:.3f} mm"


def _fewest(found: Comparison, other: Row) -> list[str]:
    """How many landmarks of ours do what an empirical layout does, at the noise that ours are designed for."""
    i = found.noises_mm.index(design_noise(found))
    limit = other.scores[MIXES][i].rmse_mm
    enough: Sequence[int] = [
        row.landmarks for row in found.rows if is_ours(row) and row.scores[MIXES][i].rmse_mm <= limit
    ]
    what = f"{other.method}: {limit:.3f} mm at {found.noises_mm[i]:g} mm noise"
    if enough:
        return [f"{what}; ours does as well with {min(enough)} landmarks, of the budgets compared"]
    return [f"{what}; ours does not reach it with any budget compared"]
