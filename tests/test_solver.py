"""Integer programs end with Ctrl-C, which is heard after them as before, and with the work that they share."""

import signal
import subprocess
import sys
import time

import pytest
from ortools.sat.python import cp_model

from capture_plan.solver import UndecidedError, solve, work_within

HARD = """
import signal
import numpy as np
from ortools.sat.python import cp_model
from capture_plan.solver import solve

def program(sites, rows):
    model, rng = cp_model.CpModel(), np.random.default_rng(0)
    f = [model.new_bool_var(str(s)) for s in range(sites)]
    for row in rng.random((rows, sites)) < 0.1:
        model.add_at_least_one([f[s] for s in np.flatnonzero(row)])
    model.minimize(cp_model.LinearExpr.sum(f))
    return model

signal.signal(signal.SIGINT, signal.default_int_handler)  # also where a shell lets what runs behind it ignore Ctrl-C
solve(program(20, 9))
assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
print("begins", flush=True)
try:
    solve(program(900, 900), work_limit=60.0)
except KeyboardInterrupt:
    print("stopped")
"""


def test_a_solve_ends_within_a_second_of_ctrl_c_after_others_that_ended_by_themselves():
    with subprocess.Popen([sys.executable, "-c", HARD], stdout=subprocess.PIPE, text=True) as child:
        assert child.stdout.readline() == "begins\n"
        time.sleep(1.0)
        child.send_signal(signal.SIGINT)
        said, _ = child.communicate(timeout=20)
    assert said == "stopped\n"
    assert child.returncode == 0


def pigeons(holes):
    """One more than fit, which takes a search to find out."""
    model = cp_model.CpModel()
    sits = [[model.new_bool_var("") for _ in range(holes)] for _ in range(holes + 1)]
    for row in sits:
        model.add_bool_or(row)
    for hole in range(holes):
        for one in range(holes + 1):
            for other in range(one):
                model.add_bool_or(~sits[one][hole], ~sits[other][hole])
    return model


def test_programs_that_share_their_work_end_together():
    with work_within(0.15) as shared:
        for _ in range(20):
            if shared.left <= 0:
                break
            before = shared.left
            solve(pigeons(7))
            assert shared.left < before
        with pytest.raises(UndecidedError):
            solve(pigeons(7))
    solve(pigeons(7))
