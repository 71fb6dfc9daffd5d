"""An inspection as a page for the terminal: short sections, every number with its unit."""

from capture_plan.evaluation.alternatives import Alternative
from capture_plan.evaluation.identifiability import CONFUSABLE_DEG, WEAK, Mix, Reason, Separator
from capture_plan.evaluation.rings import PROMISED
from capture_plan.evaluation.robustness import EXTENT_MM, GROWTH, Loss, Tolerance
from capture_plan.inspection.inspect import Inspection, MarkerReport, TakeReport
from capture_plan.layout.predict import MIXES
from capture_plan.plan.predicted import SOLVE, error_words, prediction_words
from capture_plan.plan.summary import fit_words

SHORT = 14  # lines of the short text
TIGHT = 3  # dots with the least room that it names
NAMED = 8  # names in one of its lines
PAIRS = 8  # the worst pairs of lost markers that are named
TELLING = 5  # markers that a take needs most and least
TELLING_DEG = 2.0  # a smaller change of an angle is not worth a word
TELLS_APART = 0.8  # a pair's angle shrinks to this share without the marker: worth saying as its reason


def inspection_text(found: Inspection) -> str:
    """The whole inspection as a page of text."""
    sections = (
        *((("DRAFT: this plan does not hold", found.draft),) if found.draft else ()),
        ("What the markers see", overview(found)),
        *((("What the markers leave of the take", take_lines(found.take, found)),) if found.take else ()),
        ("Weak and confusable blendshapes", sight_lines(found)),
        ("Why each marker is there", [f"{m.name} {m.label}: {reason_words(m, found)}" for m in found.markers]),
        ("How far a dot may stand from its place", tolerance_lines(found)),
        ("If a marker falls off", loss_lines(found)),
        ("If two markers fall off", pair_lines(found)),
        (
            f"Mishaps played through: error of the skin, {MIXES}, {SOLVE}",
            trial_lines(found),
        ),
        ("Other layouts as good as this one", other_lines(found)),
        ("Beside the layouts that studios use", alike_lines(found)),
    )
    return "\n".join(line for title, lines in sections for line in ("", title, *(f"  {line}" for line in lines)))[1:]


def short_text(found: Inspection) -> str:
    """What matters most of it, in `SHORT` lines at most: what is weak, which dots need most care, what may fall off."""
    markers, names = found.markers, {m.name: f"{m.name} {m.label}" for m in found.markers}
    tight = sorted((m for m in markers if m.unnoticed.worst_mm < EXTENT_MM), key=lambda m: m.unnoticed.worst_mm)[:TIGHT]
    needed, again = [m for m in markers if m.reason.only_one], [m.name for m in markers if not m.lost.carry_on]
    weak = [s.name for s in found.blendshapes if s.signal_to_noise < WEAK]
    lines = [
        *(f"DRAFT: {one}" for one in found.draft[:1]),
        *overview(found)[:1],
        *(fit_words(found.take.fit)[:1] if found.take else ()),
        *mix_lines(found)[:2],
        f"Single blendshapes below {WEAK:g} times the noise: {few(weak)}.",
        *sight_lines(found)[-1:],
        f"The only ones that see a blendshape: {few([m.name for m in needed])}.",
        *(
            f"{names[m.name]} has a ring of {m.ring_mm:.1f} mm; alone, unnoticed, it may stand "
            f"{tolerance_words(m.unnoticed)} off its place."
            for m in tight
        ),
        f"If one falls off, carry on; but re-apply {few(again)}.",
        *pair_lines(found)[:1],
        *other_lines(found)[:1],
    ]
    return "\n".join(line.removesuffix("; the worst are") for line in lines[:SHORT])


def few(names: list[str]) -> str:
    """The first names, and how many more there are."""
    if not names:
        return "none"
    return ", ".join(names[:NAMED]) + (f" and {len(names) - NAMED} more" if len(names) > NAMED else "")


def overview(found: Inspection) -> list[str]:
    """Number, rank, error and blind spots of the markers, a line each."""
    information, values = found.information, found.singular_values_mm
    lines = [
        f"{found.rig}: {information.landmarks} markers, rank {information.rank} of {information.full_rank}, "
        f"{error_words(information, found.predictions)}.",
        *prediction_words(found.information, found.predictions),
        f"Singular values from {values[0]:.1f} mm down to {values[-1]:.2f} mm of marker movement at weight 1.",
        *mix_lines(found),
        f"Blind at epsilon {found.epsilon:g}: {', '.join(found.blind) or 'to no blendshape'}.",
    ]
    if found.blind_of_68 is None:
        return [*lines, "The 68-point reference could not be laid onto this rig."]
    blind = ", ".join(found.blind_of_68) or "to no blendshape"
    return [*lines, f"68 points (iBUG) are blind at epsilon {found.epsilon:g}: {blind}."]


def mix_lines(found: Inspection) -> list[str]:
    """The mixes that these markers do not tell apart, and why, then those that they hardly do."""
    lost = found.information.full_rank - found.information.rank
    unseen, weak = found.weakest[:lost], found.weakest[lost:]
    more = [f"Not distinguished: {lost - len(unseen)} mixes more."] if lost > len(unseen) else []
    return [
        *(f"Not distinguished, since it moves no marker, only skin between them: {mix_words(mix)}." for mix in unseen),
        *more,
        *(f"Weak mix: {mix_words(mix)}." for mix in weak),
    ]


def take_lines(take: TakeReport, found: Inspection) -> list[str]:
    """The error of the take, of other layouts, and which markers it needs most and least."""
    fit, without = take.fit, zip(take.without_mm, found.markers, strict=True)
    named = [f"{m.name} {m.label} {error:.2f} mm" for error, m in sorted(without, key=lambda one: -one[0])]
    others = [f"{name} {error:.2f} mm" for name, error in fit.references_mm.items()]
    few = named if len(named) <= 2 * TELLING else [*named[:TELLING], "...", *named[-TELLING:]]
    return [
        *fit_words(fit),
        *([f"For comparison: {', '.join(others)}."] if others else []),
        f"Without one marker, the most needed first: {', '.join(few)}.",
    ]


def mix_words(mix: Mix) -> str:
    """'0.71 cheekSquint_L - 0.62 eyeSquint_L moves the markers 0.41 mm in all, the skin 0.02 mm (rms)'."""
    words = "".join(f" {'-' if part < 0 else '+'} {abs(part):.2f} {name}" for name, part in mix.parts)
    return f"{words.removeprefix(' + ')} moves the markers {mix.response_mm:.2f} mm in all, the skin " + (
        f"{mix.skin_mm:.3f} mm (rms)"
    )


def sight_lines(found: Inspection) -> list[str]:
    """Weak and least known blendshapes, and the pairs that are hardest to distinguish."""
    weak = sorted((s for s in found.blendshapes if s.signal_to_noise < WEAK), key=lambda s: s.signal_to_noise)
    lines = [
        f"Weak: {s.name} moves the markers {s.response_mm:.2f} mm in all, {s.signal_to_noise:.1f} times the noise."
        for s in weak
    ] or [f"No blendshape is weaker than {WEAK:g} times the noise."]
    unsure = max(found.blendshapes, key=lambda s: s.weight_sd)
    lines.append(f"Least known: {unsure.name}, its weight (0 to 1) to +-{unsure.weight_sd:.2f}.")
    for one, label in zip(found.separators, found.separator_labels, strict=True):
        lines.append(
            f"Confusable: {one.blendshapes[0]} and {one.blendshapes[1]}, {separator_words(one, label, found)}."
        )
    if not found.separators:
        closest = min(found.blendshapes, key=lambda s: s.angle_degrees)
        lines.append(
            f"Closest pair: {closest.name} and {closest.partner}, {closest.angle_degrees:.0f} degrees "
            f"(below {CONFUSABLE_DEG:g} one more dot is looked for)."
        )
    return lines


def separator_words(one: Separator, label: str, found: Inspection) -> str:
    """'12 degrees; one more dot on the left cheek, 9 mm from M14, makes it 21: at (36, 29, 95) mm from the rig's
    origin, x to the subject's left, y up, z to the front'."""
    if one.angle_then_degrees - one.angle_degrees < TELLING_DEG:
        return f"{one.angle_degrees:.0f} degrees; no place for one more dot opens it by {TELLING_DEG:g} degrees"
    where = ", ".join(f"{x:.0f}" for x in one.position)
    return (
        f"{one.angle_degrees:.0f} degrees; one more dot on the {label}, {one.nearest_mm:.0f} mm from "
        f"{found.markers[one.nearest].name}, makes it {one.angle_then_degrees:.0f}: at ({where}) mm from the rig's "
        "origin, x to the subject's left, y up, z to the front"
    )


def reason_words(marker: MarkerReport, found: Inspection) -> str:
    """Why a marker stands where it does, in one sentence."""
    reason: Reason = marker.reason
    if reason.only_one:
        return f"the only one that sees {', '.join(reason.only_one)}"
    if reason.angle_without_degrees < TELLS_APART * reason.angle_degrees:
        return (
            f"tells {reason.pair[0]} from {reason.pair[1]} apart: angle {reason.angle_degrees:.0f} degrees with it, "
            f"{reason.angle_without_degrees:.0f} without"
        )
    with_it, without = found.information.error_mm, marker.lost.error_mm
    view = f"a further view: upper estimate {with_it:.3f} mm with it, {without:.3f} without"
    if reason.angle_degrees - reason.angle_without_degrees < TELLING_DEG:
        return view
    return (
        f"{view}; helps to tell {reason.pair[0]} from {reason.pair[1]}, {reason.angle_degrees:.0f} degrees with it, "
        f"{reason.angle_without_degrees:.0f} without"
    )


def tolerance_lines(found: Inspection) -> list[str]:
    """How far each dot may stand beside its place: with all others off too, and alone, unnoticed and measured."""
    return [
        f"Ring, to place by: all dots may stand so far off at once, and {PROMISED:.0%} of crews stay under "
        f"{GROWTH - 1:+.0%} of error; the marker pages draw it.",
        "Alone, to judge one dot that slipped: it may stand so far off while all others stand at their places, until a "
        f"blendshape is lost, the skin ends, or the upper estimate of the error grows by {GROWTH - 1:.0%}; the worst "
        "direction and the best, left being the subject's own.",
        "Unnoticed: the solver takes the dot for one at its place. Measured: it is told where the dot stands.",
        *(
            f"{m.name} {m.label}: ring {m.ring_mm:.1f} mm; alone, unnoticed, {tolerance_words(m.unnoticed)}; alone, "
            f"measured, {tolerance_words(m.measured)}"
            for m in found.markers
        ),
    ]


def tolerance_words(tolerance: Tolerance) -> str:
    """'1.5 mm (up) to 6.0 mm (left)'; one number where both are the most that was tried."""
    if tolerance.worst_mm >= EXTENT_MM:
        return f"{EXTENT_MM:g} mm or more everywhere"
    most = f"{EXTENT_MM:g} mm or more"
    best = most if tolerance.best_mm >= EXTENT_MM else f"{tolerance.best_mm:.1f} mm ({tolerance.best_direction})"
    return f"{tolerance.worst_mm:.1f} mm ({tolerance.worst_direction}) to {best}"


def loss_lines(found: Inspection) -> list[str]:
    """What to do where a dot falls off, marker by marker."""
    return [f"{m.name} {m.label}: {loss_words(m.lost)}; {substitute_words(m)}" for m in found.markers]


def loss_words(loss: Loss) -> str:
    """'carry on, upper estimate 0.21 mm' or 're-apply, upper estimate 0.31 mm, nobody sees noseSneer_R'."""
    blind = f", nobody sees {', '.join(loss.uncovered)}" if loss.uncovered else ""
    return f"{'carry on' if loss.carry_on else 're-apply'}, upper estimate {loss.error_mm:.3f} mm{blind}"


def substitute_words(marker: MarkerReport) -> str:
    """The nearest place that serves instead of a marker."""
    other = marker.substitute
    if other is None:
        return f"no other place within {EXTENT_MM:g} mm serves as well"
    return (
        f"nearest substitute vertex {marker.substitute_source_vertex:,}, {marker.substitute_label}, "
        f"{other.distance_mm:.1f} mm {other.direction}, upper estimate {other.error_mm:.3f} mm"
    )


def pair_lines(found: Inspection) -> list[str]:
    """How many pairs of dots can be lost, and which of them are worst."""
    pairs = found.two_lost
    worst = sorted(pairs, key=lambda loss: (-len(loss.uncovered), -loss.error_mm, loss.landmarks))[:PAIRS]
    carry_on = sum(loss.carry_on for loss in pairs)
    return [
        f"{carry_on} of {len(pairs)} pairs can be lost and the session carry on; the worst are",
        *(f"{' and '.join(found.markers[m].name for m in loss.landmarks)}: {loss_words(loss)}" for loss in worst),
    ]


def trial_lines(found: Inspection) -> list[str]:
    """The errors of simulated mishaps, millimetres."""
    return [f"{trial.what}: {trial.error_mm:.2f} mm, 1 in 20 above {trial.worst_mm:.2f} mm" for trial in found.trials]


def other_lines(found: Inspection) -> list[str]:
    """What a person could have instead."""
    good = [one for one in found.others if one.as_good]
    lines = [
        f"{one.landmarks} markers, upper estimate {one.error_mm:.3f} mm{left_words(one)}: "
        f"without {', '.join(one.leaves)}, instead on {', '.join(one.takes)}."
        for one in good
    ]
    worse = [one for one in found.others if not one.as_good]
    if worse:
        lines.append(
            f"The next that leaves a fifth of the places is {worse[0].worse:.1%} worse, in its error or "
            f"its number of markers ({worse[0].landmarks} markers, {worse[0].error_mm:.3f} mm{left_words(worse[0])})."
        )
    return lines or ["None: no other layout keeps all constraints."]


def left_words(one: Alternative) -> str:
    """', 1.31 mm left of the take', where there is one."""
    return "" if one.lost_mm is None else f", {one.lost_mm:.3f} mm left of the take"


def alike_lines(found: Inspection) -> list[str]:
    """The empirical layouts, the most alike first."""
    return [
        f"{one.name}: nearest points {one.mean_nearest_mm:.1f} mm apart on average, "
        f"{one.region_overlap:.0%} of the points in the same regions."
        for one in found.alike
    ] or ["No empirical layout could be laid onto this rig."]
