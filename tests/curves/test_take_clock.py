"""Frame rates from timecodes and times: by their usual step, with gaps and doubled frames counted."""

import json

import numpy as np
import pytest

from capture_plan.curves.clock import by_numbers, timing_by, timing_of
from capture_plan.curves.clock_cells import CLOCKS, NTSC
from capture_plan.curves.columns import CLOCK_KINDS, kind_of
from capture_plan.sample import sample_rig
from capture_plan.sequence import read_sequence


def codes(n, clock, step=1, start=0, sign=":"):
    """Timecodes of n frames, `step` numbers of the clock apart."""
    ticks = start + step * np.arange(n)
    s = ticks // clock
    return [
        f"{s // 3600:02d}:{s // 60 % 60:02d}:{s % 60:02d}{sign}{f:02d}" for s, f in zip(s, ticks % clock, strict=True)
    ]


def drop_codes(n, clock):
    """Codes of a clock that leaves out the first numbers of every minute but each tenth."""
    numbers = [
        (minute, second, f)
        for minute in range(12)
        for second in range(60)
        for f in range(clock)
        if second or f >= clock // 15 or minute % 10 == 0
    ]
    return [f"00:{m:02d}:{s:02d};{f:02d}" for m, s, f in numbers[:n]]


@pytest.mark.parametrize("clock", CLOCKS)
@pytest.mark.parametrize("step", [1, 2, 5])
def test_the_rate_is_the_clocks_divided_by_the_step(clock, step):
    timing = timing_of(codes(4 * clock, clock, step))
    assert timing.fps == pytest.approx(clock / step)
    assert timing.notes == ()


@pytest.mark.parametrize("clock", [30, 60])
def test_drop_frame_codes_have_no_gaps_and_the_slower_rate(clock):
    timing = timing_of(drop_codes(150 * clock, clock))
    assert timing.fps == pytest.approx(clock * NTSC, abs=1e-3)
    assert timing.notes == ()
    assert timing_of(codes(150 * clock, clock, sign=";")).fps == clock  # uses the numbers that would be dropped


def test_a_clock_of_30_that_stamps_60_frames_says_so():
    timing = timing_of([code for code in codes(120, 30) for _ in range(2)])
    assert timing.fps == 60
    assert "2 times in a row" in timing.notes[0]


def test_less_than_a_second_of_timecode_tells_no_rate():
    assert timing_of(codes(11, 60, start=7)).fps is None
    assert timing_of(codes(60, 60)).fps == 60


def test_midnight_is_no_gap():
    timing = timing_of(codes(240, 60, start=(86_400 - 2) * 60)[:120] + codes(120, 60))
    assert (timing.fps, timing.notes) == (60.0, ())


@pytest.mark.parametrize("unit_s", [1.0, 1e-3, 1e-6, 1e-9])
@pytest.mark.parametrize("fps", [10.0, 24.0, 30.0, 60.0, 120.0])
@pytest.mark.parametrize("message", [True, False])
def test_times_in_any_unit_give_the_rate(unit_s, fps, message):
    times = [repr(float(t / fps / unit_s)) for t in range(200)]
    assert timing_of(times, unit_s if message else None).fps == fps


def test_whole_milliseconds_do_not_round_the_rate():
    for fps in (24.0, 30.0, 60.0, 120.0):
        assert timing_of([str(round(1000 * t / fps)) for t in range(300)]).fps == fps


def test_jitter_does_not_change_the_rate():
    times = np.arange(300) / 30 + np.random.default_rng(0).uniform(-0.004, 0.004, 300)
    assert timing_of([str(x) for x in times]).fps == 30


def test_numbers_that_only_count_frames_tell_no_rate():
    assert timing_of([str(t) for t in range(50)]).fps is None


def test_a_name_that_tells_the_wrong_unit_is_told():
    timing = timing_of([str(t / 60) for t in range(90)], 1e-3)
    assert timing.fps == 60
    assert "whatever their name says" in timing.notes[0]


@pytest.mark.parametrize(
    "write", [lambda x: str(x), lambda x: f"00:00:{x:06.3f}", lambda x: f"{int(x // 60)}:{x % 60:06.3f}"]
)
def test_gaps_doubled_and_backward_times_are_counted(write):
    t = np.arange(200)
    t[80:] += 4
    t[150:] += 9
    t[20] = 19
    timing = timing_of([write(x / 25) for x in t])
    assert timing.fps == 25
    assert any("2 gaps" in note and "13 frames" in note for note in timing.notes) or any(
        "3 gaps" in note for note in timing.notes
    )
    assert any("1 of 200 frames have the time of the frame before" in note for note in timing.notes)
    assert any(
        "backwards at 1 of 50" in note
        for note in timing_of([write(x / 25) for x in [*range(30), *range(10, 30)]]).notes
    )


WRITE = [
    lambda x: f"{x:.5f}",
    lambda x: str(round(1000 * x)),
    lambda x: f"10:00:{x:06.3f}",
    lambda x: f"10:00:{int(x):02d}:{round(x % 1 * 25):02d}",
    lambda x: f"2026-11-28T10:00:{x:09.6f}",
]


@pytest.mark.parametrize("write", WRITE)
@pytest.mark.parametrize("kind", ["reversed", "shuffled"])
def test_frames_out_of_order_are_sorted_by_their_times_and_said(write, kind):
    order = np.arange(100)[::-1] if kind == "reversed" else np.random.default_rng(1).permutation(100)
    timing = timing_of([write(t / 25) for t in order])
    assert timing.fps == 25
    assert order[timing.order].tolist() == list(range(100))
    assert "sorted" in timing.notes[0]


@pytest.mark.parametrize("kind", ["reversed", "shuffled"])
def test_frames_out_of_order_are_sorted_by_their_numbers_and_said(kind):
    order = np.arange(100)[::-1] if kind == "reversed" else np.random.default_rng(1).permutation(100)
    timing = by_numbers("frame", [str(t + 7) for t in order])
    assert order[timing.order].tolist() == list(range(100))
    assert timing.fps is None
    assert "sorted" in timing.notes[0]


@pytest.mark.parametrize("numbers", [[*range(90)], [*range(45), *range(45)], [0, 5, 1000, 3], [], [3]])
def test_numbers_in_order_or_of_two_takes_sort_nothing(numbers):
    timing = by_numbers("frame", [str(n) for n in numbers])
    assert (timing.fps, timing.notes, timing.order) == (None, (), None)


def test_two_takes_at_the_same_times_are_not_sorted_into_each_other():
    timing = timing_of([f"{t / 25:.3f}" for t in [*range(60), *range(60)]])
    assert timing.order is None
    assert "backwards at 1 of 120" in timing.notes[0]


@pytest.mark.parametrize("write", WRITE)
@pytest.mark.parametrize("every", [2, 3, 5])
def test_times_on_some_frames_only_give_the_rate_of_all(write, every):
    timing = timing_of([write(t / 25) if t % every == 0 else "" for t in range(200)])
    assert timing.fps == 25
    assert "of 200 frames have a time" in timing.notes[-1]
    assert not any("gap" in note for note in timing.notes)


def test_seconds_and_milliseconds_in_one_column_tell_no_rate():
    each = [str(t / 60) if t % 2 else str(round(1000 * t / 60)) for t in range(120)]
    halves = [str(t / 60) if t < 60 else str(1000 * t / 60) for t in range(120)]
    frames = [str(t / 60) if t % 3 else str(t) for t in range(120)]
    for times in (each, halves, frames):
        timing = timing_of(times)
        assert timing.fps is None
        assert "tell no frame rate" in timing.notes[-1]


def test_uneven_times_of_a_camera_give_their_mean():
    d = np.random.default_rng(0).choice([0.02, 0.09], 400)
    timing = timing_of([f"{x:.4f}" for x in np.cumsum(d)])
    assert timing.fps == pytest.approx(1 / d.mean(), rel=0.02)
    assert "uneven" in timing.notes[0]


def test_film_in_a_clock_of_60_keeps_its_rate():
    ticks = [t * 60 // 24 for t in range(200)]
    assert timing_of([f"00:00:{t // 60:02d}:{t % 60:02d}" for t in ticks]).fps == 24


@pytest.mark.parametrize(
    ("start", "write"),
    [
        (86_399, lambda x: f"{int(x % 86_400 // 3600):02d}:{int(x % 3600 // 60):02d}:{x % 60:06.3f}"),
        (86_399, lambda x: f"{x % 86_400:.4f}"),
        (86_399, lambda x: str(round(1000 * (x % 86_400)))),
        (3_599, lambda x: f"{int(x % 3600 // 60):02d}:{x % 60:06.3f}"),
        (43_199, lambda x: f"{int(x % 43_200 // 3600):02d}:{int(x % 3600 // 60):02d}:{x % 60:06.3f}"),
    ],
)
def test_a_clock_that_begins_again_goes_on(start, write):
    timing = timing_of([write(start + t / 50) for t in range(150)])
    assert (timing.fps, timing.notes, timing.order) == (50.0, (), None)


@pytest.mark.parametrize("sign", ["{}:{}:{};{}", "{};{};{};{}"])
def test_drop_frame_codes_are_read_in_every_spelling(sign):
    timing = timing_of([sign.format(*code.replace(";", ":").split(":")) for code in drop_codes(4000, 30)])
    assert (timing.fps, timing.notes) == (29.97, ())


def test_dates_are_times():
    assert timing_of([f"2026-11-28T10:00:{t / 50:09.6f}" for t in range(100)]).fps == 50


@pytest.mark.parametrize("unit_s", [1.0, 1e-3])
@pytest.mark.parametrize("fps", [24.0, 30.0, 60.0])
@pytest.mark.parametrize("named", [True, False])
def test_how_long_each_frame_lasted_gives_the_rate_and_the_gaps(unit_s, fps, named):
    lasted = np.full(100, 1 / fps / unit_s)
    lasted[[0, 40]] = 0, 5 / fps / unit_s
    timing = timing_by("step", [f"{x:.6f}" for x in lasted], unit_s if named else None)
    assert timing.fps == fps
    assert timing.notes == ("1 gap in its times, 4 frames long in all: frames are missing there",)


@pytest.mark.parametrize(
    ("cells", "fps"),
    [
        (["60"] * 50, 60.0),
        (["29,97"] * 50, 29.97),
        ([f"{x:.2f}" for x in np.linspace(59.6, 60.4, 50)], 60.0),
        (["", "25", ""], 25.0),
        (["30"] * 25 + ["60"] * 25, None),
        (["0"] * 50, None),
        (["1e6"] * 50, None),
        (["fast"] * 50, None),
        ([], None),
    ],
)
def test_a_rate_that_rows_state_is_the_rate_where_they_state_one(cells, fps):
    assert timing_by("rate", cells).fps == fps


@pytest.mark.parametrize(
    "name", ["fps", "Frame Rate", "frames_per_second", "delta_time", "deltaTimeMs", "dt", "frameDelta", "timestep (s)"]
)
def test_columns_of_clocks_are_no_weights(name):
    assert kind_of(name) in CLOCK_KINDS


@pytest.mark.parametrize("ending", ["csv", "json", "npz"])
@pytest.mark.parametrize(("name", "cell"), [("fps", 48.0), ("deltaTime", 1 / 48)])
def test_a_take_without_times_has_the_rate_that_its_frames_tell(tmp_path, ending, name, cell):
    path, n = tmp_path / f"take.{ending}", 24
    jaw = [round(t / n, 3) for t in range(n)]
    if ending == "csv":
        path.write_text("\n".join([f"{name},jawOpen,mouthSmileLeft", *(f"{cell},{x},{1 - x}" for x in jaw)]))
    elif ending == "json":
        path.write_text(json.dumps([{name: cell, "jawOpen": x, "mouthSmileLeft": 1 - x} for x in jaw]))
    else:
        weights = np.array([[x, 1 - x] for x in jaw])
        np.savez(path, weights=weights, names=["jawOpen", "mouthSmileLeft"], **{name: np.full(n, cell)})
    take = read_sequence(path, rig=sample_rig())
    assert take.fps == 48
    assert not any("assumed" in note for note in take.notes)


@pytest.mark.parametrize("fps", [24, 25, 30, 48, 50, 60, 90, 100, 120])
@pytest.mark.parametrize("count", [150, 1800])
def test_times_in_hundredths_of_a_second_give_the_rate_without_gaps(fps, count):
    timing = timing_of([f"{t / fps:.2f}" for t in range(count)])
    assert timing.fps == pytest.approx(fps, rel=2e-3)
    assert timing.notes == ()


@pytest.mark.parametrize("count", [90, 150, 610])
@pytest.mark.parametrize("write", [str, lambda s: f"10:00:{s:02d}"])
def test_whole_seconds_give_the_number_of_frames_in_each(count, write):
    timing = timing_of([write(t // 30) for t in range(count)])
    assert timing.fps == 30
    assert timing.notes == ("each time stands 30 times in a row: that many frames are read within it",)


def test_seconds_that_the_take_cuts_off_do_not_count():
    assert timing_of([str((t + 20) // 30) for t in range(75)]).fps == 30  # 10, 30, 30 and 5 frames of a second


@pytest.mark.parametrize(("first", "then"), [(60, 30), (30, 25), (24, 48)])
def test_a_rate_that_changes_in_the_middle_is_said_and_not_averaged(first, then):
    timing = timing_of([repr(t) for t in np.cumsum([1 / first] * 45 + [1 / then] * 45).tolist()])
    assert timing.fps is None
    way = "slowly" if then < first else "fast"
    assert f"{max(first / then, then / first):.3g} times as {way} at its end" in timing.notes[0]


def test_a_step_that_goes_on_is_a_time_or_a_number():
    assert timing_by("step", [str(t) for t in range(90)]).fps is None
    assert timing_by("step", [repr(t / 60) for t in range(90)]).fps == 60
    assert timing_by("step", ["2"] * 90).fps is None


@pytest.mark.parametrize("unit", [1 / 3600, 1 / 60, 800 * 30])
def test_times_that_no_take_can_have_tell_no_rate(unit):
    timing = timing_of([repr(t * unit / 30) for t in range(90)])
    assert timing.fps is None
    assert "they tell no frame rate" in timing.notes[0]


def test_ticks_of_a_tenth_of_a_microsecond_give_the_rate():
    assert timing_of([str(round(t * 1e7 / 60)) for t in range(90)]).fps == 60
    assert timing_by("step", ["166667"] * 90).fps == 60


@pytest.mark.parametrize("ending", ["csv", "json"])
def test_clocks_that_disagree_are_said_and_the_surer_one_is_taken(tmp_path, ending):
    rows = [{"time": round(t / 30, 6), "fps": 60, "jawOpen": t / 40, "mouthSmileLeft": 0.5} for t in range(40)]
    path = tmp_path / f"take.{ending}"
    if ending == "json":
        path.write_text(json.dumps(rows))
    else:
        path.write_text("\n".join([",".join(rows[0]), *(",".join(map(str, row.values())) for row in rows)]))
    take = read_sequence(path, rig=sample_rig())
    assert take.fps == 30
    assert any("'time' makes 30" in note and "'fps' 60" in note for note in take.notes)


def test_a_rate_that_no_take_has_is_not_believed(tmp_path):
    path = tmp_path / "take.json"
    frames = [{"jawOpen": t / 40, "mouthSmileLeft": 0.5} for t in range(40)]
    path.write_text(json.dumps({"sampleRate": 48000, "fps": 60, "frames": frames}))
    assert read_sequence(path, rig=sample_rig()).fps == 60


@pytest.mark.parametrize("clock", [24, 25, 30, 60])
@pytest.mark.parametrize("sign", [".", ","])
def test_two_digits_behind_minutes_and_seconds_are_frames_where_they_begin_again_each_second(clock, sign):
    frames = timing_of([f"1:{t // clock:02d}{sign}{t % clock:02d}" for t in range(4 * clock)])
    assert (frames.fps, frames.notes) == (clock, ())
    hundredths = timing_of([f"1:{t // clock:02d}{sign}{100 * (t % clock) // clock:02d}" for t in range(4 * clock)])
    assert (hundredths.fps, hundredths.notes) == (clock, ())
