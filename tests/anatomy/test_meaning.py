"""What a name says counts where the motion agrees: a mouth that opens by its lips alone is no open jaw."""

from dataclasses import replace

import numpy as np
import pytest

from capture_plan.anatomy.meaning import arkit_by_motion
from capture_plan.sample import sample_rig

RIG = sample_rig()
LIPS = ("mouthUpperUpLeft", "mouthUpperUpRight", "mouthLowerDownLeft", "mouthLowerDownRight")


def called(name, *parts):
    """The sample with its jawOpen replaced by the sum of some blendshapes, under another name."""
    k = RIG.names.index("jawOpen")
    deltas = RIG.deltas.copy()
    deltas[k] = RIG.deltas[np.isin(RIG.names, parts)].sum(axis=0)
    return replace(RIG, deltas=deltas, names=(*RIG.names[:k], name, *RIG.names[k + 1 :]))


@pytest.mark.parametrize("name", ["mouth-part-later", "mouth_opened_2", "lips_part"])
def test_a_mouth_that_opens_is_an_open_jaw_where_the_chin_goes_along(name):
    assert arkit_by_motion(called(name, "jawOpen"), name) == "jawOpen"
    assert arkit_by_motion(called(name, *LIPS), name) is None


def test_the_outer_brow_is_not_called_inner_in_any_words():
    for word in ("extern", "outer", "outside"):
        name = f"eyebrows-left-{word}-up"
        k = RIG.names.index("browOuterUpLeft")
        rig = replace(RIG, names=(*RIG.names[:k], name, *RIG.names[k + 1 :]))
        assert arkit_by_motion(rig, name) == "browOuterUpLeft"
