"""Frames of named weights as JSON tools write them, gathered into one table.

    {"timestamp": s, "blendShapes": {name: weight}}         ARKit apps; Faceware: "animationValues"
    {"timestampMs": ms, name: weight, ...}
    [{"categoryName": name, "score": weight}, ...]          MediaPipe tasks, also category_name
    {"faceBlendshapes": [{"categories": [...]}], ...}       MediaPipe in a browser: one entry for each face
    {"names": [name, ...], "values": [weight, ...]}         Unity's JsonUtility, under any keys
    [weight, ...]                                           with names beside the frames: Audio2Face
How names and weights of one face stand: `json_weights.py`; names that frames leave out: `sparse.py`. A frame whose
weights are null or empty has lost the face; one in which a weight is no number is damaged. Faces with numbers or names
of their own are distinguished, and one of them is the take (`presence.py`).
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int

from capture_plan.curves.clock import Timing, agreed, by_numbers, timing_by, timing_of
from capture_plan.curves.columns import CLOCK_KINDS, MANY, kind_of, plain, unit_of, why_not
from capture_plan.curves.empty_frames import EMPTY, NAMELESS, fill_frames
from capture_plan.curves.json_faces import CONTAINERS, NEST_KEYS, SHAPE_KEYS, by_key, faces_of, has_key, versions_of
from capture_plan.curves.json_weights import (
    has_numbers,
    is_number,
    is_weight,
    known,
    named_numbers,
    named_weights,
    number_in,
    unread,
)
from capture_plan.curves.lost_signs import rows_without_face
from capture_plan.curves.presence import other_faces, refuse_takes
from capture_plan.curves.rows import Rows, table_of
from capture_plan.curves.streams import in_turn
from capture_plan.curves.text import NOTHING
from capture_plan.curves.weights import WeightTable
from capture_plan.formats.naming import listed
from capture_plan.input.bounds import check_cells, check_names

ABOUT_KEYS = (
    *("meta", "metadata", "info", "information", "header", "status", "state", "tracking", "tracker", "trackinginfo"),
    *("faceinfo", "frameinfo", "framemeta", "capture", "device", "camera", "session", "source", "time", "timing"),
    *("clock", "properties", "attributes", "context", "quality"),
)
SAME_RATE = 0.02
ASIDE = (*CLOCK_KINDS, "count", "tracked", "lost", "confidence", "face", "source", "take")
LONGEST = 64  # letters of a device's name
SOME = 6  # names listed in a sentence


def _paired(frame: Any) -> Any:
    """The frame with its weights by name where it holds a list of names and as long a list of numbers."""
    lists = {key: inner for key, inner in frame.items() if isinstance(inner, list)} if isinstance(frame, dict) else {}
    texts = [key for key, inner in lists.items() if inner and isinstance(inner[0], str) and known(inner[0])]
    if len(texts) != 1 or not all(isinstance(name, str) for name in lists[texts[0]]):
        return frame
    names = lists.pop(texts[0])
    numbers = [key for key, inner in lists.items() if len(inner) == len(names) and all(map(is_number, inner))]
    if len(numbers) != 1:
        return frame
    rest = {key: inner for key, inner in frame.items() if key not in (texts[0], numbers[0])}
    return {**rest, "blendShapes": dict(zip(names, lists[numbers[0]], strict=True))}


class DamagedFrameError(Exception):
    """What is wrong with one frame."""


@dataclass
class FrameRecording:
    """Frames as they come. `orders`: rows of weights by the names in their order; `names` those of bare numbers.

    `wordy[name]` is what rows hold in place of a number, by row; `facts[kind, key]` what they say beside their
    weights, by row too: times, faces, whether one was tracked.
    """

    names: Sequence[str] = ()
    orders: dict[tuple[str, ...], tuple[list[int], list[np.ndarray]]] = field(default_factory=dict)
    facts: dict[tuple[str, str], dict[int, str]] = field(default_factory=dict)
    times: Sequence[str] = ()
    unit_s: float | None = None
    lost: list[bool] = field(default_factory=list)
    empty: list[int] = field(default_factory=list)
    faults: dict[int, str] = field(default_factory=dict)
    crowded: int = 0
    written: bool = False
    mixed: int = 0
    versions: dict[str, None] = field(default_factory=dict)
    aside: dict[str, None] = field(default_factory=dict)
    wordy: dict[str, dict[int, str]] = field(default_factory=dict)

    def add(self, frame: Any) -> None:
        """One frame, a row for each of its faces where these have names."""
        one, versions = versions_of(_paired(frame))
        self.versions |= dict.fromkeys(versions)
        for face in faces_of(one):
            self.add_face(face)

    def add_face(self, frame: Any) -> None:
        """One face of one frame."""
        t = len(self.lost)
        self.lost.append(False)
        self.empty.append(0)
        try:
            named = self.weights_in(frame)
            values = None if named is None else self.numbers(named)
        except DamagedFrameError as error:
            self.faults[t] = f"frame {t:,} {error}"
        except (ValueError, TypeError, OverflowError):
            self.faults[t] = f"frame {t:,} holds a weight that is no number"
        else:
            self.keep(t, named, values)
        if isinstance(frame, dict):
            self.look_around(t, frame)

    def numbers(self, named: Mapping[str, Any]) -> np.ndarray:
        """The weights of a frame as numbers."""
        values = list(named.values())
        if str in set(map(type, values)):
            signs = sum(type(x) is str and x.strip().endswith("%") for x in values)
            if 0 < signs < len(values):  # hundredths beside weights
                self.mixed += 1
                values = [number_in(x) / (100 if type(x) is str and x.strip().endswith("%") else 1) for x in values]
            self.written |= signs == len(values)
            values = [number_in(x) for x in values]
        return np.array(values, dtype=np.float64)

    def keep(self, t: int, named: Mapping[str, Any] | None, values: np.ndarray | None) -> None:
        """The weights of frame t."""
        self.lost[t] = named is None
        if named is not None and values is not None:
            rows, retained = self.orders.setdefault(tuple(named), ([], []))
            rows.append(t)
            retained.append(values)

    def look_around(self, t: int, frame: Mapping[str, Any]) -> None:
        """What frame t says beside its weights: its time, whether a face was tracked, and whose."""
        for key, value in frame.items():
            if type(value) not in CONTAINERS:
                kind = kind_of(key)
                if kind in ASIDE:
                    self.facts.setdefault((kind, key), {}).setdefault(t, str(value))
                elif type(value) is str and kind is None and len(value) <= LONGEST:
                    self.facts.setdefault(("text", key), {}).setdefault(t, value)
            elif type(value) is dict and plain(key) in (*NEST_KEYS, *ABOUT_KEYS):
                self.look_around(t, value)
            elif type(value) is dict and plain(key) in SHAPE_KEYS and (own := list_names(tuple(value))):
                self.look_around(t, {name: value[name] for name in own})

    def weights_in(self, value: Any) -> Mapping[str, Any] | None:
        """The weights by name in a part of a frame; None where it holds no face."""
        if value is None:
            return None
        if value in ({}, []):
            self.empty[-1] = NAMELESS if isinstance(value, list) else EMPTY
            return None
        reader = next((read for fits, read in self.dialects if fits(value)), None)
        if reader is None:
            raise DamagedFrameError("holds no weights")
        return reader(value)

    @property
    def dialects(self) -> tuple[tuple[Callable[[Any], Any], Callable[[Any], Mapping[str, Any] | None]], ...]:
        """How parts of a frame can look, and what reads them: the first that fits."""
        return (
            (lambda value: has_key(value, SHAPE_KEYS), self.shapes_and_more),
            (has_numbers, self.numbers_in),
            (lambda value: has_key(value, NEST_KEYS), lambda value: self.weights_in(by_key(value, NEST_KEYS))),
            (lambda value: isinstance(value, dict), self.nothing_in),
            (named_weights, named_weights),
            (lambda value: isinstance(value, list) and isinstance(value[0], dict | list), self.first_face),
            (lambda value: isinstance(value, list), self.bare_numbers),
        )

    def nothing_in(self, value: Mapping[str, Any]) -> None:
        """An object that names no weight, as an empty one where it does not say that one is null."""
        self.empty[-1] = 0 if None in value.values() else NAMELESS

    def shapes_and_more(self, value: Mapping[str, Any]) -> Mapping[str, Any] | None:
        """The weights of an object that holds one of weights, with what it names of a face beside that."""
        found = self.shapes_in(by_key(value, SHAPE_KEYS))
        more = {} if found is None else named_lists(value)
        return {**more, **found} if found and more else found

    def shapes_in(self, value: Any) -> Mapping[str, Any] | None:
        """The weights of an object in which every name should be one; what is none is remembered."""
        if isinstance(value, dict) and value and not has_key(value, SHAPE_KEYS):
            self.aside |= dict.fromkeys(unread(value))
            return self.numbers_in(value) or None
        return self.weights_in(value)

    def numbers_in(self, value: Mapping[str, Any]) -> Mapping[str, Any]:
        """The numbers in an object; what is none is remembered, for it may stand in place of a weight."""
        for name in unread(value):
            if (word := str(value[name])[:24].strip()).lower() not in NOTHING:
                self.wordy.setdefault(name, {})[len(self.lost) - 1] = word
        return named_numbers(value)

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
        """The table of all frames of one face; `fps` is what the file says beside them."""
        for key, cells in self.columns("take"):
            refuse_takes(key, cells)
        mine, whose = self.one_face()
        timing = self.timing(fps, mine)
        retained = np.flatnonzero(mine) if timing.order is None else np.flatnonzero(mine)[timing.order]
        names = tuple(dict.fromkeys(name for order in self.face_orders for name in order))
        check_cells(len(mine), len(names))
        check_names(names, "")
        place = {name: c for c, name in enumerate(names)}
        x, given = np.full((len(mine), len(names)), np.nan), np.zeros((len(mine), len(names)), dtype=bool)
        for order, (rows, values) in self.face_orders.items():
            columns = np.ix_(rows, [place[name] for name in order])
            x[columns], given[columns] = np.stack(values), True
        x[np.isinf(x)] = np.nan
        self.aside = {name: None for name in self.aside if name not in place}
        for name in self.wordy.keys() & place.keys():
            self.faults |= {t: f"frame {t:,} has '{word}' for '{name}'" for t, word in self.wordy[name].items()}
        faults = {t: self.faults[row] for t, row in enumerate(retained.tolist()) if row in self.faults}
        x, sound = x[retained], ~np.isin(np.arange(len(retained)), list(faults))
        empty = np.array(self.empty, dtype=int)[retained][sound]
        x[sound], left_out, there = fill_frames(x[sound], given[retained][sound], empty, names)
        everywhere = np.full((len(mine), len(names)), np.nan)
        everywhere[retained] = x
        gone, messages = self.gone(retained[sound][there], everywhere)
        rows = Rows(names, x, gone[retained], faults)
        return table_of(
            rows,
            timing.fps,
            (),
            (*whose, *left_out, *self.said(), *messages, *timing.notes),
            100.0 if self.written and not self.mixed else None,
        )

    @property
    def face_orders(self) -> Mapping[tuple[str, ...], tuple[list[int], list[np.ndarray]]]:
        """Rows whose names say something of a face, where any do: a head's turn alone is no face."""
        of_faces = {order: rows for order, rows in self.orders.items() if any(map(known, order))}
        return of_faces or self.orders

    def one_face(self) -> tuple[Bool[np.ndarray, " t"], tuple[str, ...]]:
        """Rows of the one face that is read, and what has to be said of others."""
        mine, notes = np.ones(len(self.lost), dtype=bool), []
        times = next((cells for kind in ("code", "time") for _, cells in self.columns(kind)), [])
        for kind, what in (("face", "faces"), ("source", "devices"), ("text", "devices")):
            for key, cells in self.columns(kind):
                if kind != "text" or (not is_weight(next(filter(None, cells), "")) and in_turn(cells, times)):
                    other, message = other_faces(key, cells, times, what=what)
                    mine &= ~other
                    notes += [message] if message else []
        return mine, tuple(notes)

    def gone(
        self, there: Int[np.ndarray, " n"], x: Float[np.ndarray, "t c"]
    ) -> tuple[Bool[np.ndarray, " t"], tuple[str, ...]]:
        """Rows without a face, by their weights or by what they say, and what has to be said of that.

        `there` are rows that have a face though they name no weight; x are the weights of all rows.
        """
        lost, notes = np.array(self.lost, dtype=bool), []
        lost[there] = False
        for order in self.orders.keys() - self.face_orders.keys():
            lost[self.orders[order][0]] = True
        for kind in ("tracked", "lost", "confidence"):
            for key, cells in self.columns(kind):
                failed, message = rows_without_face(key, cells, x, kind)
                lost |= failed
                notes += [message] if message else []
        return lost, tuple(notes)

    def columns(self, kind: str) -> Iterator[tuple[str, list[str]]]:
        """What rows say under each name of a kind, one cell for each row."""
        for (of, key), said in self.facts.items():
            if of == kind:
                yield key, [said.get(t, "") for t in range(len(self.lost))]

    def said(self) -> tuple[str, ...]:
        """Sentences about names that are no weights, and about other faces."""
        notes = []
        if self.aside:
            some, more = ", ".join(f"'{name}'" for name in list(self.aside)[:SOME]), len(self.aside) - SOME
            also = f" and {more:,} more" if more > 0 else ""
            one = len(self.aside) == 1
            notes.append(f"{some}{also} {'holds' if one else 'hold'} no number and {'is' if one else 'are'} not read")
        if self.versions:
            best, *others = self.versions
            quoted = listed(f"'{name}'" for name in others)
            notes.append(f"of '{best}' and {quoted}, versions of one face, '{best}' is read")
        if self.mixed:
            notes.append(f"in {self.mixed:,} frames only some weights carry a %: these are taken as hundredths")
        if self.crowded:
            notes.append(f"{self.crowded:,} frames hold several faces without names: the first is read, whoever it is")
        return tuple(notes)

    def timing(self, fps: float | None, mine: Bool[np.ndarray, " t"]) -> Timing:
        """The timing of the frames' own times; what the file says beside them where these tell none."""
        found = self.own_timing(mine)
        if found.fps is None or fps is None or abs(found.fps - fps) < SAME_RATE * fps:
            return replace(found, fps=fps or found.fps)
        message = f"it says {fps:g} frames in a second, but its times make it {found.fps:g}: the times are followed"
        return replace(found, notes=(*found.notes, message))

    def own_timing(self, mine: Bool[np.ndarray, " t"]) -> Timing:
        """The timing that the frames tell: timecodes first, then times, times beside the frames, numbers of frames."""
        timings = [
            (key, timing_by(kind, [cell for cell, own in zip(cells, mine, strict=True) if own], unit_of(key)))
            for kind in CLOCK_KINDS
            for key, cells in self.columns(kind)
        ]
        if not timings and self.times:
            found = timing_of(self.times, self.unit_s)
            timings = [("times", found if len(self.times) == mine.sum() else replace(found, order=None))]
        if timings:
            return agreed(timings)
        numbers = (
            by_numbers(key, [cell for cell, own in zip(cells, mine, strict=True) if own])
            for key, cells in self.columns("count")
        )
        return next(numbers, Timing(None))


@lru_cache(MANY)
def list_names(names: tuple[str, ...]) -> tuple[str, ...]:
    """Those of an object's names that say something beside its weights; asked once for objects of the same names."""
    return tuple(name for name in names if kind_of(name) in ASIDE)


def named_lists(value: Mapping[str, Any]) -> dict[str, Any]:
    """Weights of a face that stand beside the object of weights, some in objects of their own."""
    rest = {name: x for name, x in value.items() if plain(name) not in (*SHAPE_KEYS, *NEST_KEYS) and not why_not(name)}
    return {name: x for name, x in named_numbers(rest).items() if x is not None and known(name)} if rest else {}
