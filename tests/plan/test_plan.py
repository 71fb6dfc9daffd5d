"""Plans: kept as they are, checked without a solver, refused when they lie."""

import json
from dataclasses import replace as change

import msgspec
import numpy as np
import pytest
from msgspec.structs import replace

from capture_plan.check.check import check_plan
from capture_plan.errors import InfeasibleError, PlanError, RigError
from capture_plan.layout.settings import LayoutSettings
from capture_plan.plan.files import (
    change_settings,
    plan_bytes,
    plan_schema,
    read_plan,
    read_settings,
    rig_of,
    write_plan,
)
from capture_plan.plan.inputs import read_inputs
from capture_plan.plan.make import make_plan
from capture_plan.plan.record import RigReference
from capture_plan.plan.settings import Settings
from capture_plan.plan.summary import summary
from tests.light import light_sample
from tests.once import plan_of
from tests.tampering import answers_kept


@pytest.fixture(scope="module")
def plan():
    return plan_of()


def test_a_plan_reads_back_equal(plan, tmp_path):
    assert read_plan(write_plan(plan, tmp_path / "deep" / "plan.json")) == plan


def test_the_same_rig_and_settings_give_the_same_bytes(plan, rig):
    assert plan_bytes(make_plan(rig)) == plan_bytes(plan)


def test_every_claim_of_a_fresh_plan_holds(plan, rig):
    assert [claim for claim in check_plan(plan, rig) if not claim.holds] == []


def moved(plan):
    first, *rest = plan.layout.landmarks
    return replace(plan, layout=replace(plan.layout, landmarks=(replace(first, position=(0.0, 0.0, 0.0)), *rest)))


def dropped(plan):
    first, *retained = plan.layout.landmarks
    order = tuple(name for name in plan.layout.order if name != first.name)
    return replace(plan, layout=replace(plan.layout, landmarks=tuple(retained), order=order))


def boasting(plan):
    return replace(plan, layout=replace(plan.layout, information=replace(plan.layout.information, error_mm=0.01)))


def overpriced(plan):
    c = plan.layout.certificate
    return replace(
        plan, layout=replace(plan.layout, certificate=replace(c, weights=tuple(2 * w for w in c.weights), landmarks=99))
    )


def merged(plan):
    first, second, *rest = plan.packing.expressions
    both = replace(
        first, blendshapes=first.blendshapes + second.blendshapes, weights=first.weights + second.weights, covered=0.9
    )
    return replace(plan, packing=replace(plan.packing, expressions=(both, *rest)))


def twice(plan):
    first, *rest = plan.packing.expressions
    return replace(plan, packing=replace(plan.packing, expressions=(first, first, *rest)))


@pytest.mark.parametrize("lie", [moved, dropped, boasting, overpriced, merged, twice])
def test_a_plan_that_lies_is_caught(plan, rig, lie):
    with answers_kept():
        assert not all(claim.holds for claim in check_plan(lie(plan), rig))


def test_the_schema_describes_the_plan(plan):
    schema = json.loads(plan_schema())
    fields = schema["$defs"]["Plan"]["properties"]
    assert set(fields) == set(json.loads(plan_bytes(plan)))


def test_the_summary_gives_every_number_a_unit(plan):
    text = "\n".join(summary(plan))
    assert f"{len(plan.layout.landmarks)} landmarks" in text
    assert "mm under 0.2 mm of noise" in text
    assert f"{len(plan.packing.expressions)} expressions" in text


def test_a_changed_rig_behind_an_old_plan_is_refused(plan, rig, tmp_path, monkeypatch):
    changed = change(rig, neutral=rig.neutral + np.array([0.0, 0.0, 1.0]))
    monkeypatch.setattr("capture_plan.plan.files.sample_rig", lambda: changed)
    with pytest.raises(PlanError, match="the rig has changed since"):
        rig_of(plan, tmp_path / "plan.json")


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"", "is not a plan"),
        (b"[1, 2]", "is not a plan"),
        (b'{"format": 8}', "is not a plan"),
        (b'{"format": 6}', "format 6, expected 8"),
        (b"\xff\xfe\x00", "is not a plan"),
        (b"[" * 100_000, "is not a plan"),
    ],
)
def test_what_is_no_plan_is_refused_in_one_line(tmp_path, content, says):
    path = tmp_path / "plan.json"
    path.write_bytes(content)
    with pytest.raises(PlanError, match=says) as caught:
        read_plan(path)
    assert "\n" not in str(caught.value)


def test_a_plan_cut_anywhere_is_refused(plan, tmp_path):
    whole = plan_bytes(plan)
    path = tmp_path / "plan.json"
    for end in np.linspace(1, len(whole) - 3, 40).astype(int):
        path.write_bytes(whole[:end])
        with pytest.raises(PlanError):
            read_plan(path)


def test_an_unwritable_place_is_named_and_leaves_nothing(plan, tmp_path):
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(PlanError, match="cannot be written"):
        write_plan(plan, tmp_path / "file" / "plan.json")
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_settings_come_from_a_file_and_options_win(tmp_path):
    path = tmp_path / "settings.toml"
    path.write_text('[landmarks]\nepsilon = 0.6\nspacing_mm = 10\n[expressions]\nmethod = "sequential"\n')
    settings = change_settings(read_settings(path), {"landmarks": {"epsilon": 0.7}})
    assert (settings.landmarks.epsilon, settings.landmarks.spacing_mm) == (0.7, 10)
    assert settings.expressions.method == "sequential"


@pytest.mark.parametrize(
    ("text", "says"),
    [("[landmarks]\nepsilom = 0.6", "epsilom"), ("[landmarks]\nepsilon = 0", "epsilon"), ("[[[", "settings.toml")],
)
def test_a_wrong_setting_is_named(tmp_path, text, says):
    path = tmp_path / "settings.toml"
    path.write_text(text)
    with pytest.raises(PlanError, match=says):
        read_settings(path)


def test_a_target_neutral_of_another_mesh_is_refused(rig, tmp_path):
    path = tmp_path / "actor.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    with pytest.raises(RigError, match=r"actor\.obj has 3 vertices"):
        read_inputs(rig, Settings(target=str(path)))


def test_settings_survive_json():
    settings = Settings(cameras="frontal")
    assert msgspec.json.decode(msgspec.json.encode(settings), type=Settings) == settings


@pytest.mark.parametrize(("by", "said"), [(0.3, True), (1.0, False)])
def test_where_nothing_can_be_had_on_a_head_of_another_size_its_size_is_said(by, said):
    rig = light_sample()
    small = change(rig, neutral=by * rig.neutral, deltas=np.float32(by) * rig.deltas)
    settings = Settings(landmarks=LayoutSettings(method="cover", spacing_mm=45.0))
    with pytest.raises(InfeasibleError) as error:
        make_plan(small, settings)
    assert ("between the pupils" in str(error.value)) is said


def test_a_file_name_that_a_page_would_obey_is_refused_before_any_work():
    reference = RigReference("hero", "he\tro.npz", "0" * 16, 3)
    with pytest.raises(PlanError, match=r"control character in rig\.path.*give the file another name"):
        make_plan(light_sample(), reference=reference)
