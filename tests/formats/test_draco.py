"""glTF in Draco compression: as the file without it where the library is there, one line where it is not."""

import importlib.util

import numpy as np
import pytest

from capture_plan.errors import RigError
from capture_plan.formats import draco
from capture_plan.formats.gltf import read_gltf
from tests.formats.test_gltf import LIFT, QUAD, SQUARE, Writer, primitive

NEEDS = pytest.mark.skipif(importlib.util.find_spec("DracoPy") is None, reason="the extra 'draco' is not installed")


def compressed(data: bytes, required=True) -> Writer:
    """A square whose places and faces are only in `data`; its blendshape is not compressed."""
    writer = Writer()
    p = primitive(writer)
    for index in (p["attributes"]["POSITION"], p["indices"]):
        del writer.document["accessors"][index]["bufferView"]
    view = writer.view(np.frombuffer(data, np.uint8))
    p["extensions"] = {draco.NAME: {"bufferView": view, "attributes": {"POSITION": 0}}}
    writer.mesh([p], ["lift"])
    writer.document |= {"extensionsUsed": [draco.NAME]} | ({"extensionsRequired": [draco.NAME]} if required else {})
    return writer


def encoded(vertices=SQUARE) -> bytes:
    """What the library makes of a square."""
    import DracoPy  # pyright: ignore[reportMissingImports]

    return DracoPy.encode(vertices, QUAD.reshape(-1, 3).astype(np.uint32), quantization_bits=16, preserve_order=True)


@NEEDS
@pytest.mark.parametrize("required", [True, False])
def test_what_is_compressed_is_read_as_if_it_were_not(tmp_path, required):
    rig = read_gltf(compressed(encoded(), required).glb(tmp_path / "r.glb"))
    np.testing.assert_allclose(rig.neutral, SQUARE, atol=1e-4)
    np.testing.assert_array_equal(rig.triangles, QUAD.reshape(-1, 3))
    np.testing.assert_array_equal(rig.deltas[0], LIFT)


@NEEDS
@pytest.mark.parametrize(
    ("data", "says"),
    [
        (lambda: b"no Draco at all", "cannot be unpacked"),
        (lambda: encoded()[:40], "cannot be unpacked"),
        (lambda: encoded(SQUARE[[0, 1, 2, 3, 3]]), "has 5 values in Draco compression"),
    ],
)
def test_damage_is_refused_in_one_line(tmp_path, data, says):
    with pytest.raises(RigError, match=says):
        read_gltf(compressed(data()).glb(tmp_path / "r.glb"))


def test_without_the_library_the_line_says_what_to_do(tmp_path, monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(RigError, match=r"r\.glb needs KHR_draco_mesh_compression: install it .* without compression"):
        read_gltf(compressed(b"").glb(tmp_path / "r.glb"))
