"""The bundled sample: the MakeHuman head with the 52 ARKit face units, CC0 (see NOTICE.md and rebuild.py)."""

from importlib.resources import files

import numpy as np

from capture_plan.rig.record import Rig


def sample_rig() -> Rig:
    """The sample head: 4,939 vertices, 52 blendshapes, millimetres."""
    with files("capture_plan.rig.sample").joinpath("head.npz").open("rb") as file, np.load(file, allow_pickle=False) as data:
        arrays = dict(data)
    names = tuple(str(name) for name in arrays["names"])
    neutral = arrays["vertices"].astype(np.float64)
    deltas = np.zeros((len(names), len(neutral), 3), dtype=np.float32)
    deltas[arrays["delta_k"], arrays["delta_v"]] = arrays["delta_xyz"].T * arrays["delta_unit"]
    return Rig(
        name="MakeHuman head",
        neutral=neutral,
        triangles=arrays["faces"].astype(np.int32),
        deltas=deltas,
        names=names,
        skin=arrays["parts"] == 0,
        parts=arrays["parts"].astype(np.int32),
        part_names=tuple(str(name) for name in arrays["part_names"]),
        source_index=arrays["source_index"].astype(np.int32),
    )
