"""What the names of a rig mean where the motion agrees: a "blink" that moves the mouth is not believed.

Letters    C[k]     centre of what blendshape k moves, by energy (`face/channels.py`)
           h        its height, 0 at the mouth and 1 at the eyes; and that of the mean vertex by |d|^2, without areas: a
                    few vertices of a neck have more area than two pupils, and many small ones count more often
           D[k, y]  how far it moves up, of how far it moves at all: -1 straight down, 1 straight up; and its highest
                    rise less its deepest fall: a brow whose inner end goes up as its outer end goes down does both
A name is doubted only where both measures of one thing speak against it.
Doubt      an eye or a brow whose motion has h < MOUTH_HIGH; a jaw, a mouth or a lip with h > EYES_LOW; a jaw
           that opens, a brow that goes up or down against its own word, |D| > WAY; lids, lips, cheeks, a jaw or a nose
           that does not do what the one movement of the name does there (`said_motion.py`)
The user's own name map is always believed, and every name where eyes and mouth are not beyond doubt or whose blendshape
was exported wrongly.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from capture_plan.anatomy.delta_relations import Finding
from capture_plan.anatomy.said_motion import instead, measures
from capture_plan.face.misexported import misexported
from capture_plan.face.of_rig import rig_channels
from capture_plan.face.reading import face_reading
from capture_plan.names.arkit import base_name
from capture_plan.names.movements import Movement, movements_of, said_of
from capture_plan.names.name_map import NameMap
from capture_plan.names.recognise import Recognised, recognise_all
from capture_plan.once import once
from capture_plan.rig import Rig

MOUTH_HIGH, EYES_LOW = 0.35, 0.75  # of the way from the mouth to the eyes; smiles reach 0.4, squints come down to 0.7
WAY = 0.4  # of the length of the motion: brows and jaws of real rigs have over 0.6
AT_EYES = frozenset(("blink", "eye wide", "eye squint", "brow up", "brow down"))
AT_MOUTH = frozenset(
    ("jaw open", "jaw side", "jaw forward", "mouth open", "mouth close", "mouth narrow", "mouth wide", "smile", "frown",
     "mouth side", "lip up", "lip down", "lip roll", "lip press", "mouth other", "tongue")
)  # fmt: skip
GOES = {"jaw open": -1, "brow up": 1, "brow down": -1}


class Doubt(NamedTuple):
    """A blendshape whose name is not believed, and the sentence that says why."""

    name: str
    message: str


@once
def name_doubts(rig: Rig) -> tuple[Doubt, ...]:
    """Blendshapes whose motion is not what their names say."""
    heights = _heights(rig)
    if heights is None:
        return ()
    moves = rig.displacement.max(axis=1) > 0
    silent = {name for name, _ in rig.meanings} | {one.name for one in misexported(rig)}
    means = recognise_all(rig.names)
    placed = dict(zip(rig.names, _against_place(rig, heights), strict=True))
    done = dict(zip(rig.names, _against_motion(rig, means), strict=True))
    return tuple(
        Doubt(name, f"{message}: the name is not believed")
        for name, moving in zip(rig.names, moves.tolist(), strict=True)
        if moving and name not in silent and (message := placed[name] or done[name])
    )


def agreed_meanings(rig: Rig) -> dict[str, Recognised | None]:
    """What every name means; None where no standard knows it or the motion speaks against it."""
    doubted = {doubt.name for doubt in name_doubts(rig)}
    found = recognise_all(rig.names, mine=NameMap(dict(rig.meanings)))
    return {name: None if name in doubted else meaning for name, meaning in found.items()}


def misleading(rig: Rig) -> list[Finding]:
    """The doubts as findings of the audit."""
    advice = "Rename it, or say in a --names file what it is; until then it is planned without words for it."
    return [Finding("name", (doubt.name,), doubt.message, advice, False, "rigger") for doubt in name_doubts(rig)]


def _heights(rig: Rig) -> Float[np.ndarray, "k 2"] | None:
    """Where between mouth (0) and eyes (1) each blendshape moves, by energy and by vertices; None where eyes or mouth
    are not sure."""
    reading = face_reading(rig)
    eyes, mouth = reading.eyes, reading.mouth
    both = [eye[1] for eye in (eyes.left, eyes.right) if eye is not None]
    if not (eyes.sure and mouth.sure and both and mouth.at is not None):
        return None
    above = float(np.mean(both)) - mouth.at[1]
    squared = rig.displacement.astype(float) ** 2
    by_vertex = squared @ rig.neutral[:, 1] / np.maximum(squared.sum(axis=1), np.finfo(float).tiny)
    heights = np.column_stack([rig_channels(rig).centre[:, 1], by_vertex])
    return (heights - mouth.at[1]) / above if above > 0 else None


def _ways(rig: Rig) -> Float[np.ndarray, "k 2"]:
    """How far up each blendshape moves, by energy, and how much further its highest rise goes than its deepest fall."""
    up = rig.deltas[..., 1].astype(float)
    rise, fall = up.max(axis=1, initial=0), -up.min(axis=1, initial=0)
    ends = (rise - fall) / np.maximum(rig.displacement.max(axis=1), np.finfo(float).tiny)
    return np.column_stack([rig_channels(rig).direction[:, 1], ends])


def _against_place(rig: Rig, heights: Float[np.ndarray, "k 2"]) -> list[str | None]:
    """What speaks against each name by where it moves, and by the way of jaws and brows."""
    message = zip(rig.names, movements_of(rig.names), heights, _ways(rig), strict=True)
    return [movement and _against(name, movement, height, way) for name, movement, height, way in message]


def _against_motion(rig: Rig, means: dict[str, Recognised | None]) -> list[str | None]:
    """What speaks against each name that says one movement by what this does to the skin."""
    measured = measures(rig)
    found = []
    for k, (name, movement) in enumerate(zip(rig.names, movements_of(rig.names), strict=True)):
        meaning = means[name]
        bases = {base_name(one) for one in meaning.arkit} if meaning else set()
        if len(bases) != 1 or ("jawOpen" in bases and movement and movement.kind != "jaw open"):
            found.append(None)  # lips alone may open a mouth
            continue
        does = instead(bases.pop(), {measure: float(each[k]) for measure, each in measured.items()})
        found.append(f"{name} says '{meaning.words}', but {does}" if meaning and does else None)
    return found


def _against(
    name: str, movement: Movement, height: Float[np.ndarray, " 2"], way: Float[np.ndarray, " 2"]
) -> str | None:
    """The sentence of a name that its motion speaks against; None where they agree or the name says no place."""
    says = f"{name} says '{said_of(movement)}', but "
    if movement.kind in AT_EYES and height.max() < MOUTH_HIGH:
        return f"{says}what it moves lies at the mouth or below"
    if movement.kind in AT_MOUTH and height.min() > EYES_LOW:
        return f"{says}what it moves lies at the eyes or above"
    if (GOES.get(movement.kind, 0) * way < -WAY).all():
        return f"{says}it moves {'up' if way[0] > 0 else 'down'}"
    return None
