"""Random damage to a rig in every format that is read in this process, for as long as one has patience.

    PYTHONPATH=tests python tests/benchmarks/mutate_readers.py SECONDS

Each damaged copy must give a rig or one `RigError` line, with little memory. What was found stands in NOTES.md.
"""

import random
import resource
import sys
import tempfile
import time
import zipfile
from collections import Counter
from pathlib import Path

import numpy as np
from fbx_files import ascii_text, binary, head, scene
from test_gltf import write_sample_glb

from capture_plan.errors import RigError
from capture_plan.rig import sample_rig
from capture_plan.rig.read import read_raw

MEMORY = 4 << 30
SPARKS = (b"", b"\xff\xff\xff\xff", b"\0\0\0\0", b"{", b"}", b'"', b"-1", b"1e999", b"nan", b"\n")


def seeds(folder: Path) -> list[Path]:
    """Small whole rigs, one in each format."""
    rig, k = sample_rig(), 2
    obj, ply, archive = folder / "obj", folder / "ply", folder / "rig.zip"
    obj.mkdir()
    ply.mkdir()
    shapes = {"neutral": rig.neutral} | {rig.names[i]: rig.neutral + rig.deltas[i] for i in range(k)}
    faces = rig.triangles[:400]
    for name, vertices in shapes.items():
        corners = "".join(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in faces)
        (obj / f"{name}.obj").write_text("".join(f"v {x:.3f} {y:.3f} {z:.3f}\n" for x, y, z in vertices) + corners)
        top = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(vertices)}\n"
        columns = "property float x\nproperty float y\nproperty float z\n"
        top += f"{columns}element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
        rows = np.zeros(len(faces), dtype=[("n", "u1"), ("corner", "<i4", 3)])
        rows["n"], rows["corner"] = 3, faces
        (ply / f"{name}.ply").write_bytes(top.encode() + vertices.astype("<f4").tobytes() + rows.tobytes())
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as file:
        for path in sorted(obj.iterdir()):
            file.write(path, f"rig/{path.name}")
    np.savez(
        folder / "rig.npz", vertices=rig.neutral, faces=faces, deltas=rig.deltas[:k], names=np.array(rig.names[:k])
    )
    tree = scene(*head())
    (folder / "bin7400.fbx").write_bytes(binary(tree))
    (folder / "bin7700.fbx").write_bytes(binary(tree, 7700))
    (folder / "ascii.fbx").write_bytes(ascii_text(tree))
    glbs = [write_sample_glb(folder / f"{kind}.glb", k=k, sparse=kind == "sparse") for kind in ("sparse", "dense")]
    return [*glbs, folder / "rig.npz", archive, obj, ply, *sorted(folder.glob("*.fbx"))]


def damage(content: bytes, rng: random.Random) -> bytes:
    """Cut off, or with some bytes changed, most of them near the start where sizes are declared."""
    data = bytearray(content)
    if rng.random() < 0.2:
        return bytes(data[: rng.randrange(len(data))])
    for _ in range(rng.randint(1, 30)):
        reach = len(data) if rng.random() < 0.5 else min(len(data), 2000)
        if not reach:
            break
        at = rng.randrange(reach)
        data[at : at + 1] = rng.choice((bytes([rng.randrange(256)]), rng.choice(SPARKS)))
    return bytes(data)


def main(seconds: float) -> None:
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    rng, outcome, slowest = random.Random(0), Counter(), Counter()
    with tempfile.TemporaryDirectory() as name:
        rigs = seeds(Path(name))
        print(*(f"{rig.name}: {len(read_raw(rig).names)} blendshapes" for rig in rigs), sep=", ")
        stop = time.monotonic() + seconds
        while time.monotonic() < stop:
            rig = rng.choice(rigs)
            victim = rng.choice(sorted(rig.iterdir())) if rig.is_dir() else rig
            whole = victim.read_bytes()
            victim.write_bytes(damage(whole, rng))
            start = time.monotonic()
            try:
                read_raw(rig)
                outcome[rig.name, "read"] += 1
            except RigError as error:
                lines = len(str(error).splitlines())
                outcome[rig.name, "refused" if lines == 1 else f"{lines} lines"] += 1
            slowest[rig.name] = max(slowest[rig.name], time.monotonic() - start)
            victim.write_bytes(whole)
    for rig in rigs:
        print(
            f"{rig.name:12} read {outcome[rig.name, 'read']:6,}  refused {outcome[rig.name, 'refused']:6,}  "
            f"slowest {slowest[rig.name]:.2f} s"
        )
    wrong = {kind for _, kind in outcome} - {"read", "refused"}
    assert not wrong, f"answers of {wrong}"
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024
    print(f"{sum(outcome.values()):,} damaged rigs in {seconds:.0f} s, none without an answer; peak memory {peak} MB")


if __name__ == "__main__":
    main(float(sys.argv[1]))
