"""Which constraints cannot be had together: a smallest set of them that no layout keeps.

From all constraints one after another is left out; where what is left still cannot be had, it was not to blame. What
remains clashes, and giving up any one of it would do (deletion filter of Chinneck & Dravnieks 1991).
"""

from scipy.sparse import csr_array

from capture_plan.layout.constraint_rows import Limit
from capture_plan.layout.program import IntegerProgram, branch, relax
from capture_plan.solver import UndecidedError

COVERAGE = "a landmark on every blendshape"
SPACING = "the spacing"


def clash_words(program: IntegerProgram) -> str:
    """One sentence that names the constraints of a program without a solution."""
    constraints = smallest_clash(program)
    if constraints == [COVERAGE]:
        return "no landmarks reach every blendshape: lower epsilon or min_visibility"
    return f"these cannot be had together: {'; '.join(constraints)}. Give up or loosen one of them"


def smallest_clash(program: IntegerProgram) -> list[str]:
    """Names of constraints no one of which can be left out of the clash, in the order of the program."""
    constraints: list[Limit | str] = [COVERAGE, SPACING, *program.limits]
    for constraint in tuple(constraints):
        rest = [other for other in constraints if other is not constraint]
        if not possible(program, rest):
            constraints = rest
    return [constraint if isinstance(constraint, str) else constraint.name for constraint in constraints]


def possible(program: IntegerProgram, constraints: list[Limit | str]) -> bool:
    """Whether some choice keeps these constraints of a program; yes where that is undecided."""
    rows = len(program.covers) if COVERAGE in constraints else 0
    s = len(program.cost)
    none = csr_array((0, s), dtype=bool), csr_array((s, s), dtype=bool)
    cliques, close = (program.cliques, program.close) if SPACING in constraints else none
    limits = tuple(constraint for constraint in constraints if isinstance(constraint, Limit))
    wanted = IntegerProgram(program.covers[:rows], 0 * program.cost, program.demand[:rows], cliques, close, limits)
    if relax(wanted) is None:
        return False
    try:
        return branch(wanted) is not None
    except UndecidedError:
        return True
