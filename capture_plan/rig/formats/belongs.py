"""What of a file is the rig that is shown."""

import numpy as np

from capture_plan.rig.formats.raw import RawRig
from capture_plan.rig.formats.weld import weld_seams


def what_belongs(raw: RawRig) -> RawRig:
    """The rig with its seams closed."""
    meshes = np.zeros(len(raw.parts), np.int32) if raw.meshes is None else raw.meshes
    return weld_seams(raw, meshes * len(raw.part_names) + raw.parts)
