"""Frames of named weights as JSON tools write them, gathered into one table.

    {"timestamp": s, "blendShapes": {name: weight}}         ARKit apps; Faceware: "animationValues"
    {"timestampMs": ms, name: weight, ...}
    [{"categoryName": name, "score": weight}, ...]          MediaPipe tasks, also category_name
    {"faceBlendshapes": [{"categories": [...]}], ...}       MediaPipe in a browser: one entry for each face
    [weight, ...]                                           with names beside the frames: Audio2Face
A name that some frames leave out has weight 0 there, which is said. A frame whose weights are null or empty has lost
the face; one in which a weight is no number is damaged.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, TypeGuard

import numpy as np

from capture_plan.rig.sequence.clock import Timing, timing_of
from capture_plan.rig.sequence.columns import kind_of, plain, unit_of, why_not
from capture_plan.rig.sequence.rows import Rows, table_of
from capture_plan.rig.sequence.weights import WeightTable

SHAPE_KEYS = (
    *("blendshapes", "faceblendshapes", "animationvalues", "categories"),
    *("weights", "shapes", "values", "coefficients"),
)
NEST_KEYS = ("result", "results", "face", "faces", "frame", "data", "params")
LABEL_KEYS = ("categoryname", "name", "displayname", "label", "shape")
SCORE_KEYS = ("score", "value", "weight", "coefficient")
SAME_RATE = 0.02
CONTAINERS, NUMBERS = {dict, list, type(None)}, {int, float}
NO = (False, 0, "0", "false", "False", "no")


class DamagedFrameError(Exception):
    """What is wrong with one frame."""


@dataclass
class Recording:
    """Frames as they come. `orders`: rows of weights by the names in their order; `names` those of bare numbers."""

    names: Sequence[str] = ()
    orders: dict[tuple[str, ...], tuple[list[int], list[np.ndarray]]] = field(default_factory=dict)
    times: list[str] = field(default_factory=list)
    unit_s: float | None = None
    lost: list[bool] = field(default_factory=list)
    failed: list[bool] = field(default_factory=list)
    faults: dict[int, str] = field(default_factory=dict)
    crowded: int = 0

    def add(self, frame: Any) -> None:
        """One frame."""
        t = len(self.lost)
        self.lost.append(False)
        self.failed.append(False)
        try:
            named = self.weights_in(frame)
            values = None if named is None else np.array(list(named.values()), dtype=np.float64)
        except DamagedFrameError as error:
            self.faults[t] = f"frame {t:,} {error}"
        except (ValueError, TypeError, OverflowError):
            self.faults[t] = f"frame {t:,} holds a weight that is no number"
        else:
            self.keep(t, named, values)
        if isinstance(frame, dict):
            self.look_beside(t, frame)

    def keep(self, t: int, named: Mapping[str, Any] | None, values: np.ndarray | None) -> None:
        """The weights of frame t."""
        self.lost[t] = named is None
        if named is not None and values is not None:
            rows, kept = self.orders.setdefault(tuple(named), ([], []))
            rows.append(t)
            kept.append(values)

    def look_beside(self, t: int, frame: Mapping[str, Any]) -> None:
        """What frame t says beside its weights: its time, and whether a face was tracked."""
        for key, value in frame.items():
            kind = kind_of(key) if type(value) not in CONTAINERS else None
            if kind in ("code", "time") and len(self.times) <= t:
                self.times.append(str(value))
                self.unit_s = unit_of(key)
            elif kind == "tracked":
                self.failed[t] = value in NO

    def weights_in(self, value: Any) -> Mapping[str, Any] | None:
        """The weights by name in a part of a frame; None where it holds no face."""
        if value is None or value in ({}, []):
            return None
        reader = next((read for fits, read in self.dialects if fits(value)), None)
        if reader is None:
            raise DamagedFrameError("holds no weights")
        return reader(value)

    @property
    def dialects(self) -> tuple[tuple[Callable[[Any], Any], Callable[[Any], Mapping[str, Any] | None]], ...]:
        """How parts of a frame can look, and what reads them: the first that fits."""
        return (
            (lambda value: has_key(value, SHAPE_KEYS), lambda value: self.weights_in(by_key(value, SHAPE_KEYS))),
            (has_numbers, named_numbers),
            (lambda value: has_key(value, NEST_KEYS), lambda value: self.weights_in(by_key(value, NEST_KEYS))),
            (lambda value: isinstance(value, dict), lambda _: None),
            (lambda value: isinstance(value, list) and is_category(value[0]), categories),
            (lambda value: isinstance(value, list) and isinstance(value[0], dict | list), self.first_face),
            (lambda value: isinstance(value, list), self.bare_numbers),
        )

    def first_face(self, faces: list[Any]) -> Mapping[str, Any] | None:
        """The weights of the first of several faces."""
        self.crowded += len(faces) > 1
        return self.weights_in(faces[0])

    def bare_numbers(self, values: list[Any]) -> Mapping[str, Any] | None:
        """Numbers in the order of the names; no face where all are null."""
        if all(x is None for x in values):
            return None
        if len(values) != len(self.names):
            raise DamagedFrameError(f"has {len(values)} numbers, expected {len(self.names)}")
        return dict(zip(self.names, values, strict=True))

    def table(self, fps: float | None) -> WeightTable:
        """The table of all frames; `fps` is what the file says beside them."""
        names = tuple(dict.fromkeys(name for order in self.orders for name in order))
        place = {name: c for c, name in enumerate(names)}
        x = np.full((len(self.lost), len(names)), np.nan)
        given = np.zeros(len(names), dtype=int)
        for order, (rows, values) in self.orders.items():
            columns = [place[name] for name in order]
            x[rows] = 0
            x[np.ix_(rows, columns)] = np.stack(values)
            given[columns] += len(rows)
        x[np.isinf(x)] = np.nan
        failed = np.array(self.failed, dtype=bool)
        lost = np.array(self.lost, dtype=bool) | (failed & ~failed.all())
        timing = self.timing(fps)
        rows = Rows(names, x, lost, self.faults)
        return table_of(rows, timing.fps, notes=(*self.said(given), *timing.notes))

    def said(self, given: np.ndarray) -> tuple[str, ...]:
        """Sentences about names that were left out of frames, and about other faces."""
        seldom = int((given < sum(len(rows) for rows, _ in self.orders.values())).sum())
        notes = []
        if seldom:
            notes.append(f"{seldom:,} of {len(given):,} names are missing in some frames and count as 0 there")
        if self.crowded:
            notes.append(f"{self.crowded:,} frames hold several faces: the first is read")
        return tuple(notes)

    def timing(self, fps: float | None) -> Timing:
        """The timing of the frames' own times; what the file says beside them where these tell none."""
        found = timing_of(self.times, self.unit_s) if self.times else Timing(None)
        if found.fps is None or fps is None or abs(found.fps - fps) < SAME_RATE * fps:
            return Timing(fps or found.fps, found.notes)
        told = f"it says {fps:g} frames in a second, but its times make it {found.fps:g}: the times are followed"
        return Timing(found.fps, (*found.notes, told))


def by_key(value: Mapping[str, Any], keys: Sequence[str]) -> Any:
    """The object, list or null under the first of these keys, whatever their spelling."""
    found = {plain(key): inner for key, inner in value.items() if type(inner) in CONTAINERS}
    return next(found[key] for key in keys if key in found)


def has_key(value: Any, keys: Sequence[str]) -> bool:
    """Whether an object has an object, a list or null under one of these keys."""
    if not isinstance(value, dict) or not CONTAINERS & set(map(type, value.values())):
        return False
    return any(type(inner) in CONTAINERS and plain(key) in keys for key, inner in value.items())


def has_numbers(value: Any) -> bool:
    """Whether an object holds a number under a name that can be a weight's."""
    return isinstance(value, dict) and any(is_number(x) and not why_not(name) for name, x in value.items())


def named_numbers(value: Mapping[str, Any]) -> Mapping[str, Any]:
    """The numbers and nulls under names that can be weights'."""
    if set(map(type, value.values())) <= NUMBERS and all_weights(tuple(value)):
        return value
    return {name: x for name, x in value.items() if (x is None or is_number(x)) and not why_not(name)}


@lru_cache(64)
def all_weights(names: tuple[str, ...]) -> bool:
    """Whether all of these can be weights; asked once for frames of the same names."""
    return not any(map(why_not, names))


def is_category(value: Any) -> bool:
    """Whether an object names one weight: {"categoryName": "jawOpen", "score": 0.5}."""
    keys = {plain(key) for key in value} if isinstance(value, dict) else set()
    return bool(keys & set(LABEL_KEYS)) and bool(keys & set(SCORE_KEYS))


def categories(values: Sequence[Any]) -> Mapping[str, Any]:
    """Weights of a list of categories."""
    found = [{plain(key): inner for key, inner in one.items()} for one in values if is_category(one)]
    return {
        next((one[key] for key in LABEL_KEYS if isinstance(one.get(key), str) and one[key]), ""): next(
            one[key] for key in SCORE_KEYS if key in one
        )
        for one in found
    }


def is_number(value: Any) -> TypeGuard[int | float]:
    """Whether a value is a number and no truth value."""
    return isinstance(value, int | float) and not isinstance(value, bool)
