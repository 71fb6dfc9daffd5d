"""A plan with any one value changed is refused or fails its check, with the seal broken or made anew."""

import json
from dataclasses import replace as dataclass_replace

import numpy as np
import pytest
from msgspec.structs import replace

from capture_plan.layout.follow import SINGLE_COVER, decided_in
from capture_plan.plan import again, check
from capture_plan.plan.files import read_plan, write_plan
from capture_plan.plan.landmark_claims import head_claims
from capture_plan.plan.record import sealed
from capture_plan.plan.refuted_claims import studio_claims
from capture_plan.rig import sample_rig
from tests.lies import LIES
from tests.tampering import FREE, KINDS, answers_kept, is_free, outcomes, verdict

CHANGES = 120  # of each plan; all kinds of its fields have a turn or nearly


@pytest.fixture(scope="module", autouse=True)
def asked_once():
    with answers_kept():
        yield


@pytest.mark.parametrize("name", KINDS)
def test_no_changed_value_goes_unnoticed(made, name):
    found = outcomes(made[name], CHANGES, 1, resealed=False)
    assert sorted(kind for said, kind in found if said == "uncaught") == []
    assert sum(times for (said, _), times in found.items() if said == "caught") > CHANGES / 4


@pytest.mark.parametrize("name", KINDS)
def test_a_forger_who_seals_anew_is_found_out_but_for_a_short_list(made, name):
    found = outcomes(made[name], CHANGES, 2, resealed=True)
    assert sorted(kind for said, kind in found if said == "uncaught" and not is_free(kind)) == []
    assert len(FREE) < 10


@pytest.mark.parametrize("name", KINDS)
def test_a_plan_that_nobody_changed_holds(made, name):
    plan, document = read_plan(made[name]), json.loads(made[name].read_bytes())
    assert verdict(document, plan, made[name], resealed=False) == "same"
    document["seal"] = ""
    assert verdict(document, plan, made[name], resealed=True) == "uncaught"


@pytest.mark.parametrize(("name", "lie"), [one[:2] for one in LIES], ids=[one[1].__name__ for one in LIES])
def test_lies_that_agree_with_themselves_are_found_out(made, name, lie):
    document = json.loads(made[name].read_bytes())
    lie(document)
    assert verdict(document, read_plan(made[name]), made[name], resealed=True) in ("caught", "refused")


def single_cover_at(vertices):
    def forge(plan):
        others = plan.layout.references
        one = replace(others[SINGLE_COVER], vertices=vertices(plan.layout))
        return replace(plan, layout=replace(plan.layout, references={**others, SINGLE_COVER: one}))

    return forge


def order_turned(plan):
    return replace(plan, layout=replace(plan.layout, order=plan.layout.order[::-1]))


def program_of_all(plan):
    layout = plan.layout
    every = replace(
        layout.programs[0], vertices=tuple(m.vertex for m in layout.landmarks), bound=float(len(layout.landmarks))
    )
    return replace(plan, layout=replace(layout, programs=(every,)))


def one_expression_more(plan):
    """A list that is longer than it need be, by two blendshapes that have an expression of their own."""
    packing, paired = plan.packing, {name for pair in plan.packing.pairs for name in pair}
    long = next(one for one in packing.expressions if len(one.blendshapes) > 3)
    moved = tuple(name for name in long.blendshapes if name not in paired)[:1] or long.blendshapes[:2]
    rest = tuple(name for name in long.blendshapes if name not in moved)
    lists = [replace(one, blendshapes=rest) if one is long else one for one in packing.expressions]
    longer = (*lists, replace(long, blendshapes=moved))
    return replace(plan, packing=replace(packing, expressions=longer, solver_bound=len(longer)))


def broken_by(path, decide):
    """What does not hold of a plan in which all else follows from other decisions, by the code that writes plans."""
    plan, rig = read_plan(path), sample_rig()
    report = check.audit(rig)
    task = check.task_of(check.see_face(rig, report.used, ()), plan.settings.landmarks)
    forged = sealed(again.made_again(decide(plan), report, task, None))
    return [one.what for one in check.claims_of(forged, rig, path.parent) if not one.holds]


def expressions_turned(plan):
    return replace(plan, packing=replace(plan.packing, expressions=plan.packing.expressions[::-1]))


@pytest.mark.parametrize(
    ("decide", "named"),
    [
        (single_cover_at(lambda layout: layout.references[SINGLE_COVER].vertices[:1]), "single set cover sees every"),
        (single_cover_at(lambda layout: tuple(m.vertex for m in layout.landmarks)), "no more landmarks than any cover"),
        (order_turned, "missed least"),
        (program_of_all, "can be left out"),
        (one_expression_more, "a clique"),
        (expressions_turned, "no other order of the expressions"),
    ],
    ids=["no cover", "a large cover", "order turned", "a large program", "a long list", "list turned"],
)
def test_decisions_that_a_second_look_refutes_are_lies_although_all_else_follows_from_them(made, decide, named):
    broken = broken_by(made["default"], decide)
    assert all(any(word in what for word in (named, "no other order of the expressions")) for what in broken), broken
    assert any(named in what for what in broken), broken


def test_writing_a_plan_seals_it(made, tmp_path):
    plan = read_plan(made["default"])
    assert read_plan(write_plan(plan, tmp_path / "again.json")) == plan


def bare(plan):
    return replace(plan, layout=replace(plan.layout, order=plan.layout.order[: len(plan.layout.order) // 2]))


def all_alone(plan):
    """Every blendshape in an expression of its own, and the solver's word that fewer are needed."""
    first, *_ = plan.packing.expressions
    names = [name for one in plan.packing.expressions for name in one.blendshapes]
    alone = tuple(replace(first, blendshapes=(name,), weights=(1.0,)) for name in names)
    return replace(plan, packing=replace(plan.packing, expressions=alone))


@pytest.mark.parametrize(
    ("decide", "named"), [(bare, "is not worth its while"), (all_alone, "(a clique)")], ids=["bare", "alone"]
)
def test_what_the_default_promises_is_asked_of_it(made, decide, named):
    assert any(named in what for what in broken_by(made["default"], decide))


def test_a_default_with_landmarks_to_spare_is_none(made):
    plan, rig = read_plan(made["default"]), sample_rig()
    task = check.task_of(check.see_face(rig, plan.audit.used, ()), plan.settings.landmarks)
    chosen = decided_in(plan.layout, task)
    assert all(one.holds for one in studio_claims(plan, task, chosen))
    free = np.setdiff1d(task.open_, chosen.further)[::40]
    padded = dataclass_replace(chosen, further=np.concatenate([chosen.further, free]))
    assert not studio_claims(plan, task, padded)[0].holds


def test_head_markers_that_move_are_none(made):
    plan, rig = read_plan(made["cameras"]), sample_rig()
    face = check.see_face(rig, plan.audit.used, ())
    task = check.task_of(face, replace(plan.settings.landmarks, min_views=0))
    moving = np.argsort(-face.displacement.max(axis=0))[: len(plan.layout.head)].tolist()
    head = tuple(replace(m, vertex=v) for m, v in zip(plan.layout.head, moving, strict=True))
    assert head
    assert not head_claims(replace(plan, layout=replace(plan.layout, head=head)), task)[0].holds
