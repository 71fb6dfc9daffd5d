"""The faces of one frame of a JSON take: which of its objects are faces, and which are versions of one.

    {"faces": [{"id": 3, "blendShapes": {...}}, ...]}, {"face0": {...}, "face1": {...}}, {"anna": {...}, "bo": {...}}
Faces have names or numbers of their own, or name the same movements. Objects named raw, smoothed or target are versions
of one face (`unfiltered.py`).
"""

import re
from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any

from capture_plan.curves.columns import MANY, kind_of, plain
from capture_plan.curves.json_weights import SIDES, known
from capture_plan.curves.unfiltered import best_version, is_version

SHAPE_KEYS = (
    *("blendshapes", "faceblendshapes", "blendshapeweights", "animationvalues", "categories"),
    *("weights", "shapes", "values", "coefficients", "arkit", "expressions", "morphs", "morphtargets"),
)
NEST_KEYS = ("result", "results", "face", "faces", "frame", "data", "params", "faceanchor", "anchor")
FACE_KEYS = ("faces", "results", "people", "persons", "subjects", "actors", "anchors", "faceanchors")
OWN_KEYS = ("id", "uuid", "index", "name")
NUMBERED_FACE = re.compile(r"(?:face|person|subject|actor|user|player|performer|head)(?:\d{1,3}|[a-h])")
CONTAINERS = {dict, list, type(None)}


def versions_of(frame: Any) -> tuple[Any, tuple[str, ...]]:
    """The frame with one of the objects that are versions of one face, and the names of these, that one first."""
    inner = [name for name, x in frame.items() if type(x) is dict] if type(frame) is dict else []
    marked = any(map(is_version, inner)) if len(inner) > 1 else False
    alike = _alike(tuple((name, names_in(frame[name])) for name in inner), parts=True) if marked else ()
    best = best_version(alike)
    if best is None:
        return frame, ()
    kept = {name: x for name, x in frame.items() if name not in alike} | {"face": frame[best]}
    return kept, (best, *(name for name in alike if name != best))


def faces_of(frame: Any) -> list[Any]:
    """The faces of a frame that have names or numbers of their own, each with what the frame says; else the frame."""
    if type(frame) is not dict:
        return [frame]
    inner = [name for name, face in frame.items() if type(face) is dict]
    own = {name: frame[name] for name in inner if is_one_face(name)}
    if not own and len(inner) > 1:
        own = {name: frame[name] for name in _alike(tuple((name, names_in(frame[name])) for name in inner))}
    if own:
        rest = {name: value for name, value in frame.items() if name not in own}
        return [{**rest, "face": {"faceId": name, **face}} for name, face in own.items()]
    for key, inner in frame.items():
        if plain(key) in FACE_KEYS and type(inner) in (dict, list) and inner and (faces := identified(inner)):
            rest = {name: value for name, value in frame.items() if name != key}
            return [{**rest, "face": face} for face in faces]
    return [frame]


@lru_cache(MANY)
def is_one_face(name: str) -> bool:
    """Whether a name is one of several faces': face0, personA."""
    return bool(NUMBERED_FACE.fullmatch(plain(name)))


@lru_cache(MANY)
def _alike(objects: tuple[tuple[str, tuple[str, ...]], ...], *, parts: bool = False) -> tuple[str, ...]:
    """Objects of one frame that name the same movements, as those of several faces do; (name, names in it) each.

    Those with names of sides or of a frame's parts only where `parts` says so.
    """
    some = {name: {inner for inner in names if known(inner)} for name, names in objects if parts or not is_part(name)}
    return tuple(
        name
        for name, mine in some.items()
        if any(2 * len(mine & other) > min(len(mine), len(other)) for them, other in some.items() if them != name)
    )


def names_in(value: Mapping[str, Any]) -> tuple[str, ...]:
    """The names in an object, or in the object of weights in it."""
    return next((tuple(x) for key, x in value.items() if type(x) is dict and plain(key) in SHAPE_KEYS), tuple(value))


def is_part(name: str) -> bool:
    """Whether a name is that of a side, or of the weights of a frame."""
    return plain(name) in (*SIDES, *SHAPE_KEYS, *NEST_KEYS)


def identified(faces: Mapping[str, Any] | Sequence[Any]) -> list[dict[str, Any]]:
    """Faces with what tells them apart under one name; none where they have nothing of their own."""
    if isinstance(faces, Mapping):
        one = has_key(faces, SHAPE_KEYS) or any(type(face) is not dict for face in faces.values())
        return [] if one else [{"faceId": name, **face} for name, face in faces.items()]
    found = []
    for face in faces:
        own = face if isinstance(face, dict) else {}
        which = next((x for key, x in own.items() if kind_of(key) == "face" or plain(key) in OWN_KEYS), None)
        if which is None or type(which) in CONTAINERS:
            return []
        found.append({**{key: x for key, x in own.items() if plain(key) not in OWN_KEYS}, "faceId": which})
    return found


def by_key(value: Mapping[str, Any], keys: Sequence[str]) -> Any:
    """The object, list or null under the first of these keys, whatever their spelling."""
    found = {plain(key): inner for key, inner in value.items() if type(inner) in CONTAINERS}
    return next(found[key] for key in keys if key in found)


def has_key(value: Any, keys: Sequence[str]) -> bool:
    """Whether an object has an object, a list or null under one of these keys."""
    if not isinstance(value, dict) or not CONTAINERS & set(map(type, value.values())):
        return False
    return any(type(inner) in CONTAINERS and plain(key) in keys for key, inner in value.items())
