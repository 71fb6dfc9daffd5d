"""The mirror plane is found whichever way a head lies, and what is not symmetric is told in figures."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from capture_plan.anatomy.symmetry import pair_disagreements, symmetry_report
from capture_plan.mesh.mirror import Plane, find_mirror_plane, mirror_map, mirror_plane, partner_map
from capture_plan.sample import sample_rig

HEAD = sample_rig().neutral


def degrees_off(plane, n):
    return np.degrees(np.arccos(min(1.0, abs(np.dot(plane.normal, n)))))


@settings(max_examples=4, deadline=None)
@given(st.integers(0, 10_000), st.sampled_from([1e-3, 1.0, 1000.0]))
def test_turning_moving_and_scaling_a_head_does_so_with_its_plane(seed, scale):
    R = Rotation.random(random_state=seed).as_matrix()
    shift = np.random.default_rng(seed).uniform(-300, 300, 3)
    plane = find_mirror_plane(scale * (HEAD @ R.T + shift))
    n = R[:, 0] * np.sign(R[:, 0] @ plane.normal)
    assert degrees_off(plane, n) < 0.01
    c = np.sign(R[:, 0] @ plane.normal) * (mirror_plane(HEAD) + R[:, 0] @ shift)
    assert plane.offset == pytest.approx(scale * c, abs=0.01 * scale)


def test_a_turned_head_has_the_partners_of_the_upright_one():
    turned = 1000 * HEAD @ Rotation.from_euler("xyz", [10, 20, 30], degrees=True).as_matrix().T
    assert (partner_map(turned, find_mirror_plane(turned), tie=20.0) == mirror_map(HEAD)).mean() > 0.999


@pytest.mark.parametrize("what", ["a swollen cheek", "a quarter cut off", "noise"])
def test_what_is_not_symmetric_does_not_tilt_the_plane(what):
    v = HEAD.copy()
    if what == "a swollen cheek":
        cheek = v[np.argmax(v[:, 0])]
        v[:, 0] += 30 * np.exp(-((v - cheek) ** 2).sum(axis=1) / 40**2)
    elif what == "a quarter cut off":
        v = v[~((v[:, 0] > 20) & (v[:, 1] > np.median(v[:, 1])))]
    else:
        v += np.random.default_rng(0).normal(0, 0.5, v.shape)  # millimetres
    R = Rotation.random(random_state=5).as_matrix()
    assert degrees_off(find_mirror_plane(v @ R.T), R[:, 0]) < 0.5


def test_reflecting_in_a_plane_twice_changes_nothing_and_leaves_the_plane_alone():
    plane = Plane((0.6, 0.0, 0.8), 12.0)
    assert plane.reflect(plane.reflect(HEAD)) == pytest.approx(HEAD)
    on = 12 * np.array([[0.6, 0, 0.8]])
    assert plane.reflect(on) == pytest.approx(on)
    assert plane.reflect(HEAD) - plane.reflect(0 * HEAD) == pytest.approx(plane.turn(HEAD))


def test_points_in_one_place_have_a_plane_too():
    assert find_mirror_plane(np.full((5, 3), 2.0)) == Plane((1.0, 0.0, 0.0), 2.0)


def test_the_sample_is_symmetric_to_the_figures_that_are_told():
    found = symmetry_report(sample_rig())
    assert found.neutral_max_mm < 0.05
    assert found.tilt_degrees < 0.01
    assert all(image.partner for image in found.blendshapes)
    message = {image.blendshape: image.partner for image in found.blendshapes}
    assert message["mouthSmileLeft"] == "mouthSmileRight"
    assert message["jawLeft"] == "jawRight"
    assert message["jawOpen"] == "jawOpen"


def test_a_lopsided_delta_is_told_by_how_much():
    rig = sample_rig()
    k = rig.names.index("mouthSmileLeft")
    deltas = rig.deltas.copy()
    deltas[k] *= np.float32(1.2)
    before, after = (symmetry_report(each).blendshapes[k] for each in (rig, replace(rig, deltas=deltas)))
    assert before.percent < 5
    # |1.2 - 1| / sqrt((1.2^2 + 1) / 2)
    assert after.percent == pytest.approx(100 * 0.2 / np.sqrt((1.2**2 + 1) / 2), abs=5)
    assert after.worst_percent == pytest.approx(100 * 0.2 / 1.2, abs=4)


def test_a_lopsided_neutral_is_told_in_millimetres():
    rig = sample_rig()
    pushed = rig.neutral.copy()
    vertex = int(np.flatnonzero(rig.skin & (rig.neutral[:, 0] > 20))[0])
    pushed[vertex] += [0, 0, 0.3]
    assert symmetry_report(replace(rig, neutral=pushed)).neutral_max_mm == pytest.approx(0.3, abs=0.05)


def test_a_lopsided_neutral_makes_no_blendshape_lopsided():
    rig = sample_rig()
    left = np.clip(rig.neutral[:, [0]] / 60, 0, 1)
    bulged = replace(rig, neutral=rig.neutral + left * [3.0, 4.0, 0.0])
    found = symmetry_report(bulged)
    assert found.neutral_p95_mm > 1.5
    message = {image.blendshape: image.percent for image in found.blendshapes}
    assert max(message[name] for name in ("eyeBlinkLeft", "eyeSquintRight", "mouthSmileLeft", "browDownLeft")) < 12
    halved = replace(bulged, deltas=np.where([[[n == "eyeBlinkLeft"]] for n in rig.names], 0.5, 1) * bulged.deltas)
    message = {image.blendshape: image.percent for image in symmetry_report(halved).blendshapes}
    assert message["eyeBlinkLeft"] > 40


def test_hair_that_lies_on_a_brow_is_no_mirror_image_of_it():
    rig = sample_rig()
    fringe = np.flatnonzero(rig.skin & (rig.displacement[rig.names.index("browOuterUpLeft")] > 3))
    deeper = rig.neutral - np.where(rig.neutral[:, [0]] < 0, [[0.0, 0.0, 0.3]], 0)
    rest = {
        "neutral": np.concatenate([deeper, rig.neutral[fringe] * [-1, 1, 1]]),
        "deltas": np.concatenate([rig.deltas, np.zeros((len(rig.names), len(fringe), 3), np.float32)], axis=1),
        "skin": np.append(rig.skin, np.zeros(len(fringe), dtype=bool)),
        "parts": np.append(rig.parts, np.zeros(len(fringe), dtype=rig.parts.dtype)),
        "source_index": np.append(rig.source_index, np.arange(len(fringe), dtype=rig.source_index.dtype)),
    }
    found = symmetry_report(replace(rig, **rest)).blendshapes[rig.names.index("browOuterUpLeft")]
    assert found.percent < 8


def test_what_has_no_mirror_image_is_told():
    rig = sample_rig()
    keep = [k for k, name in enumerate(rig.names) if name != "noseSneerRight"]
    less = replace(rig, deltas=rig.deltas[keep].copy(), names=tuple(rig.names[k] for k in keep))
    found = {image.blendshape: image.partner for image in symmetry_report(less).blendshapes}
    assert found["noseSneerLeft"] is None
    assert "without mirror image: " in symmetry_report(less).text()


def disagreements(rig):
    return pair_disagreements(rig, symmetry_report(rig).blendshapes)


def test_names_and_geometry_of_the_sample_agree():
    assert disagreements(sample_rig()) == ()


def renamed(**names):
    rig = sample_rig()
    return replace(rig, names=tuple(names.get(name, name) for name in rig.names))


def test_the_mirror_image_of_the_left_eye_looking_left_is_not_called_so():
    rig = renamed(
        eyeLookOutLeft="eyeLookLeftL", eyeLookInLeft="eyeLookRightL",
        eyeLookInRight="eyeLookLeftR", eyeLookOutRight="eyeLookRightR",
    )  # fmt: skip
    found = {one.blendshape: one for one in disagreements(rig)}
    assert set(found) == {"eyeLookLeftL", "eyeLookRightL", "eyeLookLeftR", "eyeLookRightR"}
    assert found["eyeLookLeftL"].by_geometry == "eyeLookRightR"
    assert found["eyeLookLeftL"].by_name in ("eyeLookLeftR", "eyeLookRightL")


def test_exchanged_sides_are_told():
    rig = renamed(mouthSmileLeft="mouthSmileRight", mouthSmileRight="mouthSmileLeft")
    words = [one.words for one in disagreements(rig)]
    assert "mouthSmileLeft is called left and moves the subject's right" in words
    assert len(words) == 2


def off_by(rig, name):
    (found,) = [image for image in symmetry_report(rig).blendshapes if image.blendshape == name]
    assert found.partner is not None
    return found.percent


def with_vertices(rig, places, deltas, *, skin):
    """The rig with vertices added that hang on no triangle of another piece."""
    count = len(places)
    triangles = len(rig.neutral) + np.arange(count // 3 * 3).reshape(-1, 3)
    return replace(
        rig,
        neutral=np.concatenate([rig.neutral, places]),
        triangles=np.concatenate([rig.triangles, triangles]),
        deltas=np.concatenate([rig.deltas, deltas.astype(np.float32)], axis=1),
        skin=np.concatenate([rig.skin, np.full(count, skin)]),
        parts=np.concatenate([rig.parts, np.zeros(count, dtype=rig.parts.dtype)]),
        source_index=np.arange(len(rig.neutral) + count),
    )


def test_a_highlight_on_one_side_has_no_mirror_image_and_is_no_fault_of_a_blink():
    rig = sample_rig()
    eye = rig.neutral[rig.displacement[rig.names.index("eyeBlinkLeft")].argmax()]
    places = np.random.default_rng(0).normal(eye + np.array([0, -4, 4]), 0.5, (60, 3))
    lit = with_vertices(rig, places, np.zeros((len(rig.names), 60, 3)), skin=False)
    before = off_by(rig, "eyeBlinkLeft"), off_by(rig, "eyeBlinkRight")
    assert (off_by(lit, "eyeBlinkLeft"), off_by(lit, "eyeBlinkRight")) == pytest.approx(before, abs=0.1)


def test_of_two_vertices_in_one_place_the_one_that_moves_alike_is_the_mirror_image():
    """A brow drawn onto the skin: its vertices lie on those of the face, and rest when the face moves."""
    rig = sample_rig()
    lid = np.flatnonzero(rig.skin & (rig.displacement[rig.names.index("eyeBlinkLeft")] > 2))[:30]
    rim = np.concatenate([lid, mirror_map(rig.neutral)[lid]])
    drawn = with_vertices(rig, rig.neutral[rim], np.zeros((len(rig.names), len(rim), 3)), skin=True)
    assert off_by(drawn, "eyeBlinkLeft") < off_by(rig, "eyeBlinkLeft") + 0.5
