"""Recorded weights as JSON documents: where the frames are, in the dialects of many tools (`json_frames.py`: a frame).

Frames     a list at the top, or below "frames", "data", ...; or a line for each frame (JSON lines)
Numbered   {"0": frame, "1": frame, ...} or {"0.033": frame, ...}
Columns    {name: [weight, ...], ...}, or {name: {"0": weight, "1": weight, ...}, ...}
One        a single frame
Long       an object for each weight (`json_long.py`)
Curves     for each name its keys (`json_curves.py`)
Parts of a document are decoded one at a time, when they are needed.
"""

import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec

from capture_plan.curves.columns import kind_of, plain, unit_of, why_not
from capture_plan.curves.json_curves import curve_take
from capture_plan.curves.json_faces import SHAPE_KEYS
from capture_plan.curves.json_frames import ASIDE, FrameRecording
from capture_plan.curves.json_long import gathered
from capture_plan.curves.json_several import is_frame, only_take
from capture_plan.curves.json_twice import message_of
from capture_plan.curves.json_weights import is_category, is_number, known
from capture_plan.curves.stated_rate import possible, rate_in_value
from capture_plan.curves.text import text_of
from capture_plan.curves.weights import WeightTable
from capture_plan.errors import RigError
from capture_plan.input.bounds import MOST_TAKE_VALUES, check_values

NAME_KEYS = ("names", "facsnames", "blendshapenames", "columns", "posenames")
FRAME_KEYS = ("frames", "weights", "weightmat", "data", "values", "results", "samples", "blendshapes")
RATE_KEYS = ("fps", "exportfps", "framerate", "samplerate")
LASTED_KEYS = ("dt", "deltatime", "frametime", "frameduration", "timestep")  # seconds that a frame lasts
TOLD_KEYS = (*RATE_KEYS, *LASTED_KEYS)
HEAD_KEYS = ("metadata", "meta", "info", "header", "settings", "data", "take", "recording")
NO_NUMBER = re.compile(r"(?<=[\[:,\s])(?:NaN|-?Infinity)(?=\s*[,\]}])")
TRAILING = re.compile(r",(\s*[\]}])")  # a comma before a bracket, as hand-made writers leave it
NUMBERED = re.compile(r"\D*(\d+(?:\.\d+)?)\D*")
NUMBER = re.compile(r"\d+(?:\.\d+)?")
FEWEST = 2  # names of a face
USUAL_KEYS = (*FRAME_KEYS, *HEAD_KEYS, *SHAPE_KEYS)
Document = list[msgspec.Raw] | dict[str, msgspec.Raw]
Dialect = Callable[[Document], WeightTable | None]
UNREADABLE = (msgspec.DecodeError, ValueError, RecursionError)


def read_json(path: Path) -> WeightTable:
    """The frames of a JSON file. RigError where it holds no weights that can be told."""
    try:
        text, notes = text_of(path)
        return take_in(text, (*notes, *message_of(text)))
    except RecursionError:
        raise RigError("nests deeper than any take: export it again") from None


def take_in(text: str, notes: tuple[str, ...]) -> WeightTable:
    """The frames of a document; `notes` are what has to be said of its text."""
    check_values(text, MOST_TAKE_VALUES)
    document = _decode(text)
    if (
        isinstance(document, list)
        and document
        and is_category(opened(document[0]))
        and (rows := gathered(_whole(document)))
    ):
        document = parts_again(rows)
    take = None if is_plain(document) else only_take(_whole(document))
    messages = (
        *notes,
        *([f"of the file, '{take.name}' is read"] if take and plain(take.name) not in USUAL_KEYS else []),
    )
    part = document if take is None else parts_again(take.part)
    for dialect in DIALECTS:
        if table := dialect(part):
            return replace(table, fps=table.fps or rate_in(head_of(document)), notes=(*messages, *table.notes))
    if table := curve_take(_whole(document), rate_in(head_of(document))):
        return replace(table, notes=(*notes, *table.notes))
    raise RigError('holds no weights: expected frames such as {"blendShapes": {"jawOpen": 0.5}}')


def _decode(text: str) -> Document:
    """The parts of a document, each still undecoded; of JSON lines, the lines. RigError where it is neither."""
    problem: Exception | None = None
    plainer = NO_NUMBER.sub("null", text) if "NaN" in text or "Infinity" in text else text
    for some in dict.fromkeys((text, plainer, TRAILING.sub(r"\1", plainer))):
        try:
            return msgspec.json.decode(some, type=Document)
        except UNREADABLE as error:
            problem = error
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    if len(lines) > 1 and all(line[0] in "[{" and line[-1] in "]}" for line in lines[:3]):
        return [msgspec.Raw(NO_NUMBER.sub("null", line).encode()) for line in lines]
    raise RigError(f"is no JSON ({str(problem)[:80]}): export the take again") from problem


def is_plain(document: Document) -> bool:
    """Whether a document shows at its first part that it is one take and no more, as most do."""
    head = head_of(document)
    found = document if isinstance(document, list) else list_of_frames(head)
    if found:
        first = next((opened(raw) for raw in found if opening(raw) != "n"), None)
        return is_frame(first) or is_numbers(first)
    first = next(iter(head.items()), None)
    if first is not None and NUMBERED.fullmatch(first[0]) and is_frame(opened(first[1])):
        return True
    lists = (raw for key, raw in head.items() if known(key) and opening(raw) == "[")
    return any(is_numbers(opened(raw)) for raw in lists)


def _whole(document: Document) -> Any:
    """All parts of a document decoded."""
    if isinstance(document, list):
        return [opened(raw) for raw in document]
    return {key: opened(raw) for key, raw in document.items()}


def parts_again(value: Any) -> Document:
    """The parts of a value, each undecoded."""
    return msgspec.json.decode(msgspec.json.encode(value), type=Document)


def head_of(document: Document) -> dict[str, msgspec.Raw]:
    """What a document has by name; nothing of a list."""
    return document if isinstance(document, dict) else {}


def _frames(document: Document) -> WeightTable | None:
    """A list of frames at the top or below a key."""
    head = document if isinstance(document, dict) else {}
    found = document if isinstance(document, list) else list_of_frames(head)
    first = next((opened(raw) for raw in found or () if opening(raw) != "n"), None)
    if found is None or not isinstance(first, dict | list) or is_category(first):
        return _inside(document, _frames)
    names = next((value for key, raw in head.items() if plain(key) in NAME_KEYS and is_texts(value := opened(raw))), ())
    recording = FrameRecording(names)
    rows = [opened(raw) for raw in found] if names else ()
    across = is_turned(rows, len(names))
    for frame in zip(*rows, strict=True) if across else rows or map(opened, found):
        recording.add(list(frame) if across else frame)
    clock = next((key for key, raw in head.items() if kind_of(key) in ("code", "time") and opening(raw) == "["), None)
    if clock:
        recording.times, recording.unit_s = [str(one) for one in opened(head[clock])], unit_of(clock)
    table = recording.table(rate_in(head))
    message = f"it holds a list for each of {len(names):,} names, not for each frame: it is turned"
    return replace(table, notes=(message, *table.notes)) if across else table


def is_turned(rows: Sequence[Any], names: int) -> bool:
    """Whether there is a list of numbers for each of the names, of as many frames, and none for each frame."""
    lengths = {len(row) if isinstance(row, list) else 0 for row in rows}
    return len(rows) == names > 1 and len(lengths) == 1 and not lengths & {0, names} and all(map(is_numbers, rows))


def _numbered(document: Document) -> WeightTable | None:
    """Frames by their numbers or times."""
    head = document if isinstance(document, dict) else {}
    keys = {match[1]: key for key in head if (match := NUMBERED.fullmatch(key))}
    if not keys or len(keys) < len(head) or any(opening(raw) not in "{[n" for raw in head.values()):
        return _inside(document, _numbered, FRAME_KEYS)
    recording, order = FrameRecording(), sorted(keys, key=float)
    for number in order:
        recording.add(opened(head[keys[number]]))
    recording.times = order
    return recording.table(None) if recording.orders else None


def _columns(document: Document) -> WeightTable | None:
    """A list of numbers for each name, and lists of what is beside them. RigError where they differ in length."""
    head = document if isinstance(document, dict) else {}
    lists = {key: opened(raw) for key, raw in head.items() if opening(raw) == "["}
    named = {key: values for key, values in lists.items() if is_numbers(values) and not why_not(key)}
    if not named:
        return _inside(document, _columns)
    usual = Counter(map(len, named.values())).most_common(1)[0][0]
    if uneven := [key for key, values in named.items() if len(values) != usual]:
        few = f"has {len(named[uneven[0]]):,} numbers for '{uneven[0]}'"
        raise RigError(f"{few}, {usual:,} for other names: export the take again")
    aside = {key: values for key, values in lists.items() if kind_of(key) in ASIDE and len(values) == usual}
    recording = FrameRecording()
    for row in zip(*named.values(), *aside.values(), strict=True):
        recording.add(dict(zip((*named, *aside), row, strict=True)))
    return recording.table(rate_in(head))


def keyed(document: Document) -> WeightTable | None:
    """The numbers of each name under those of their frames, as pandas writes a data frame; or under their times."""
    head = head_of(document)
    if sum(known(key) for key, raw in head.items() if opening(raw) == "{") < FEWEST:
        return _inside(document, keyed)
    found = {key: opened(raw) for key, raw in head.items() if opening(raw) == "{"}
    found = {key: one for key, one in found.items() if one and all(map(NUMBER.fullmatch, one))}
    if sum(map(known, found)) < FEWEST:
        return None
    at = sorted({number for one in found.values() for number in one}, key=float)
    lists = {key: [one.get(number) for number in at] for key, one in found.items()}
    counted = [float(number) for number in at] == list(range(int(float(at[0])), int(float(at[0])) + len(at)))
    if not counted and not any(kind_of(key) in ("code", "time") for key in head):
        lists["time"] = at
    return _columns(parts_again({**head, **lists}))


def one(document: Document) -> WeightTable | None:
    """The table of a document that is a single frame; None where it is none."""
    frame = _whole(document)
    bare = isinstance(frame, dict) and not any(plain(key) in SHAPE_KEYS for key in frame)
    if bare and (len(frame) < 2 or not is_frame(frame)):
        return None
    recording = FrameRecording()
    recording.add(frame)
    return recording.table(None) if recording.orders else None


DIALECTS: tuple[Dialect, ...] = (_frames, keyed, _numbered, _columns, one)


def _inside(document: Document, dialect: Dialect, below: Sequence[str] = ()) -> WeightTable | None:
    """What a dialect finds in an object below the top, also under the keys `below`, with the frame rate from above."""
    head = document if isinstance(document, dict) else {}
    for key, raw in head.items():
        if plain(key) in (*HEAD_KEYS, *SHAPE_KEYS, *below) and opening(raw) == "{":
            table = dialect(msgspec.json.decode(raw, type=dict[str, msgspec.Raw]))
            if table is not None:
                return replace(table, fps=table.fps or rate_in(head))
    return None


def list_of_frames(head: Mapping[str, msgspec.Raw]) -> list[msgspec.Raw] | None:
    """The list under the first key that frames stand under."""
    spelled = {plain(key): raw for key, raw in head.items() if opening(raw) == "["}
    return next(
        (msgspec.json.decode(spelled[key], type=list[msgspec.Raw]) for key in FRAME_KEYS if key in spelled), None
    )


def rate_in(head: Mapping[str, msgspec.Raw]) -> float | None:
    """The frame rate that an object tells, or one of those that describe the take."""
    asked = {plain(key): opened(raw) for key, raw in head.items() if plain(key) in TOLD_KEYS}
    for key, raw in head.items():
        if plain(key) in HEAD_KEYS and opening(raw) == "{":
            asked |= {plain(name): value for name, value in opened(raw).items() if plain(name) in TOLD_KEYS}
    rates = [rate_in_value(value) for name, value in asked.items() if name in RATE_KEYS]
    lasted = [value for name, value in asked.items() if name in LASTED_KEYS and is_number(value) and value > 0]
    rates += [1 / value for value in lasted if possible(1 / value)]
    return next((rate for rate in rates if rate is not None), None)


def opening(raw: msgspec.Raw) -> str:
    """The first character of a part: { of an object, [ of a list, n of null."""
    return bytes(memoryview(raw)[:1]).decode("latin-1")


def opened(raw: msgspec.Raw) -> Any:
    """A part decoded; a text where it is damaged, so that it is no frame."""
    try:
        return msgspec.json.decode(raw)
    except UNREADABLE:
        return "damaged"


def is_texts(value: Any) -> bool:
    """Whether a value is a list of texts."""
    return isinstance(value, list) and bool(value) and all(isinstance(item, str) for item in value)


def is_numbers(value: Any) -> bool:
    """Whether a value is a list of numbers or nulls, not all null."""
    return isinstance(value, list) and all(x is None or is_number(x) for x in value) and any(map(is_number, value))
