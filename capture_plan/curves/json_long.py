"""JSON takes with an object for each weight of each frame: the objects of one time are a frame.

[{"timestamp": 0.0, "location": "jawOpen", "value": 0.5}, {"timestamp": 0.0, "location": "eyeBlinkLeft", ...}, ...]
"""

from typing import Any

from capture_plan.curves.columns import kind_of
from capture_plan.curves.json_weights import is_category

FEWEST = 2  # weights in a frame, on average
SOME = 50  # objects looked at
TWICE = 0.05  # of the objects may name what their frame has already


def gathered(document: Any) -> list[dict[str, Any]] | None:
    """A list of frames of such objects; None where it is no list of them."""
    if not isinstance(document, list) or len(document) < FEWEST or not all(map(is_category, document[:SOME])):
        return None
    clocks = [key for kind in ("code", "time", "count") for key in document[0] if kind_of(key) == kind]
    for clock in clocks:
        frames: dict[Any, list[Any]] = {}
        for one in document:
            if is_category(one) and isinstance(one.get(clock), int | float | str):
                frames.setdefault(one[clock], []).append(one)
        if frames and len(document) >= FEWEST * len(frames):
            return [{clock: time, "blendShapes": weights} for time, weights in frames.items()]
    return None
