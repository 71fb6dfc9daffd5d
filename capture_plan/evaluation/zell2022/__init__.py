"""Zell & McDonnell 2022, Compact facial landmark layouts: what the paper compares, on your own rig.

epsilon_sweep      fig. 3, right: the number of landmarks against epsilon, each with the proof that none has fewer
replacement_map    fig. 5: how well every other place would do instead of a landmark
multicovers        fig. 4: two landmarks for every blendshape, by four methods
discarded_metrics  section 3.1: what the authors tried in place of displacement, and left
"""

from capture_plan.evaluation.zell2022.discarded_metrics import discarded_metrics
from capture_plan.evaluation.zell2022.epsilon_sweep import EpsilonRow, epsilon_sweep
from capture_plan.evaluation.zell2022.replacement_map import replacement_map
from capture_plan.evaluation.zell2022.variants import multicovers, single_cover, terms

__all__ = [
    "EpsilonRow",
    "discarded_metrics",
    "epsilon_sweep",
    "multicovers",
    "replacement_map",
    "single_cover",
    "terms",
]
