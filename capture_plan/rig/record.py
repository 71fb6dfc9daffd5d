"""The rig that everything else is computed from, in one unit and one pose of the axes."""

import hashlib
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float, Int

from capture_plan.errors import RigError
from capture_plan.names.name_map import NameMap
from capture_plan.names.recognise import recognise
from capture_plan.rig.understood import Understood

NAMING = ("ARKit", "FACS")  # standards whose names say exactly one movement
HowFound = Literal["given", "format", "detected"]


@dataclass(frozen=True, eq=False)
class Rig:
    """A delta-blendshape rig (Lewis et al. 2014): v(w) = v0 + sum_k w_k d_k.

    Lengths are in millimetres; +y is up, the face looks along +z, the subject's left is +x.
    Arrays are read-only. `parts[v]` indexes `part_names`; `source_index[v]` is the vertex number in the artist's file,
    counted from 0. One unit of that file is `unit_mm` long; `up` and `facing` are its signed axes ("+y", "-z"); how
    each of the three was found stands beside it, and `note` says in a sentence what a person should know about it.
    `meanings` is what the user's own name map says of blendshapes: (name, standard name). `turn` is the rotation from
    the file's axes to the rig's, row by row: its rows are the subject's left, up and facing in the file. `understood`
    says what unit and axes rest on; None where the rig was made by hand.
    """

    name: str
    neutral: Float[np.ndarray, "v 3"]
    triangles: Int[np.ndarray, "f 3"]
    deltas: Float[np.ndarray, "k v 3"]
    names: tuple[str, ...]
    skin: Bool[np.ndarray, " v"]
    parts: Int[np.ndarray, " v"]
    part_names: tuple[str, ...]
    source_index: Int[np.ndarray, " v"]
    unit_mm: float = 1.0
    up: str = "+y"
    facing: str = "+z"
    unit_found: HowFound = "given"
    up_found: HowFound = "given"
    facing_found: HowFound = "given"
    note: str = ""
    meanings: tuple[tuple[str, str], ...] = ()
    turn: tuple[float, ...] = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
    understood: Understood | None = None

    def __post_init__(self) -> None:
        v = len(self.neutral)
        check_blendshapes(self.name, self.neutral, self.triangles, self.deltas, self.names)
        if not np.isfinite(self.deltas).all():
            raise RigError(f"{self.name}: blendshapes hold NaN or infinite coordinates: leave them out")
        for what in ("skin", "parts", "source_index"):
            if len(getattr(self, what)) != v:
                raise RigError(f"{self.name}: {what} has {len(getattr(self, what)):,} entries for {v:,} vertices")
        if not self.skin.any():
            raise RigError(
                f"{self.name}: no face skin found: name the skin vertices with --skin or export the face mesh"
            )
        for array in (self.neutral, self.triangles, self.deltas, self.skin, self.parts, self.source_index):
            array.flags.writeable = False

    @cached_property
    def fingerprint(self) -> str:
        """16 hexadecimal digits of the SHA-256 over geometry, names and skin: equal rigs, equal fingerprints."""
        digest = hashlib.sha256("\0".join([*self.names, *map(repr, self.meanings)]).encode())
        for array in (self.neutral.astype("<f4"), self.triangles.astype("<i4"), self.deltas.astype("<f4"), self.skin):
            digest.update(np.ascontiguousarray(array).tobytes())
        return digest.hexdigest()[:16]

    @cached_property
    def vertex_of(self) -> dict[int, int]:
        """From the vertex number in the artist's file to the rig's own; of several the first."""
        return {source: vertex for vertex, source in reversed(list(enumerate(self.source_index.tolist())))}

    def arkit(self, name: str) -> str | None:
        """ARKit's name for blendshape `name`, by the user's map, its spelling or its action unit; None by none."""
        found = recognise(name, mine=NameMap(dict(self.meanings)))
        return found.arkit[0] if found and found.standard in NAMING and len(found.arkit) == 1 else None

    @cached_property
    def displacement(self) -> Float[np.ndarray, "k v"]:
        """Length of every delta, millimetres."""
        return np.linalg.norm(self.deltas, axis=2)

    @cached_property
    def _row_of(self) -> dict[str, int]:
        return {name: k for k, name in enumerate(self.names)}

    def rows(self, names: Iterable[str]) -> list[int]:
        """The rows of `deltas` that hold these blendshapes."""
        return [self._row_of[name] for name in names]

    def in_file(self, points: Float[np.ndarray, "*n 3"]) -> Float[np.ndarray, "*n 3"]:
        """Points of the rig's frame, millimetres, in the coordinates and the unit of the artist's file."""
        return points @ np.reshape(self.turn, (3, 3)) / self.unit_mm

    def pose(self, weights: Float[np.ndarray, " k"]) -> Float[np.ndarray, "v 3"]:
        """v0 + sum_k w_k d_k, millimetres."""
        return self.neutral + np.einsum("k,kvx->vx", weights, self.deltas)


def check_blendshapes(
    name: str,
    neutral: Float[np.ndarray, "v 3"],
    triangles: Int[np.ndarray, "f 3"],
    deltas: Float[np.ndarray, "*kvx"],
    names: tuple[str, ...],
) -> None:
    """RigError unless these arrays are one mesh with differently named blendshapes of the same vertices."""
    v, k = len(neutral), len(names)
    if k == 0:
        raise RigError(f"{name}: no blendshapes found, only a neutral: export at least one")
    if deltas.shape != (k, v, 3):
        raise RigError(
            f"{name}: {deltas.shape[0]} blendshapes of {deltas.shape[1]:,} vertices but {k} "
            f"names and {v:,} neutral vertices: give one name and one delta per blendshape"
        )
    if len(set(names)) < k:
        twice = next(name for name in names if names.count(name) > 1)
        raise RigError(f"{name}: two blendshapes are called '{twice}': give each its own name")
    if len(triangles) == 0:
        raise RigError(f"{name}: no triangles found: export the neutral with its faces")
    if triangles.min() < 0 or triangles.max() >= v:
        worst = triangles.max() if triangles.max() >= v else triangles.min()
        raise RigError(f"{name}: a face uses vertex {worst:,} of {v:,}, counted from 0: export the mesh again")
    if not np.isfinite(neutral).all():
        raise RigError(f"{name}: the neutral holds NaN or infinite coordinates: clean the mesh and export it again")
