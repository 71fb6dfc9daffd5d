"""The audit: every planted fault is found, what is left out is exactly what cannot be planned."""

from dataclasses import replace

import msgspec
import numpy as np
import pytest

from capture_plan.audit.audit import Audit, audit_rig
from capture_plan.audit.report import audit_text, verdict
from capture_plan.expressions.compatibility import driven
from capture_plan.sample import sample_rig

NAMES = ("browDownLeft", "browDownRight", "eyeBlinkLeft", "eyeBlinkRight", "jawLeft", "jawOpen", "jawRight")
NAMES += ("mouthClose", "mouthDimpleLeft", "mouthDimpleRight", "mouthShrugLower", "mouthSmileLeft", "mouthSmileRight")
NAMES += ("tongueOut",)


@pytest.fixture(scope="module")
def rig():
    """The sample with a few of its blendshapes."""
    whole = sample_rig()
    return replace(whole, names=NAMES, deltas=whole.deltas[[whole.names.index(name) for name in NAMES]])


@pytest.fixture(scope="module")
def sample(rig):
    return audit_rig(rig)


def with_blendshape(rig, name, delta):
    return replace(rig, names=(*rig.names, name), deltas=np.concatenate([rig.deltas, delta[None].astype(np.float32)]))


def kinds(found, name):
    return {finding.kind for finding in found.findings if name in finding.blendshapes}


def test_the_sample_leaves_out_the_tongue_alone(rig, sample):
    assert set(rig.names) - set(sample.used) == {"tongueOut"}
    assert kinds(sample, "tongueOut") == {"non-face"}
    assert sample.rank == len(sample.used) == len(NAMES) - 1
    assert 54 < sample.interpupillary_mm < 74


def test_nothing_is_dropped_in_silence(rig, sample):
    out = {name for finding in sample.findings if finding.left_out for name in finding.blendshapes}
    assert set(sample.used) | out == set(rig.names)
    assert not set(sample.used) & out


def test_mouth_close_is_found_as_corrective_without_its_name(rig):
    found = audit_rig(replace(rig, names=tuple(f"shape{k}" for k in range(len(rig.names)))))
    pairs = [finding.blendshapes for finding in found.findings if finding.kind == "corrective"]
    close, jaw = (f"shape{rig.names.index(name)}" for name in ("mouthClose", "jawOpen"))
    assert pairs == [(close, jaw)]
    assert close in found.used


def test_a_name_says_on_what_a_corrective_is_performed_whatever_else_it_undoes(rig):
    viseme = 0.3 * rig.deltas[rig.names.index("jawOpen")] - rig.deltas[rig.names.index("mouthClose")]
    with_viseme = with_blendshape(rig, "viseme_aa", viseme.astype(np.float32))
    found = audit_rig(with_viseme)
    pairs = [finding.blendshapes for finding in found.findings if finding.kind == "corrective"]
    assert pairs == [("mouthClose", "jawOpen")]
    assert driven(with_viseme, found.used) == (("mouthClose", "jawOpen"),)


def test_a_still_blendshape_is_left_out(rig):
    found = audit_rig(with_blendshape(rig, "still", 0 * rig.deltas[0]))
    assert kinds(found, "still") == {"static"}
    assert "still" not in found.used


def test_a_blendshape_below_the_noise_is_left_out(rig):
    weak = rig.deltas[rig.names.index("jawOpen")] * np.where(rig.skin, 1, 0)[:, None] * 1e-3
    found = audit_rig(with_blendshape(rig, "weak", weak))
    assert kinds(found, "weak") == {"noise"}
    assert "weak" not in found.used


@pytest.mark.parametrize("times", [1.0, 0.5])
def test_a_copy_is_left_out_and_its_original_kept(rig, times):
    found = audit_rig(with_blendshape(rig, "copy", times * rig.deltas[rig.names.index("jawOpen")]))
    assert kinds(found, "copy") == {"duplicate"}
    assert "copy" not in found.used
    assert "jawOpen" in found.used


def test_an_opposite_is_no_copy(rig):
    found = audit_rig(with_blendshape(rig, "opposite", -rig.deltas[rig.names.index("jawOpen")]))
    assert "duplicate" not in kinds(found, "opposite")
    assert "opposite" in found.used


def test_a_sum_lowers_the_rank_and_is_still_planned(rig, sample):
    both = rig.deltas[rig.names.index("browDownLeft")] + rig.deltas[rig.names.index("browDownRight")]
    found = audit_rig(with_blendshape(rig, "both", both))
    assert kinds(found, "both") >= {"dependent"}
    assert not kinds(found, "jawOpen") & {"dependent"}
    assert {"browDownLeft", "browDownRight"} <= {
        name for finding in found.findings if finding.kind == "dependent" for name in finding.blendshapes
    }
    assert "both" in found.used
    assert found.rank == sample.rank == len(found.used) - 1


def test_a_left_blendshape_without_its_right_one_is_reported(rig):
    keep = [k for k, name in enumerate(rig.names) if name != "mouthSmileRight"]
    found = audit_rig(replace(rig, names=tuple(rig.names[k] for k in keep), deltas=rig.deltas[keep]))
    assert kinds(found, "mouthSmileLeft") == {"partner"}
    assert "mouthSmileLeft" in found.used


def test_a_head_of_another_size_is_reported(rig):
    found = audit_rig(replace(rig, neutral=rig.neutral * 10, deltas=rig.deltas * 10))
    assert any("601.9 mm apart" in finding.message for finding in found.findings)
    assert verdict(found).startswith("Check the size first")


def test_broken_meshes_are_reported(rig):
    broken = np.concatenate([rig.triangles, rig.triangles[:3]])
    messages = " ".join(finding.message for finding in audit_rig(replace(rig, triangles=broken)).findings)
    assert "3 of 9,611 triangles are there twice" in messages
    inward = audit_rig(replace(rig, triangles=rig.triangles[:, ::-1].copy()))
    assert verdict(inward).startswith("Not yet")


def test_a_rig_that_moves_no_skin_cannot_be_shot(rig):
    found = audit_rig(replace(rig, deltas=rig.deltas * ~rig.skin[:, None]))
    assert found.used == ()
    assert found.rank == 0
    assert verdict(found).startswith("No:")


def test_the_page_says_every_finding_and_fits_the_terminal(sample):
    text = audit_text(sample)
    assert max(map(len, text.splitlines())) <= 100
    flat = " ".join(text.split())
    assert (
        text.index("Shoot with it?")
        < text.index("LEFT OUT")
        < text.index("tongueOut moves")
        < text.index("PLANNED, AND")
        < text.index("mouthClose is a")
    )
    for finding in sample.findings:
        assert finding.message[1:] in flat
        assert finding.advice in flat


def test_the_audit_survives_json(sample):
    assert msgspec.json.decode(msgspec.json.encode(sample), type=Audit) == sample
