"""The whole evaluation of Le et al. 2013 on one take: what is run, and what is kept of it.

found = evaluate_take(take, face, (40, 60), people)       -> Evaluation
"""

from collections.abc import Sequence as Several

import numpy as np
from jaxtyping import Int
from msgspec import Struct
from scipy.optimize import linear_sum_assignment
from scipy.spatial.distance import cdist

from capture_plan.evaluation.le2013.cross_subject import CrossSubject, cross_subject
from capture_plan.evaluation.le2013.methods import (
    MIRRORED,
    OURS,
    RANDOM_NAME,
    Scored,
    by_method,
    optimised,
    tail_of,
)
from capture_plan.evaluation.le2013.skinning import Skinning, skinning
from capture_plan.evaluation.le2013.validation import (
    Descents,
    Folds,
    Recovery,
    descents,
    five_fold,
    recovery_as_published,
    simulation_recovery,
)
from capture_plan.layout.face import Face
from capture_plan.layout.settings import LayoutSettings
from capture_plan.progress import track
from capture_plan.shell.motion import with_mirror_image
from capture_plan.shell.take import Take

COUNTS = (20, 30, 40)
PAPERS_COUNTS = (40, 60, 80, 100)  # Le et al. 2013, section 5
ROOM = 12  # vertices that may carry a marker for each marker: below that methods choose among the same few
SIMULATIONS = 2  # layouts that are looked for at each number of markers
FOLDED = (OURS, "MSLS-meshes (our reading)", "LS-meshes", RANDOM_NAME)


class Rims(Struct, frozen=True):
    """RMSE (mm) of our layout with the rim of the motion held, and with nothing held; `loose` are its vertices."""

    markers: int
    held_mm: float
    loose_mm: float
    loose: tuple[int, ...]


class _Symmetry(Struct, frozen=True):
    """Our symmetric layout beside the free one: mean distance of their markers, each to its own, millimetres."""

    markers: int
    apart_mm: float


class Evaluation(Struct, frozen=True):
    """All that was measured on one take; lengths in millimetres.

    `rest_mm` is the root mean square movement that there is to rebuild, `motion_rank` the number of movements that hold
    all of it but 1 %, and `uneven` the share of it that its mirror image lacks; `full_rank` the mixes of the `used`
    blendshapes that the whole skin tells apart; `unperformed` the blendshapes that the take lacks. `subjects` is there
    where there are other people, of whom `about_subjects` says where they come from.
    """

    rig: str
    take: str
    frames: int
    vertices: int
    held: int
    rest_mm: float
    motion_rank: int
    uneven: float
    used: int
    full_rank: int
    counts: tuple[int, ...]
    scored: tuple[Scored, ...]
    rims: tuple[Rims, ...]
    symmetry: tuple[_Symmetry, ...]
    recoveries: tuple[Recovery, ...]
    published: Recovery
    folds: tuple[Folds, ...]
    skinning: tuple[Skinning, ...]
    descents: Descents
    unperformed: tuple[str, ...]
    notes: tuple[str, ...]
    subjects: CrossSubject | None = None
    about_subjects: str = ""

    def rmse_mm(self, method: str, markers: int) -> float:
        """Of a method with so many markers; not a number where there is none."""
        found = self.layout(method, markers)
        return found.rmse_mm if found else float("nan")

    def layout(self, method: str, markers: int) -> Scored | None:
        """The layout that a method chose for so many markers; None where it has none."""
        return next((one for one in self.scored if (one.method, one.markers) == (method, markers)), None)


class People(Struct, frozen=True):
    """Other people's takes, and in a sentence where they come from."""

    takes: tuple[Take, ...]
    about: str


def counts_for(take: Take) -> tuple[int, ...]:
    """The paper's numbers of markers on a mesh that is dense enough, else fewer."""
    return PAPERS_COUNTS if take.candidates.sum() >= ROOM * max(PAPERS_COUNTS) else COUNTS


def evaluate_take(take: Take, face: Face, counts: Several[int], people: People | None = None) -> Evaluation:
    """Every method at every number of markers, and what holds beyond the take.

    Raises:
        InfeasibleError: less skin moves than markers are asked for.
    """
    counts = tuple(sorted(counts))
    scored = by_method(take, face, counts)
    held = {one.markers: one for one in scored if one.method == OURS}
    mirrored = {one.markers: one for one in scored if one.method == MIRRORED}
    loose = {m: np.array(optimised(take.loose, take, m).markers) for m in track(counts, "Markers on a loose skin")}
    skins = {m: skinning(take.loose, take.motion, H, take.sizes) for m, H in loose.items()}
    simulations = [(m, seed) for m in counts for seed in range(SIMULATIONS)]
    folds = [(m, method) for m in counts for method in FOLDED]
    return Evaluation(
        rig=take.rig.name,
        take=take.sequence.name,
        frames=len(take.sequence),
        vertices=len(take.at),
        held=int(take.shell.fixed.sum()),
        rest_mm=float(np.sqrt(np.square(take.motion.rows).sum() / len(take.at))),
        motion_rank=take.motion.compressed(tail_of(take.motion)).rows.shape[1],
        uneven=uneven(take),
        used=len(face.used),
        full_rank=face.observation(LayoutSettings().noise_mm).full_rank,
        counts=counts,
        scored=scored,
        rims=tuple(Rims(m, held[m].rmse_mm, skins[m].markers_mm, tuple(take.at[H].tolist())) for m, H in loose.items()),
        symmetry=tuple(
            _Symmetry(m, apart_mm(take, np.array(held[m].vertices), np.array(mirrored[m].vertices))) for m in counts
        ),
        recoveries=tuple(
            simulation_recovery(take.shell, m, seed, joint=True) for m, seed in track(simulations, "Simulated layouts")
        ),
        published=recovery_as_published(take.shell, counts[0], 0),
        folds=tuple(five_fold(take, m, method=method) for m, method in track(folds, "Frames kept apart")),
        skinning=tuple(skins.values()),
        descents=descents(take, counts[0]),
        unperformed=take.missing(face.used),
        notes=take.sequence.notes,
        subjects=cross_subject((take, *people.takes), counts) if people else None,
        about_subjects=people.about if people else "",
    )


def uneven(take: Take) -> float:
    """Half the difference between a take and its mirror image, as a share of the movement: 0 where both sides do the
    same, 1 where they do the opposite."""
    both, n = with_mirror_image(take.motion, take.mirror).rows, take.motion.rows.shape[1]
    apart = both[:, :n] - both[:, n:]
    return float(np.sqrt(np.square(apart).sum() / np.square(both).sum() / 2))


def apart_mm(take: Take, some: Int[np.ndarray, " m"], others: Int[np.ndarray, " m"]) -> float:
    """Mean distance of two layouts of as many markers, each marker to one of the other."""
    apart = cdist(take.rig.neutral[some], take.rig.neutral[others])
    return float(apart[linear_sum_assignment(apart)].mean())
