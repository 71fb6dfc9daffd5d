"""A plan, its rig and its files move together; the user's own names win."""

import os
import shutil

import numpy as np
import pytest
from msgspec.structs import replace

from capture_plan.check.check import check_plan
from capture_plan.errors import PlanError, RigError
from capture_plan.expressions.settings import Edits
from capture_plan.plan.files import (
    inputs_of,
    read_plan,
    read_settings,
    refer_to,
    settings_seen_from,
    write_plan,
)
from capture_plan.plan.inputs import read_inputs
from capture_plan.plan.make import make_plan
from capture_plan.plan.places import found_from, seen_from
from capture_plan.plan.replacing import edits_lost, refuse_to_replace
from capture_plan.plan.settings import Settings
from capture_plan.reader.read import read_rig
from capture_plan.rig.read_options import ReadOptions
from capture_plan.sample import sample_rig
from tests.once import QUICK, plan_of


@pytest.fixture
def session(tmp_path):
    """A folder with a rig of house names, a name map, a skin file and a camera file; plans go to a folder inside."""
    sample = sample_rig()
    retained = [sample.names.index(n) for n in ("jawOpen", "mouthSmileLeft", "mouthSmileRight", "eyeBlinkLeft")]
    folder = tmp_path / "session"
    (folder / "plans").mkdir(parents=True)
    np.savez(
        folder / "hero.npz",
        vertices=sample.neutral,
        faces=sample.triangles,
        deltas=sample.deltas[retained],
        names=np.array(["shape_a", "shape_b", "shape_c", "shape_d"]),
    )
    (folder / "names.toml").write_text('[names]\nshape_a = "jawOpen"\nshape_b = "mouthSmileLeft"\nshape_c = "AU12R"\n')
    (folder / "skin.txt").write_text(" ".join(map(str, np.flatnonzero(sample.skin))))
    (folder / "session.toml").write_text('cameras = "rig.toml"\n')
    (folder / "rig.toml").write_text(
        "[[cameras]]\nname = 'front'\nwidth = 2000\nheight = 2000\nfx = 3000\nfy = 3000\ncx = 1000\ncy = 1000\n"
        "position = [0, 700, 1000]\nlook_at = [0, 700, 0]\n"
    )
    return folder


def plan_in(folder, monkeypatch):
    monkeypatch.chdir(folder)
    corrected = {"unit_mm": 1.0, "up": "+y", "facing": "+z", "skin": "skin.txt", "names": "names.toml"}
    rig, target = read_rig("hero.npz", **corrected), folder / "plans" / "plan.json"
    settings = settings_seen_from(target.parent, read_settings(folder / "session.toml"))
    reference = refer_to(rig, "hero.npz", target, ReadOptions(**corrected))
    write_plan(
        make_plan(read_inputs(rig, settings, target.parent, names=reference.names), settings, reference=reference),
        target,
    )
    return rig, target


def test_a_session_that_moved_is_found_and_checked_from_any_folder(session, tmp_path, monkeypatch):
    plan_in(session, monkeypatch)
    shutil.move(session, tmp_path / "elsewhere")
    (tmp_path / "work").mkdir()
    monkeypatch.chdir(tmp_path / "work")
    path = tmp_path / "elsewhere" / "plans" / "plan.json"
    plan = read_plan(path)
    assert (plan.rig.path, plan.rig.skin, plan.rig.names) == ("../hero.npz", "../skin.txt", "../names.toml")
    assert plan.settings.cameras == "../rig.toml"
    assert [claim for claim in check_plan(plan, inputs_of(plan, path)) if not claim.holds] == []


def test_the_user_s_names_reach_the_actor(session, monkeypatch):
    rig, path = plan_in(session, monkeypatch)
    assert [rig.arkit(name) for name in rig.names] == ["jawOpen", "mouthSmileLeft", "mouthSmileRight", None]
    said = " ".join(expression.sentence for expression in read_plan(path).packing.expressions)
    assert "smile" in said.lower()
    assert "jaw" in said.lower()


def test_other_names_are_another_rig(session):
    plain = read_rig(session / "hero.npz", unit_mm=1.0)
    named = read_rig(session / "hero.npz", unit_mm=1.0, names=str(session / "names.toml"))
    assert plain.fingerprint != named.fingerprint


def test_a_map_that_speaks_of_another_rig_is_refused(session):
    (session / "other.toml").write_text('[names]\nfrown = "mouthFrownLeft"\n')
    with pytest.raises(RigError, match=r"other\.toml names no blendshape of hero"):
        read_rig(session / "hero.npz", names=str(session / "other.toml"))


def test_a_plan_is_replaced_by_its_like_also_where_a_corrective_is_kept_apart_with_what_it_corrects(tmp_path):
    edits = Edits(apart=(("jawOpen", "noseSneerLeft"),))
    asked = replace(QUICK, expressions=replace(QUICK.expressions, edits=edits))
    made = make_plan(sample_rig(), asked)
    assert ("mouthClose", "noseSneerLeft") in made.packing.edits.apart
    write_plan(made, tmp_path / "plan.json")
    refuse_to_replace(tmp_path / "plan.json", sample_rig(), "sample", asked)


def test_a_plan_with_wishes_that_would_go_is_not_replaced_unasked(tmp_path):
    """Each constraint is named, those that the new settings have are not, and a plan without any is made again."""
    edits = Edits(together=(("jawOpen", "browInnerUp"),), dropped=("cheekPuff",))
    plan, path = plan_of(QUICK), tmp_path / "plan.json"
    pin = plan.layout.landmarks[3]
    constraints = replace(
        QUICK.landmarks, pins=(pin.source_vertex,), forbidden=(7,), caps={"nose": 4}, keep_out={"wet lip": 5.0}
    )
    asked = replace(QUICK, landmarks=constraints, expressions=replace(QUICK.expressions, edits=edits))
    made = replace(plan, settings=asked, packing=replace(plan.packing, edits=edits))
    write_plan(made, path)
    with pytest.raises(PlanError, match="--replace") as refused:
        refuse_to_replace(path, sample_rig(), "sample", Settings())
    assert f"(pin at {pin.name}, no dot at vertex 7, nose at most 4, keep-out wet lip 5 mm, " in str(refused.value)
    assert list(edits_lost(made, Edits())) == ["jawOpen and browInnerUp together", "cheekPuff dropped"]
    with pytest.raises(PlanError, match=r"would go \(nose at most 4\)"):
        refuse_to_replace(
            path, sample_rig(), "sample", replace(asked, landmarks=replace(constraints, caps={"nose": 3}))
        )
    refuse_to_replace(path, sample_rig(), "sample", asked)
    write_plan(plan, path)
    refuse_to_replace(path, sample_rig(), "sample", Settings())


def test_a_word_that_is_no_file_stays_a_word(tmp_path):
    assert seen_from(tmp_path, "frontal") == "frontal"
    assert found_from(tmp_path, "frontal") == "frontal"
    assert seen_from(tmp_path, None) is found_from(tmp_path, None) is None


def test_seen_from_and_found_from_undo_each_other(tmp_path, monkeypatch):
    (tmp_path / "a").mkdir()
    (tmp_path / "b.toml").touch()
    monkeypatch.chdir(tmp_path)
    retained = seen_from(tmp_path / "a", "b.toml")
    assert retained == "../b.toml"
    assert os.path.samefile(str(found_from(tmp_path / "a", retained)), "b.toml")


def test_settings_without_files_stay_as_they_are(tmp_path):
    assert settings_seen_from(tmp_path, Settings(cameras="frontal")) == Settings(cameras="frontal")


def test_a_name_longer_than_any_file_has_is_kept_as_it_stands(tmp_path):
    assert found_from(tmp_path, "a" * 5000) == "a" * 5000
    assert seen_from(tmp_path, "a" * 5000) == "a" * 5000
