"""Whether the place taken for a mouth lies where lips are: asked of the skin around it, and of two signs of its height.

Letters    p  pupil distance;  m  the place, on the midline;  s  skin beside the midline at the height of its lips
Before     max z of s - z of m, or of where movements place it if that lies further forward, over p: 22 avatars, the
           sample and heads whose mouths stand open 0.01 to 0.21, a fox 0.30; beaks, muzzles and the bag behind the
           lips of a mouth that was opened by hand 0.45 to 4
Apart      from the height at which blendshapes part skin or are named for the mouth to that of the border of the lips,
           over p, where lips stand open less half of that: the same heads 0.04 at most, beaks and muzzles 0.12 to 0.23
"""

import numpy as np
from jaxtyping import Float

from capture_plan.rig.understood import Sign

BURIED, ASUNDER = 0.35, 0.12  # pupil distances
GAPE = 0.5  # of the way between lips that stand open: movements may place the mouth at either of them
ASIDE = 0.15  # pupil distances from the midline, and above and below the lips


def against_mouth(
    skin: Float[np.ndarray, "n 3"],
    mouth: Float[np.ndarray, " 3"],
    lips: Float[np.ndarray, "m 3"],
    sign: Float[np.ndarray, " 3"],
    p: float,
) -> tuple[Sign, ...]:
    """What speaks against a mouth: `lips` is its border, if one was found, `sign` where movements place it."""
    y = np.append(lips[:, 1], mouth[1])
    low, high = y.min() - ASIDE * p, y.max() + ASIDE * p
    around = skin[(np.abs(skin[:, 0] - mouth[0]) < ASIDE * p) & (skin[:, 1] > low) & (skin[:, 1] < high), 2]
    before = float(around.max(initial=-np.inf) - max(mouth[2], sign[2]))
    apart = float(abs(mouth[1] - sign[1]))
    found = []
    if before > BURIED * p:
        found.append(Sign("the skin around it, which lies before it", f"{before:.0f} mm further forward", -1.0))
    if apart > ASUNDER * p + GAPE * float(np.ptp(y)):
        found.append(Sign("the height of its movements", f"{apart:.0f} mm away", -1.0))
    return tuple(found)
