"""VRM avatars: morph targets are the blendshapes; expressions name unnamed ones and are told in the note."""

import numpy as np
import pytest

from capture_plan.errors import RigError
from capture_plan.formats.gltf import read_gltf
from tests.formats.test_gltf import LIFT, SQUARE, Writer, primitive


def avatar(extensions: dict, names: tuple = (None, None), hidden: bool = False) -> Writer:
    """A face of three targets and brows of two; in the file a bone stands before them."""
    writer = Writer()
    if hidden:
        writer.document["nodes"].append({"name": "hips"})
    writer.mesh([primitive(writer, deltas=(LIFT, 2 * LIFT, 3 * LIFT))], names[0], name="Face")
    writer.mesh([primitive(writer, vertices=SQUARE + 5, deltas=(4 * LIFT, 5 * LIFT))], names[1], name="Brows")
    writer.document["extensions"] = extensions
    writer.document["extensionsUsed"] = list(extensions)
    return writer


def vrm_0(*groups: dict) -> dict:
    return {"VRM": {"blendShapeMaster": {"blendShapeGroups": list(groups)}}}


def vrm_1(preset: dict | None = None, custom: dict | None = None) -> dict:
    return {"VRMC_vrm": {"specVersion": "1.0", "expressions": {"preset": preset or {}, "custom": custom or {}}}}


BLINK = {"name": "Blink", "presetName": "blink", "binds": [{"mesh": 0, "index": 1, "weight": 100}]}
JOY = {
    "name": "Joy",
    "presetName": "joy",
    "binds": [{"mesh": 0, "index": 0, "weight": 50}, {"mesh": 1, "index": 1, "weight": 100}],
}


def test_an_old_avatar_faces_backward_and_a_new_one_forward(tmp_path):
    assert read_gltf(avatar(vrm_0()).glb(tmp_path / "old.vrm")).facing == "-z"
    assert read_gltf(avatar(vrm_1()).glb(tmp_path / "new.vrm")).facing == "+z"
    both = read_gltf(avatar(vrm_0() | vrm_1()).glb(tmp_path / "both.vrm"))
    assert (both.facing, both.up, both.unit_mm) == ("+z", "+y", 1000.0)


def test_blendshapes_are_the_morph_targets_and_keep_the_artist_s_names(tmp_path):
    writer = avatar(vrm_0(BLINK, JOY), (["smile", "lid", "jaw"], ["up", "down"]))
    rig = read_gltf(writer.glb(tmp_path / "a.vrm"))
    assert rig.names == ("smile", "lid", "jaw", "up", "down")
    assert rig.note == "VRM expressions are poses of the blendshapes: blink = lid, joy = 0.5 smile + down"


def test_an_expression_of_one_full_target_names_it_where_the_file_does_not(tmp_path):
    rig = read_gltf(avatar(vrm_0(BLINK, JOY)).glb(tmp_path / "a.vrm"))
    assert rig.names == ("Face/target_0", "blink", "Face/target_2", "Brows/target_0", "Brows/target_1")
    np.testing.assert_array_equal(rig.deltas[1, 2], [0, 0, 4])


def test_unnamed_targets_of_several_meshes_that_one_expression_moves_are_one_blendshape(tmp_path):
    binds = [{"node": 1, "index": 2, "weight": 1}, {"node": 2, "index": 0, "weight": 1}]
    writer = avatar(vrm_1(custom={"jawOpen": {"morphTargetBinds": binds}}), hidden=True)
    rig = read_gltf(writer.glb(tmp_path / "a.vrm"))
    np.testing.assert_array_equal(rig.deltas[rig.names.index("jawOpen")][[2, 6], 2], [6, 8])


def test_an_unknown_preset_is_called_by_its_own_name(tmp_path):
    writer = avatar(vrm_0(BLINK | {"presetName": "unknown", "name": "wink"}))
    assert "wink" in read_gltf(writer.glb(tmp_path / "a.vrm")).names


def test_expressions_without_morph_targets_are_nothing(tmp_path):
    writer = avatar(vrm_1({"neutral": {}, "lookUp": {"morphTargetBinds": []}}), (["a", "b", "c"], ["d", "e"]))
    assert read_gltf(writer.glb(tmp_path / "a.vrm")).note == ""


@pytest.mark.parametrize(
    "extensions",
    [
        vrm_1({"aa": {"morphTargetBinds": [{"node": 9, "index": 0, "weight": 1}]}}),
        vrm_1({"aa": {"morphTargetBinds": [{"node": 0, "index": "x", "weight": 1}]}}),
        vrm_0({"binds": [{"mesh": 0}]}),
        {"VRM": {"blendShapeMaster": {"blendShapeGroups": [7]}}},
        {"VRMC_vrm": []},
    ],
)
def test_expressions_that_do_not_read_are_refused_in_one_line(tmp_path, extensions):
    with pytest.raises(RigError, match=r"a\.vrm") as error:
        read_gltf(avatar(extensions).glb(tmp_path / "a.vrm"))
    assert "\n" not in str(error.value)
