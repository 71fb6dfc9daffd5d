"""A plan on the actor's own head, from the command line to the pages: what is shown is the actor's, what is claimed the
rig's."""

import csv
from dataclasses import replace as changed

import numpy as np
import pytest
import trimesh
from msgspec.structs import replace
from PIL import Image

from capture_plan.check.actor_claims import actor_claims
from capture_plan.errors import PlanError
from capture_plan.exports.delivery import Delivery, dots_mm, posed_dots_mm
from capture_plan.exports.tables import write
from capture_plan.plan.carry import actor_words, as_worn, off_surface
from capture_plan.plan.files import inputs_of, read_plan, write_plan
from capture_plan.plan.inputs import PlanInputs
from capture_plan.plan.record import sealed, whose_words
from capture_plan.sample.people import made_up_people
from tests.command import run
from tests.once import QUICK, plan_of


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A plan, and the scan of another person in centimetres, z up, in other triangles; carried from the command line
    into another folder."""
    folder = tmp_path_factory.mktemp("carry")
    plan = plan_of(QUICK)
    write_plan(plan, folder / "plan.json")
    rig = inputs_of(plan, folder / "plan.json").rig
    person = made_up_people(rig, 1)[0].neutral
    skin = rig.triangles[rig.skin[rig.triangles].all(axis=1)]
    x, triangles = trimesh.remesh.subdivide(person, skin)
    mesh = trimesh.Trimesh(np.stack([x[:, 0], -x[:, 2], x[:, 1]], axis=1) / 10, triangles)
    mesh.export(folder / "anna.ply")
    (folder / "out").mkdir()
    where = ("carry", "plan.json", "anna.ply", "-o", "out/anna.json")
    said = run(*where, cwd=folder)
    assert said.returncode == 0, said.stderr
    assert "placed on anna's head, error about" in said.stdout
    return folder


@pytest.fixture(scope="module")
def carried(folder):
    path = folder / "out" / "anna.json"
    plan = read_plan(path)
    return plan, inputs_of(plan, path)


def test_dots_lie_on_the_scan_in_its_own_coordinates(folder, carried):
    plan, inputs = carried
    mesh = trimesh.load_mesh(folder / "anna.ply")
    there = np.array([dot.in_file for dot in plan.actor.dots])
    near = [
        np.linalg.norm(
            trimesh.triangles.closest_point(mesh.triangles, np.repeat(x[None], len(mesh.faces), 0)) - x, axis=1
        )
        for x in there
    ]
    assert max(gaps.min() for gaps in near) < 1e-3
    assert plan.actor.unit_mm == 10
    assert off_surface(plan.actor) == ()
    truth = made_up_people(inputs.rig, 1)[0].neutral[[m.vertex for m in plan.layout.markers]]
    truth = np.stack([truth[:, 0], -truth[:, 2], truth[:, 1]], axis=1)
    assert np.median(np.linalg.norm(10 * there - truth, axis=1)) < 1.5


def test_dots_of_every_pose_begin_where_they_lie_on_the_scan(carried):
    plan, inputs = carried
    posed = posed_dots_mm(plan, inputs)
    np.testing.assert_allclose(posed[0], [dot.position for dot in plan.actor.dots], atol=1e-9)
    assert np.linalg.norm(posed[1:] - posed[0], axis=2).max() > 3


def test_what_was_laid_stands_as_the_rig_stands(carried):
    plan, inputs = carried
    rig, worn = inputs.rig, inputs.worn
    skin = rig.skin
    assert np.ptp(worn[skin], axis=0) == pytest.approx(np.ptp(rig.neutral[skin], axis=0), rel=0.2)
    shown, on_head = as_worn(plan, inputs)
    assert np.array_equal(on_head.neutral, worn)
    assert on_head.names == rig.names
    jaw = rig.names.index("jawOpen")
    moved = rig.displacement[jaw] > 5
    assert np.corrcoef(on_head.deltas[jaw][moved].ravel(), rig.deltas[jaw][moved].ravel())[0, 1] > 0.95
    assert [m.position for m in shown.layout.markers] == [dot.position for dot in plan.actor.dots]
    assert [m.vertex for m in shown.layout.markers] == [m.vertex for m in plan.layout.markers]


def test_the_carried_plan_holds_and_its_lies_are_caught(carried):
    plan, inputs = carried
    assert all(claim.holds for claim in actor_claims(plan, inputs))

    def fails(plan, inputs=inputs):
        return {claim.what for claim in actor_claims(plan, inputs) if not claim.holds}

    actor = plan.actor
    first = actor.dots[0]
    aside = replace(first, position=(first.position[0] + 1, *first.position[1:]))
    assert "dots have the same places in the head's own file" in fails(
        replace(plan, actor=replace(actor, dots=(aside, *actor.dots[1:])))
    )
    off = replace(first, in_file=tuple(np.add(first.in_file, 0.5)))
    assert "dots lie on the surface of the actor's head" in fails(
        replace(plan, actor=replace(actor, dots=(off, *actor.dots[1:])))
    )
    assert "every marker has its dot on the actor's head" in fails(
        replace(plan, actor=replace(actor, dots=actor.dots[1:]))
    )
    other = changed(inputs, worn=inputs.worn + 0.1)
    assert "the neutral laid on the actor's head is unchanged" in fails(plan, other)
    cut = changed(inputs, head=changed(inputs.head, fingerprint="0" * 16))
    assert fails(plan, cut) == {"the scan of the actor's head is unchanged"}


def test_pages_and_tables_speak_of_the_head(carried, tmp_path):
    plan, inputs = carried
    with pytest.raises(PlanError, match="stands on anna's head, which was not given"):
        as_worn(plan, PlanInputs(inputs.rig))
    rows = list(csv.DictReader(write(Delivery(plan, inputs), tmp_path)[0].open()))
    assert dots_mm(plan, inputs)[0].tolist() == list(plan.actor.dots[0].position)
    assert [float(rows[0][key]) for key in ("x_mm", "y_mm", "z_mm")] == list(plan.actor.dots[0].position)
    assert float(rows[0]["x_in_head_file"]) == plan.actor.dots[0].in_file[0]
    assert "an estimate: no points" in actor_words(plan.actor)


def test_the_picture_shows_the_scan_with_its_dots(folder):
    picture = np.asarray(Image.open(folder / "out" / "anna.png").convert("RGB")).astype(int)
    assert picture.shape[1] > 2000
    saturated = (picture.max(axis=2) - picture.min(axis=2) > 90).mean()
    assert 0.002 < saturated < 0.2  # dots and net
    assert (np.abs(picture - 255).max(axis=2) > 10).mean() > 0.2  # heads


def test_a_carried_plan_can_be_made_of_and_one_with_a_lie_not(folder, carried):
    path = folder / "out" / "anna.json"
    said = run("export", path, "--only", "csv", "-o", "tables", cwd=folder)
    assert said.returncode == 0, said.stderr
    lie = sealed(replace(carried[0], actor=replace(carried[0].actor, laid_fingerprint="0" * 16)))
    write_plan(lie, folder / "out" / "lie.json")
    said = run("export", "out/lie.json", "--only", "csv", "-o", "no", cwd=folder)
    assert said.returncode == 1
    assert "the neutral laid on the actor's head is unchanged" in said.stderr


def test_what_is_no_head_is_refused_in_one_line_and_nothing_is_written(folder):
    trimesh.creation.icosphere(4, 120).export(folder / "ball.stl")
    said = run("carry", "plan.json", "ball.stl", "-o", "out/ball.json", cwd=folder)
    assert said.returncode == 2
    assert "not sure where the face is" in said.stderr
    assert not list((folder / "out").glob("ball*"))


def test_a_folder_that_shows_one_head_is_not_given_another(folder, carried):
    """Nor that of another scan of the same name; the rig's own is another head, too."""
    plan, _ = carried
    assert run("export", "out/anna.json", "-o", "shown", "--only", "csv", cwd=folder).returncode == 0
    rescanned = replace(plan, actor=replace(plan.actor, fingerprint="0123456789abcdef"))
    assert whose_words(rescanned) != whose_words(plan)
    done = run("export", "plan.json", "-o", "shown", "--only", "csv", cwd=folder)
    assert done.returncode == 2
    assert "on anna's head (scan " in done.stderr
    assert "choose another place with -o" in done.stderr
