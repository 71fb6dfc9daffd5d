"""Files that a plan refers to, written as seen from the plan's folder, so that both can move together.

A setting that may be a file or a word (a camera preset, names of parts) is a file where one of that name exists.
"""

import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import overload

from msgspec.structs import replace

from capture_plan.plan.settings import Settings


@overload
def seen_from(folder: Path, given: str) -> str: ...
@overload
def seen_from(folder: Path, given: None) -> None: ...
def seen_from(folder: Path, given: str | None) -> str | None:
    """`given` as a path from `folder`, with forward slashes, where it is a file or folder; else as it is."""
    if given is None or not os.path.exists(given):
        return given
    try:
        return Path(os.path.relpath(Path(given).resolve(), folder.resolve())).as_posix()
    except ValueError:  # another drive
        return Path(given).resolve().as_posix()


@overload
def found_from(folder: Path, given: str) -> str: ...
@overload
def found_from(folder: Path, given: None) -> None: ...
def found_from(folder: Path, given: str | None) -> str | None:
    """Where `seen_from(folder, ...)` leads from the working folder."""
    if given is None:
        return None
    path = Path(os.path.normpath(folder.resolve() / given))  # also where the folder is yet to be made
    return str(path) if os.path.exists(path) else given


def named_files(settings: Settings) -> Iterator[tuple[str, str]]:
    """What settings name that may be a file: what it is for, and its name there. Zones are among them by any name."""
    single = {
        "cameras": settings.cameras,
        "rules": settings.expressions.rules,
        "the actor's neutral": settings.target,
        "vertex weights": settings.vertex_weights,
    }
    yield from ((what, name) for what, name in single.items() if name)
    yield from (("takes", name) for name in settings.sequences)
    yield from (("a keep-out zone", name) for name in settings.landmarks.keep_out)


def with_files(settings: Settings, placed: Callable[[str], str]) -> Settings:
    """The settings with `placed(name)` in place of each of `named_files`."""
    zones = {placed(name): margin for name, margin in settings.landmarks.keep_out.items()}
    rules = settings.expressions.rules
    return replace(
        settings,
        landmarks=replace(settings.landmarks, keep_out=zones),
        expressions=replace(settings.expressions, rules=rules and placed(rules)),
        sequences=tuple(map(placed, settings.sequences)),
        cameras=settings.cameras and placed(settings.cameras),
        target=settings.target and placed(settings.target),
        vertex_weights=settings.vertex_weights and placed(settings.vertex_weights),
    )
