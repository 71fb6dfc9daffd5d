"""The plan: one record that every sheet, picture, page and export is drawn from."""

import hashlib

import msgspec
from msgspec import Struct, structs

from capture_plan.audit.audit import Audit
from capture_plan.expressions.record import Packing
from capture_plan.expressions.session import Session
from capture_plan.layout.dot_contact import Meeting, meetings
from capture_plan.layout.record import Layout
from capture_plan.plan.settings import Settings
from capture_plan.rig import Rig

FORMAT_VERSION = 5
SAMPLE = "sample"
DECIDING = ("capture-plan", "numpy", "scipy", "embreex", "ortools")  # packages that a plan's numbers depend on


class RigReference(Struct, frozen=True, forbid_unknown_fields=True):
    """Which rig a plan belongs to: `path` is relative to the plan file, or `sample`.

    `unit_mm`, `up`, `facing` and `skin` are the overrides given when it was read, absent where they were detected;
    `names` is the user's name map. Files are relative to the plan file.
    """

    name: str
    path: str
    fingerprint: str
    vertices: int
    unit_mm: float | None = None
    up: str | None = None
    facing: str | None = None
    skin: str | None = None
    names: str | None = None


class Plan(Struct, frozen=True, forbid_unknown_fields=True):
    """What `plan.json` holds: the same input, settings and versions give it byte for byte.

    `meetings` are dots that come too near to each other in the neutral or in an expression (`layout/dot_contact.py`).
    `draft` says what did not hold of the plan when something was made of it all the same; empty where all holds.
    `seal` is a digest of all else: it tells a plan that was changed by hand, and is no signature.
    """

    format: int
    rig: RigReference
    settings: Settings
    audit: Audit
    layout: Layout
    packing: Packing
    session: Session
    versions: dict[str, str]
    meetings: tuple[Meeting, ...] = ()
    draft: tuple[str, ...] = ()
    seal: str = ""


def with_meetings(plan: Plan, rig: Rig) -> Plan:
    """The plan with the dots that come too near to each other in its expressions."""
    found = meetings(rig, plan.layout.markers, plan.packing.poses, plan.settings.landmarks.dot_mm)
    return structs.replace(plan, meetings=found)


def sealed(plan: Plan) -> Plan:
    """The plan with the seal of what it says."""
    return structs.replace(plan, seal=seal_of(plan))


def seal_of(plan: Plan) -> str:
    """Digest of all that a plan says."""
    return hashlib.sha256(msgspec.json.encode(structs.replace(plan, seal=""))).hexdigest()[:32]
