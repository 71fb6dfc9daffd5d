"""The whole evaluation of Le et al. 2013 on one take: what is run, and what is kept of it.

found = evaluate_all(rig, sequence, counts=(20, 30, 40))      -> Evaluation
print(motion_text(found))                                     `page.py`
"""

from collections.abc import Sequence as Several

import numpy as np
from msgspec import Struct

from capture_plan.layout.face import Face, see_face
from capture_plan.layout.settings import LayoutSettings
from capture_plan.layout.shell.evaluate import (
    OURS,
    RANDOM_NAME,
    Scored,
    by_method,
    held_or_loose,
    skinned,
)
from capture_plan.layout.shell.skinning import Skinning
from capture_plan.layout.shell.take import Take, face_take
from capture_plan.layout.shell.validate import Folds, Recovery, descents, five_fold, simulation_recovery
from capture_plan.progress import track
from capture_plan.rig import Rig
from capture_plan.rig.audit import audit
from capture_plan.rig.sequence import Sequence

COUNTS = (20, 30, 40)
SIMULATIONS = 5  # layouts that are looked for at each number of markers
FOLDED = (OURS, "MSLS-meshes (our reading)", "LS-meshes", RANDOM_NAME)


class Rims(Struct, frozen=True):
    """RMSE (mm) of our layout with the rim of the motion held, and with nothing held."""

    markers: int
    held_mm: float
    loose_mm: float


class Evaluation(Struct, frozen=True):
    """All that was measured on one take; lengths in millimetres.

    `rest_mm` is the root mean square movement that there is to rebuild; `full_rank` the mixes of the `used`
    blendshapes that the whole skin tells apart; `descents_mm` the paper's algorithm after each iteration, one row for
    each of its starts, with the fewest markers; `unperformed` the blendshapes that the take lacks.
    """

    rig: str
    take: str
    frames: int
    vertices: int
    held: int
    rest_mm: float
    used: int
    full_rank: int
    counts: tuple[int, ...]
    scored: tuple[Scored, ...]
    rims: tuple[Rims, ...]
    recoveries: tuple[Recovery, ...]
    folds: tuple[Folds, ...]
    skinning: tuple[Skinning, ...]
    descents_mm: tuple[tuple[float, ...], ...]
    unperformed: tuple[str, ...]
    notes: tuple[str, ...]

    def rmse_mm(self, method: str, markers: int) -> float:
        """Of a method with so many markers; not a number where there is none."""
        found = [one.rmse_mm for one in self.scored if (one.method, one.markers) == (method, markers)]
        return found[0] if found else float("nan")


def evaluate_all(rig: Rig, sequence: Sequence, *, counts: Several[int] = COUNTS) -> Evaluation:
    """Every method at every number of markers, and what holds beyond the take.

    Raises:
        RigError: the take is of another mesh, or moves nothing.
        InfeasibleError: less skin moves than markers are asked for.
    """
    return evaluate_take(face_take(rig, sequence), see_face(rig, audit(rig).used), counts)


def evaluate_take(take: Take, face: Face, counts: Several[int]) -> Evaluation:
    """The same of a take that is at hand."""
    counts = tuple(sorted(counts))
    tasks = track(counts, "Markers held, loose and as a skin")
    rims = tuple(Rims(count, *held_or_loose(take, count)) for count in tasks)
    return Evaluation(
        rig=take.rig.name,
        take=take.sequence.name,
        frames=len(take.sequence),
        vertices=len(take.at),
        held=int(take.shell.fixed.sum()),
        rest_mm=float(np.sqrt(np.square(take.motion.rows).sum() / len(take.at))),
        used=len(face.used),
        full_rank=face.observation(LayoutSettings().noise_mm).full_rank,
        counts=counts,
        scored=by_method(take, face, counts),
        rims=rims,
        recoveries=tuple(
            simulation_recovery(take.shell, count, seed, joint=True) for count in counts for seed in range(SIMULATIONS)
        ),
        folds=tuple(five_fold(take, count, method=method) for count in counts for method in FOLDED),
        skinning=tuple(skinned(take, count) for count in counts),
        descents_mm=tuple(tuple(row) for row in descents(take, counts[0]).tolist()),
        unperformed=take.missing(face.used),
        notes=take.sequence.notes,
    )
