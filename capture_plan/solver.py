"""How every integer program is solved: CP-SAT, one worker, seeded, with a limit that knows no clock.

CP-SAT would take Ctrl-C for itself and afterwards leave it to kill the process without a word. So it works in a thread
of its own, and whoever asked listens meanwhile and stops it: to Ctrl-C, and in a notebook to `stop_work`.
Where nobody knows how many programs a question takes, `with work_within(work):` limits their sum.
"""

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor, wait
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass

from ortools.sat.python import cp_model

from capture_plan.progress import go_on

LISTENS_S = 0.2  # seconds between two looks at whether somebody asked for the end
WORK_LIMIT = 20.0  # CP-SAT's deterministic time, about seconds: the same input gives the same answer on any machine


class UndecidedError(Exception):
    """The work ran out before any answer was found or any proof that there is none."""


@dataclass
class Allowance:
    """What programs that share it may still take, deterministic time."""

    left: float


_allowance: ContextVar[Allowance | None] = ContextVar("allowance", default=None)


@contextmanager
def work_within(work: float) -> Iterator[Allowance]:
    """Let the programs that are solved inside the block take so much deterministic time together: once it is used up,
    a further one raises UndecidedError."""
    shared = Allowance(work)
    token = _allowance.set(shared)
    try:
        yield shared
    finally:
        _allowance.reset(token)


def solve(
    model: cp_model.CpModel, *, work_limit: float | None = None
) -> tuple[cp_model.CpSolver, cp_model.CpSolverStatus]:
    """The solver with its solution, and the status, which the caller tests on its next line.

    Raises UndecidedError where `work_within` leaves nothing to begin with.
    """
    shared, limit = _allowance.get(), WORK_LIMIT if work_limit is None else work_limit
    if shared is not None:
        if shared.left <= 0:
            raise UndecidedError
        limit = min(limit, shared.left)
    solver = cp_model.CpSolver()
    solver.parameters.num_workers = 1
    solver.parameters.random_seed = 0
    solver.parameters.linearization_level = 2
    solver.parameters.max_deterministic_time = limit
    solver.parameters.catch_sigint_signal = False
    with ThreadPoolExecutor(1) as thread:
        solving = thread.submit(solver.solve, model)
        try:
            while not solving.done():
                go_on()
                wait([solving], timeout=LISTENS_S)
            status = solving.result()
        except BaseException:
            solver.stop_search()
            raise
    if shared is not None:
        shared.left -= solver.response_proto.deterministic_time
    assert status != cp_model.MODEL_INVALID, model.validate()
    return solver, status
