"""Thin-shell layouts on heads: what each constraint does to them, how they grow, and where the skin is missed."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from matplotlib.figure import Figure

from capture_plan.evaluation.le2013 import methods
from capture_plan.evaluation.le2013.evaluation import Evaluation
from capture_plan.evaluation.le2013.methods import Scored, vertex_errors
from capture_plan.figures.heads import ASPECT, Sitter
from capture_plan.figures.layouts import CAPTION_IN, DOT_PT2, GAP_IN, dots, show
from capture_plan.figures.maps import BAD, HeadMap, shared_maps_figure
from capture_plan.figures.style import OTHERS, OURS, SMALL_PT, TITLE_PT, WIDTH_IN, blank, caption, house
from capture_plan.sheets.view import FRONT
from capture_plan.shell.take import Take

TOP_SHARE = 0.99  # of the vertices whose error the scale of a map reaches
RED, GREEN, BLUE = OTHERS[0], OTHERS[1], OURS
ERROR = "error of each vertex, mm (rms over the frames)"
SMALL, SMALLEST = 0.4, 0.25  # of the area of a dot: the second leaves the dot below to be seen
SHOWN_ITERATIONS = 5  # Fig. 3
_Dots = tuple[Int[np.ndarray, " _"], str, float]  # vertices, colour, share of the usual area


@dataclass(frozen=True, eq=False)
class Dotted:
    """A head with dots in several colours, the last on top; a title above what is said of it."""

    title: str
    said: str
    layers: tuple[_Dots, ...]


def dotted_heads(sitter: Sitter, heads: Sequence[Dotted], *, columns: int = 4) -> Figure:
    """Heads from the front in rows, each above its title."""
    rows = -(-len(heads) // columns)
    width = (WIDTH_IN - (columns - 1) * GAP_IN) / columns
    height = width / ASPECT
    across = min(columns, len(heads)) * (width + GAP_IN) - GAP_IN
    with house():
        figure = blank(across, rows * (height + CAPTION_IN))
        for i, one in enumerate(heads):
            row, column = divmod(i, columns)
            left, top = column * (width + GAP_IN), row * (height + CAPTION_IN)
            axes = show(figure, left, top, width, sitter.front)
            for vertices, colour, share in one.layers:
                area = share * DOT_PT2 * (4 / columns) ** 2
                dots(axes, sitter, FRONT, sitter.front, vertices, area=area, colour=colour)
            middle = left + width / 2
            caption(figure, middle, top + height + 0.02, one.title, size=TITLE_PT, bold=True, centred=True)
            caption(figure, middle, top + height + 0.2, one.said, size=SMALL_PT, centred=True)
    return figure


def layouts_over_iterations(sitter: Sitter, found: Evaluation) -> Figure:
    """The published algorithm's first start: green before an iteration, red after it (Fig. 3)."""
    errors, layouts = found.descents.by_iteration_mm[0], [np.array(one) for one in found.descents.layouts]
    heads = [
        Dotted(
            f"iteration {i}",
            f"{errors[i]:.3f} mm, {len(np.setdiff1d(layouts[i], layouts[i - 1]))} moved",
            ((layouts[i - 1], GREEN, 1.0), (layouts[i], RED, 1.0)),
        )
        for i in range(1, min(SHOWN_ITERATIONS, len(layouts) - 1) + 1)
    ]
    return dotted_heads(sitter, heads, columns=SHOWN_ITERATIONS)


def constraints(sitter: Sitter, take: Take, found: Evaluation) -> Figure:
    """Without and with the rim held, and in mirrored pairs (Figs. 4 and 5): markers red, held vertices blue."""
    rim = found.rims[-2 if len(found.rims) > 1 else -1]
    held = np.flatnonzero(take.shell.fixed)
    shown = {"nothing held": Scored(methods.OURS, rim.markers, rim.loose, rim.loose_mm, 0, ())}
    for title, name in (("rim held", methods.OURS), ("rim held, in pairs", methods.MIRRORED)):
        layout = found.layout(name, rim.markers)
        assert layout is not None, "these methods have a layout of every number"
        shown[title] = layout
    heads = [
        Dotted(
            title,
            f"M = {one.markers}, {one.rmse_mm:.3f} mm",
            (*(((take.at[held], BLUE, SMALL),) if n else ()), (np.array(one.vertices), RED, 1.0)),
        )
        for n, (title, one) in enumerate(shown.items())
    ]
    return dotted_heads(sitter, heads, columns=3)


def nested_layouts(sitter: Sitter, nested: Sequence[Scored], free: Sequence[Scored]) -> Figure:
    """Layouts each inside the next, inherited markers red and new ones blue; below, free ones (Fig. 7)."""
    lists = [np.array(one.vertices) for one in nested]
    inherited = [np.empty(0, dtype=int), *lists]
    heads = [
        Dotted(
            f"M = {one.markers}, inside",
            f"{one.rmse_mm:.3f} mm, {len(np.setdiff1d(vertices, before))} new",
            ((before, RED, 1.0), (np.setdiff1d(vertices, before), BLUE, 1.0)),
        )
        for one, vertices, before in zip(nested, lists, inherited, strict=False)
    ]
    heads += [
        Dotted(f"M = {one.markers}, free", f"{one.rmse_mm:.3f} mm", ((np.array(one.vertices), BLUE, 1.0),))
        for one in free
    ]
    return dotted_heads(sitter, heads, columns=len(nested))


def shared_layouts(sitter: Sitter, found: Evaluation) -> Figure:
    """The layouts from all people (Fig. 8)."""
    assert found.subjects is not None, "there are other people"
    heads = [
        Dotted(f"M = {one.markers}", f"{one.rmse_mm:.3f} mm over all", ((np.array(one.vertices), RED, 1.0),))
        for one in found.subjects.shared
    ]
    return dotted_heads(sitter, heads, columns=len(heads))


def recovered_layouts(sitter: Sitter, take: Take, found: Evaluation) -> Figure:
    """Simulated layouts, red, under what was found of them, green (Fig. 9); last what the published algorithm found."""
    best = [min((r for r in found.recoveries if r.markers == m), key=lambda r: r.rmse_mm) for m in found.counts]
    heads = [
        Dotted(
            title,
            f"{one.hit} of {one.markers} found, {one.rmse_mm:.3f} mm",
            ((take.at[list(one.planted)], RED, 1.0), (take.at[list(one.found)], GREEN, SMALLEST)),
        )
        for title, one in (
            *((f"M = {one.markers}", one) for one in best),
            (f"as published, M = {found.published.markers}", found.published),
        )
    ]
    return dotted_heads(sitter, heads, columns=len(heads))


def error_maps(sitter: Sitter, take: Take, layouts: Mapping[str, Scored]) -> Figure:
    """Error of each vertex (mm, rms over the frames), one scale for all (Figs. 6 and 11)."""
    errors = {title: _on_head(take, one.vertices) for title, one in layouts.items()}
    top = max(float(np.nanquantile(values, TOP_SHARE)) for values in errors.values())
    maps = [
        HeadMap(sitter, f"{title}: {layouts[title].rmse_mm:.3f} mm", values, ERROR, (0.0, top), BAD)
        for title, values in errors.items()
    ]
    return shared_maps_figure(maps)


def _on_head(take: Take, vertices: Sequence[int]) -> Float[np.ndarray, " v"]:
    """The errors at the rig's vertices, NaN beyond the shell."""
    values = np.full(len(take.rig.neutral), np.nan)
    values[take.at] = vertex_errors(take.shell, take.motion, take.places(np.array(vertices)))
    return values
