"""A plan in the place of another: decisions made by hand are not replaced unasked, and whatever is replaced is kept."""

from collections.abc import Iterator
from pathlib import Path

from capture_plan.errors import PlanError
from capture_plan.expressions.settings import Edits
from capture_plan.layout.dot_numbers import dots_of
from capture_plan.layout.settings import LayoutSettings
from capture_plan.output import same
from capture_plan.plan.files import read_plan
from capture_plan.plan.places import found_from, named_files
from capture_plan.plan.record import SAMPLE, Plan, seal_of
from capture_plan.plan.settings import Settings
from capture_plan.rig import Rig

SHOWN = 6  # constraints that are named


def refuse_to_replace(path: Path, rig: Rig, source: str, settings: Settings) -> None:
    """Refuse to put a plan of `rig`, read from `source`, made with `settings` whose files are seen from the folder of
    `path`, where work would be lost.

    Raises:
        PlanError: the file is no plan, one that was edited by hand or made with constraints that are not in the
            settings, or one of another rig.
    """
    if path.exists() and (reason := what_is_lost(path, rig, source, settings)):
        raise PlanError(
            f"{path} {reason}: choose another place with -o, or give --replace (the old file is kept as {path.name}~)"
        )


def what_is_lost(path: Path, rig: Rig, source: str, settings: Settings) -> str | None:
    """What a file holds that another plan of `rig` would not; None where that is nothing. The same file read otherwise,
    or exported again, is the same rig."""
    try:
        plan = read_plan(path)
    except PlanError:
        return "holds no plan that can be read"
    if plan.rig.fingerprint != rig.fingerprint and not is_from(plan, path.parent, source):
        return f"holds a plan of another rig ({plan.rig.name})"
    if not plan.packing.as_made:
        return "holds a plan whose expressions were edited by hand"
    if plan.seal != seal_of(plan):
        return "holds a plan that was changed by hand"
    if constraints := [*constraints_lost(plan, settings.landmarks), *edits_lost(plan, settings.expressions.edits)]:
        shown = ", ".join(constraints[:SHOWN]) + (
            f" and {len(constraints) - SHOWN} more" if len(constraints) > SHOWN else ""
        )
        return f"holds a plan with constraints that would go ({shown})"
    return None


def constraints_lost(plan: Plan, settings: LayoutSettings) -> Iterator[str]:
    """The constraints of a plan for its landmarks that are not in other settings, each in words."""
    was, dots = plan.settings.landmarks, {vertex: name for name, vertex in dots_of(plan.layout).items()}
    usual = LayoutSettings().keep_out
    for vertex in was.pins:
        if vertex not in settings.pins:
            yield f"pin at {dots.get(vertex, vertex)}"
    for vertex in was.forbidden:
        if vertex not in settings.forbidden:
            yield f"no dot at vertex {vertex}"
    for region, most in was.caps.items():
        if settings.caps.get(region) != most:
            yield f"{region} at most {most}"
    for zone, margin in was.keep_out.items():
        if margin not in (usual.get(zone), settings.keep_out.get(zone)):
            yield f"keep-out {zone} {margin:g} mm"
    for zone in usual:
        if zone not in was.keep_out and zone in settings.keep_out:
            yield f"{zone} open"


def edits_lost(plan: Plan, edits: Edits) -> Iterator[str]:
    """The edits of a plan's expressions that are not among others, each in words."""
    was = plan.settings.expressions.edits
    for name, where in was.locked.items():
        if edits.locked.get(name) != where:
            yield f"{name} locked"
    for kind in ("together", "apart"):
        for group in getattr(was, kind):
            if group not in getattr(edits, kind):
                yield f"{' and '.join(group)} {kind}"
    for name in was.dropped:
        if name not in edits.dropped:
            yield f"{name} dropped"


def is_from(plan: Plan, folder: Path, source: str) -> bool:
    """Whether a plan in `folder` was made of the rig at `source`."""
    if SAMPLE in (source, plan.rig.path):
        return source == plan.rig.path
    return same(Path(str(found_from(folder, plan.rig.path))), Path(source))


def files_of(settings: Settings, folder: Path = Path()) -> list[str]:
    """The files that settings name, seen from `folder`."""
    return [found_from(folder, name) for _, name in named_files(settings)]


def files_of_plan(plan: Plan, path: Path, rig: str | None = None) -> list[str | Path]:
    """The files that a plan at `path` is made of, itself among them; `rig` where the rig has moved."""
    reference = (rig or plan.rig.path, plan.rig.skin, plan.rig.names)
    named = [str(found_from(path.parent, name)) for name in reference if name and name != SAMPLE]
    if plan.actor:
        named += [found_from(path.parent, name) for name in (plan.actor.path, plan.actor.laid)]
    return [path, *named, *files_of(plan.settings, path.parent)]
