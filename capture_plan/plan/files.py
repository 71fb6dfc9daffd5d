"""`plan.json`: written whole or not at all, read back to an equal `Plan`, described by a JSON schema."""

import json
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec

from capture_plan.errors import PlanError, SettingsError
from capture_plan.input.documents import read_plain, read_toml
from capture_plan.layout.record import Layout
from capture_plan.output import write_whole
from capture_plan.plan.inputs import PlanInputs, read_inputs
from capture_plan.plan.places import found_from, seen_from, with_files
from capture_plan.plan.record import FORMAT_VERSION, SAMPLE, Plan, RigReference, sealed
from capture_plan.plan.settings import Settings
from capture_plan.plan.structure import check_texts
from capture_plan.plan.wrong_settings import what_is_wrong
from capture_plan.reader.head_scan import read_head
from capture_plan.reader.neutral import read_neutral
from capture_plan.reader.read import rig_at
from capture_plan.rig import Rig
from capture_plan.rig.read_options import AS_FOUND, ReadOptions
from capture_plan.sample import sample_rig

MOST_BYTES = 100_000_000  # a plan of 200 landmarks and 60 expressions has 2 MB


def plan_bytes(plan: Plan) -> bytes:
    """The plan as indented JSON, sealed; equal plans give equal bytes."""
    return msgspec.json.format(msgspec.json.encode(sealed(plan)), indent=1) + b"\n"


def write_plan(plan: Plan, path: Path | str) -> Path:
    """Write `path` whole or not at all.

    Raises:
        PlanError: the place cannot be written.

    Example:
        >>> plan = read_plan("hero.plan.json")
        >>> read_plan(write_plan(plan, "again.plan.json")) == plan
        True
    """
    write_whole(Path(path), plan_bytes(plan))
    return Path(path)


def write_layout(layout: Layout, path: Path) -> Path:
    """A layout alone, as JSON, for a take without a rig."""
    write_whole(path, msgspec.json.format(msgspec.json.encode(layout), indent=1) + b"\n")
    return path


def read_plan(path: Path | str) -> Plan:
    """The plan in `path`.

    Raises:
        PlanError: missing, not a plan, of another format, or with a value that no plan may have.

    Example:
        >>> read_plan("hero.plan.json").rig.name
        'MakeHuman head'
    """
    path = Path(path)
    content = read_plain(path, PlanError, "give the plan.json that `plan` wrote", most=MOST_BYTES)
    try:
        json.loads(content, object_pairs_hook=each_name_once)  # msgspec takes the last of two
        found = msgspec.json.decode(content, type=dict[str, Any]).get("format")
        if found != FORMAT_VERSION:
            raise PlanError(f"{path} has format {found!r}, expected {FORMAT_VERSION}: make the plan again")
        plan = msgspec.json.decode(content, type=Plan)
    except (msgspec.DecodeError, ValueError, RecursionError) as error:
        raise PlanError(f"{path} is not a plan ({error}): make it again with `capture-plan plan`") from None
    check_texts(plan)
    return plan


def each_name_once(pairs: list[tuple[str, Any]]) -> None:
    """ValueError where a key stands twice: who reads the file may see the other value than we do."""
    keys = [key for key, _ in pairs]
    if len(set(keys)) < len(keys):
        raise ValueError(f"'{next(key for n, key in enumerate(keys) if key in keys[:n])}' stands twice in one place")


Named = Callable[[Iterable[str | int], str], tuple[int, ...]]  # vertices meant by names and numbers, and what for


def read_settings(path: Path, named: Named | None = None) -> Settings:
    """Settings from a TOML file as described in `plan.settings`; files are looked for beside it first. Where dots have
    names, `named` finds the vertices that pins and forbidden ones mean.

    Raises:
        PlanError: missing, not TOML, an unknown name or a value out of range.
    """
    try:
        document = read_toml(path, PlanError, "`capture-plan settings` shows what can be set")
        settings = msgspec.convert(_by_number(document, named) if named else document, Settings)
        return with_files(settings, lambda name: found_from(path.parent, name))
    except msgspec.ValidationError as error:
        raise PlanError(f"{path}: {what_is_wrong(error)}: `capture-plan settings` shows what can be set") from None


def _by_number(document: dict[str, Any], named: Named) -> dict[str, Any]:
    """The document with vertex numbers in place of the names of dots."""
    landmarks = document.get("landmarks")
    if not isinstance(landmarks, dict):
        return document
    asked = {what: words for what in ("pins", "forbidden") if isinstance(words := landmarks.get(what), list)}
    plain = {
        what: [word if isinstance(word, int) else named([str(word)], f"landmarks.{what}")[0] for word in words]
        for what, words in asked.items()
    }
    return document | {"landmarks": landmarks | plain}


def change_settings(settings: Settings, changes: dict[str, Any], spelled: Callable[[str], str] = str) -> Settings:
    """`settings` with `changes`, a nested mapping as in a settings file; `spelled` is how a person wrote a name in it.

    Raises:
        SettingsError: an unknown name or a value out of range.
    """
    merged = msgspec.to_builtins(settings)
    for name, value in changes.items():
        merged[name] = merged[name] | value if isinstance(value, dict) else value
    try:
        return msgspec.convert(merged, Settings)
    except msgspec.ValidationError as error:
        raise SettingsError(what_is_wrong(error, spelled)) from None


def plan_schema() -> bytes:
    """The JSON schema of `plan.json`."""
    return json.dumps(msgspec.json.schema(Plan), indent=1).encode() + b"\n"


def refer_to(
    rig: Rig,
    rig_path: str,
    plan_path: Path,
    given: ReadOptions = AS_FOUND,
) -> RigReference:
    """How the plan at `plan_path` remembers its rig, and what a person stated of it."""
    path, skin, names = (seen_from(plan_path.parent, one) for one in (rig_path, given.skin, given.names))
    place = SAMPLE if rig_path == SAMPLE else str(path)
    return RigReference(
        rig.name, place, rig.fingerprint, len(rig.neutral), given.unit_mm, given.up, given.facing, skin, names
    )


def settings_seen_from(folder: Path, settings: Settings) -> Settings:
    """The settings with their files as seen from `folder`."""
    return with_files(settings, lambda name: seen_from(folder, name))


def inputs_of(plan: Plan, plan_path: Path, *, rig_path: str | None = None, takes: bool = True) -> PlanInputs:
    """Read what a plan was made from: its rig, from where the plan says or from `rig_path`, and what its settings name.
    Without `takes` these are left out, and the scan that a plan was carried onto: pages need only what was laid on it.

    Raises:
        RigError: the rig or a file of the settings cannot be read.
        PlanError: it is not the rig the plan was made for, or an input was given in Python.
    """
    rig, folder = rig_of(plan, plan_path, rig_path=rig_path), plan_path.parent
    inputs = read_inputs(rig, plan.settings, folder, names=plan.rig.names, takes=takes, carried=plan.cameras)
    if (actor := plan.actor) is None:
        return inputs
    head = read_head(found_from(folder, actor.path), actor.unit_mm) if takes else None
    return replace(inputs, worn=read_neutral(Path(found_from(folder, actor.laid)), rig), head=head)


def rig_file_of(plan: Plan, plan_path: Path, *, rig_path: str | None = None) -> Path | None:
    """The file or folder of a plan's rig, from where the plan says or `rig_path`; None for the bundled head."""
    if plan.rig.path == SAMPLE:
        return None
    return Path(rig_path or plan_path.parent / plan.rig.path)


def rig_of(plan: Plan, plan_path: Path, *, rig_path: str | None = None) -> Rig:
    """Read the rig that a plan belongs to, from where the plan says or from `rig_path`.

    Raises:
        RigError: the rig cannot be read.
        PlanError: it is not the rig the plan was made for.
    """
    reference, folder = plan.rig, plan_path.parent
    skin, names = (found_from(folder, one) for one in (reference.skin, reference.names))
    given = ReadOptions(reference.unit_mm, reference.up, reference.facing, skin, names)
    place = rig_file_of(plan, plan_path, rig_path=rig_path)
    if place is None:
        if given != AS_FOUND:
            raise PlanError(f"{plan_path} corrects the bundled head, which needs none: make the plan again")
        rig = sample_rig()
    else:
        rig = rig_at(place, given)
    if rig.fingerprint != plan.rig.fingerprint:
        raise PlanError(
            f"the rig has changed since {plan_path} was made (fingerprint {rig.fingerprint}, the plan's is "
            f"{plan.rig.fingerprint}): make the plan again, or give the old rig with --rig"
        )
    return rig
