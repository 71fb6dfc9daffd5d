"""The record of a rig."""

import pytest

from capture_plan.sample import sample_rig


def test_rows_are_those_of_the_names_in_the_order_asked():
    rig = sample_rig()
    assert rig.rows(rig.names) == list(range(len(rig.names)))
    assert [rig.names[k] for k in rig.rows(("jawOpen", "browInnerUp", "jawOpen"))] == [
        "jawOpen",
        "browInnerUp",
        "jawOpen",
    ]
    assert rig.rows(()) == []
    with pytest.raises(KeyError):
        rig.rows(("no such blendshape",))
