"""Names that another program takes."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from capture_plan.exports.marker_names import distinct_names, plain_names

NAMES = st.lists(st.text(max_size=8) | st.sampled_from(["a", "A", "a_2", "a_2_2", "é", "e", "m1", "1"]), max_size=40)


@given(NAMES, st.integers(4, 30))
def test_plain_names_are_safe_short_and_all_different(names, longest):
    plain = plain_names(names, longest=longest)
    assert len({name.lower() for name in plain}) == len(names)
    assert all(re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", name) and len(name) <= longest for name in plain)


@given(NAMES, st.integers(4, 30))
def test_distinct_names_are_all_different_and_begin_as_they_did(names, longest):
    distinct = distinct_names(names, longest=longest)
    assert len(set(distinct)) == len(names)
    assert all(new == old[:longest] or re.search(r"_\d+$", new) for new, old in zip(distinct, names, strict=True))


@pytest.mark.parametrize("name", ["M01", "H04", "brow_left"])
def test_good_names_stay(name):
    assert plain_names([name], longest=30) == distinct_names([name], longest=30) == (name,)
