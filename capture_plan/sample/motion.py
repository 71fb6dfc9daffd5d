"""A take of any rig, made up: every blendshape rises and falls once, in a random order, a few at a time.

Data    start_k, length_k   frames; peak_k weight: drawn from a seed
Model   w[t, k] = peak_k sin^2(pi (t - start_k) / length_k) while it lasts, else 0
        what corrects another blendshape never goes beyond it: w[t, j] >= w[t, k] where k corrects j
"""

import numpy as np
from jaxtyping import Float

from capture_plan.anatomy.delta_relations import correctives
from capture_plan.curves.frames import PosedFrames
from capture_plan.rig.record import Rig
from capture_plan.sample import sample_rig
from capture_plan.sequence import Sequence

FRAMES, FPS = 240, 30.0
SHORTEST, LONGEST = 15, 40  # frames: a movement of the face takes half a second to a little over one
LEAST_PEAK = 0.5


def sample_motion(seed: int = 0, *, frames: int = FRAMES) -> Sequence:
    """A take of the sample head; the same seed gives the same take."""
    return made_up_take(sample_rig(), seed, frames=frames)


def made_up_take(rig: Rig, seed: int = 0, *, frames: int = FRAMES) -> Sequence:
    """`frames` frames of any rig with blendshapes, where nobody has been recorded yet."""
    return Sequence(
        name=f"made-up take {seed}",
        neutral=rig.neutral,
        triangles=rig.triangles,
        frames=PosedFrames(rig, random_weights(rig, seed, frames)),
        fps=FPS,
        rig=rig,
        notes=("the take is made up from a seed: no person moved like this",),
    )


def random_weights(rig: Rig, seed: int, frames: int) -> Float[np.ndarray, "t k"]:
    """Smooth weights of any rig, most of them 0 in a frame."""
    rng, k = np.random.default_rng(seed), len(rig.names)
    length = np.minimum(rng.integers(SHORTEST, LONGEST + 1, k), frames)
    start = rng.permutation(np.linspace(0, 1, k)) * (frames - length)
    since = (np.arange(frames)[:, None] - start) / length
    weights = rng.uniform(LEAST_PEAK, 1, k) * np.where((since > 0) & (since < 1), np.sin(np.pi * since) ** 2, 0)
    for finding in correctives(rig, rig.names):
        corrective, *corrected = rig.rows(finding.blendshapes)
        weights[:, corrected] = np.maximum(weights[:, corrected], weights[:, [corrective]])
    return weights
