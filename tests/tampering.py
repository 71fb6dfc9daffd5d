"""Plans with one value changed: flipped, scaled, emptied, swapped, dropped; and what a check says of each.

Every kind of field has its turn, however many values of it a plan has. Run for many, with a seed, of all plans or some:
`python -m tests.tampering 1000 7 default budget`.
"""

import copy
import json
import os
import random
import re
import sys
from collections import Counter, defaultdict
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from fcntl import LOCK_EX, flock
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from unittest.mock import patch

import msgspec
import numpy as np

from capture_plan.check import again, check
from capture_plan.errors import InfeasibleError, PlanError, RigError
from capture_plan.expressions import early
from capture_plan.expressions.settings import Edits
from capture_plan.layout import assembly as follow
from capture_plan.layout.settings import LayoutSettings
from capture_plan.plan import inputs
from capture_plan.plan.files import read_plan, rig_of, write_plan
from capture_plan.plan.inputs import read_inputs
from capture_plan.plan.make import make_plan
from capture_plan.plan.record import Plan, sealed
from capture_plan.plan.revise import edited_plan
from capture_plan.plan.settings import Settings
from capture_plan.rig import Rig
from capture_plan.sample import sample_rig
from capture_plan.sample.motion import sample_motion
from tests.once import plan_of

# What no check can find out when the seal was made anew with the change, a reason each.
FREE = {
    r"seal": "it is made anew",
    r"versions(\.\*)?": "a plan may have been made elsewhere, said to be unchecked",
    r"packing\.solver_bound": "the solver's word, said to be unchecked",
    r"packing\.unmoved": "what a person did: the list that stood there before is not in the plan",
    r"layout\.programs(\.#\.bound)?": "under a budget the fewest landmarks are the solver's word, said to be unchecked",
    r"layout\.(error|target)_bound\..*": "a share of a thousandth, or at another vertex, proves the same",
    r"settings\..*": "a constraint that the plan keeps as well as the one it was made for",
    r"rig\.(up|facing|unit_mm|skin)": "a correction to what was found anyway",
}
KINDS = ("default", "budget", "cameras", "edited", "motion of two people")
LEAST = 2e-4  # numbers of a plan carry four decimals, the last of which may be rounded otherwise elsewhere
CONTAINERS = ("keep_out", "caps", "references", "versions", "locked", "references_mm")
Path_ = tuple[str | int, ...]


def kind_of(path: Path_) -> str:
    """The path without numbers and names of its own: `layout.landmarks.#.label`."""
    steps = zip(path, (None, *path), strict=False)
    return ".".join("#" if isinstance(step, int) else "*" if before in CONTAINERS else step for step, before in steps)


def paths_of(value: Any, path: Path_ = ()) -> Iterator[Path_]:
    """Every place in a document."""
    if path:
        yield path
    inner = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for name, one in inner:
        yield from paths_of(one, (*path, name))


def value_at(document: Any, path: Path_) -> Any:
    """What stands at a place."""
    for step in path:
        document = document[step]
    return document


def changes(value: Any, others: list[Any], rng: random.Random) -> list[Any]:
    """Other values in place of one: of its own kind, as a careless or a crooked hand would write them; `others` are
    what stands in the same place of other records."""
    another = rng.choice(others)
    if isinstance(value, bool):
        return [not value]
    if isinstance(value, int):
        return [value + 1, value - 1, -value, 0, 2 * value, another]
    if isinstance(value, float):
        others = [value + max(0.01 * abs(value), LEAST), 1.5 * value + LEAST, value + 1, -value - LEAST, 0.0, another]
        return [one for one in others if not isinstance(one, float) or abs(one - value) >= LEAST]
    if isinstance(value, str):
        words = [word for several in choices() if value in several for word in several if word != value]
        return [rng.choice(words)] if words and rng.random() < 0.7 else ["", value[::-1], another, f"{value} "]
    if isinstance(value, list):
        mixed, one = rng.sample(value, len(value)), rng.randrange(len(value) + 1)
        return [[], value[:one] + value[one + 1 :], value[:-1], mixed, [*value, *value[:1]], another]
    if isinstance(value, dict):
        names = [*value]
        gone = rng.choice(names) if names else None
        turned = dict(zip(names, [*value.values()][1:] + [*value.values()][:1], strict=True))
        return [{}, {name: value[name] for name in names if name != gone}, turned, another]
    return [5, 0.5, "x", True, [], {}, another]


@cache
def choices() -> list[list[str]]:
    """The words that fields of a plan have to choose from."""
    return [found["enum"] for found in _inside(msgspec.json.schema(Plan)) if "enum" in found]


def _inside(schema: Any) -> Iterator[dict[str, Any]]:
    if isinstance(schema, dict):
        yield schema
    for one in schema.values() if isinstance(schema, dict) else schema if isinstance(schema, list) else ():
        yield from _inside(one)


def by_kind(document: dict[str, Any]) -> dict[str, list[Path_]]:
    """The places of every kind of field."""
    found: dict[str, list[Path_]] = defaultdict(list)
    for path in paths_of(document):
        found[kind_of(path)].append(path)
    return found


def tampered(
    document: dict[str, Any], number: int, seed: int, *, kinds: dict[str, list[Path_]] | None = None
) -> tuple[str, dict[str, Any]]:
    """The kind of the field that was changed, and the document with the change; `kinds` are its places by kind."""
    rng, kinds = random.Random(f"{seed}:{number}"), kinds or by_kind(document)
    kind = sorted(kinds)[number % len(kinds)]
    path = rng.choice(kinds[kind])
    changed = _with_own(document, path)
    held, old = value_at(changed, path[:-1]), value_at(document, path)
    if rng.random() < 0.1:
        held.pop(path[-1])
    else:
        held[path[-1]] = rng.choice(changes(old, [value_at(document, one) for one in kinds[kind]], rng))
    return kind, changed


def _with_own(document: Any, path: Path_) -> Any:
    """The document with its own copy of all that holds the place."""
    if not path:
        return document
    own = copy.copy(document)
    own[path[0]] = _with_own(document[path[0]], path[1:])
    return own


def verdict(document: dict[str, Any], plan: Plan, path: Path, *, resealed: bool) -> str:
    """'same', 'refused', 'caught' or 'uncaught'; any other error goes on up."""
    try:
        read = msgspec.convert(document, Plan) if document.get("format") == plan.format else None
        if read is None or not msgspec.json.encode(document):
            return "refused"
        if _plain(read) == _plain(plan):
            return "same"
        rig = rig_of(read, path) if read.rig != plan.rig else rig_of(plan, path)
        given = read_inputs(rig, read.settings, path.parent, names=read.rig.names)
        claims = check.claims_of(sealed(read) if resealed else read, given)
        return "uncaught" if all(claim.holds for claim in claims) else "caught"
    except (msgspec.ValidationError, PlanError, RigError, InfeasibleError):
        return "refused"


def _plain(plan: Plan) -> bytes:
    return msgspec.json.encode(plan).replace(b"-0.0", b"0.0")


@contextmanager
def answers_kept() -> Iterator[None]:
    """Within it what is slow is asked once for the same arguments, so that thousands of plans can be checked."""
    slow = [(check, "audit_rig"), (check, "see_face"), (check, "task_of"), (again, "collide"), (again, "state_problem")]
    slow += [(again, "blendshape_importance"), (again, "session"), (inputs, "read_takes"), (check, "motion_claims")]
    slow += [(early, "habit_squares"), (follow, "name_landmarks"), (follow, "points_of"), (follow, "motion_fit")]
    slow += [(follow, "performances"), (follow, "predictions")]
    with ExitStack() as patches:
        for room, name in slow:
            if not hasattr(function := getattr(room, name), "answers"):
                patches.enter_context(patch.object(room, name, _answered(function)))
        yield


@cache
def _answered(function: Any) -> Any:
    answers: dict[tuple[Any, ...], Any] = {}
    alive = []  # so that no identity is given away twice

    def asked(*arguments: Any, **named: Any) -> Any:
        key = tuple(map(_key, (*arguments, *named.values())))
        if key not in answers:
            alive.append(arguments)
            answers[key] = function(*arguments, **named)
        return answers[key]

    asked.answers = answers  # pyright: ignore[reportFunctionMemberAccess]
    return asked


def _key(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return value.tobytes()
    if isinstance(value, dict):
        return tuple((name, _key(one)) for name, one in value.items())
    return repr(value) if isinstance(value, msgspec.Struct | tuple | list | str | type(None)) else id(value)


def outcomes(path: Path, count: int, seed: int, *, resealed: bool) -> Counter[tuple[str, str]]:
    """How often each verdict fell on each kind of field."""
    plan, document = read_plan(path), json.loads(path.read_bytes())
    found: Counter[tuple[str, str]] = Counter()
    kinds = by_kind(document)
    with answers_kept():
        for number in range(count):
            kind, changed = tampered(document, number, seed, kinds=kinds)
            found[verdict(changed, plan, path, resealed=resealed), kind] += 1
    return found


def is_free(kind: str) -> bool:
    """Whether nobody can be asked to find out a change of this kind."""
    return any(re.fullmatch(pattern, kind) for pattern in FREE)


def plans(folder: Path) -> dict[str, Path]:
    """Plans of several kinds on the bundled head, written; made once for all who test in this folder."""
    with (folder / "lock").open("w") as lock:
        flock(lock, LOCK_EX)
        if not all((folder / f"{name}.json").is_file() for name in KINDS):
            for name, plan in made_plans(folder).items():
                write_plan(plan, folder / f"{name}.json")
    return {name: folder / f"{name}.json" for name in KINDS}


def made_plans(folder: Path) -> dict[str, Plan]:
    """A plan of each kind; takes are written into `folder`."""
    rig = sample_rig()
    takes = tuple(write_take(folder / f"{name}.npz", rig, wider) for name, wider in (("anna", 1.0), ("bert", 1.08)))
    asked = {
        "default": Settings(),
        "budget": Settings(landmarks=LayoutSettings(method="budget", budget=16)),
        "cameras": Settings(
            cameras="head-mounted-pair", landmarks=LayoutSettings(method="adaptive", head_markers=3, rounds=2)
        ),
        "motion of two people": Settings(sequences=takes, landmarks=LayoutSettings(method="motion", number=12)),
    }
    made = {
        name: make_plan(read_inputs(rig, settings, folder), settings) if settings.sequences else plan_of(settings)
        for name, settings in asked.items()
    }
    edits = Edits(locked={"jawOpen": 2}, apart=(("jawOpen", "browInnerUp"),))
    return made | {"edited": edited_plan(made["default"], rig, edits)}


def write_take(path: Path, rig: Rig, wider: float) -> str:
    """Some frames of the bundled head, or of one that is wider and shorter, as a file; its name."""
    moved = sample_motion(0, frames=12).frames.block(0, 12) - rig.neutral
    neutral = rig.neutral * np.array([wider, 2 - wider, 1.0])
    frames = neutral + moved
    np.savez(path, faces=rig.triangles, frames=frames, neutral=neutral, units=np.array("mm"), fps=np.array(30.0))
    return path.name


def main() -> None:
    count, seed, *asked = sys.argv[1:]
    with TemporaryDirectory() as folder, patch.dict(os.environ, XDG_CACHE_HOME=folder):  # what was planned once, too
        for name, path in plans(Path(folder)).items():
            for resealed in (False, True) if not asked or name in asked else ():
                message(name, outcomes(path, int(count), int(seed), resealed=resealed), resealed=resealed)


def message(name: str, found: Counter[tuple[str, str]], *, resealed: bool) -> None:
    """Print how often each verdict fell, and on which kinds of field a change was not caught."""
    total = Counter({said: 0 for said in ("caught", "refused", "same", "uncaught")})
    for (said, _), times in found.items():
        total[said] += times
    print(name, "resealed" if resealed else "as changed", dict(total), flush=True)
    for (said, kind), times in sorted(found.items()):
        if said == "uncaught":
            print(f"  {times:4} {'free' if is_free(kind) else 'UNCAUGHT'} {kind}", flush=True)


if __name__ == "__main__":
    main()
