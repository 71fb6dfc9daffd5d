"""What every file for another program is drawn from: a plan, what it was made from, and where dots and skin are.

Positions  x_m = sum_i b_mi v[t_mi]     the dot at weights b on triangle t of a head v, in a pose
All writers ask here, so that another head than the rig's own is one change in `head_of`.

Letters: v vertices, m markers, e poses: the neutral, then the expressions in the order of shooting.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from capture_plan.exports.kinds import DRAFT
from capture_plan.plan.inputs import PlanInputs
from capture_plan.plan.record import Plan
from capture_plan.rig import Rig

NEUTRAL = "neutral"


@dataclass(frozen=True, eq=False)
class Delivery:
    """A plan and its inputs, and the file or folder that the artist's rig was read from; None for the bundled head and
    for a rig made in Python. `stands_in` is where the files will stand, for one that leads to another."""

    plan: Plan
    inputs: PlanInputs
    rig_file: Path | None = None
    stands_in: Path = Path()

    @property
    def suffix(self) -> str:
        """What stands behind the names of files: a draft says so."""
        return DRAFT if self.plan.draft else ""

    def place(self, folder: Path, stem: str, ending: str = "") -> Path:
        """Where a file or folder of a name goes."""
        return folder / f"{stem}{self.suffix}{ending}"

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all markers, as the plan has them."""
        return tuple(marker.name for marker in self.plan.layout.markers)

    @property
    def poses(self) -> dict[str, dict[str, float]]:
        """Weights that are not 0, by the name of each pose, in the order of shooting."""
        return {NEUTRAL: {}} | {expression.name: expression.pose for expression in self.plan.in_session}


def head_of(inputs: PlanInputs) -> Rig:
    """The head that dots stand on, millimetres, +y up, facing +z: the actor's own where one is known."""
    return inputs.worn_rig


def dots_mm(plan: Plan, inputs: PlanInputs) -> Float[np.ndarray, "m 3"]:
    """Where every marker of the plan stands on the neutral, or on the scan of the actor's head, millimetres, +y up,
    facing +z."""
    if plan.actor and inputs.worn is not None:
        return np.array([dot.position for dot in plan.actor.dots])
    return _dots_on(plan, inputs, head_of(inputs).neutral)


def posed_dots_mm(plan: Plan, inputs: PlanInputs) -> Float[np.ndarray, "e m 3"]:
    """Where every marker stands on the neutral, then in each expression, millimetres, +y up, facing +z. On a scan they
    move from where they lie there as the skin does that was laid on it."""
    posed = np.stack([_dots_on(plan, inputs, vertices) for _, vertices in poses_mm(plan, inputs)])
    return posed + (dots_mm(plan, inputs) - posed[0])


def poses_mm(plan: Plan, inputs: PlanInputs) -> Iterator[tuple[str, Float[np.ndarray, "v 3"]]]:
    """Name and vertices of the neutral, then of each expression, millimetres, +y up, facing +z."""
    head = head_of(inputs)
    for name, pose in Delivery(plan, inputs).poses.items():
        yield name, head.pose(np.array([pose.get(each, 0.0) for each in head.names]))


def _dots_on(plan: Plan, inputs: PlanInputs, vertices: Float[np.ndarray, "v 3"]) -> Float[np.ndarray, "m 3"]:
    markers = plan.layout.markers
    corners = head_of(inputs).triangles[[marker.triangle for marker in markers]]
    return np.einsum("mi,mix->mx", np.array([marker.barycentric for marker in markers]), vertices[corners])
