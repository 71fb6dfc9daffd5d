"""An evaluation as lines to read: tables, and which of the paper's claims hold on this take."""

from collections.abc import Sequence

import numpy as np

from capture_plan.evaluation.le2013.claims import claims
from capture_plan.evaluation.le2013.evaluation import Evaluation
from capture_plan.evaluation.le2013.methods import METHODS, MIRRORED, NESTED, RIG
from capture_plan.sequence.record import UNUSED
from capture_plan.shell.motion import TAIL_MM

LISTED = 6  # names in one sentence
SHOWN_MM = 0.001  # the last digit of an error
NO_SUBJECTS = "no other people: give their rigs to see whether a layout passes from one person to another (section 6.2)"
ABOUT_SHELLS = "every person bends a shell of their own while layouts are chosen"
PAPERS_RECOVERY = (
    "the paper reports 0.167 to 0.228 mm for 40 to 80 markers, which our copy of its algorithm does not reach: its "
    "layouts, displacements and program are not public"
)


def motion_text(found: Evaluation) -> str:
    """The whole evaluation as a page of text."""
    head = [
        f"{found.rig}, {found.take}: {found.frames:,} frames; {found.vertices:,} vertices move or border on what "
        f"moves, {found.held} of them are held; root mean square movement {found.rest_mm:.2f} mm, of which "
        f"{found.motion_rank} movements hold all but 1 % or {TAIL_MM:g} mm",
        "Root mean square error in millimetres over all frames and vertices, markers without noise, one shell for all",
        "",
    ]
    parts = [errors, _views, variants, subjects, folds, recoveries, skins, claims]
    lines = [*head, *(line for part in parts for line in (*part(found), ""))]
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


def _views(found: Evaluation) -> list[str]:
    """What the layouts of most markers show of the rig."""
    m = found.counts[-1]
    lines = [f"of {found.used} blendshapes, {found.full_rank} mixes can be distinguished; with M = {m}"]
    for one in found.scored:
        if one.markers == m and one.method in methods(found):
            unseen = f", {len(one.unseen)} not seen: {_listed(one.unseen)}" if one.unseen else ", all seen"
            lines.append(f"{one.method}: tells {one.rank} mixes apart{unseen}")
    return lines


def variants(found: Evaluation) -> list[str]:
    """Held or loose, symmetric or free."""
    lines = ["rim of the motion held or not, markers in mirrored pairs or free, mm"]
    for rim, pairs in zip(found.rims, found.symmetry, strict=True):
        lines.append(
            f"M = {rim.markers}: {rim.held_mm:.3f} held, {rim.loose_mm:.3f} with nothing held; "
            f"{found.rmse_mm(MIRRORED, rim.markers):.3f} in pairs, {pairs.apart_mm:.1f} mm from the free markers"
        )
    return lines


def about_people(found: Evaluation) -> list[str]:
    """Who they are, and how layouts were chosen from several."""
    return [line for line in (found.about_subjects, ABOUT_SHELLS) if line] if found.subjects else [NO_SUBJECTS]


def subjects(found: Evaluation) -> list[str]:
    """Layouts from other people (section 6.2)."""
    if found.subjects is None:
        return about_people(found)
    lines = ["each person under a layout from the others, under an own one, and under one from all, mm"]
    lines += about_people(found)
    for one in found.subjects.left_out:
        gone = f", {one.fewer} markers of the others' have no place" if one.fewer else ""
        lines.append(
            f"M = {one.markers}, {one.subject}: {one.others_mm:.3f} from the others, {one.own_mm:.3f} own, "
            f"{one.all_mm:.3f} from all, {one.random_mm:.3f} random{gone}"
        )
    return lines


def folds(found: Evaluation) -> list[str]:
    """Frames that the layout was not chosen from."""
    return ["five parts, each rebuilt by a layout from the other four: mean and standard deviation, mm"] + [
        f"M = {one.markers}, {one.method}: {one.mean_mm:.3f} +- {one.sd_mm:.3f}, on the frames it was chosen from "
        f"{np.mean(one.chosen_from_mm):.3f}"
        for one in found.folds
    ]


def recoveries(found: Evaluation) -> list[str]:
    """How well simulated layouts were found again, a line each."""
    lines = ["simulated layouts, of random markers displaced by up to 10 mm, looked for again"]
    for m in found.counts:
        runs = [one for one in found.recoveries if one.markers == m]
        exact = sum(one.hit == m for one in runs)
        worst = max(one.rmse_mm for one in runs)
        apart = np.mean([one.apart_mm for one in runs])
        left = f"the worst leaves {worst:.3f} mm" if worst >= SHOWN_MM else f"none leaves {SHOWN_MM:g} mm"
        lines.append(
            f"M = {m}: {exact} of {len(runs)} found to the last vertex; {left}, markers {apart:.2f} mm apart on average"
        )
    one = found.published
    return [
        *lines,
        f"M = {one.markers} looked for by the published algorithm as we wrote it again, ten starts: {one.hit} found, "
        f"error {one.rmse_mm:.3f} mm; {PAPERS_RECOVERY}",
        "all of these are our figures, on simulations of our own",
    ]


def skins(found: Evaluation) -> list[str]:
    """Markers as a way to store the take; nothing held, as in the paper's Table 4."""
    head = (
        "the take stored as markers, mm (and how many times smaller); corrections (EigenSkin) and key points (KPSA) "
        "are fitted to this very take: they compress what is known and predict nothing from markers"
    )
    return [head] + [
        f"M = {one.markers}: markers {one.markers_mm:.4f} ({one.markers_ratio:.1f}), "
        f"with {one.rank} corrections {one.corrected_mm:.4f} ({one.corrected_ratio:.1f}), "
        f"key points {one.key_points_mm:.4f} ({one.key_points_ratio:.1f})"
        for one in found.skinning
    ]


def balance(found: Evaluation) -> list[str]:
    """What the take cannot teach (section 8)."""
    if not found.unperformed:
        return []
    return [
        f"the take hardly or never moves {len(found.unperformed)} of the rig's blendshapes (no weight above "
        f"{UNUSED:g}): {_listed(found.unperformed)}; a layout chosen from it owes them nothing: record them, or take "
        "the layout from the rig"
    ]


def _listed(names: Sequence[str]) -> str:
    """The first names, and how many more."""
    more = f" and {len(names) - LISTED} more" if len(names) > LISTED else ""
    return ", ".join(names[:LISTED]) + more


def _number(value: float) -> str:
    return f"{value:>10.3f}" if np.isfinite(value) else f"{'-':>10}"
