"""Markers as handles: a frame of a take changed by hand (Le et al. 2013, section 7.1).

Data     X_t (v 3) a frame, millimetres; markers H of the shell; d (m 3) how far each is dragged, millimetres
Answer   X_t + W d: the shell carries the change over the skin, what the frame has of its own stays. Every other marker
         holds the skin where the frame has it, and so does the held rim.
"""

import numpy as np
from jaxtyping import Float, Int

from capture_plan.shell.take import Take


def drag(
    take: Take, markers: Int[np.ndarray, " m"], dragged: Float[np.ndarray, "m 3"], frame: int
) -> Float[np.ndarray, "v 3"]:
    """The vertices of the rig in a frame, counted from 0, with the markers `dragged`.

    Raises:
        RigError: there is no such frame.
        InfeasibleError: a marker stands where nothing moves.
    """
    pose = take.sequence.frame(frame).copy()
    pose[take.at] += take.shell.weights(markers) @ dragged
    return pose
