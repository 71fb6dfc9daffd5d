"""What a person brings to a comparison: layouts by vertex number, and a recorded take.

Layouts  {"name": [vertex, ...], ...}   JSON; vertices as numbered in the rig's own file, counted from 0
Take     recorded weights or meshes of the rig in any format of `read_sequence`
"""

from pathlib import Path

import msgspec
import numpy as np
from jaxtyping import Float

from capture_plan.curves.frames import PosedFrames
from capture_plan.errors import PlanError
from capture_plan.input.documents import read_plain
from capture_plan.layout.dot_numbers import vertices_of
from capture_plan.rig import Rig
from capture_plan.sequence import Sequence


def read_layouts(path: Path, rig: Rig) -> dict[str, np.ndarray]:
    """Layouts by vertex of the rig.

    Raises:
        PlanError: the file cannot be read, is no such table, or names a vertex that the rig does not have.
    """
    try:
        content = read_plain(path, PlanError, "give a JSON file of layouts")
        listed = msgspec.json.decode(content, type=dict[str, list[int | str]])
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        raise PlanError(f'{path} is not a JSON file of layouts ({error}): write {{"name": [vertex, ...]}}') from None
    layouts = {}
    for name, words in listed.items():
        sources = [
            vertices_of([one], {}, what=f"{path}: '{name}'")[0] if isinstance(one, str) else one for one in words
        ]
        if not sources:
            raise PlanError(f"{path}: '{name}' has no vertices: list at least one")
        if missing := [source for source in sources if source not in rig.vertex_of]:
            raise PlanError(f"{path}: '{name}' names vertex {missing[0]}, which {rig.name} does not have")
        vertices = [rig.vertex_of[source] for source in sources]
        if len(set(vertices)) < len(vertices):
            raise PlanError(f"{path}: '{name}' names a vertex twice: list every vertex once")
        layouts[name] = np.array(vertices)
    return layouts


def take_weights(take: Sequence, rig: Rig, used: tuple[str, ...]) -> Float[np.ndarray, "t k"] | None:
    """Recorded weights of the used blendshapes, held between 0 and 1, which is what the solver allows; None of a take
    of meshes."""
    if not isinstance(take.frames, PosedFrames):
        return None
    return np.clip(take.frames.weights[:, rig.rows(used)], 0, 1)
