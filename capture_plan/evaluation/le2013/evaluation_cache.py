"""An evaluation, cached: a take, its people and numbers of markers are judged once, and shown at once afterwards.

found = evaluate_all(rig, sequence, counts=(40, 60), people=people)       -> Evaluation
print(motion_text(found))                                                 `report.py`
"""

from collections.abc import Sequence as Several

import msgspec
import numpy as np

from capture_plan.audit.audit_cache import audit_once
from capture_plan.cache import cached, digest
from capture_plan.evaluation.le2013.evaluation import Evaluation, People, counts_for, evaluate_take
from capture_plan.layout.face import Face, see_face
from capture_plan.rig import Rig
from capture_plan.sequence import Sequence
from capture_plan.shell.take import Take, face_take

ANSWER = "evaluation 1"  # a new number where the same take would be judged otherwise
ENTRIES = 20


def evaluate_all(
    rig: Rig, sequence: Sequence, *, counts: Several[int] = (), people: People | None = None
) -> Evaluation:
    """A take of a rig, judged by every method; without `counts` at as many markers as its mesh is dense enough for.

    Raises:
        RigError: the take is of another mesh, or moves nothing.
        InfeasibleError: less skin moves than markers are asked for.
    """
    take = face_take(rig, sequence)
    return cached_evaluation(take, see_face(rig, audit_once(rig).used), counts or counts_for(take), people)


def cached_evaluation(take: Take, face: Face, counts: Several[int], people: People | None = None) -> Evaluation:
    """`evaluate_take`, or what it answered before."""
    counts = tuple(sorted(counts))
    name = name_of(take, face, counts, people)

    def evaluate() -> dict[str, np.ndarray]:
        found = evaluate_take(take, face, counts, people)
        return {"evaluation": np.frombuffer(msgspec.json.encode(found), dtype=np.uint8)}

    return msgspec.json.decode(
        cached(evaluate, "evaluations", name, entries=ENTRIES)["evaluation"].tobytes(), type=Evaluation
    )


def name_of(take: Take, face: Face, counts: Several[int], people: People | None = None) -> str:
    """The name of an evaluation: equal where everything that it depends on is equal, and nowhere else."""
    takes = (take, *people.takes) if people else (take,)
    parts = [part for one in takes for part in _everything_of(one)]
    return digest([ANSWER, np.array(counts), *face.used, people.about if people else "", *parts])


def _everything_of(take: Take) -> list[str | np.ndarray]:
    """What an evaluation depends on of one take: the shell, and the frames in their order, which rows do not tell."""
    names = [take.rig.name, take.rig.fingerprint, take.sequence.name, *take.sequence.notes]
    frames = [part for one in take.recordings for part in (one.weights, one.shapes, np.array(one.share))]
    shell = [take.at, take.shell.vertices, take.shell.fixed, take.candidates, take.motion.weights]
    return [*names, take.rig.skin, *frames, *shell]
