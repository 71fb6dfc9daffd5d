"""Le, Zhu & Deng 2013, Marker optimization for facial motion acquisition: its methods and figures, on your own take.

by_method     fig. 12: the error that each method's layout leaves, at every number of markers
evaluate_all  figs. 3 to 13 and table 4, each of the paper's observations held against what was found
motion_text   all of it as a page of text
"""

from capture_plan.evaluation.le2013.evaluation import Evaluation, People
from capture_plan.evaluation.le2013.evaluation_cache import evaluate_all
from capture_plan.evaluation.le2013.methods import Scored, by_method
from capture_plan.evaluation.le2013.report import motion_text

__all__ = ["Evaluation", "People", "Scored", "by_method", "evaluate_all", "motion_text"]
