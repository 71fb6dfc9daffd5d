"""An answer is found once for equal arguments, and lives as long as the record that it was asked of."""

import gc
import pickle
import weakref
from copy import deepcopy
from dataclasses import dataclass, replace

import numpy as np
import pytest
from jaxtyping import Float

from capture_plan.face.reading import face_reading
from capture_plan.layout.settings import LayoutSettings
from capture_plan.once import once
from capture_plan.sample import sample_rig


@dataclass(frozen=True, eq=False)
class Record:
    """Numbers, and how often they were asked."""

    numbers: Float[np.ndarray, " n"]
    asked: list[object]

    @once
    def times(self, factor: object, *, plus: object = 0) -> "Record":
        """A record that also holds the first, as answers may."""
        self.asked.append((factor, plus))
        return replace(self)


@pytest.fixture
def record():
    return Record(np.arange(3.0), [])


@pytest.mark.parametrize(
    ("one", "equal", "other"),
    [
        (2, 2, 3),
        (np.arange(4), np.arange(4), np.arange(4.0)),
        (np.zeros((2, 3)), np.zeros((2, 3)), np.zeros((3, 2))),
        (LayoutSettings(caps={"nose": 2}), LayoutSettings(caps={"nose": 2}), LayoutSettings(caps={"nose": 3})),
    ],
    ids=["numbers", "types of arrays", "shapes of arrays", "settings that hold tables"],
)
def test_equal_arguments_are_asked_once_and_others_anew(record, one, equal, other):
    assert record.times(one) is record.times(equal)
    assert record.times(one, plus=equal) is record.times(equal, plus=one)
    assert record.times(other) is not record.times(one)
    assert len(record.asked) == 3


def test_what_fails_is_asked_again(record):
    @once
    def fails(record):
        record.asked.append("failed")
        raise ValueError("now and later")

    for _ in range(2):
        with pytest.raises(ValueError, match="now and later"):
            fails(record)
    assert record.asked == ["failed"] * 2


def test_a_changed_record_is_asked_anew(record):
    record.times(2)
    changed = replace(record, numbers=record.numbers + 1)
    changed.times(2)
    assert len(record.asked) == 2


def test_answers_go_with_their_record(record):
    other = Record(np.arange(3.0), [])
    alive = weakref.ref(other)
    assert other.times(2).numbers is other.numbers
    del other
    gc.collect()
    assert alive() is None


def test_two_functions_of_one_name_do_not_answer_for_each_other(record):
    first, second = (once(lambda record, answer=answer: answer) for answer in (1, 2))
    assert (first(record), second(record)) == (1, 2)


def test_arguments_of_other_types_are_other_arguments(record):
    answers = [record.times(one) for one in (1, True, 1.0, None)]
    assert len({id(answer) for answer in answers}) == 4


def test_a_record_that_was_asked_can_be_copied_and_pickled_and_is_asked_anew():
    rig = replace(sample_rig())
    face_reading(rig)
    for copy in (pickle.loads(pickle.dumps(rig)), deepcopy(rig)):
        assert not vars(copy).get("answers")
        assert face_reading(copy) == face_reading(rig)
