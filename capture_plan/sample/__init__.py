"""The bundled sample: the MakeHuman head with the 52 ARKit face units, CC0 (see NOTICE.md and rebuild.py)."""

from functools import cache
from importlib.resources import files

import numpy as np

from capture_plan.face.skin import find_skin
from capture_plan.rig.record import Rig

UNIT_MM = 100.0  # the artist's file is in decimetres


@cache
def sample_rig() -> Rig:
    """The sample head: 4,939 vertices, 52 blendshapes, millimetres.

    Example:
        >>> rig = sample_rig()
        >>> rig.neutral.shape, rig.triangles.shape, rig.deltas.shape
        ((4939, 3), (9608, 3), (52, 4939, 3))
    """
    head = files("capture_plan.sample").joinpath("head.npz")
    with head.open("rb") as file, np.load(file, allow_pickle=False) as data:
        arrays = dict(data)
    names = tuple(str(name) for name in arrays["names"])
    neutral = arrays["vertices"].astype(np.float64)
    triangles = arrays["faces"].astype(np.int32)
    deltas = np.zeros((len(names), len(neutral), 3), dtype=np.float32)
    deltas[arrays["delta_k"], arrays["delta_v"]] = arrays["delta_xyz"].T * arrays["delta_unit"]
    parts = arrays["parts"].astype(np.int32)
    part_names = tuple(str(name) for name in arrays["part_names"])
    return Rig(
        name="MakeHuman head",
        neutral=neutral,
        triangles=triangles,
        deltas=deltas,
        names=names,
        skin=find_skin(neutral, triangles, deltas, parts, part_names),
        parts=parts,
        part_names=part_names,
        source_index=arrays["source_index"].astype(np.int32),
        unit_mm=UNIT_MM,
    )
