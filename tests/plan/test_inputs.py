"""What a plan is made from: read from files or built by hand it is the same, and what is missing is said."""

import msgspec
import numpy as np
import pytest
from msgspec.structs import replace

from capture_plan.camera import cameras_for
from capture_plan.check.check import check_plan
from capture_plan.errors import PlanError
from capture_plan.expressions.rules import Rules
from capture_plan.plan.files import read_plan, write_plan
from capture_plan.plan.inputs import IN_PYTHON, PlanInputs, inputs_for, read_inputs
from capture_plan.plan.make import make_plan
from capture_plan.plan.places import named_files, with_files
from capture_plan.plan.revise import edited_plan
from capture_plan.plan.settings import Settings
from capture_plan.sample.motion import sample_motion
from capture_plan.shell.takes import takes_of
from tests.once import QUICK, plan_of

EVERY = msgspec.convert(
    {
        "cameras": "rig.toml",
        "target": "actor.npy",
        "sequences": ["a.npz", "b.npz"],
        "vertex_weights": "w.txt",
        "expressions": {"rules": "rules.toml"},
        "landmarks": {"keep_out": {"scar.txt": 2.0, "wet lip": 3.0}},
    },
    Settings,
)


@pytest.fixture(scope="module")
def hand(rig):
    """Cameras, a wider actor, rules of one movement at once, a painted cheek, and a take, all made in memory."""
    return {
        "cameras": cameras_for("frontal", rig.neutral, rig.skin),
        "target": rig.neutral * [1.1, 1.0, 1.0],
        "rules": Rules(most_things=1),
        "zones": {"scar": rig.skin & (np.abs(rig.neutral[:, 0] - 40) < 6)},
        "takes": takes_of(rig, [sample_motion(0, frames=12)]),
    }


@pytest.fixture(scope="module")
def written(rig, hand, tmp_path_factory):
    """Settings that name files, and the folder where these say what `hand` holds."""
    folder = tmp_path_factory.mktemp("day")
    mesh = "".join(f"v {x:.17g} {y:.17g} {z:.17g}\n" for x, y, z in in_file(rig, hand["target"]))
    (folder / "actor.obj").write_text(mesh + "f 1 2 3\n")
    (folder / "rules.toml").write_text("most_things = 1\n")
    (folder / "scar.txt").write_text(" ".join(str(n) for n in rig.source_index[hand["zones"]["scar"]]))
    motion = sample_motion(0, frames=12)
    frames = motion.frames.block(0, 12)
    np.savez(
        folder / "take.npz", frames=frames, faces=rig.triangles, neutral=motion.neutral, units=np.array("mm"), fps=30.0
    )
    return folder, replace(
        QUICK,
        cameras="frontal",
        target="actor.obj",
        sequences=("take.npz",),
        landmarks=replace(QUICK.landmarks, keep_out={"scar.txt": 1.0}),
        expressions=replace(QUICK.expressions, rules="rules.toml"),
    )


def in_file(rig, points):
    """Vertices in the numbering of the artist's file."""
    whole = np.zeros((int(rig.source_index.max()) + 1, 3))
    whole[rig.source_index] = points
    return whole


def test_read_from_files_or_given_in_python_makes_the_same_plan(rig, hand, written):
    folder, settings = written
    read = read_inputs(rig, settings, folder)
    given = PlanInputs(rig, **hand | {"zones": {"scar.txt": hand["zones"]["scar"]}, "takes": read.takes})
    assert np.allclose(read.target, hand["target"], atol=1e-3)
    assert read.rules == hand["rules"]
    assert np.array_equal(read.zones["scar.txt"], hand["zones"]["scar"])
    by_hand = make_plan(PlanInputs(**vars(given) | {"target": read.target}), settings)
    assert make_plan(read, settings) == by_hand


def test_a_plan_says_what_was_given_in_python_and_holds_with_it(rig, hand, tmp_path):
    given = PlanInputs(rig, **hand)
    asked = replace(QUICK, landmarks=replace(QUICK.landmarks, keep_out={"scar": 1.0}))
    plan = make_plan(given, asked)
    assert (plan.settings.cameras, plan.settings.target, plan.settings.expressions.rules) == (IN_PYTHON,) * 3
    assert plan.settings.sequences == (f"{IN_PYTHON}: {hand['takes'].names[0]}",)
    assert plan.layout.motion is not None
    again = read_plan(write_plan(plan, tmp_path / "plan.json"))
    assert [claim.what for claim in check_plan(again, given) if not claim.holds] == []
    with pytest.raises(PlanError, match="cameras given in Python, which no file has"):
        read_inputs(rig, again.settings, tmp_path)
    with pytest.raises(PlanError, match="takes given in Python"):
        read_inputs(rig, Settings(sequences=again.settings.sequences), tmp_path)
    with pytest.raises(PlanError, match="name rules"):
        check_plan(again, rig)


def test_what_is_given_decides(rig, hand):
    """Each input changes where landmarks lie, what is said of them, or the list."""
    asked = replace(QUICK, landmarks=replace(QUICK.landmarks, keep_out={"scar": 1.0}))
    nothing = {"zones": {"scar": np.zeros_like(rig.skin)}}
    alone = make_plan(PlanInputs(rig, **nothing), asked)
    for what, given in hand.items():
        made = make_plan(PlanInputs(rig, **nothing | {what: given}), asked)
        assert (made.layout, made.packing) != (alone.layout, alone.packing), what


@pytest.mark.parametrize(
    "settings",
    [
        Settings(cameras="stage.toml"),
        Settings(target="actor.obj"),
        Settings(sequences=("take.npz",)),
        replace(QUICK, expressions=replace(QUICK.expressions, rules="rules.toml")),
    ],
    ids=["cameras", "target", "sequences", "rules"],
)
def test_settings_that_name_what_was_not_given_are_refused_with_what_to_do(rig, settings):
    with pytest.raises(PlanError, match=r"no such input was given: read_inputs\(rig, settings, folder\)"):
        make_plan(rig, settings)


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        ({"target": np.zeros((3, 3))}, r"the actor's neutral has the shape \(3, 3\), expected \(4939, 3\)"),
        ({"zones": {"scar": np.ones(7, dtype=bool)}}, r"the zone 'scar' has the shape \(7,\), expected \(4939,\)"),
    ],
    ids=["target", "zone"],
)
def test_an_array_of_another_mesh_is_refused_with_both_shapes(rig, wrong, says):
    with pytest.raises(PlanError, match=says):
        PlanInputs(rig, **wrong)


def test_a_preset_of_cameras_needs_no_file(rig):
    (camera,) = inputs_for(rig, Settings(cameras="frontal")).cameras
    (same,) = cameras_for("frontal", rig.neutral, rig.skin)
    assert repr(camera) == repr(same)


def test_takes_are_not_asked_for_where_none_are_needed(rig):
    settings = Settings(sequences=("take.npz",))
    assert inputs_for(rig, settings, takes=False).takes is None
    assert read_inputs(rig, settings, "nowhere", takes=False).takes is None


def test_expressions_are_edited_with_the_rules_that_were_given(rig, hand):
    plan = make_plan(PlanInputs(rig, rules=Rules(most_things=1)), QUICK)
    with pytest.raises(PlanError, match="name rules"):
        edited_plan(plan, rig, plan.packing.edits)
    edited = edited_plan(plan, PlanInputs(rig, rules=Rules(most_things=1)), plan.packing.edits)
    assert plan_of(QUICK).packing.objective < edited.packing.objective


def test_every_name_of_a_file_is_found_and_may_be_changed():
    names = [name for _, name in named_files(EVERY)]
    assert sorted(names) == sorted(
        ["rig.toml", "actor.npy", "a.npz", "b.npz", "w.txt", "rules.toml", "scar.txt", "wet lip"]
    )
    louder = with_files(EVERY, str.upper)
    assert [name for _, name in named_files(louder)] == [name.upper() for name in names]
    assert with_files(louder, str.lower) == EVERY
