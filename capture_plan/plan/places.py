"""Files that a plan refers to, written as seen from the plan's folder, so that both can move together.

A setting that may be a file or a word (a camera preset, names of parts) is a file where one of that name exists.
"""

import os
from pathlib import Path

import numpy as np
from jaxtyping import Float
from msgspec.structs import replace

from capture_plan.expressions.rules import Rules, read_rules
from capture_plan.names.name_map import read_name_map
from capture_plan.plan.settings import Settings
from capture_plan.reader.neutral import read_neutral
from capture_plan.reader.vertex_weights import read_vertex_weights
from capture_plan.rig import Rig
from capture_plan.sequence import read_sequence
from capture_plan.shell.takes import Takes, takes_of
from capture_plan.visibility import Camera, cameras_for


def seen_from(folder: Path, given: str | None) -> str | None:
    """`given` as a path from `folder`, with forward slashes, where it is a file or folder; else as it is."""
    if given is None or not os.path.exists(given):
        return given
    try:
        return Path(os.path.relpath(Path(given).resolve(), folder.resolve())).as_posix()
    except ValueError:  # another drive
        return Path(given).resolve().as_posix()


def found_from(folder: Path, kept: str | None) -> str | None:
    """Where `seen_from(folder, ...)` leads from the working folder."""
    if kept is None:
        return kept
    path = Path(os.path.normpath(folder.resolve() / kept))  # also where the folder is yet to be made
    return str(path) if os.path.exists(path) else kept


def zones_seen_from(folder: Path, zones: dict[str, float]) -> dict[str, float]:
    """Keep-outs with their files as seen from `folder`."""
    return {str(seen_from(folder, name)): margin for name, margin in zones.items()}


def with_zones_found(settings: Settings, folder: Path) -> Settings:
    """The settings with the files of keep-outs where they lead from the working folder."""
    zones = settings.landmarks.keep_out
    found = {str(found_from(folder, name)): margin for name, margin in zones.items()}
    return replace(settings, landmarks=replace(settings.landmarks, keep_out=found))


def names_files(settings: Settings, folder: Path) -> bool:
    """Whether the settings are about files seen from `folder`, recorded takes aside."""
    given = (settings.cameras, settings.target, settings.expressions.rules, *settings.landmarks.keep_out)
    return any(os.path.exists(str(found_from(folder, name))) for name in given if name)


def read_rules_of(settings: Settings, folder: Path) -> Rules | None:
    """The rule file of the settings, seen from `folder`; None where ours do."""
    path = found_from(folder, settings.expressions.rules)
    return read_rules(Path(path)) if path else None


def read_takes_of(rig: Rig, settings: Settings, folder: Path, names: str | None = None) -> Takes | None:
    """The takes of the settings together, seen from `folder` as the name map `names` is; None where there are none."""
    mine = read_name_map(str(found_from(folder, names))) if names else None
    paths = [str(found_from(folder, path)) for path in settings.sequences]
    if not paths:
        return None
    sequences = [read_sequence(path, rig=rig, name_map=mine) for path in paths]
    weighed = found_from(folder, settings.vertex_weights)
    s = read_vertex_weights(Path(weighed), rig) if weighed else 1.0
    return takes_of(rig, sequences, shares=settings.sequence_weights, s=s)


def read_cameras_of(rig: Rig, settings: Settings, folder: Path) -> tuple[Camera, ...]:
    """The cameras of the settings, none where they are unknown; a camera file is seen from `folder`."""
    spec = found_from(folder, settings.cameras)
    return cameras_for(spec, rig.neutral, rig.skin) if spec else ()


def read_target(rig: Rig, settings: Settings, folder: Path) -> Float[np.ndarray, "v 3"] | None:
    """The actor's neutral on the rig's mesh; nothing where none is given."""
    path = found_from(folder, settings.target)
    return read_neutral(Path(path), rig) if path else None
