"""Blendshapes one by one: how far each is off, and which landmarks stand for it."""

from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Float
from matplotlib.figure import Figure

from capture_plan.figures.style import OTHERS, OURS, SMALL_PT, WIDTH_IN, blank, house
from capture_plan.sheets.style import FAINT

LINE_IN = 0.155  # height of a blendshape's line
HEAD_IN = 0.75
SHOWN = 20


def blendshape_bars(
    names: Sequence[str], errors: Mapping[str, Float[np.ndarray, " k"]], *, meaning: str, shown: int = SHOWN
) -> Figure:
    """The blendshapes that the first layout knows worst, with what the other layouts make of the same."""
    first = next(iter(errors.values()))
    worst = np.argsort(-first, kind="stable")[:shown][::-1]
    thick = 0.8 / len(errors)
    with house():
        figure = blank(WIDTH_IN * 0.72, HEAD_IN + len(worst) * LINE_IN * max(1, 0.6 * len(errors) + 0.4))
        figure.set_layout_engine("constrained")
        axes = figure.add_subplot()
        for n, (name, values) in enumerate(errors.items()):
            at = np.arange(len(worst)) + (len(errors) - 1) * thick / 2 - n * thick
            axes.barh(at, values[worst], thick * 0.92, color=[OURS, *OTHERS][n % 8], label=name)
        axes.set_yticks(range(len(worst)), [str(names[k]) for k in worst], color="black")
        axes.set_ylim(-0.6, len(worst) - 0.4)
        axes.tick_params(axis="y", length=0)
        axes.set_xlabel(meaning)
        axes.grid(axis="x")
        axes.set_axisbelow(True)
        axes.spines["left"].set_visible(False)
        if len(errors) > 1:
            axes.legend(loc="lower right")
    return figure


def incidence(
    names: Sequence[str], landmarks: Sequence[str], extent: Float[np.ndarray, "k m"], *, epsilon: float
) -> Figure:
    """Which landmark moves with which blendshape: dark from epsilon on, where it stands for it, faint below."""
    with house():
        figure = blank(WIDTH_IN, 2 * HEAD_IN + len(names) * LINE_IN)
        figure.set_layout_engine("constrained")
        axes = figure.add_subplot()
        image = axes.imshow(extent, cmap="Blues", vmin=0, vmax=1, aspect="auto", interpolation="nearest")
        k, m = np.nonzero(extent >= epsilon)
        axes.scatter(m, k, s=9, c="white", linewidths=0)
        axes.set_xticks(range(len(landmarks)), list(landmarks), rotation=90, color="black")
        axes.set_yticks(range(len(names)), list(names), color="black")
        axes.set_xticks(np.arange(len(landmarks) - 1) + 0.5, minor=True)
        axes.set_yticks(np.arange(len(names) - 1) + 0.5, minor=True)
        axes.grid(which="minor", color=FAINT, linewidth=0.3)
        axes.tick_params(which="both", length=0, labelsize=SMALL_PT - 1.0)
        axes.xaxis.tick_top()
        for spine in axes.spines.values():
            spine.set_visible(False)
        bar = figure.colorbar(image, ax=axes, orientation="horizontal", shrink=0.4, aspect=40, pad=0.02)
        bar.set_label(f"share of the blendshape's largest movement; dots from {epsilon:g} on")
        bar.outline.set_linewidth(0.4)
    return figure
