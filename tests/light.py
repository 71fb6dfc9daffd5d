"""The bundled head with half of its vertices, for laws that do not depend on how fine a mesh is."""

from dataclasses import replace
from functools import cache

from capture_plan.mesh.decimate import decimate
from capture_plan.rig import Rig
from capture_plan.sample import sample_rig

TRIANGLES = 4500  # the head has 9,668: lids, lips and eyeballs are still what they are


@cache
def light_sample() -> Rig:
    """The sample, decimated; `source_index` leads back to the vertices of the whole one."""
    rig = sample_rig()
    at, triangles = decimate(rig.neutral, rig.triangles, TRIANGLES)
    return replace(
        rig,
        neutral=rig.neutral[at],
        triangles=triangles,
        deltas=rig.deltas[:, at],
        skin=rig.skin[at],
        parts=rig.parts[at],
        source_index=rig.source_index[at],
    )
