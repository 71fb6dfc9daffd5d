"""JSON takes as curves, as animation programs export them: for each name its keys, a time and a value each.

    {"Curves": {"jawOpen": [{"Time": 0.0, "Value": 0.1}, ...], ...}}            also [time, value], {"times", "values"}
    {"curves": [{"name": "jawOpen", "keys": [{"frame": 1, "value": 0.1}, ...]}, ...]}
Frames     at the numbers of frames; of times, in the unit that their name tells, at the rate that the file tells, else
           at the usual step of all keys
Between    keys a curve runs straight, before the first and behind the last it stays: said where keys are fewer
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
from jaxtyping import Float

from capture_plan.curves.columns import kind_of, of_path, plain, unit_of
from capture_plan.curves.json_weights import is_number, known
from capture_plan.curves.rows import Rows, table_of
from capture_plan.curves.weights import WeightTable
from capture_plan.errors import RigError

DEEPEST = 6
LABELS = ("name", "curve", "curvename", "target", "attribute", "property", "shape", "blendshape", "datapath")
TIMES, VALUES = ("x", "key", "times"), ("value", "val", "v", "y", "weight", "values", "weights")
FEWEST = 2  # names of a face
MOST_FRAMES = 1_000_000
Keys = tuple[list[float], list[float], float | None]  # times, values, seconds in a unit of time (0: numbers of frames)


def curve_take(document: Any, fps: float | None) -> WeightTable | None:
    """The take that curves in a document make; None where it holds none. `fps` is the rate that the file tells."""
    found = curves_in(document)
    if found is None:
        return None
    units = [unit for *_, unit in found.values()]
    curves = {n: (np.array(times, float) * (unit or 1), np.array(x, float)) for n, (times, x, unit) in found.items()}
    every = np.unique(np.concatenate([times for times, _ in curves.values()]))
    counted = units.count(0.0) == len(units) or (not any(units) and bool((every == np.round(every)).all()))
    steps = np.diff(every)
    step = 1.0 if counted else 1 / fps if fps else float(np.median(steps)) if len(steps) else 1.0
    at = frames_at(every, step)
    x = np.column_stack([sampled(at, *curve) for curve in curves.values()])
    rate = fps if counted or fps else round(1 / step, 3) or None
    message = f"it holds curves: they are read at {len(at):,} frames, each curve straight between its keys"
    few = any(len(times) < len(at) for times, _ in curves.values())
    rows = Rows(tuple(curves), x, np.zeros(len(at), dtype=bool), {})
    return table_of(rows, rate, (), (message,) if few else ())


def frames_at(every: Float[np.ndarray, " n"], step: float) -> Float[np.ndarray, " t"]:
    """Times from the first key to the last, one step apart. RigError where these are too many."""
    count = float(every[-1] - every[0]) / step
    if not 0 <= count < MOST_FRAMES:
        raise RigError(f"has curves of {count:,.0f} frames, expected at most {MOST_FRAMES:,}: export it again")
    return every[0] + step * np.arange(round(count) + 1)


def sampled(
    at: Float[np.ndarray, " t"], times: Float[np.ndarray, " n"], values: Float[np.ndarray, " n"]
) -> Float[np.ndarray, " t"]:
    """Values of a curve at these times."""
    order = times.argsort(kind="stable")
    return np.interp(at, times[order], values[order])


def curves_in(value: Any, depth: int = 0) -> dict[str, Keys] | None:
    """The first curves by name that a document holds; None where there are none."""
    if depth > DEEPEST or not isinstance(value, dict | list):
        return None
    named = _by_name(value) if isinstance(value, dict) else labelled(value)
    if sum(map(known, named)) >= FEWEST:
        return named
    parts = value.values() if isinstance(value, dict) else value if len(value) < MOST_FRAMES and depth < 2 else ()
    return next((found for part in parts if (found := curves_in(part, depth + 1))), None)


def _by_name(value: Mapping[str, Any]) -> dict[str, Keys]:
    """Curves that stand under their names."""
    return {of_path(name): keys for name, one in value.items() if (keys := keys_in(one) or keys_below(one))}


def labelled(values: list[Any]) -> dict[str, Keys]:
    """Curves of a list whose objects hold name and keys."""
    found: dict[str, Keys] = {}
    for one in values:
        if not isinstance(one, dict):
            return {}
        spelled = {plain(key): inner for key, inner in one.items()}
        name = next((spelled[key] for key in LABELS if isinstance(spelled.get(key), str)), None)
        keys = keys_in(one) or keys_below(one)
        if name is not None and keys:
            found.setdefault(of_path(name), keys)
    return found


def keys_below(value: Any) -> Keys | None:
    """The keys that an object holds under a name of its own."""
    if not isinstance(value, dict):
        return None
    return next((keys for inner in value.values() if (keys := keys_in(inner))), None)


def keys_in(value: Any) -> Keys | None:
    """The keys of a curve: a list of them, or lists of times and values; None where it is neither."""
    if isinstance(value, dict):
        times, values, unit = time_and_value(value)
        good = isinstance(times, list) and isinstance(values, list) and len(times) == len(values) > 0
        return (times, values, unit) if good and all(map(is_number, [*times, *values])) else None
    if not isinstance(value, list) or not value:
        return None
    pairs = [time_and_value(one) for one in value]
    if not all(is_number(time) and is_number(number) for time, number, _ in pairs):
        return None
    return [float(t) for t, _, _ in pairs], [float(x) for _, x, _ in pairs], pairs[0][2]


def time_and_value(one: Any) -> tuple[Any, Any, float | None]:
    """Time and value of a key, None where nothing stands for them, and the seconds in a unit of time: 0 where it is the
    number of a frame, None where nobody tells."""
    if isinstance(one, list):
        return (*one, None) if len(one) == 2 else (None, None, None)
    if not isinstance(one, dict):
        return None, None, None
    if isinstance(co := one.get("co"), list) and len(co) == 2:  # Blender's keyframe points
        return co[0], co[1], 0.0
    time = next((key for key in one if kind_of(key) in ("time", "count") or plain(key) in TIMES), None)
    value = next((key for key in one if plain(key) in VALUES), None)
    if time is None or value is None:
        return None, None, None
    return one[time], one[value], 0.0 if kind_of(time) == "count" else unit_of(time)
