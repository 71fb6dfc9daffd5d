"""The figures of Zell & McDonnell 2022 of any rig: one function a figure, from the answers of the layout room.

Fig. 1      `teaser`: layouts over epsilon            Fig. 4   `named_layouts`: under each term, each multi-cover
Fig. 2      `models`: layouts of several rigs         Fig. 5   `replacements`: where else a landmark could stand
Fig. 3      `occlusion`, and `number_against_epsilon` Fig. 6   `seeds`: what a method answers to other seeds
Section 3.1.3   `discarded`: what was tried in the place of displacement
"""

from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Float, Int
from matplotlib.figure import Figure

from capture_plan.evaluation.zell2022.discarded_metrics import TOP
from capture_plan.evaluation.zell2022.epsilon_sweep import EpsilonRow
from capture_plan.evaluation.zell2022.replacement_map import blendshape_map, neutral_visibility, replacement_map
from capture_plan.figures.heads import Sitter
from capture_plan.figures.layouts import Captioned, layouts_figure
from capture_plan.figures.maps import BAD, GOOD, LIGHT, HeadMap, maps_figure
from capture_plan.layout.face import Face
from capture_plan.layout.settings import LayoutSettings

TEASED = (0.3, 0.5, 0.7, 0.8)
STEP = 0.1  # the scales of importance maps start at a multiple of this


def teaser(sitter: Sitter, face: Face, rows: Sequence[EpsilonRow]) -> Figure:
    """The paper's layouts over four of the epsilons."""
    k = len(face.used)
    return layouts_figure(
        [
            Captioned(sitter, f"ε = {row.epsilon:g}", f"K = {k - len(row.uncovered)}", np.array(row.paper_vertices))
            for row in rows
            if row.epsilon in TEASED
        ]
    )


def models(shown: Sequence[tuple[Sitter, Face, Int[np.ndarray, " _"]]]) -> Figure:
    """One layout for each rig, beside each other."""
    return layouts_figure(
        [Captioned(sitter, face.rig.name, f"K = {len(face.used)}", vertices) for sitter, face, vertices in shown],
        columns=max(3, min(4, len(shown))),
    )


def occlusion(sitter: Sitter, face: Face) -> Figure:
    """How well the skin is seen in the worst of all expressions, and what of the neutral's view that takes away."""
    neutral = np.where(face.markable, neutral_visibility(face), np.nan)
    worst = np.where(face.markable, face.visibility, np.nan)
    seen, lost = "share of the hemisphere that sees the skin", "share of the hemisphere that expressions hide"
    return maps_figure(
        [
            HeadMap(sitter, "Worst of all expressions", worst, seen, colours=LIGHT),
            HeadMap(sitter, "Neutral less worst", neutral - worst, lost, colours=BAD),
        ]
    )


def named_layouts(
    sitter: Sitter, layouts: Mapping[str, Int[np.ndarray, " _"]], notes: Mapping[str, str] | None = None
) -> Figure:
    """Layouts by name, in their order."""
    return layouts_figure(
        [Captioned(sitter, name, (notes or {}).get(name, ""), vertices) for name, vertices in layouts.items()],
        columns=even_columns(len(layouts)),
    )


def replacements(sitter: Sitter, face: Face, settings: LayoutSettings, vertices: Int[np.ndarray, " m"]) -> Figure:
    """Where else the two freest landmarks of a layout could stand."""
    maps = [replacement_map(face, settings, vertices, m) for m in range(len(vertices))]
    freest = sorted(range(len(maps)), key=lambda m: -int(np.isfinite(maps[m]).sum()))[:2]
    return maps_figure(
        [
            HeadMap(
                sitter,
                f"In the place of the ringed landmark: {int(np.isfinite(maps[m]).sum()):,} vertices",
                maps[m],
                "importance weight, 1 for the best place",
                limits=(lowest(maps[m]), 1.0),
                colours=GOOD,
                marked=vertices[[m]],
            )
            for m in freest
        ]
    )


def suited(sitter: Sitter, face: Face, settings: LayoutSettings, names: Sequence[str]) -> Figure:
    """Every candidate for a blendshape, by how well it suits."""
    maps = {name: blendshape_map(face, settings, name) for name in names}
    return maps_figure(
        [
            HeadMap(sitter, name, q, "importance weight, 1 for the best place", limits=(lowest(q), 1.0), colours=GOOD)
            for name, q in maps.items()
        ],
        columns=2,
    )


def discarded(sitter: Sitter, metrics: Mapping[str, Float[np.ndarray, " v"]]) -> Figure:
    """The metrics on the head."""
    meaning = f"share of the value that {TOP:.0%} of the skin stay below"
    return maps_figure(
        [HeadMap(sitter, name.capitalize(), values, meaning, colours=GOOD) for name, values in metrics.items()]
    )


def seeds(
    sitter: Sitter, layouts: Mapping[str, Sequence[Int[np.ndarray, " _"]]], errors: Mapping[str, Sequence[float]]
) -> Figure:
    """A row a method, a head a seed, with the upper estimate (mm): a method that hangs on its start shows it."""
    return layouts_figure(
        [
            Captioned(sitter, name, f"{error:.2f} mm", vertices)
            for name, some in layouts.items()
            for vertices, error in zip(some, errors[name], strict=True)
        ],
        columns=max(len(some) for some in layouts.values()),
    )


def even_columns(count: int) -> int:
    """At most five, and as few as the same number of rows needs."""
    return -(-count // -(-count // 5))


def lowest(q: Float[np.ndarray, " v"]) -> float:
    """Where the scale of an importance map starts: below its least value."""
    least = float(np.nanmin(q)) if np.isfinite(q).any() else 0.0
    return min(float(np.floor(least / STEP) * STEP), 1 - STEP)
