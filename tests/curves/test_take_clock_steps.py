"""Frame rates of clocks that do not step evenly: the count of frames over their time agrees, or it is said."""

import numpy as np
import pytest

from capture_plan.curves.clock import Timing, agreed, timing_of

N = 600


def of(times):
    """The timing of times in seconds, in tenths of a millisecond."""
    return timing_of([f"{x:.4f}" for x in times])


def stamps(fps, clock, start=3600):
    """Timecodes of a clock that stamps frames which come at another rate."""
    ticks = np.floor(np.arange(N) * clock / fps + 1e-9).astype(int)
    seconds = start + ticks // clock
    return [
        f"{s // 3600:02d}:{s // 60 % 60:02d}:{s % 60:02d}:{f:02d}" for s, f in zip(seconds, ticks % clock, strict=True)
    ]


@pytest.mark.parametrize(
    "burst", [(20, 20, 20, 20, 10 / 3), (22, 22, 6), (18,) * 8 + (6,), (5, 5, 40), (30, 10 / 3), (32, 4 / 3, 50 / 3)]
)
def test_frames_that_arrive_in_bursts_have_the_rate_of_their_count_and_lose_none(burst):
    times = np.cumsum(np.tile(burst, N // len(burst))) / 1000
    timing = of(times)
    assert timing.fps == pytest.approx((len(times) - 1) / np.ptp(times), rel=0.01) or timing.notes
    assert timing.fps is None or timing.fps == pytest.approx(60, rel=0.02)
    assert not any("missing there" in note for note in timing.notes)


@pytest.mark.parametrize("jitter_ms", [1, 3, 5, 7])
def test_frames_that_arrive_early_and_late_have_their_rate(jitter_ms):
    for seed in range(4):
        times = np.sort(np.arange(N) / 60 + np.random.default_rng(seed).normal(0, jitter_ms / 1000, N))
        assert of(times).fps == pytest.approx(60, rel=0.03)


@pytest.mark.parametrize("share", [0.02, 0.1, 0.2])
@pytest.mark.parametrize("fps", [25, 60])
def test_frames_that_are_lost_do_not_slow_the_rate(share, fps):
    for seed in range(4):
        kept = np.flatnonzero(np.random.default_rng(seed).random(N) > share)
        seconds = of(kept / fps)
        codes = timing_of([code for t, code in enumerate(stamps(fps, fps)) if t in set(kept.tolist())])
        assert (seconds.fps, codes.fps) == (fps, fps)
        assert all(any("missing there" in note for note in one.notes) for one in (seconds, codes))


@pytest.mark.parametrize(("first", "then"), [(60, 30), (30, 60), (60, 40), (24, 60), (60, 48)])
@pytest.mark.parametrize("cut", [100, 150, 300, 420, 500])
def test_two_rates_are_said_wherever_the_take_changes(first, then, cut):
    for jitter in (0, 0.0005):
        d = np.where(np.arange(N) < cut, 1 / first, 1 / then) + np.random.default_rng(0).normal(0, jitter, N)
        timing = of(np.cumsum(d))
        assert timing.fps is None
        assert "export it at one rate" in timing.notes[0]


def test_a_slower_stretch_in_the_middle_is_said():
    timing = of(np.cumsum(np.where(abs(np.arange(N) - 300) < 50, 1 / 40, 1 / 60)))
    assert "1.5 times as slowly in some parts of it as in others" in timing.notes[0]


@pytest.mark.parametrize(
    ("fps", "clock"), [(60, 24), (60, 25), (50, 30), (50, 24), (120, 50), (60, 30), (75, 30), (25, 30), (24, 60)]
)
def test_a_clock_of_another_rate_than_the_frames_stamps_them_unevenly_and_the_rate_is_theirs(fps, clock):
    assert timing_of(stamps(fps, clock)).fps == pytest.approx(fps, rel=2e-3)


@pytest.mark.parametrize(("fps", "polls"), [(60, 75), (60, 72), (50, 60), (50, 64)])
def test_frames_that_wait_for_a_poll_have_the_rate_of_their_count_and_that_is_said(fps, polls):
    timing = of(np.ceil(np.arange(N) / fps * polls - 1e-9) / polls)
    assert timing.fps == pytest.approx(fps, rel=2e-3)
    assert "uneven" in timing.notes[0]


def test_of_two_clocks_that_disagree_the_much_steadier_one_is_taken():
    steady = of(np.arange(N) / 60)
    rough = of(np.cumsum(np.random.default_rng(0).uniform(0.01, 0.03, N)))
    assert agreed([("a", rough), ("b", steady)]).fps == 60
    assert "'b' is steadier" in agreed([("a", rough), ("b", steady)]).notes[-1]
    assert agreed([("b", steady), ("a", rough)]).fps == 60
    assert "the first is taken" in agreed([("b", steady), ("rate", Timing(24.0))]).notes[-1]
