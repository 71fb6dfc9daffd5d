"""What sentences say against what shapes do, recomputed from the rig without the code that writes sentences.

Largest   of an expression's blendshapes, a corrective's together with what it corrects, the one that moves the skin
          furthest, and by how far, alone or at its place in the pose: the sentence has a phrase for its name, or the
          millimetres of it. A phrase for one eye says nothing of what moves the skin of both sides alike
Lips      lips that a sentence asks to close are closed in the pose: on the midline, the rim that goes down with the jaw
          and the one that stays above it are at most OPEN_MM further apart than in the neutral
"""

import re

import numpy as np
from jaxtyping import Float

from capture_plan.anatomy.meaning import arkit_by_motion, base_name
from capture_plan.expressions.movement import movements
from capture_plan.expressions.record import Expression
from capture_plan.expressions.sentences import phrases
from capture_plan.mesh.mirror import mirror_plane
from capture_plan.plan.advice import say_names
from capture_plan.plan.claims import Claim, claim
from capture_plan.plan.record import Plan
from capture_plan.rig import Rig

SAID = 0.75  # of the largest movement: a place is told by its own furthest point, and millimetres are rounded
SMALL_MM = 1.0  # an expression that moves less than that moves nothing that a sentence could leave out
MILLIMETRES = re.compile(r"by ([0-9]+(?:\.[0-9]+)?) mm")
PICTURE = "match the picture"
CLOSED = "keep your lips closed"
OPEN_MM = 3.0  # a scan shows lips as open


def sentence_claims(plan: Plan, rig: Rig) -> list[Claim]:
    """Every expression's sentence names its largest movement, and asks for no closed lips where they are open."""
    expressions = plan.packing.expressions
    drivers = plan.packing.drivers
    unsaid = [line for expression in expressions if (line := largest_unsaid(rig, expression, drivers))]
    apart = [line for expression in expressions if (line := open_lips_unsaid(rig, expression))]
    return [
        claim(
            "every sentence names the largest movement of its expression",
            not unsaid,
            "; ".join(unsaid) or f"{len(expressions)} sentences",
            f"tell the actor these movements too, or {say_names(plan.rig)} and plan again",
        ),
        claim(
            "lips that a sentence closes are closed",
            not apart,
            "; ".join(apart) or "as the pose shows",
            "close them in the corrective blendshape, or expect a scan with open lips",
        ),
    ]


def largest_unsaid(rig: Rig, expression: Expression, drivers: tuple[tuple[str, str], ...]) -> str | None:
    """What a sentence leaves out, where it is the largest movement of the expression; None where it says it."""
    far = {
        name: _furthest(rig, (name, *(base for of, base in drivers if of == name))) for name in expression.blendshapes
    }
    name = max(far, key=lambda name: far[name])
    messages = [float(mm) for mm in MILLIMETRES.findall(expression.sentence)]
    both = (far[name], _in_pose(rig, name, expression.blendshapes, drivers))
    if not messages and PICTURE in expression.sentence.lower() and not movements(rig, (name,)):
        return None  # neither its name nor its place has words: the picture shows it
    if min(both) < SMALL_MM or any(SAID * mine <= mm <= mine + 1 for mine in both for mm in messages):
        return None
    arkit = arkit_by_motion(rig, name)
    said = any(phrase in expression.sentence.lower() for phrase in _phrases_for(arkit))
    if said and not (arkit and _of_one_eye(arkit) and _moves_both(rig, name)):
        return None
    return f"{expression.name} moves the skin by {far[name]:.0f} mm ({name}), and its sentence does not say so"


def open_lips_unsaid(rig: Rig, expression: Expression) -> str | None:
    """By how much the lips are open in an expression whose sentence closes them; None where it is not so."""
    if CLOSED not in expression.sentence:
        return None
    jaw = _jaw_of(rig, expression)
    if jaw is None:
        return None
    pose = rig.pose(np.isin(rig.names, [*expression.pose, jaw]) * 1.0)
    gap = _lip_gap(rig, rig.deltas[rig.names.index(jaw)], pose)
    if gap < OPEN_MM:
        return None
    return f"{expression.name} asks for closed lips, in its pose they stand {gap:.0f} mm apart"


def _jaw_of(rig: Rig, expression: Expression) -> str | None:
    """The jaw that the lips are closed over: that of the pose, else what moves the chin furthest of all that is called
    or moves like an open jaw, since a vowel parts the lips too."""
    opens = [name for name in rig.names if arkit_by_motion(rig, name) == "jawOpen"]
    posed = [name for name in opens if name in expression.pose]
    return max(posed or opens, key=lambda name: rig.displacement[rig.names.index(name), rig.skin].max(), default=None)


def _furthest(rig: Rig, names: tuple[str, ...]) -> float:
    """How far the skin goes when these are at full weight, millimetres."""
    moved = rig.deltas[np.isin(rig.names, names)].sum(axis=0)
    return float(np.linalg.norm(moved[rig.skin], axis=1).max())


def _in_pose(rig: Rig, name: str, names: tuple[str, ...], drivers: tuple[tuple[str, str], ...]) -> float:
    """How far the skin goes in the pose where blendshape `name` moves it at least half as far as it does anywhere."""
    held = {*names, *(base for of, base in drivers if of in names)}
    length = np.where(rig.skin, rig.displacement[rig.names.index(name)], 0)
    moved = np.linalg.norm(rig.deltas[np.isin(rig.names, [*held])].sum(axis=0), axis=1)
    return float(moved[length >= length.max() / 2].max())


def _of_one_eye(arkit: str) -> bool:
    return base_name(arkit) != arkit and base_name(arkit).startswith("eye")


def _moves_both(rig: Rig, name: str) -> bool:
    """Whether a blendshape moves the skin of the left and of the right half of the face, the weaker half as much."""
    squared = np.where(rig.skin, rig.displacement[rig.names.index(name)], 0) ** 2
    aside = rig.neutral[:, 0] - mirror_plane(rig.neutral[rig.skin])
    left, right = float(squared[aside > 0].sum()), float(squared[aside < 0].sum())
    return min(left, right) > max(left, right) / 2


def _phrases_for(arkit: str | None) -> list[str]:
    """All that may be said for one of ARKit's names."""
    table, together = phrases()
    if arkit is None or base_name(arkit) not in table:
        return []
    entry = table[base_name(arkit)]
    one = [entry["one"].format(side=side) for side in ("left", "right")] if "one" in entry else []
    opening = [entry["open"].split("{")[0]] if "open" in entry else []
    return [entry["both"], *one, *opening, *(say for names, say in together if arkit in names)]


def _lip_gap(rig: Rig, jaw: Float[np.ndarray, "v 3"], pose: Float[np.ndarray, "v 3"]) -> float:
    """How far the lips part in `pose`, millimetres: how much further the lower lip is below the upper one, by height.

    The lower lip is what of the skin goes down most with the jaw at the midline, the upper what stays just above it.
    """
    x, drop = rig.neutral, -jaw[:, 1]
    middle = rig.skin & (np.abs(x[:, 0] - np.median(x[rig.skin, 0])) < 0.06 * np.ptp(x[rig.skin, 0]))
    lower = np.flatnonzero(middle & (drop > 0.6 * drop[middle].max()))
    if len(lower) == 0:
        return 0.0
    rim = lower[x[lower, 1].argmax()]
    near = np.linalg.norm(x - x[rim], axis=1) < 10.0
    upper = np.flatnonzero(middle & near & (drop < 0.25 * drop[middle].max()))
    if len(upper) == 0:
        return 0.0
    edge = upper[np.linalg.norm(x[upper] - x[rim], axis=1).argmin()]
    return float((pose[edge, 1] - pose[rim, 1]) - (x[edge, 1] - x[rim, 1]))
