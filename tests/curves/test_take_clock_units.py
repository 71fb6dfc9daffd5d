"""Clocks without a unit: one usual rate is sure, several or none are said; minutes, seconds and frames are no hours."""

import numpy as np
import pytest

from capture_plan.curves.clock import timing_of

N = 300


def ticks(second, fps, start=0):
    """Whole ticks of a clock of so many in a second."""
    return [str(round(start + t * second / fps)) for t in range(N)]


def doubt(timing):
    """Whether a rate is said to be uncertain."""
    return any("not certain" in note for note in timing.notes)


@pytest.mark.parametrize("fps", [24, 25, 30, 60, 120])
@pytest.mark.parametrize("second", [1000, 10**6, 10**7, 10**9])
def test_decimal_ticks_of_a_usual_rate_are_sure(fps, second):
    timing = timing_of(ticks(second, fps))
    assert doubt(timing) if (fps, second) == (120, 10**7) else (timing.fps, timing.notes) == (fps, ())  # 12 in \u00b5s


@pytest.mark.parametrize("fps", [24, 25, 30, 50, 60])
@pytest.mark.parametrize("second", [100, 600, 10_000, 48_000, 90_000, 46_186_158_000])
def test_ticks_of_another_clock_are_never_a_rate_in_silence(fps, second):
    timing = timing_of(ticks(second, fps))
    assert doubt(timing) or timing.fps in (None, fps)
    assert timing.fps is None or timing.fps >= 10


@pytest.mark.parametrize("step", [2, 3, 5, 7, 10, 20, 22])
def test_steps_that_several_units_or_none_make_usual_are_said(step):
    assert doubt(timing_of([str(step * t) for t in range(N)]))


@pytest.mark.parametrize("fps", [50, 45])
@pytest.mark.parametrize("known", ["named", "epoch"])
def test_a_unit_that_is_told_or_shown_leaves_no_doubt(fps, known):
    if known == "named":
        assert timing_of(ticks(1000, fps), 1e-3).notes == ()
    assert timing_of(ticks(1000, fps, 1_700_000_000_000)).notes == ()
    assert timing_of(ticks(10**6, fps, 1_700_000_000_000_000)).fps == pytest.approx(fps)


@pytest.mark.parametrize("clock", [24, 25, 30, 48, 50, 60])
@pytest.mark.parametrize("step", [1, 2])
@pytest.mark.parametrize("minutes", [True, False])
def test_what_grows_from_row_to_row_behind_minutes_and_seconds_are_frames(clock, step, minutes):
    n = step * np.arange(4 * clock)
    times = [f"{'7:' * minutes}{t // clock:02d}:{t % clock:02d}" for t in n]
    timing = timing_of(times)
    assert timing.fps == clock / step
    assert doubt(timing) == (clock == 60)


def test_less_than_a_second_of_frames_tells_no_rate_and_whole_seconds_stay_seconds():
    timing = timing_of([f"0:00:{t:02d}" for t in range(20)])
    assert timing.fps is None
    assert doubt(timing)
    assert timing_of([f"0:00:{t // 30:02d}" for t in range(N)]).fps == 30
