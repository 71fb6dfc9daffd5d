"""A plan in a few sentences, for the terminal, the title page and the first screen of a notebook."""

from capture_plan.anatomy.kinds import apart_lines
from capture_plan.expressions.record import Packing
from capture_plan.expressions.session import spare_words
from capture_plan.expressions.settings import MEASURED_BY
from capture_plan.face.words import doubts
from capture_plan.layout.assembly import EVEN, target_of
from capture_plan.layout.dot_contact import meeting_words
from capture_plan.layout.face import SIXTY_EIGHT
from capture_plan.layout.record import Information, Layout, MotionFit, Prediction, View
from capture_plan.layout.studio import LEAST_GAIN
from capture_plan.plan.budget_words import bound_words, budget_words, unspent_words
from capture_plan.plan.predicted import at_noise, error_words, prediction_words
from capture_plan.plan.record import Plan
from capture_plan.rig import Rig
from capture_plan.sequence.record import UNUSED

FIRST = 5  # expressions whose share of the importance is told: what an hour of scanning shows
MOST_TOLD = 5  # markers that are not read
WITHOUT_CONSTRAINTS = {"single set cover": " (without spacing and constraints)"}


def summary(plan: Plan) -> tuple[str, ...]:
    """What a supervisor wants to know first, one sentence a line; every number with its unit."""
    from capture_plan.layout.told_apart import label_words  # with a solver, which who checks a plan does not load

    layout, packing, audit = plan.layout, plan.packing, plan.audit
    took = f"The session takes about {plan.session.minutes:.0f} minutes."
    asked_mm = plan.settings.landmarks.label_margin_mm
    lines = [
        f"{plan.rig.name}: {len(audit.used)} of {audit.blendshapes} blendshapes planned for, "
        f"{audit.skin_vertices:,} skin vertices.",
        *uncovered_words(plan),
        f"{information_words(layout.information, layout.predictions)}{budget_words(plan)}.",
        *unspent_words(plan),
        *prediction_words(layout.information, layout.predictions),
        *target_words(plan),
        *unidentified_words(plan),
        *fewer_words(plan),
        *bound_words(plan),
        *motion_words(plan),
        *region_words(plan),
        *head_words(plan),
        *near_words(plan),
        *view_words(plan),
        *label_words((*plan.labels, *plan.take_labels), [m.name for m in plan.layout.markers], plan.shots, asked_mm),
        f"Proved: under these constraints, to see {'all of the others' if layout.uncovered else 'every blendshape'} at "
        f"all takes at least {layout.certificate.landmarks} landmarks.",
        *fine_words(plan),
        *(
            f"For comparison, {name}{WITHOUT_CONSTRAINTS.get(name, '')}: {information_words(other, other.predictions)}"
            f"{lost_words(layout.motion, name)}."
            for name, other in layout.references.items()
        ),
        f"{expression_words(packing)}{first_words(plan)}.",
        " ".join(filter(None, [took, spare_words(plan.session), plan.session.stop])),
    ]
    lines += [f"{heading}, planned apart: {names}." for heading, names, _ in apart_lines(audit.apart)]
    if packing.left_out:
        lines.append(f"Left out by the limit on expressions: {', '.join(packing.left_out)}.")
    return tuple(lines)


def fine_words(plan: Plan) -> list[str]:
    """What proofs on a fine mesh speak of."""
    fine = [finding for finding in plan.audit.findings if finding.kind == "fine"]
    return [f"{finding.message[0].upper()}{finding.message[1:]}. {finding.advice}" for finding in fine]


def uncovered_words(plan: Plan) -> list[str]:
    """Which blendshapes no landmark moves with, and why."""
    layout, names = plan.layout, ", ".join(plan.layout.uncovered)
    if not names:
        return []
    if layout.method == "motion":
        return [f"Chosen for the take, the layout has no landmark on {names}."]
    if layout.programs or plan.settings.landmarks.method != "budget":
        return [
            f"No landmark can stand for {names}: the skin that they move is seen too little or lies in a zone without "
            "dots. Capture these by another means, or make the zones smaller (--keep-out)."
        ]
    return [f"The budget does not pay for a landmark on every blendshape; without one: {names}."]


def target_words(plan: Plan) -> list[str]:
    """How the layout stands beside the one that it has to equal, how few landmarks anybody would need for it, and what
    is said of 68 points that fit this face badly."""
    layout = plan.layout
    if layout.error_bound is None:
        return []
    name, target = target_of(layout.references)
    messages = []
    if SIXTY_EIGHT in layout.references and name != SIXTY_EIGHT:
        placed = layout.references[SIXTY_EIGHT].error_mm
        messages.append(
            f"{SIXTY_EIGHT} have an upper estimate of {placed:.3f} mm, as many {EVEN} {target:.3f} mm: the points do "
            "not fit this face and are no target."
        )
    messages.append(comparison_words(layout, name))
    if layout.information.error_mm > target and layout.method == "studio":
        messages.append(
            f"The upper estimate of {name}, {target:.3f} mm, is not reached here: beyond {len(layout.landmarks)} "
            f"landmarks, another one lowers it by less than {LEAST_GAIN:.0%}. Smaller zones without dots, a closer "
            "spacing or a budget of your own bring more."
        )
    messages.append(fewest_words(layout.target_landmarks, target, name))
    return messages


def comparison_words(layout: Layout, name: str) -> str:
    """'Beside 68 points (iBUG), these 34 landmarks have a predicted error 3 % lower and an upper estimate as high.'"""
    mine, other = layout.information, layout.references[name]
    upper = f"an upper estimate {more_words(mine.error_mm, other.error_mm)}"
    first = [at_noise(one, mine.noise_mm)[:1] for one in (layout.predictions, other.predictions)]
    both = [one.error_mm for found in first for one in found]
    predicted = f"a predicted error {more_words(both[0], both[1])} and " if len(both) > 1 else ""
    return f"Beside {name}, these {mine.landmarks} landmarks have {predicted}{upper}."


def more_words(error_mm: float, other_mm: float) -> str:
    """An error beside another in words: '3.1% lower', '12 times as high'."""
    share = error_mm / max(other_mm, 1e-9) - 1
    if share >= 1:
        return f"{1 + share:,.3g} times as high"
    return f"{abs(share):.1%} {'lower' if share < 0 else 'higher'}" if round(abs(share), 3) else "as high"


def fewest_words(fewest: int | None, target_mm: float, name: str) -> str:
    """What is proved of the number of landmarks that any layout needs for the upper estimate of another."""
    wanted = f"upper estimate of {name}, {target_mm:.3f} mm"
    if fewest is None:
        return f"Proved: under these constraints no number of landmarks has the {wanted}."
    return f"Proved: under these constraints no layout of fewer than {fewest} landmarks has the {wanted}, or less."


def region_words(plan: Plan) -> list[str]:
    """What of the face was not understood beyond doubt, what to give, and why places then have no names."""
    read = plan.audit.reading
    if not read:
        return []
    doubted = [f"In doubt: {' '.join(message)}"] if (message := doubts(read)) else []
    if read.regions_known:
        return doubted
    return [
        *doubted,
        "Eyes, mouth or axes of this face are not certain, so that places go without the names of regions, and zones "
        "without dots lie where eyes and mouth are assumed: look at `capture-plan audit RIG -o audit.png` first.",
    ]


def near_words(plan: Plan) -> list[str]:
    """Which dots come too near to each other in which expression."""
    words = meeting_words(plan.meetings, plan.settings.landmarks.dot_mm, plan.shots)
    return [f"{words}."] if words else []


def motion_words(plan: Plan) -> list[str]:
    """What a recorded take was used for, what it loses by the landmarks, and what it says nothing of."""
    if not plan.layout.motion:
        return []
    if plan.layout.method == "motion":
        use = "The take chose the landmarks: they are those found to lose least of it."
    else:
        use = "The take did not choose the landmarks (--method motion does): what they lose of it is measured."
    return [use, *fit_words(plan.layout.motion)]


def take_summary(layout: Layout, rig: Rig) -> tuple[str, ...]:
    """What a layout for a take alone is worth: its frames stand for blendshapes."""
    information = layout.information
    return (
        f"{rig.name}: {information.landmarks} markers on {int(rig.skin.sum()):,} skin vertices.",
        *(fit_words(layout.motion) if layout.motion else ()),
        f"With {len(rig.names)} frames of it in place of blendshapes, the markers have rank {information.rank} of "
        f"{information.full_rank}, {error_words(information, layout.predictions)}.",
        *prediction_words(layout.information, layout.predictions),
    )


def fit_words(fit: MotionFit) -> list[str]:
    """What the takes lose by any layout."""
    steps = [f"{fit.curve_mm[m - 1]:.2f} mm off with the first {m}" for m in quarters(len(fit.curve_mm))]
    lines = [
        f"Without blendshapes, a smooth sheet of skin bent between these landmarks is {fit.rmse_mm:.2f} mm off in a "
        f"take of {fit.frames:,} frames (root mean square where the take moves it)"
        f"{'; ' if steps else ''}{', '.join(steps)}. What a solver of blendshapes leaves is the predicted error."
    ]
    if fit.missing:
        lines.append(
            f"The take hardly or never moves {len(fit.missing)} blendshapes (no weight above {UNUSED:g}), so that this "
            f"says nothing of them: {', '.join(fit.missing)}."
        )
    lines += [f"Of {', '.join(one.sequences)} alone, {one.rmse_mm:.2f} mm." for one in fit.subjects]
    return [*lines, *(f"Note: {note}." for note in fit.notes)]


def lost_words(fit: MotionFit | None, name: str) -> str:
    """', 1.31 mm of the take', of a layout for comparison."""
    return f", {fit.references_mm[name]:.2f} mm left of the take" if fit and name in fit.references_mm else ""


def quarters(count: int) -> list[int]:
    """A quarter, a half and three quarters of a number."""
    return sorted({count * part // 4 for part in (1, 2, 3)} - {0})


def head_words(plan: Plan) -> list[str]:
    """What head markers are worth."""
    pose, head = plan.layout.head_pose, plan.layout.head
    if pose is None:
        return []
    lost = [m.name for m in head if m.views and not any(view.always for view in m.views)]
    given = (
        f"{len(head)} head markers more give the head's pose to {pose.rotation_degrees:.2f} degrees and "
        f"{pose.translation_mm:.2f} mm: {pose.surface_mm:.2f} mm on the face"
    )
    if not lost:
        return [f"{given}."]
    enough = len(head) - len(lost) >= 3
    fixed = "so that it is less exact" if enough else "and fewer than three of the others fix no pose"
    return [
        f"{given}, where all of them are measured. These cameras do not read {', '.join(lost)}, {fixed}: add a camera, "
        "or leave head markers out where the cameras move with the head."
    ]


def view_words(plan: Plan) -> list[str]:
    """What each camera reads, and why not the rest; how exactly the markers are measured."""
    marks, landmarks = plan.layout.markers, plan.layout.landmarks
    lines = []
    for c, camera in enumerate(plan.cameras):
        views = {m.name: m.views[c] for m in marks}
        never, always = ([name for name, view in views.items() if view.share == share] for share in (0.0, 1.0))
        if len(never) == len(marks):
            lines.append(f"Camera '{camera.name}' reads no marker: check where it stands and looks.")
            continue
        rest = {name: view for name, view in views.items() if not view.always}
        line = f"Camera '{camera.name}' reads {len(always)} of {len(marks)} markers in every expression"
        if slip := camera.slip:
            line += f", wherever the head slips within {slip[0]:g} mm and {slip[1]:g}°"
        lines.append(f"{line}{'; not always ' + _reasons(rest) if rest else ''}.")
    deep = [m for m in landmarks if len(m.measured_mm) == 3]
    if deep:
        across, along = (sorted(m.measured_mm[i] for m in deep)[len(deep) // 2] for i in (0, 2))
        lines.append(
            f"As these cameras measure it, half of the markers' places are known to {across:.2f} mm along their best "
            f"axis and to {along:.2f} mm along their worst (standard deviations)."
        )
    flat = [m.name for m in landmarks if m.measured_mm and len(m.measured_mm) < 3]
    if flat and plan.cameras:
        told = "all markers" if len(flat) == len(landmarks) else ", ".join(flat)
        lines.append(
            f"One camera alone reads {told}: how deep they lie in its view is not measured, and what moves them along "
            "it is told from the other markers only."
        )
    return lines + unread_words(plan)


def _reasons(views: dict[str, View]) -> str:
    """'M07, M09 (hidden), M11 (edge-on)'."""
    by_reason: dict[str, list[str]] = {}
    for name, view in views.items():
        by_reason.setdefault(view.why, []).append(name)
    return ", ".join(f"{', '.join(names)} ({why})" for why, names in by_reason.items())


def unread_words(plan: Plan) -> list[str]:
    """Markers that fewer cameras than asked for read in an expression of the plan."""
    missing: dict[tuple[str, str], list[str]] = {}
    for one in plan.unread:
        missing.setdefault((one.pose, one.dot), []).append(f"{one.why} for '{one.camera}'")
    least = max(plan.settings.landmarks.min_views, 1)
    bad = {at: why for at, why in missing.items() if len(plan.cameras) - len(why) < least}
    if not bad:
        return []
    first = "; ".join(f"{dot} in {pose} ({', '.join(why)})" for (pose, dot), why in list(bad.items())[:MOST_TOLD])
    more = f"; and {len(bad) - MOST_TOLD} more" if len(bad) > MOST_TOLD else ""
    fewer = "no camera reads" if least == 1 else f"fewer than {least} cameras read"
    return [f"In expressions of the plan {fewer} {first}{more}: move the marker or add a camera."]


def fewer_words(plan: Plan) -> list[str]:
    """What a quarter, a half and three quarters of the landmarks would leave, where they have an order."""
    curve = plan.layout.curve_mm
    counts = quarters(len(curve))
    steps = ", ".join(f"{curve[m - 1]:.2f} mm with the first {m}" for m in counts)
    return [f"Upper estimate in the order of plan.json: {steps}."] if steps else []


def information_words(information: Information, predictions: tuple[Prediction, ...]) -> str:
    """'34 landmarks, rank 51 of 51, predicted error 0.140 mm, upper estimate 0.182 mm under 0.2 mm of noise'."""
    rank = f"rank {information.rank} of {information.full_rank}"
    return f"{information.landmarks} landmarks, {rank}, {error_words(information, predictions)}"


def expression_words(packing: Packing) -> str:
    """'18 expressions, proved the fewest'; of a list that is cut short '10 of 18 expressions; 18 proved the fewest'."""
    shown, proof = len(packing.expressions), proof_words(packing)
    if shown == packing.objective:
        return f"{shown} expressions, {proof}"
    return f"{shown} of {packing.objective} expressions; {packing.objective} {proof}"


def number_words(packing: Packing) -> str:
    """What stands beside the number of expressions: 'proved the fewest', or of a cut list 'of 18; 18 proved …'."""
    cut = len(packing.expressions) < packing.objective
    return f"of {packing.objective}; {packing.objective} {proof_words(packing)}" if cut else proof_words(packing)


def proof_words(packing: Packing) -> str:
    """What may be said of the number of the whole list."""
    proven = packing.proven_optimal and packing.bound == packing.objective
    return "proved the fewest" if proven else f"not proved the fewest (at least {packing.bound})"


def unidentified_words(plan: Plan) -> list[str]:
    """How many mixes of blendshapes are not distinguished, and why: by these markers, or on this rig by any."""
    information, used = plan.layout.information, len(plan.audit.used)
    lines, full_rank = [], information.full_rank
    if information.rank < full_rank:
        lines.append(
            f"Not distinguished by these landmarks: {full_rank - information.rank} of {full_rank} mixes of "
            "blendshapes, which move other skin only; `capture-plan inspect` names them."
        )
    if full_rank < used:
        lines.append(
            f"Not distinguished by any landmarks: {used - full_rank} of {used} mixes, which move no skin of this "
            "rig (`capture-plan audit` names blendshapes that others make up)."
        )
    return lines


def first_words(plan: Plan) -> str:
    """'; the first 5 cover 46% of the importance'; nothing where the list is no longer than that."""
    if len(plan.packing.expressions) <= FIRST:
        return ""
    measured = MEASURED_BY[plan.settings.expressions.importance]
    return f"; the first {FIRST} cover {first_share(plan, FIRST):.0%} of {measured}"


def first_share(plan: Plan, count: int) -> float:
    """Share of the importance (`MEASURED_BY`) that the first `count` expressions that are shot cover, 0 to 1."""
    shots = [item for item in plan.session.items if item.kind == "expression"][:count]
    return shots[-1].covered if shots else 0.0


def expression_lines(plan: Plan, former: Plan) -> tuple[str, ...]:
    """The list after an edit, a line an expression; what changed is marked."""
    packing, before = plan.packing, {shot.blendshapes for shot in former.packing.expressions}
    names = sum(len(shot.blendshapes) for shot in packing.expressions)
    unmoved = "" if packing.unmoved is None else f"; {packing.unmoved} of {names} blendshapes stay where they were"
    return (
        f"{expression_words(packing)}{unmoved}.",
        *(
            f"{'  ' if shot.blendshapes in before else '* '}{plan.shots.get(shot.name, shot.name)}: "
            f"{', '.join(shot.blendshapes)}"
            for shot in plan.in_session
        ),
    )
