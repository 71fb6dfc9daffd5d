"""The same face under each form of the paper's program (Zell & McDonnell 2022, fig. 4), by the name it has there.

Displacement, visibility, both    the single cover with alpha 0, 1, and as set: what makes one place better than another
Symmetric                         the single cover of mirrored pairs
Distance Off, swarm, Distance On  two landmarks for every blendshape: `particle_swarm`
Adaptive                          Algorithm 1: more where one would have to tell too many blendshapes apart
"""

from contextlib import suppress

import numpy as np
from jaxtyping import Float, Int
from msgspec.structs import replace

from capture_plan.errors import InfeasibleError
from capture_plan.evaluation.zell2022.discarded_metrics import cover_by_metric
from capture_plan.evaluation.zell2022.particle_swarm import DEMAND, swarm
from capture_plan.layout.design import design_layout
from capture_plan.layout.face import Face
from capture_plan.layout.multicover import best_cover
from capture_plan.layout.settings import LayoutSettings

Layouts = dict[str, Int[np.ndarray, " _"]]  # as many landmarks as each has


def single_cover(face: Face, settings: LayoutSettings) -> Int[np.ndarray, " m"]:
    """Vertices of the cover that `settings.weights` call best, spacing left aside.

    Example:
        >>> len(single_cover(see_face(sample_rig()), LayoutSettings(epsilon=0.5)))
        12
    """
    sites = face.sites(replace(settings, method="cover"))
    rows = np.flatnonzero(sites.covers(settings.epsilon).any(axis=1))
    return sites.members(best_cover(sites, settings, rows, np.arange(len(sites.visibility)), None).chosen)


def terms(face: Face, settings: LayoutSettings) -> Layouts:
    """The single cover under each term of the weight, and of mirrored pairs."""
    free = replace(settings, symmetric=False)
    return {
        "Displacement only": single_cover(face, replace(free, alpha=0.0)),
        "Visibility only": single_cover(face, replace(free, alpha=1.0)),
        "Both": single_cover(face, free),
        "Symmetric": single_cover(face, replace(settings, symmetric=True)),
    }


def multicovers(face: Face, settings: LayoutSettings) -> Layouts:
    """Two landmarks for every blendshape: side by side, spread by a swarm, at the spacing; and the adaptive cover.

    A form that has no answer at the spacing is left out.
    """
    free = replace(settings, symmetric=False, keep_out={}, rounds=DEMAND)
    off = layout_vertices(face, replace(free, method="trivial"))
    found = {"Distance Off": off, "Swarm": swarm(face, free, off)}
    with suppress(InfeasibleError):
        found["Distance On"] = layout_vertices(face, replace(free, method="distance"))
    return found | {
        "Adaptive": layout_vertices(face, replace(settings, symmetric=False, keep_out={}, method="adaptive"))
    }


def layout_vertices(face: Face, settings: LayoutSettings) -> Int[np.ndarray, " m"]:
    """Vertices of the layout that the settings ask for."""
    return np.array([m.vertex for m in design_layout(face, settings).landmarks])


def by_metric(face: Face, settings: LayoutSettings, metrics: dict[str, Float[np.ndarray, " v"]]) -> Layouts:
    """The paper's cover with displacement in its weight, and with each metric in the place of displacement."""
    free = replace(settings, symmetric=False, method="cover", weights="paper")
    found = {"Displacement": single_cover(face, free)}
    return found | {name.capitalize(): cover_by_metric(face, free, metric) for name, metric in metrics.items()}
