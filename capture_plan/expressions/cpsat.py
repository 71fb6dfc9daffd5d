"""How every program of this room is solved: CP-SAT, one worker, seeded, with a limit that knows no clock."""

from ortools.sat.python import cp_model

WORK_LIMIT = 20.0  # CP-SAT's deterministic time, about seconds: the same input gives the same answer on any machine


class UndecidedError(Exception):
    """The work limit was reached before an answer."""


def solve(model: cp_model.CpModel) -> tuple[cp_model.CpSolver, cp_model.CpSolverStatus]:
    """The solver with its solution, and the status, which the caller tests on its next line."""
    solver = cp_model.CpSolver()
    solver.parameters.num_workers = 1
    solver.parameters.random_seed = 0
    solver.parameters.linearization_level = 2
    solver.parameters.max_deterministic_time = WORK_LIMIT
    status = solver.solve(model)
    assert status != cp_model.MODEL_INVALID, model.validate()
    return solver, status
