"""From a rig to a plan: audit, landmarks, expressions."""

from importlib.metadata import version

from capture_plan.audit.audit import Audit
from capture_plan.audit.audit_cache import audit_once
from capture_plan.camera import Camera, recorded
from capture_plan.errors import InfeasibleError, RigError
from capture_plan.expressions.pack import pack
from capture_plan.expressions.record import Packing
from capture_plan.expressions.session import session
from capture_plan.face.unit import HUMAN_MM
from capture_plan.layout.design import design_layout
from capture_plan.layout.face import see_face
from capture_plan.layout.record import Layout
from capture_plan.plan.collide import collide
from capture_plan.plan.files import change_settings
from capture_plan.plan.inputs import PlanInputs, inputs_for, settings_recorded
from capture_plan.plan.record import (
    DECIDING,
    FORMAT_VERSION,
    SAMPLE,
    Plan,
    RigReference,
    in_order,
    sealed,
    with_poses,
    with_takes,
)
from capture_plan.plan.settings import Settings
from capture_plan.plan.structure import check_texts
from capture_plan.rig import Rig
from capture_plan.shell.takes import Takes


def make_plan(
    inputs: Rig | PlanInputs, settings: Settings | None = None, *, reference: RigReference | None = None
) -> Plan:
    """Plan a session for a rig, or for a rig with what else is known. `reference` says where the rig was read from, for
    the plan file.

    Raises:
        RigError: the rig has no blendshape that can be planned for.
        PlanError: the settings name a file that is not among the inputs.
        SettingsError: a value of the settings is out of range.
        InfeasibleError: no plan satisfies the settings.

    Example:
        >>> plan = make_plan(sample_rig(), Settings(landmarks=LayoutSettings(method="cover")))
        >>> len(plan.layout.landmarks), plan.layout.certificate.landmarks
        (12, 12)
    """
    settings = settings or Settings()
    change_settings(settings, {})  # what is written in Python is not held against its ranges before
    if reference:
        check_texts(reference, "give the file another name")
    given = inputs_for(inputs, settings)
    rig, settings = given.rig, settings_recorded(settings, given)
    report = audit_once(rig)
    if not report.used:
        wrong = [f"{one.message}. {one.advice}" for one in report.findings if one.kind == "export"]
        nothing = ["no blendshape moves the face skin: export deltas that do, or name the skin"]
        raise RigError(f"{rig.name}: {' '.join(wrong or nothing)}")
    face = see_face(rig, report.used, given.cameras, given.zones)
    packing = pack(
        rig,
        report.used,
        settings.expressions,
        target=given.target,
        rules=given.rules,
        apart=collide(rig, report.used, settings.expressions),
    )
    shots = session(rig, report.used, packing, settings.session, settings.expressions.importance)
    try:
        layout = design_layout(face, settings.landmarks, takes=given.takes, poses=in_order(packing, shots))
    except InfeasibleError as error:
        raise InfeasibleError(f"{error}{size_words(report)}") from error
    return assemble_plan(
        rig, settings, report, layout, packing, cameras=given.cameras, takes=given.takes, reference=reference
    )


def size_words(report: Audit) -> str:
    """What a person should know of the size where nothing can be had; nothing where the pupils are a person's apart."""
    pupils = report.interpupillary_mm
    if pupils is None or HUMAN_MM[0] <= pupils <= HUMAN_MM[1]:
        return ""
    return (
        f". This head was read with {pupils:g} mm between the pupils, a person has {HUMAN_MM[0]:g} to {HUMAN_MM[1]:g}: "
        "where that is wrong give --unit-mm, or scale the rig to the actor who wears the markers"
    )


def assemble_plan(
    rig: Rig,
    settings: Settings,
    report: Audit,
    layout: Layout,
    packing: Packing,
    *,
    cameras: tuple[Camera, ...] = (),
    takes: Takes | None = None,
    reference: RigReference | None = None,
) -> Plan:
    """A plan from its parts, for who computes them one at a time."""
    made = Plan(
        format=FORMAT_VERSION,
        rig=reference or RigReference(rig.name, SAMPLE, rig.fingerprint, len(rig.neutral)),
        settings=settings,
        audit=report,
        layout=layout,
        packing=packing,
        session=session(rig, report.used, packing, settings.session, settings.expressions.importance),
        cameras=tuple(map(recorded, cameras)),
        versions={name: version(name) for name in DECIDING},
    )
    return sealed(with_takes(with_poses(made, rig), takes))
