"""A plan in the place of another: decisions made by hand are not replaced unasked, and whatever is replaced is kept."""

from pathlib import Path

from capture_plan.errors import PlanError
from capture_plan.expressions.settings import Edits
from capture_plan.output import same
from capture_plan.plan.files import read_plan
from capture_plan.plan.places import found_from
from capture_plan.plan.record import SAMPLE, Plan, seal_of
from capture_plan.plan.settings import Settings
from capture_plan.rig import Rig


def refuse_to_replace(path: Path, rig: Rig, source: str) -> None:
    """Refuse to put a plan of `rig`, read from `source`, where work would be lost.

    Raises:
        PlanError: the file is no plan, one that was edited by hand, or one of another rig.
    """
    if path.exists() and (reason := what_is_lost(path, rig, source)):
        raise PlanError(
            f"{path} {reason}: choose another place with -o, or give --replace (the old file is kept as {path.name}~)"
        )


def what_is_lost(path: Path, rig: Rig, source: str) -> str | None:
    """What a file holds that another plan of `rig` would not; None where that is nothing. The same file read otherwise,
    or exported again, is the same rig."""
    try:
        plan = read_plan(path)
    except PlanError:
        return "holds no plan that can be read"
    if plan.rig.fingerprint != rig.fingerprint and not is_from(plan, path.parent, source):
        return f"holds a plan of another rig ({plan.rig.name})"
    if plan.packing.edits != Edits() or plan.settings.expressions.edits != Edits():
        return "holds a plan whose expressions were edited by hand"
    if plan.seal != seal_of(plan):
        return "holds a plan that was changed by hand"
    return None


def is_from(plan: Plan, folder: Path, source: str) -> bool:
    """Whether a plan in `folder` was made of the rig at `source`."""
    if SAMPLE in (source, plan.rig.path):
        return source == plan.rig.path
    return same(Path(str(found_from(folder, plan.rig.path))), Path(source))


def inputs_of(settings: Settings, folder: Path = Path()) -> list[str]:
    """The files that settings name, seen from `folder`."""
    given = (
        *(settings.cameras, settings.target, settings.expressions.rules, settings.vertex_weights),
        *(*settings.sequences, *settings.landmarks.keep_out),
    )
    return [str(found_from(folder, name)) for name in given if name]


def inputs_of_plan(plan: Plan, path: Path, rig: str | None = None) -> list[str | Path]:
    """The files that a plan at `path` is made of, itself among them; `rig` where the rig has moved."""
    reference = (rig or plan.rig.path, plan.rig.skin, plan.rig.names)
    named = [str(found_from(path.parent, name)) for name in reference if name and name != SAMPLE]
    return [path, *named, *inputs_of(plan.settings, path.parent)]
