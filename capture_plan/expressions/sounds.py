"""Which sound of speech a blendshape stands for, so that an actor is told to say it.

Name     'viseme_SS', 'Fcl_MTH_A': the word after one for viseme or mouth; 'aa', 'ih', 'ou': a letter or two alone,
         where LEAST of the rig's names are such
Motion   more of sum |d|^2 of the skin lies below the middle of eyes and mouth than above: a shape called 'A' may be
         anything
"""

import re
import tomllib
from functools import cache
from importlib.resources import files

import numpy as np

from capture_plan.face.anchors import face_anchors
from capture_plan.once import once
from capture_plan.rig import Rig

LEAST = 3  # names of one or two letters that are sounds: one 'A' is a letter
SPOKEN = re.compile(r"(?:^|[^a-z])(?:viseme|phoneme|vis|mth|mouth)[^a-z]+([a-z]{1,2})$", re.IGNORECASE)


@cache
def sounds() -> dict[str, str]:
    """What to say for a sound, by the letters in names."""
    text = files("capture_plan.expressions").joinpath("data", "phrases.toml").read_text("utf-8")
    return tomllib.loads(text)["sounds"]


@once
def sounds_of(rig: Rig) -> dict[str, str]:
    """What to say for each blendshape that is the shape of a mouth for a sound, by name."""
    alone = [name for name in rig.names if name.lower() in sounds()]
    letters = {name: name.lower() for name in alone} if len(alone) >= LEAST else {}
    letters |= {name: m[1].lower() for name in rig.names if (m := SPOKEN.search(name)) and m[1].lower() in sounds()}
    return {name: sounds()[letter] for name, letter in letters.items() if _at_the_mouth(rig, name)}


def _at_the_mouth(rig: Rig, name: str) -> bool:
    low = rig.neutral[:, 1] < face_anchors(rig).between_y
    squared = rig.displacement[rig.names.index(name)].astype(float) ** 2 * rig.skin
    return bool(squared[low].sum() > squared[~low].sum() and np.any(squared))
