"""Long work that another thread stops: in a loop, in threads, in a solver; and only while it can be stopped."""

import threading
import time

import numpy as np
import pytest
from ortools.sat.python import cp_model

from capture_plan.progress import StoppedError, go_on, in_threads, stop_work, stoppable, track, track_in_threads
from capture_plan.solver import solve


def hard():
    """A program that is solved for minutes."""
    model, rng = cp_model.CpModel(), np.random.default_rng(0)
    f = [model.new_bool_var(str(s)) for s in range(900)]
    for row in rng.random((900, 900)) < 0.1:
        model.add_at_least_one([f[s] for s in np.flatnonzero(row)])
    model.minimize(cp_model.LinearExpr.sum(f))
    return model


WORK = {
    "in a loop": lambda: [time.sleep(0.02) for _ in track(range(1000), "Working")],
    "in threads": lambda: list(track_in_threads(lambda _: time.sleep(0.02), list(range(1000)), "Working")),
    "in a solver": lambda: solve(hard(), work_limit=60.0),
}


@pytest.mark.parametrize("work", WORK.values(), ids=WORK)
def test_work_ends_soon_after_another_thread_stopped_it(work):
    threading.Timer(0.3, stop_work).start()
    start = time.monotonic()
    with pytest.raises(StoppedError), stoppable():
        work()
    assert time.monotonic() - start < 5


def test_work_that_begins_after_a_stop_goes_on():
    with stoppable():
        stop_work()
        with stoppable():
            go_on()
        with pytest.raises(StoppedError):
            go_on()
    go_on()


def test_threads_end_soon_after_whoever_asked_them_failed():
    ended = []

    def endless(item):
        try:
            while item:
                go_on()
                time.sleep(0.01)
        except StoppedError:
            ended.append(item)
            raise

    start = time.monotonic()
    answers = in_threads(endless, [0, 1, 2, 3])
    next(answers)
    with pytest.raises(KeyboardInterrupt):
        answers.throw(KeyboardInterrupt)
    assert time.monotonic() - start < 5
    assert 3 not in ended  # what was not begun is never begun
    go_on()
