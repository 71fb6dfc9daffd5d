"""Takes within a JSON document: one is read from where it stands, several are named and never joined in silence.

    {"takes": [{"name": "a", "frames": [...]}, ...]}, {"take1": [frame, ...], "take2": [...]}, [[frame, ...], ...]
    {"a": {"frames": [...]}, "b": {"frames": [...]}}, {"a": {"jawOpen": [...], ...}, "b": {...}}; a take for each line
A part is a take when it holds frames of weights, or lists of weights by name. Lists that are more than the frames of
each are faces or names of one frame, and parts with other names or sides of a face are one take together.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from capture_plan.curves.columns import plain
from capture_plan.curves.json_frames import FrameRecording
from capture_plan.curves.json_weights import SIDES, is_number, known, named_weights
from capture_plan.errors import RigError
from capture_plan.prose import count

SURE_KEYS = ("frames", "samples", "weightmat")
FRAME_KEYS = (*SURE_KEYS, "data", "values", "results", "weights", "blendshapes")
NAME_KEYS = ("name", "take", "takename", "title", "label", "slate", "clip", "id", "number")
FEWEST = 2  # frames of a take, names of a face
MANY_FACES = 8  # more in a list are frames
DEEPEST = 3  # objects within each other
FEW = 6  # names in a sentence
LOOKED_AT = 8  # parts that tell what the others are


@dataclass(frozen=True, eq=False)
class _Take:
    """A part of a document that is a take by itself."""

    name: str
    frames: int
    part: Any


def only_take(document: Any) -> _Take | None:
    """The take that stands somewhere below the top of a document; None where there is none.

    RigError that names them where there are several.
    """
    takes = list(takes_in(document))
    if len(takes) < 2:
        return takes[0] if takes else None
    some = ", ".join(f"'{take.name}' with {count(take.frames, 'frame')}" for take in takes[:FEW])
    more = f" and {len(takes) - FEW:,} more" if len(takes) > FEW else ""
    message = f"holds {len(takes):,} takes or faces, each with frames of its own ({some}{more})"
    raise RigError(f"{message}: save each as a file of its own, and give one")


def takes_in(value: Any, deep: int = 0) -> Iterator[_Take]:
    """The takes below a value, nearest to the top."""
    parts = parts_of(value)
    some = [part for _, part in parts[:LOOKED_AT]]
    if not parts or deep > DEEPEST or _frames_in(value) or 2 * sum(map(is_frame, some)) > len(some):
        return
    takes = [_Take(name, n, part) for name, part in parts if plain(name) not in SIDES and (n := _frames_in(part))]
    if isinstance(value, list) and takes and max(take.frames for take in takes) <= len(parts) > MANY_FACES:
        return
    if takes and not _groups(takes):
        yield from takes
        return
    for _, part in parts:
        yield from takes_in(part, deep + 1)


def parts_of(value: Any) -> list[tuple[str, Any]]:
    """The objects and lists right below a value, with their names or numbers."""
    if isinstance(value, dict):
        return [(name, part) for name, part in value.items() if isinstance(part, dict | list)]
    if not isinstance(value, list):
        return []
    return [(_name_of(part, i), part) for i, part in enumerate(value, start=1) if isinstance(part, dict | list)]


def _name_of(part: Any, number: int) -> str:
    """What a part of a list is called, else its number."""
    own = part if isinstance(part, dict) else {}
    called = next((x for key, x in own.items() if plain(key) in NAME_KEYS and isinstance(x, str | int)), None)
    return str(called) if called not in (None, "") else f"take {number}"


def _frames_in(part: Any) -> int:
    """How many frames of a take a part holds; 0 where it is none."""
    if isinstance(part, list):
        return len(part) if len(part) >= FEWEST and all(map(is_frame, first_of(part))) else 0
    if not isinstance(part, dict):
        return 0
    for key, inner in part.items():
        short = plain(key)
        if short in FRAME_KEYS and isinstance(inner, list) and len(inner) >= FEWEST:
            enough = short in SURE_KEYS or len(inner) > MANY_FACES
            if enough and (_frames_in(inner) or all(map(are_numbers, first_of(inner)))):
                return len(inner)
    lengths = {len(inner) for inner in _columns_of(part).values()}
    return min(lengths) if lengths else 0


def _columns_of(part: Any) -> dict[str, Any]:
    """Lists of weights under names of a face, where there are some."""
    own = part if isinstance(part, dict) else {}
    lists = {name: x for name, x in own.items() if known(name) and are_numbers(x) and len(x) >= FEWEST}
    return lists if len(lists) >= FEWEST else {}


def _groups(takes: Sequence[_Take]) -> bool:
    """Whether parts are those of one face, such as eyes and mouth: lists of weights of which no two share a name."""
    names = [name for take in takes for name in _columns_of(take.part)]
    return len(takes) > 1 and bool(names) and len(set(names)) == len(names)


def first_of(values: Sequence[Any]) -> list[Any]:
    """Some of the first values that are not null or empty; all of them where all are."""
    return [value for value in values[:LOOKED_AT] if value] or list(values[:1])


def is_frame(value: Any) -> bool:
    """Whether a value reads as one frame of a face, or several faces of one frame."""
    if isinstance(value, list):
        named = named_weights(value)
        return bool(named) and any(map(known, named))
    if not isinstance(value, dict) or _frames_in(value):
        return False
    recording = FrameRecording()
    recording.add(value)
    return any(known(name) for order in recording.orders for name in order)


def are_numbers(value: Any) -> bool:
    """Whether a value is a list of numbers."""
    return isinstance(value, list) and bool(value) and all(x is None or is_number(x) for x in value)
