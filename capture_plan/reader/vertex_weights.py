"""How much an error counts at each vertex (Le et al. 2013, section 8): one number per vertex of the artist's file.

Text   one number a line, or separated by spaces or commas, in vertex order (.txt, .csv)
NumPy  an array (.npy), or `weights` of an archive (.npz)
"""

import io
from pathlib import Path

import numpy as np
from jaxtyping import Float

from capture_plan.errors import RigError
from capture_plan.formats.npz import load_npz
from capture_plan.input.bounds import MOST_TEXT_BYTES, content
from capture_plan.rig.record import Rig


def read_vertex_weights(path: Path, rig: Rig) -> Float[np.ndarray, " v"]:
    """A weight for every vertex of the rig.

    Raises:
        RigError: the file cannot be read, has another number of weights, or one that is negative or no number.
    """
    try:
        weights = _numbers(path)
    except OSError as error:
        raise RigError(f"{path} cannot be read ({error.strerror or error}): give a file of vertex weights") from error
    except (ValueError, KeyError) as error:
        raise RigError(f"{path.name} holds no vertex weights: give one number for each vertex, in its order") from error
    whole = int(rig.source_index.max()) + 1
    if len(weights) >= whole:
        weights = weights[rig.source_index]
    elif len(weights) != len(rig.neutral):
        raise RigError(
            f"{path.name} has {len(weights):,} weights, {rig.name} has {whole:,} vertices in its file: "
            "give one number for each"
        )
    if not (np.isfinite(weights).all() and (weights >= 0).all() and (weights[rig.skin] > 0).any()):
        raise RigError(f"{path.name} has weights below 0, no numbers, or none above 0 on the skin: give 0 or more")
    return weights.astype(float)


def _numbers(path: Path) -> np.ndarray:
    suffix, data = path.suffix.lower(), content(path, MOST_TEXT_BYTES)
    if suffix == ".npz":
        found = load_npz(path)["weights"]
    elif suffix == ".npy":
        found = np.load(io.BytesIO(data), allow_pickle=False)
    else:
        found = np.loadtxt(data.decode("utf-8-sig").replace(",", " ").split(), ndmin=1)
    if found.ndim != 1 or found.dtype.kind not in "fiu":
        raise ValueError(found.shape)
    return found
