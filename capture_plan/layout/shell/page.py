"""An evaluation as lines to read: tables, and which of the paper's claims hold on this take."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from capture_plan.layout.shell.evaluate import METHODS, MIRRORED, NESTED, OURS, PAPER, RIG
from capture_plan.layout.shell.evaluation import Evaluation
from capture_plan.layout.shell.take import UNUSED

LISTED = 6  # names in one sentence


def motion_text(found: Evaluation) -> str:
    """The whole page."""
    head = [
        f"{found.rig}, {found.take}: {found.frames:,} frames; {found.vertices:,} vertices move or border on what "
        f"moves, {found.held} of them are held; root mean square movement {found.rest_mm:.2f} mm",
        "Root mean square error in millimetres over all frames and vertices, markers without noise, one shell for all",
        "",
    ]
    parts = [errors(found), views(found), variants(found), folds(found), recoveries(found), skins(found), claims(found)]
    lines = [*head, *(line for part in parts for line in (*part, ""))]
    return "\n".join([*lines, *balance(found), *(f"note: {note}" for note in found.notes)])


def methods(found: Evaluation) -> list[str]:
    """The methods that have a layout at every number of markers, in the order of the table."""
    return [
        name for name in (*METHODS, RIG, NESTED) if np.isfinite([found.rmse_mm(name, m) for m in found.counts]).any()
    ]


def errors(found: Evaluation) -> list[str]:
    """Methods by number of markers, then layouts with a number of their own."""
    names = methods(found)
    wide = max(map(len, names))
    rows = [(name, [found.rmse_mm(name, m) for m in found.counts]) for name in names]
    lines = [f"{'error, mm':<{wide}}" + "".join(f"{f'M = {m}':>10}" for m in found.counts)]
    lines += [f"{name:<{wide}}" + "".join(_number(value) for value in values) for name, values in rows]
    others = [one for one in found.scored if one.method not in names]
    for one in others:
        gone = f", {one.left_out} of its points left out where nothing moves" if one.left_out else ""
        lines.append(f"{one.method}: {one.rmse_mm:.3f} mm with {one.markers} markers{gone}")
    return lines


def views(found: Evaluation) -> list[str]:
    """What the layouts of most markers show of the rig."""
    m = found.counts[-1]
    lines = [f"of {found.used} blendshapes, {found.full_rank} mixes can be told apart; with M = {m}"]
    for one in found.scored:
        if one.markers == m and one.method in methods(found):
            unseen = f", {len(one.unseen)} not seen: {listed(one.unseen)}" if one.unseen else ", all seen"
            lines.append(f"{one.method}: tells {one.rank} mixes apart{unseen}")
    return lines


def variants(found: Evaluation) -> list[str]:
    """Held or loose."""
    return ["rim of the motion, mm"] + [
        f"M = {one.markers}: {one.held_mm:.3f} held, {one.loose_mm:.3f} with nothing held" for one in found.rims
    ]


def folds(found: Evaluation) -> list[str]:
    """Frames that the layout was not chosen from."""
    return ["five parts, each rebuilt by a layout from the other four: mean and standard deviation, mm"] + [
        f"M = {one.markers}, {one.method}: {one.mean_mm:.3f} +- {one.sd_mm:.3f}, on the frames it was chosen from "
        f"{np.mean(one.chosen_from_mm):.3f}"
        for one in found.folds
    ]


def recoveries(found: Evaluation) -> list[str]:
    """Simulated layouts looked for."""
    lines = ["simulated layouts, of random markers displaced by up to 10 mm, looked for again"]
    for m in found.counts:
        runs = [one for one in found.recoveries if one.markers == m]
        exact = sum(one.hit == m for one in runs)
        low, high = min(one.rmse_mm for one in runs), max(one.rmse_mm for one in runs)
        apart = np.mean([one.apart_mm for one in runs])
        lines.append(
            f"M = {m}: {exact} of {len(runs)} found to the last vertex; error {low:.3f} to {high:.3f} mm, "
            f"markers {apart:.2f} mm apart on average"
        )
    return lines


def skins(found: Evaluation) -> list[str]:
    """Markers as a way to store the take; nothing held, as in the paper's Table 4."""
    head = "the take stored as markers, mm (and how many times smaller); the last two are fitted to this very take"
    return [head] + [
        f"M = {one.markers}: markers {one.markers_mm:.3f} ({one.markers_ratio:.1f}), "
        f"with {one.rank} corrections {one.corrected_mm:.3f} ({one.corrected_ratio:.1f}), "
        f"key points {one.key_points_mm:.3f} ({one.key_points_ratio:.1f})"
        for one in found.skinning
    ]


def claims(found: Evaluation) -> list[str]:
    """What Le et al. 2013 observe, and whether these numbers say the same."""
    m = found.counts
    rivals = [name for name in METHODS if name not in (OURS, MIRRORED, PAPER)]
    own = [found.rmse_mm(OURS, n) for n in m]
    published = [found.rmse_mm(PAPER, n) for n in m]
    best = [min(found.rmse_mm(name, n) for name in rivals) for n in m]
    folded = {(one.method, one.markers): one.mean_mm for one in found.folds}
    exact = [np.mean([one.hit == n for one in found.recoveries if one.markers == n]) for n in m]
    spread = [row[-1] for row in found.descents_mm]
    uphill = sum(b > a * (1 + 1e-9) for row in found.descents_mm for a, b in pairwise(row))
    return [
        _claim("more markers leave less error", _falls(own)),
        _claim("the published algorithm beats the baselines at every M", _below(published, best)),
        _claim("ours beats the baselines at every M", _below(own, best)),
        _claim("ours beats the published algorithm at every M", _below(own, published)),
        _claim("holding the rim helps (Fig. 4)", all(one.held_mm < one.loose_mm for one in found.rims)),
        _claim(
            "symmetry costs under 5 % (Fig. 5: close)",
            all(found.rmse_mm(MIRRORED, n) < 1.05 * found.rmse_mm(OURS, n) for n in m),
        ),
        _claim(
            "layouts inside the next cost a little (Fig. 7)",
            all(found.rmse_mm(OURS, n) <= found.rmse_mm(NESTED, n) * (1 + 1e-6) for n in m),
        ),
        _claim(
            "on unseen frames, ours beats the others (Fig. 13)",
            all(folded[OURS, n] <= min(mm for (_, k), mm in folded.items() if k == n) for n in m),
        ),
        _claim("simulated layouts are found again, to the last marker (Fig. 9: nearly)", bool(min(exact) == 1)),
        _claim(
            "corrected markers beat key points (Table 4)",
            all(one.corrected_mm < one.key_points_mm < one.markers_mm for one in found.skinning),
        ),
        f"the published descent ends between {min(spread):.3f} and {max(spread):.3f} mm with M = {m[0]} "
        f"(Fig. 3), {uphill} of its iterations ended higher than they began",
    ]


def balance(found: Evaluation) -> list[str]:
    """What the take cannot teach (section 8)."""
    if not found.unperformed:
        return []
    return [
        f"the take lacks {len(found.unperformed)} blendshapes (no weight above {UNUSED:g}): "
        f"{listed(found.unperformed)}; a layout chosen from it owes them nothing: record them, or take the layout "
        "from the rig"
    ]


def listed(names: Sequence[str]) -> str:
    """The first names, and how many more."""
    more = f" and {len(names) - LISTED} more" if len(names) > LISTED else ""
    return ", ".join(names[:LISTED]) + more


def _claim(words: str, holds: bool) -> str:
    return f"{'holds' if holds else 'does not hold'} here: {words}"


def _falls(values: Sequence[float]) -> bool:
    return all(a > b for a, b in pairwise(values))


def _below(some: Sequence[float], others: Sequence[float]) -> bool:
    return all(a < b for a, b in zip(some, others, strict=True))


def _number(value: float) -> str:
    return f"{value:>10.3f}" if np.isfinite(value) else f"{'-':>10}"
