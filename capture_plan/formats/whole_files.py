"""Files of a folder that are no whole blendshapes: left out and named, while at least half of the files are whole.

A file whose faces join other vertices ends the reading: an export that lost the order of one file's vertices may have
lost it in others without a sign, and what such a file adds to the neutral means nothing.

Letters: k files, v vertices.
"""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from capture_plan.errors import RigError
from capture_plan.formats.naming import listed
from capture_plan.input.source import Source
from capture_plan.progress import track

ENOUGH = 0.5  # of the files of blendshapes


class OtherFacesError(RigError):
    """A blendshape's file joins its vertices into other faces than the neutral."""


def whole_deltas(
    neutral: Float[np.ndarray, "v 3"], paths: list[Source], read: Callable[[Source], Float[np.ndarray, "v 3"]]
) -> tuple[list[Source], Float[np.ndarray, "k v 3"], str]:
    """The files that are whole, what they add to the neutral, and the sentence that names the others.

    `read` raises a RigError for a file that is not. RigError where too few are, or one has other faces.
    """
    deltas = np.empty((len(paths), *neutral.shape), dtype=np.float32)
    retained: list[Source] = []
    broken: list[RigError] = []
    for path in track(paths, "Reading blendshapes"):
        try:
            deltas[len(retained)] = read(path) - neutral
        except OtherFacesError:
            raise
        except RigError as error:
            broken.append(error)
        else:
            retained.append(path)
    if len(retained) < ENOUGH * len(paths):
        raise broken[0]
    return retained, deltas[: len(retained)], _messages_of(broken)


def _messages_of(broken: list[RigError]) -> str:
    """The sentence about files that were left out; each error begins with the name of its file, and ends in advice."""
    if not broken:
        return ""
    reasons = [str(error).rpartition(": ")[0] or str(error) for error in broken]
    advice = "export them again, or move away what is no blendshape"
    return f"files that are no whole blendshapes were left out, {advice}: {listed(reasons)}"
