"""Layouts for dense motion in a notebook: the take, other people, how many markers, and what the numbers say."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import marimo as mo

from capture_plan.evaluation.le2013 import methods
from capture_plan.evaluation.le2013.evaluation import COUNTS, PAPERS_COUNTS, Evaluation, People, counts_for
from capture_plan.evaluation.le2013.methods import Scored
from capture_plan.evaluation.le2013.other_subjects import made_up, people_of
from capture_plan.figures import Figure, Sitter, error_maps, nested_layouts
from capture_plan.notebooks_support.figures import show_table
from capture_plan.notebooks_support.frame import given_takes, is_sample, markdown_plain, working
from capture_plan.report.words import millimetres
from capture_plan.rig import Rig
from capture_plan.sample.motion import made_up_take
from capture_plan.sequence import Sequence, read_sequence
from capture_plan.shell.take import Take

MAPPED = {
    "Ours": methods.OURS,
    "As published": methods.PAPER,
    "MSLS-meshes": "MSLS-meshes (our reading)",
    "LS-meshes": "LS-meshes",
}


def chosen_take(rig: Rig) -> Sequence:
    """The first take given as `-- --take PATH`, else one that is made up."""
    with working():
        return read_sequence(given_takes()[0], rig=rig) if given_takes() else made_up_take(rig)


def other_people(rig: Rig) -> People | None:
    """The people given as `-- --subject PATH`, several allowed, who perform the take; made-up ones for the sample."""
    rigs = [str(path) for path in mo.cli_args().get_all("subject")]
    with working():
        if rigs:
            return people_of(rigs, next((Path(path) for path in given_takes()), None))
        return made_up(rig) if is_sample() else None


def marker_counts_knob(take: Take) -> Any:
    """How many markers are compared: at first the paper's numbers where the mesh is dense enough."""
    choices = {", ".join(map(str, counts)): counts for counts in (COUNTS, PAPERS_COUNTS)}
    return mo.ui.dropdown(choices, ", ".join(map(str, counts_for(take))), label="Markers")


def maps_of_methods(sitter: Sitter, take: Take, found: Evaluation) -> Figure:
    """Where the layouts of most markers err."""
    layouts = {title: _layout(found, name, found.counts[-1]) for title, name in MAPPED.items()}
    return error_maps(sitter, take, layouts)


def maps_of_counts(sitter: Sitter, take: Take, found: Evaluation) -> Figure:
    """Where ours err, by number of markers."""
    return error_maps(sitter, take, {f"M = {m}": _layout(found, methods.OURS, m) for m in found.counts})


def layouts_inside_the_next(sitter: Sitter, found: Evaluation) -> Figure:
    """Each layout inherits the markers of the one before; free ones below."""
    nested, free = ([_layout(found, name, m) for m in found.counts] for name in (methods.NESTED, methods.OURS))
    return nested_layouts(sitter, nested, free)


def people_table(found: Evaluation) -> mo.Html:
    """Each person with most markers."""
    assert found.subjects is not None, "there are other people"
    m = found.counts[-1]
    columns = ("From the others", "Own", "From all", "Random")
    return show_table(
        [
            {
                "Person": one.subject,
                "Markers": m - one.fewer,
                **dict(
                    zip(
                        columns,
                        map(millimetres, (one.others_mm, one.own_mm, one.all_mm, one.random_mm)),
                        strict=True,
                    )
                ),
            }
            for one in found.subjects.left_out
            if one.markers == m
        ],
        numbers=("Markers", *columns),
    )


def views_table(found: Evaluation) -> mo.Html:
    """The layouts of most markers, as seen by the motion and by the rig."""
    m = found.counts[-1]
    rows = sorted((one for one in found.scored if one.markers == m), key=lambda one: one.rmse_mm)
    return show_table(
        [
            {
                "Layout": one.method,
                "Error of the take": millimetres(one.rmse_mm),
                "Distinguished": f"{one.rank} of {found.full_rank}",
                "Not seen": len(one.unseen),
            }
            for one in rows
        ],
        numbers=("Error of the take", "Distinguished", "Not seen"),
    )


def skinning_table(found: Evaluation) -> mo.Html:
    """The take stored as markers: errors, and how many times smaller it is."""
    return show_table(
        [
            {
                "Markers": one.markers,
                "Markers alone": f"{one.markers_mm:.4f} mm, {one.markers_ratio:.1f} times smaller",
                f"Fitted corrections ({found.skinning[0].rank} to {found.skinning[-1].rank})": (
                    f"{one.corrected_mm:.4f} mm, {one.corrected_ratio:.1f} times"
                ),
                "Fitted key points": f"{one.key_points_mm:.4f} mm, {one.key_points_ratio:.1f} times",
            }
            for one in found.skinning
        ],
        numbers=("Markers",),
    )


def sentence_list(found: Evaluation, *parts: Callable[[Evaluation], list[str]]) -> mo.Html:
    """Sentences about the numbers, as a list."""
    lines = [line for part in parts for line in part(found)]
    return mo.md("\n".join(f"- {markdown_plain(line)}" for line in lines))


def _layout(found: Evaluation, method: str, markers: int) -> Scored:
    layout = found.layout(method, markers)
    assert layout is not None, "these methods have a layout of every number"
    return layout
