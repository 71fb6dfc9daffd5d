"""A plan's pages without the actor's likeness: its rig laid on the bundled head, which is nobody's.

Where dots are and how expressions move stays the plan's, in proportion; shapes and distances are the bundled head's.
"""

from dataclasses import replace

import numpy as np

from capture_plan.errors import RigError
from capture_plan.plan.inputs import PlanInputs
from capture_plan.reader.head_scan import HeadScan
from capture_plan.registration.onto_head import lay_onto_head
from capture_plan.registration.picked_points import named_vertices, picks_on
from capture_plan.sample import sample_rig


def on_generic_head(inputs: PlanInputs) -> PlanInputs:
    """The inputs with the rig on a generic head, for pages that leave the house.

    Raises:
        RigError: the rig's face is not found well enough to lay it on another head.

    Example:
        >>> given = on_generic_head(PlanInputs(sample_rig()))
        >>> given.generic, given.worn_rig.names == sample_rig().names
        (True, True)
    """
    sample = sample_rig()
    x, rig = sample.neutral, inputs.rig
    used = np.unique(sample.triangles[sample.skin[sample.triangles].all(axis=1)])
    local = np.full(len(x), -1)
    local[used] = np.arange(len(used))
    triangles = local[sample.triangles[sample.skin[sample.triangles].all(axis=1)]]
    head = HeadScan("generic", x[used].astype(float), triangles, (1.0,), sample.fingerprint)
    try:
        laid = lay_onto_head(rig, head)
    except RigError:
        own = named_vertices(sample)
        points = {name: (float(x[v, 0]), float(x[v, 1]), float(x[v, 2])) for name, v in own.items()}
        both = {name: points[name] for name in named_vertices(rig) if name in points}
        try:
            laid = lay_onto_head(rig, head, picks_on(rig, both, {}))
        except RigError:
            raise RigError(
                f"{rig.name} cannot be drawn on a generic head: its face is too unlike a person's, or not found; give "
                "away pages without pictures of it, or draw it as it is"
            ) from None
    return replace(inputs, worn=laid.in_file(laid.neutral), head=None, generic=True)
