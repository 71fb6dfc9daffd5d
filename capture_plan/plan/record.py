"""The plan: one record that every sheet, picture, page and export is drawn from."""

import hashlib
from typing import Literal

import msgspec
from msgspec import Struct, structs

from capture_plan.audit.audit import Audit
from capture_plan.camera import Camera, KnownCamera, camera_of
from capture_plan.expressions.record import Expression, Packing
from capture_plan.expressions.session import Session, shot_number
from capture_plan.layout.dot_contact import Meeting, Poses, meetings
from capture_plan.layout.labels import Labels, label_margins, take_labels
from capture_plan.layout.record import Layout
from capture_plan.layout.unread import Unread, unread
from capture_plan.plan.settings import Settings
from capture_plan.rig import Rig
from capture_plan.shell.takes import Takes

FORMAT_VERSION = 8
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


class ActorDot(Struct, frozen=True, forbid_unknown_fields=True):
    """Where a marker goes on the actor's head: `position` in millimetres as the rig stands (+y up, facing +z),
    `in_file` in the coordinates and the unit of the head's file. `gap_mm` is how far the scan's surface lies from where
    the rig's skin came to lie: the dot is on that surface, or where there is a hole or hair on the laid skin."""

    name: str
    position: tuple[float, float, float]
    in_file: tuple[float, float, float]
    gap_mm: float


class ActorHead(Struct, frozen=True, forbid_unknown_fields=True):
    """The head of the actor that a plan was carried onto. Files are relative to the plan file.

    One unit of the head's file `path` is `unit_mm` long; `rotation` (row by row) and `translation` (millimetres) lead
    from the rig's pose to the file's axes: R x + t. `laid` is the rig's neutral laid onto it, an OBJ file in
    millimetres as the rig stands. The fingerprints are of what both files held. `error_mm` and `error_95_mm` are median
    and 95th percentile of the error of places along the skin; `stated` says where they are from, `points` how many were
    picked, `left_out_mm` the distance of each that was left out from where the others lay it. `cost_mm` is that of the
    pose (`registration/onto_head.py`).
    """

    name: str
    path: str
    fingerprint: str
    unit_mm: float
    rotation: tuple[float, ...]
    translation: tuple[float, float, float]
    laid: str
    laid_fingerprint: str
    error_mm: float
    error_95_mm: float
    stated: Literal["leave-one-out", "estimated"]
    points: int
    cost_mm: float
    dots: tuple[ActorDot, ...]
    left_out_mm: dict[str, float] = {}


class Plan(Struct, frozen=True, forbid_unknown_fields=True):
    """What `plan.json` holds: the same input, settings and versions give it byte for byte.

    `cameras` are those that it was made for, in the rig's frame; none where they are unknown. `meetings` are dots that
    come too near to each other in the neutral or in an expression (`layout/dot_contact.py`), `unread` dots
    that a camera does not read in one, `labels` how surely a tracker tells them from each other between expressions in
    the order of shooting, `take_labels` in the takes.
    `draft` says what did not hold of the plan when something was made of it all the same; empty where all holds.
    `actor` is the head that the plan was carried onto; all else speaks of the rig.
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
    cameras: tuple[KnownCamera, ...] = ()
    meetings: tuple[Meeting, ...] = ()
    unread: tuple[Unread, ...] = ()
    labels: tuple[Labels, ...] = ()
    take_labels: tuple[Labels, ...] = ()
    draft: tuple[str, ...] = ()
    actor: ActorHead | None = None
    seal: str = ""

    @property
    def in_session(self) -> tuple[Expression, ...]:
        """The expressions in the order of shooting, with what is covered after each in that order."""
        of = {expression.name: expression for expression in self.packing.expressions}
        items = [item for item in self.session.items if item.name in of]
        return tuple(structs.replace(of[item.name], covered=item.covered) for item in items)

    @property
    def shots(self) -> dict[str, str]:
        """Words for every expression by its name: 'shot 18 (E11)'."""
        return {item.name: f"shot {shot_number(item)} ({item.name})" for item in self.session.items if item.slate}

    @property
    def poses(self) -> Poses:
        """The pose of every expression by its name, in the order of shooting."""
        return in_order(self.packing, self.session)


def in_order(packing: Packing, shots: Session) -> Poses:
    """The pose of every expression by its name, in the order of a session."""
    return {item.name: packing.poses[item.name] for item in shots.items if item.name in packing.poses}


def number_of(plan: Plan) -> str:
    """The plan's number, 16 hexadecimal digits that stand on all that is made of it: equal plans, equal numbers. The
    seal in plan.json begins with it, but for a draft, which has the number of its plan."""
    return seal_of(structs.replace(plan, draft=()))[:16]


def words_of(plan: Plan) -> str:
    """Which plan, and whose head all that is made of it shows: 'plan 0123456789abcdef of hero, on anna's head'."""
    return f"plan {number_of(plan)} of {head_words(plan)}"


def head_words(plan: Plan, *, generic: bool = False) -> str:
    """Whose head it shows: 'hero', or 'hero on anna's head' where the plan was carried onto an actor's; 'hero on a
    generic head'."""
    if generic:
        return f"{plan.rig.name} on a generic head"
    return f"{plan.rig.name} on {plan.actor.name}'s head" if plan.actor else plan.rig.name


def whose_words(plan: Plan) -> str:
    """Whose head a folder shows that holds what is made of the plan: scans of one name are told apart."""
    return f"{head_words(plan)} (scan {plan.actor.fingerprint[:8]})" if plan.actor else head_words(plan)


def with_poses(plan: Plan, rig: Rig) -> Plan:
    """The plan with the dots that come too near to each other in its expressions, and those that a camera does not read
    in them."""
    markers, poses, settings = plan.layout.markers, plan.packing.poses, plan.settings.landmarks
    cameras, dot_mm, asked_mm = cameras_of(plan), settings.dot_mm, settings.label_margin_mm or 0.0
    return structs.replace(
        plan,
        meetings=meetings(rig, markers, poses, dot_mm),
        unread=unread(rig, markers, poses, cameras, dot_mm),
        labels=label_margins(rig, markers, plan.poses, cameras, dot_mm=dot_mm, asked_mm=asked_mm),
    )


def with_takes(plan: Plan, takes: Takes | None) -> Plan:
    """The plan with how surely its dots are told from each other in the takes; as it is where there are none."""
    if takes is None:
        return plan
    asked_mm = plan.settings.landmarks.label_margin_mm or 0.0
    return structs.replace(
        plan, take_labels=take_labels(plan.layout.markers, takes, cameras_of(plan), asked_mm=asked_mm)
    )


def cameras_of(plan: Plan) -> tuple[Camera, ...]:
    """The cameras that a plan carries.

    Raises:
        RigError: its numbers describe none.
    """
    return tuple(camera_of(known) for known in plan.cameras)


def sealed(plan: Plan) -> Plan:
    """The plan with the seal of what it says."""
    return structs.replace(plan, seal=seal_of(plan))


def seal_of(plan: Plan) -> str:
    """Digest of all that a plan says."""
    return hashlib.sha256(msgspec.json.encode(structs.replace(plan, seal=""))).hexdigest()[:32]
