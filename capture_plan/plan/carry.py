"""A plan on the actor's own head: carried there once, and what everybody who draws it asks for afterwards.

    carried(plan, rig, head, points)        the plan with its record `actor`, and the neutral as it was laid
    as_worn(plan, inputs)                   the plan and the rig as pages show them: the head that the actor has

What a plan claims, it claims of the rig; only where dots lie and how the face looks is the actor's.
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int
from msgspec import structs

from capture_plan.cache import digest
from capture_plan.errors import PlanError
from capture_plan.input.points import Point
from capture_plan.layout.record import Landmark, Layout
from capture_plan.mesh.nearest import nearest_on_surface
from capture_plan.plan.inputs import PlanInputs
from capture_plan.plan.places import found_from, seen_from, with_files
from capture_plan.plan.record import SAMPLE, ActorDot, ActorHead, Plan, sealed
from capture_plan.reader.head_scan import HeadScan
from capture_plan.registration.onto_head import Laid, lay_onto_head
from capture_plan.registration.picked_points import picks_on
from capture_plan.rig import Rig

DIGITS = 4  # of millimetres, and of what is laid in its file
ON_SURFACE_MM = 4.0  # a scan's surface that lies further off is hair, or the rim of a hole


def carried(
    plan: Plan, rig: Rig, head: HeadScan, points: Mapping[str, Point] | None = None
) -> tuple[Plan, Float[np.ndarray, "v 3"]]:
    """The plan with where its dots go on the head, and the rig's neutral laid onto it, millimetres, as the rig stands.
    The record's file names are those of `head` and of nothing yet: see `with_places`.

    Raises:
        RigError: no face is found on the head, or the points contradict it.
        PlanError: a point has a name that is not known.
    """
    markers = {m.name: m.vertex for m in plan.layout.markers}
    laid = lay_onto_head(rig, head, picks_on(rig, points or {}, markers))
    neutral = np.round(laid.neutral, DIGITS)
    median, tail = laid.error_mm
    actor = ActorHead(
        name=head.name,
        path="",
        fingerprint=head.fingerprint,
        unit_mm=laid.unit_mm,
        rotation=tuple(laid.rotation.ravel().tolist()),
        translation=_three(laid.translation),
        laid="",
        laid_fingerprint=laid_fingerprint(neutral),
        error_mm=round(median, 2),
        error_95_mm=round(tail, 2),
        stated="leave-one-out" if laid.left_out_mm else "estimated",
        points=len(points or {}),
        cost_mm=round(laid.cost_mm, DIGITS),
        dots=dots_on(plan.layout, rig.triangles, neutral, head, laid),
        left_out_mm={name: round(mm, 1) for name, mm in laid.left_out_mm.items()},
    )
    return structs.replace(plan, actor=actor), neutral


def with_places(plan: Plan, before: Path, after: Path, head: Path, laid: Path) -> Plan:
    """The carried plan as it stands in the file `after`, where `before` is the one that it was carried from."""
    assert plan.actor is not None
    was, now = before.parent, after.parent

    def moved(name: str | None) -> str | None:
        return seen_from(now, found_from(was, name))

    rig = plan.rig
    path = rig.path if rig.path == SAMPLE else str(moved(rig.path))
    settings = with_files(plan.settings, lambda name: seen_from(now, found_from(was, name)))
    actor = structs.replace(plan.actor, path=seen_from(now, str(head)), laid=laid.name)
    rig = structs.replace(rig, path=path, skin=moved(rig.skin), names=moved(rig.names))
    return sealed(structs.replace(plan, rig=rig, settings=settings, actor=actor))


def dots_on(
    layout: Layout, triangles: Int[np.ndarray, "f 3"], neutral: Float[np.ndarray, "v 3"], head: HeadScan, laid: Laid
) -> tuple[ActorDot, ...]:
    """Every marker on the surface of the head, or where there is none near on the laid skin."""
    at = places_on(layout.markers, triangles, neutral)
    scan = head.vertices * laid.unit_mm
    foot = (nearest_on_surface(at @ laid.rotation.T + laid.translation, scan, head.triangles) - laid.translation) @ (
        laid.rotation
    )
    gap = np.linalg.norm(foot - at, axis=1)
    x = np.where((gap <= ON_SURFACE_MM)[:, None], foot, at)
    there = laid.in_file(x)
    return tuple(
        ActorDot(marker.name, _three(x[i]), _three(there[i], 7), round(float(gap[i]), DIGITS))
        for i, marker in enumerate(layout.markers)
    )


def places_on(
    markers: tuple[Landmark, ...], triangles: Int[np.ndarray, "f 3"], neutral: Float[np.ndarray, "v 3"]
) -> Float[np.ndarray, "m 3"]:
    """Where markers lie on another neutral of the rig's mesh, millimetres."""
    corners = neutral[triangles[[m.triangle for m in markers]]]
    return np.einsum("mc,mcx->mx", np.array([m.barycentric for m in markers]).reshape(-1, 3), corners)


def as_worn(plan: Plan, inputs: PlanInputs) -> tuple[Plan, Rig]:
    """The plan and the rig as pages show them: on a generic head where the inputs have one, else on the actor's own
    where the plan was carried onto it.

    Raises:
        PlanError: the plan was carried onto a head, and the inputs have none.
    """
    if plan.actor is None and not inputs.generic:
        return plan, inputs.rig
    if inputs.worn is None:
        name = plan.actor.name if plan.actor else "a generic"
        raise PlanError(f"the plan stands on {name}'s head, which was not given: read it with `inputs_of`")
    worn = inputs.worn_rig
    if plan.actor and not inputs.generic:
        x = {dot.name: dot.position for dot in plan.actor.dots}
    else:
        markers = plan.layout.markers
        places = places_on(markers, worn.triangles, worn.neutral)
        x = {marker.name: _three(place) for marker, place in zip(markers, places, strict=True)}

    def on_actor(markers: tuple[Landmark, ...]) -> tuple[Landmark, ...]:
        return tuple(structs.replace(marker, position=x[marker.name]) for marker in markers)

    layout = structs.replace(plan.layout, landmarks=on_actor(plan.layout.landmarks), head=on_actor(plan.layout.head))
    reference = structs.replace(plan.rig, fingerprint=worn.fingerprint)
    return structs.replace(plan, layout=layout, rig=reference), worn


def actor_words(actor: ActorHead) -> str:
    """'placed on anna's head, error about 1.4 mm, 95 % within 3.5 mm (leaving out each of 6 points)'."""
    how = f"leaving out each of {actor.points} points" if actor.stated == "leave-one-out" else "an estimate: no points"
    if actor.stated == "estimated" and actor.points:
        how = f"an estimate: {actor.points} points"
    error = f"error about {actor.error_mm:.1f} mm, 95 % within {actor.error_95_mm:.1f} mm"
    return f"placed on {actor.name}'s head, {error} ({how})"


def worn_words(plan: Plan, inputs: PlanInputs) -> str:
    """What pages say of a head that is not the rig's own; nothing where it is."""
    if inputs.generic:
        return "drawn on a generic head, without the actor's likeness: no distance on it is the actor's"
    return actor_words(plan.actor) if plan.actor else ""


def actor_lines(plan: Plan) -> list[str]:
    """What a person is told of a carried plan."""
    if (actor := plan.actor) is None:
        return []
    words = actor_words(actor)
    lines = [f"{len(actor.dots)} dots {words}.", f"One unit of {actor.name} was taken for {actor.unit_mm:g} mm."]
    if actor.stated == "estimated":
        lines.append("The error is no measurement: give four points or more with --points, and it is measured on them.")
    if actor.left_out_mm:
        worst = sorted(actor.left_out_mm.items(), key=lambda one: -one[1])
        lines.append(
            f"Each point from where the others lay it: {', '.join(f'{name} {mm:g} mm' for name, mm in worst)}."
        )
    if off := off_surface(actor):
        lines.append(f"No surface within {ON_SURFACE_MM:g} mm (a hole, hair?), by the laid skin: {', '.join(off)}.")
    return lines


def off_surface(actor: ActorHead) -> tuple[str, ...]:
    """Dots that have no surface of the scan near."""
    return tuple(dot.name for dot in actor.dots if dot.gap_mm > ON_SURFACE_MM)


def laid_fingerprint(neutral: Float[np.ndarray, "v 3"]) -> str:
    """16 hexadecimal digits of what was laid, to a ten-thousandth of a millimetre."""
    return digest([np.rint(neutral * 10**DIGITS).astype("<i8")])[:16]


def _three(x: Float[np.ndarray, " 3"], digits: int = DIGITS) -> tuple[float, float, float]:
    a, b, c = (round(float(value), digits) for value in x)
    return a, b, c
