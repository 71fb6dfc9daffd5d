"""Other people beside the one of the take: their own rigs driven by the same weights, or made-up ones.

Different performances of different people are what the paper has; nobody gives them away. Recorded weights on other
rigs test whether a layout passes to another shape of face, and made-up people perform made-up takes of their own.
"""

from collections.abc import Sequence
from pathlib import Path

from capture_plan.curves.frames import PosedFrames
from capture_plan.errors import RigError
from capture_plan.evaluation.le2013.evaluation import People
from capture_plan.reader.read import read_rig
from capture_plan.rig import Rig
from capture_plan.sample.motion import FRAMES, made_up_take
from capture_plan.sample.people import made_up_people
from capture_plan.sequence import read_sequence
from capture_plan.shell.take import face_take

MADE_UP = 3  # people beside the first


def people_of(rigs: Sequence[str], take: Path | None) -> People:
    """The people of these rigs, each performing a take of weights; made-up ones where none was recorded.

    Raises:
        RigError: a rig cannot be read, or the take is of meshes, which are one person's.
    """
    takes = []
    for n, path in enumerate(rigs, start=1):
        rig = read_rig(path)
        sequence = read_sequence(take, rig=rig) if take else made_up_take(rig, n)
        if not isinstance(sequence.frames, PosedFrames):
            raise RigError(f"{sequence.name} holds meshes of one person: give weights, which drive {rig.name} too")
        takes.append(face_take(rig, sequence))
    same = "they all perform the weights of this one take" if take else "each performs a made-up take of their own"
    return People(tuple(takes), f"other people by their rigs; {same}")


def made_up(rig: Rig, *, frames: int = FRAMES) -> People:
    """People who are the rig in other shapes, each with a take of their own."""
    people = made_up_people(rig, MADE_UP)
    takes = tuple(face_take(one, made_up_take(one, n, frames=frames)) for n, one in enumerate(people, start=1))
    return People(
        takes,
        "the people are made up: this head in other shapes and proportions, with blendshapes of other strengths, each "
        "in a made-up take of their own; nobody was measured",
    )
