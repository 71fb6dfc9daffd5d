"""Carrigan et al. 2020, Expression packing: what the paper measures, on your own rig.

mu_sweep             section 5: the number of expressions against mu, with the fewest that are possible
importance_ablation  section 4.3: what each term of the importance does to the order
rival_lists          other lists of the same blendshapes, and what each is worth once it is scanned (`errors_of_lists`)
"""

from capture_plan.evaluation.carrigan2020.mu_sweep import AblationRow, MuRow, importance_ablation, mu_sweep
from capture_plan.evaluation.carrigan2020.packing_error import errors_of_lists, rival_lists

__all__ = ["AblationRow", "MuRow", "errors_of_lists", "importance_ablation", "mu_sweep", "rival_lists"]
