"""How well layouts rebuild a take, ours beside others: Le et al. 2013, sections 5 and 6.3.

Data     a `Take`; numbers of markers; methods that choose a layout from a motion
Measure  RMSE = sqrt(sum_tv |X_tv - (W X_H)_tv|^2 / (N F)), millimetres, over all frames and vertices of the shell
Fair     layouts are compared, not ways to rebuild: all bend the same shell, held at the same rim (section 6.3)
Views    a layout chosen from the motion is also asked which blendshapes it shows, one chosen from the rig also how it
         rebuilds the motion
Random layouts are `RANDOM` draws; their number is the mean of the draws' errors.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Float, Int
from msgspec import Struct

from capture_plan.errors import CapturePlanError
from capture_plan.evaluation.baselines import choose_baseline
from capture_plan.evaluation.compare import error_driven
from capture_plan.evaluation.identifiability import blind_spots
from capture_plan.evaluation.le2013.published_algorithm import optimise_as_published
from capture_plan.evaluation.le2013.skinning import shapes
from capture_plan.layout.face import Face
from capture_plan.layout.farthest import Candidates
from capture_plan.layout.settings import LayoutSettings
from capture_plan.progress import track
from capture_plan.registration.empirical_layouts import empirical_layout, place_layout
from capture_plan.registration.known import EMPIRICAL
from capture_plan.shell.model import Shell
from capture_plan.shell.motion import TAIL_MM, Motion, with_mirror_image
from capture_plan.shell.optimise import MarkerProblem, Result, nested, optimise
from capture_plan.shell.take import Take

OURS, MIRRORED, RIG = "ours: exact swaps", "ours, symmetric", "from the rig: least error"
PAPER = "Le et al. 2013, as published"
NESTED = "ours, each inside the next"
FROM_MOTION = {
    "LS-meshes": "LS-meshes (neutral)",
    "MSLS-meshes (our reading)": "MSLS-meshes (our reading)",
    "farthest point": "farthest point",
}
RANDOM_NAME, RANDOM = "random", 5
TAIL_SHARE = 0.01  # of the movement: with 0.1 mm left out of a take of 1 mm, 100 markers were chosen 1.5 % worse
_Layout = Int[np.ndarray, " m"]
Method = Callable[[Take, Motion, int], tuple[np.ndarray, ...]]


class Scored(Struct, frozen=True):
    """One layout of a take: `vertices` of the rig; of several draws `rmse_mm` is the mean and `vertices` the first.

    `rank` is the number of mixes of blendshapes that the markers tell apart, `unseen` the blendshapes that move none
    of them by epsilon of their largest movement.
    """

    method: str
    markers: int
    vertices: tuple[int, ...]
    rmse_mm: float
    rank: int
    unseen: tuple[str, ...]
    left_out: int = 0


def motion_error(shell: Shell, motion: Motion, vertices: _Layout) -> float:
    """RMSE (mm) of a motion rebuilt from markers at these vertices of the shell."""
    return motion.rmse_mm(shell.weights(vertices), vertices)


def tail_of(motion: Motion) -> float:
    """RMSE (mm) that may be left out while a layout is chosen: little of the movement, where there is little of it."""
    rest = float(np.square(motion.rows).sum(axis=1) @ motion.weights / motion.weights.sum()) ** 0.5
    return min(TAIL_MM, TAIL_SHARE * rest)


def vertex_errors(shell: Shell, motion: Motion, vertices: _Layout) -> Float[np.ndarray, " v"]:
    """The error of each vertex, root mean square over the frames, millimetres."""
    R = motion.rows - shell.weights(vertices) @ motion.rows[vertices]
    return np.sqrt((R**2).sum(axis=1))


def optimised(shell: Shell, take: Take, count: int) -> Result:
    """Our layout of a take, its rim held (`take.shell`) or not (`take.loose`)."""
    return optimise(problem_of(take, take.motion, shell), count)


def problem_of(take: Take, motion: Motion, shell: Shell | None = None) -> MarkerProblem:
    """Markers of a motion on the skin of a take, whose rim is held unless another shell is given."""
    return MarkerProblem([(shell or take.shell, motion)], take.candidates, tail_mm=tail_of(motion))


def _ours(take: Take, motion: Motion, count: int) -> tuple[np.ndarray, ...]:
    """Our layout: greedy, then exact swaps."""
    return (np.array(optimise(problem_of(take, motion), count).markers),)


def ours_mirrored(take: Take, motion: Motion, count: int) -> tuple[np.ndarray, ...]:
    """Our layout in mirrored pairs, of the motion and its reflection."""
    both = with_mirror_image(motion, take.mirror)
    problem = replace(problem_of(take, both), mirror=take.mirror, tail_mm=tail_of(motion))
    return (np.array(optimise(problem, count).markers),)


def as_published(take: Take, motion: Motion, count: int) -> tuple[np.ndarray, ...]:
    """The paper's own algorithm, the best of its ten starts."""
    may, tail_mm = take.candidates, tail_of(motion)
    return (np.array(optimise_as_published(take.shell, motion, count, candidates=may, tail_mm=tail_mm).markers),)


def baseline(name: str, draws: int = 1) -> Method:
    """A method of `baselines.py`, which sees the shapes of the motion as blendshapes."""

    def choose(take: Take, motion: Motion, count: int) -> tuple[np.ndarray, ...]:
        at = np.flatnonzero(take.candidates)
        subset = Candidates(at, shapes(motion.rows), take.shell.vertices, take.shell.triangles)
        return tuple(choose_baseline(name, subset, count, seed) for seed in range(draws))

    return choose


METHODS: Mapping[str, Method] = {
    OURS: _ours,
    MIRRORED: ours_mirrored,
    PAPER: as_published,
    **{name: baseline(key) for name, key in FROM_MOTION.items()},
    RANDOM_NAME: baseline(RANDOM_NAME, RANDOM),
}


def score(take: Take, face: Face, method: str, layouts: Sequence[np.ndarray], *, left_out: int = 0) -> Scored:
    """The error of the mean draw, and what the first one shows of the rig."""
    first = take.at[layouts[0]]
    observed = face.observation(LayoutSettings().noise_mm).information(first)
    return Scored(
        method=method,
        markers=len(first),
        vertices=tuple(first.tolist()),
        rmse_mm=float(np.mean([motion_error(take.shell, take.motion, H) for H in layouts])),
        rank=observed.rank,
        unseen=blind_spots(face, LayoutSettings(), first),
        left_out=left_out,
    )


def by_method(take: Take, face: Face, counts: Sequence[int]) -> tuple[Scored, ...]:
    """Every method at every number of markers, then what is laid out in a number of its own.

    Example:
        >>> rig = sample_rig()
        >>> take = face_take(rig, read_sequence("take.csv", rig=rig))
        >>> scored = by_method(take, see_face(rig), (6,))
        >>> min(one.rmse_mm for one in scored if one.markers == 6) == scored[0].rmse_mm
        True
    """
    scored = []
    for count in counts:
        for name in track(list(METHODS), f"Layouts of {count} markers"):
            scored += [score(take, face, name, METHODS[name](take, take.motion, count))]
        scored += from_rig(take, face, count)
    return (*scored, *inside(take, face, counts), *empirical(take, face))


def from_rig(take: Take, face: Face, count: int) -> list[Scored]:
    """The layout of least upper estimate of the error that the rig alone asks for, where there is room for it."""
    try:
        designed = error_driven(face, LayoutSettings(), count)
    except CapturePlanError:
        return []
    there = take.places(designed)
    return [score(take, face, RIG, [there], left_out=len(designed) - len(there))]


def inside(take: Take, face: Face, counts: Sequence[int]) -> tuple[Scored, ...]:
    """Layouts of which each is a part of the next."""
    results = nested(problem_of(take, take.motion), counts)
    return tuple(score(take, face, NESTED, [np.array(one.markers)]) for one in results)


def empirical(take: Take, face: Face) -> tuple[Scored, ...]:
    """The layouts that people use; points where nothing moves are left out."""
    scored = []
    for key in EMPIRICAL:
        try:
            placed = place_layout(take.rig, key).vertices
        except CapturePlanError:
            continue
        there = take.places(placed)
        scored.append(score(take, face, empirical_layout(key).title, [there], left_out=len(placed) - len(there)))
    return tuple(scored)
