"""The shot list: everything once, in an order and a time that can be kept."""

import re

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec import structs

from capture_plan.errors import InfeasibleError
from capture_plan.expressions.pack import pack
from capture_plan.expressions.session import (
    EASY,
    ENOUGH,
    LAST,
    Session,
    easy_words,
    session,
    shot_note,
    shot_number,
    shot_title,
    spare_words,
    stop_below,
)
from capture_plan.expressions.session_settings import SessionSettings
from capture_plan.expressions.settings import PackingSettings
from capture_plan.sample import sample_rig

RIG = sample_rig()
PACKING = pack(RIG, RIG.names, PackingSettings(method="minimum"))


def made(**changes):
    return session(RIG, RIG.names, PACKING, SessionSettings(**changes))


def shown(of, *, fitting=False):
    return [item for item in of.items if item.kind == "expression" and (item.fits or not fitting)]


def test_every_expression_is_shot_once_in_the_order_of_the_packing():
    assert [item.name for item in shown(made(easy_first=0))] == [e.name for e in PACKING.expressions]


@pytest.mark.parametrize("count", [1, 2, 4])
def test_easy_expressions_come_first_and_what_is_covered_adds_up_in_that_order(count):
    pure, warm = shown(made(easy_first=0)), shown(made(easy_first=count))
    easy = [item.name for item in pure if item.difficulty.level <= EASY][:count]
    assert [item.name for item in warm] == easy + [item.name for item in pure if item.name not in easy]
    gains = {e.name: e.gain for e in PACKING.expressions}
    for n, item in enumerate(warm):
        assert item.covered == pytest.approx(sum(gains[each.name] for each in warm[: n + 1]), abs=1e-5)
    assert warm[-1].covered == pytest.approx(pure[-1].covered)


def test_where_time_is_short_the_expressions_that_gain_most_are_shot_whatever_their_order():
    pure, warm = made(easy_first=0, minutes=15), made(minutes=15)
    assert {item.name for item in shown(pure, fitting=True)} == {item.name for item in shown(warm, fitting=True)}
    stop = next(item for item in warm.items if item.name == warm.stop_after)
    assert f"{stop.covered:.0%} of what" in warm.stop


def test_it_begins_and_ends_with_a_neutral_and_has_one_in_the_middle():
    items = [item for item in made().items if item.kind in ("neutral", "expression")]
    places = [k for k, item in enumerate(items) if item.kind == "neutral"]
    assert (places[0], places[-1]) == (0, len(items) - 1)
    assert abs(places[1] - len(items) / 2) <= 1
    kinds = [item.kind for item in made().items]
    assert kinds.count("teeth") == 1
    assert kinds.count("turned") == 2
    assert kinds[0] == "calibration"


def test_the_clock_is_the_sum_of_the_seconds_and_slates_count_what_is_shot():
    items = made().items
    for k, item in enumerate(items):
        assert item.minutes == pytest.approx(sum(each.seconds for each in items[: k + 1]) / 60, abs=1e-3)
    assert [item.slate for item in items if item.kind != "pause"] == [
        f"{k + 1:03d}" for k in range(len(items) - pauses(items))
    ]


def pauses(items):
    return sum(item.kind == "pause" for item in items)


@pytest.mark.parametrize("every", [1, 3, 6, 100])
def test_nobody_performs_longer_than_asked_without_a_rest(every):
    run = 0
    for item in made(relax_every=every).items:
        run = run + 1 if item.kind == "expression" else 0
        assert run <= every + 1


@given(minutes=st.floats(6, 60))
@settings(max_examples=15, deadline=None)
def test_what_fits_ends_in_time_and_one_more_would_not(minutes):
    cut, free = made(minutes=minutes), made()
    assert cut.minutes <= minutes
    assert cut.fitting == len(shown(cut, fitting=True))
    assert len(shown(cut)) == len(PACKING.expressions)
    if cut.fitting < len(PACKING.expressions):
        more = structs.replace(PACKING, expressions=PACKING.expressions[: cut.fitting + 1])
        assert session(RIG, RIG.names, more, SessionSettings()).minutes > minutes
    else:
        assert cut.minutes == free.minutes


def test_more_retakes_and_longer_holds_take_longer():
    assert made(retakes=1.0).minutes > made(retakes=0.0).minutes
    assert made(hold_s=5.0).minutes > made(hold_s=2.0).minutes


def test_a_session_may_stop_once_enough_is_covered():
    of = made()
    at = next(item for item in shown(of) if item.name == of.stop_after)
    before = [item for item in shown(of) if item.minutes < at.minutes]
    assert at.covered >= ENOUGH > before[-1].covered
    assert f"{at.covered:.0%}" in of.stop
    assert stop_below(of) == of.stop_after
    assert made(minutes=12).stop_after == shown(made(minutes=12), fitting=True)[-1].name


def test_what_does_not_fit_is_named_and_nobody_stops_before_the_last_neutral():
    cut = made(minutes=12)
    fit, every = shown(cut, fitting=True), shown(cut)
    assert spare_words(cut).startswith(
        f"Shots {shot_number(every[len(fit)])} to {shot_number(every[-1])} "
        f"({every[len(fit)].name} to {every[-1].name}), {len(every) - len(fit)} of {len(every)} expressions, do not "
        "fit into 12 minutes"
    )
    assert stop_below(cut) == LAST
    last = next(item for item in cut.items if item.name == LAST)
    assert f"stop after shot {shot_number(fit[-1])} ({fit[-1].name})" in cut.stop
    assert f"take the last neutral, shot {shot_number(last)} ({LAST})" in cut.stop
    assert spare_words(made()) == ""


def test_too_little_time_is_refused_with_what_it_takes():
    with pytest.raises(InfeasibleError, match="2 minutes are too few: calibration and neutrals alone take") as refused:
        made(minutes=2)
    least = float(re.search(r"alone take ([\d.]+)", str(refused.value))[1])
    assert made(minutes=least + 0.05).fitting == 0  # what is stated is rounded to a tenth
    with pytest.raises(InfeasibleError, match="are too few"):
        made(minutes=least - 0.05)


def test_a_session_survives_being_written():
    of = made(minutes=20)
    assert msgspec.json.decode(msgspec.json.encode(of), type=Session) == of


def test_sentences_start_from_a_relaxed_face_and_warnings_come_along():
    for item in shown(made()):
        assert item.sentence.startswith("From a relaxed face: ")
        assert item.difficulty is not None
        assert item.mistakes


def test_what_is_shot_out_of_turn_is_said_and_nothing_else():
    assert easy_words(made(easy_first=0)) == ""
    easy = [item.name for item in shown(made(easy_first=0)) if item.difficulty.level <= EASY]
    first, second = (shot_number(item) for item in shown(made())[:2])
    told = f"Shots {first} and {second} ({easy[0]}, {easy[1]}) come first because they are easy."
    assert easy_words(made(easy_first=2)) == told
    assert easy_words(made(easy_first=1)) == f"Shot {first} ({easy[0]}) comes first because it is easy."


def test_one_number_counts_all_that_is_shot():
    of = made()
    shots = [item for item in of.items if item.kind != "pause"]
    assert [shot_title(item) for item in shots] == [f"Shot {number + 1}" for number in range(len(shots))]
    assert {shot_note(item, of) for item in shots} == {f"of {len(shots)} · {item.name}" for item in shots}
    assert {(shot_title(item), shot_note(item, of)) for item in of.items if item.kind == "pause"} == {("Pause", "")}
