"""A plan with any one value changed is refused or fails its check, with the seal broken or made anew."""

import json
import math
from dataclasses import replace as dataclass_replace

import numpy as np
import pytest
from msgspec.structs import replace

from capture_plan.check import again, check
from capture_plan.check.landmark_claims import head_claims
from capture_plan.check.list_claims import list_claims
from capture_plan.check.motion_claims import order_claim
from capture_plan.check.promise_claims import NO_COVER, NO_ROUND, studio_claims
from capture_plan.check.refuted_claims import several_claim, single_cover_claim
from capture_plan.check.unchecked import unchecked
from capture_plan.errors import PlanError
from capture_plan.exports import verify_plan
from capture_plan.expressions import PackingSettings, early
from capture_plan.expressions.pack import pack
from capture_plan.layout.assembly import SINGLE_COVER, Solved, decided_in, single_cover_settings
from capture_plan.layout.head_sites import head_candidates
from capture_plan.layout.second_look import Room, ranked
from capture_plan.plan.claims import claim
from capture_plan.plan.files import read_plan, write_plan
from capture_plan.plan.inputs import PlanInputs, read_inputs
from capture_plan.plan.record import sealed
from capture_plan.plan.revise import other_plan
from capture_plan.sample import sample_rig
from tests.lies import LIES
from tests.tampering import FREE, KINDS, answers_kept, is_free, outcomes, verdict

NAMES = ("browInnerUp", "browDownLeft", "eyeBlinkLeft", "jawOpen", "mouthSmileLeft", "mouthPucker", "cheekPuff")
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
    given, report = read_inputs(rig, plan.settings, path.parent), check.audit_rig(rig)
    task = check.task_of(
        check.see_face(rig, report.used, given.cameras),
        plan.settings.landmarks,
    )
    if plan.layout.head:
        task = task.with_head_markers(np.array([m.vertex for m in plan.layout.head]))
    decided = decide(plan)
    layout = check.follow(task, check.decided_in(decided.layout, task), None)
    forged = sealed(again.made_again(decided, report, layout, again.stated_list(decided, given)))
    return [one.what for one in check.claims_of(forged, given) if not one.holds]


def expressions_turned(plan):
    return replace(plan, packing=replace(plan.packing, expressions=plan.packing.expressions[::-1]))


@pytest.mark.parametrize(
    ("decide", "named"),
    [
        (single_cover_at(lambda layout: layout.references[SINGLE_COVER].vertices[:1]), "single set cover sees every"),
        (single_cover_at(lambda layout: tuple(m.vertex for m in layout.landmarks)), "no more landmarks than any cover"),
        (order_turned, "missed least"),
        (program_of_all, "makes a program cheaper"),
        (one_expression_more, "a clique"),
        (expressions_turned, "no other order of the expressions"),
    ],
    ids=["no cover", "a large cover", "order turned", "a large program", "a long list", "list turned"],
)
def test_decisions_that_a_second_look_refutes_are_lies_although_all_else_follows_from_them(made, decide, named):
    broken = broken_by(made["default"], decide)
    list_too = ("no other order of the expressions", "no exchange between two expressions")
    assert all(any(word in what for word in (named, *list_too)) for what in broken), broken
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


def without_rounds(plan):
    """The first round alone, its landmarks alone."""
    first = plan.layout.programs[0]
    landmarks = tuple(m for m in plan.layout.landmarks if m.vertex in first.vertices)
    return replace(plan, layout=replace(plan.layout, programs=(first,), landmarks=landmarks))


def without_program(plan):
    return replace(plan, layout=replace(plan.layout, programs=()))


def cut_short(plan):
    """A budget of which a part is not spent."""
    return replace(plan, layout=replace(plan.layout, order=plan.layout.order[:-2]))


def weak_prices(plan):
    layout = plan.layout
    half = tuple(weight / 2 for weight in layout.certificate.weights)
    weaker = replace(layout.certificate, weights=half, landmarks=math.ceil(sum(half) - 1e-9))
    return replace(plan, layout=replace(layout, certificate=weaker))


def heads_close_together(plan):
    """All head markers in one place, but for the spacing: nothing fixes how the head turns."""
    rig, head = sample_rig(), plan.layout.head
    face = check.see_face(rig, plan.audit.used, read_inputs(rig, plan.settings).cameras)
    x, still = rig.neutral, head_candidates(face, face.cameras).vertices
    near = still[np.argsort(np.linalg.norm(x[still] - x[still[0]], axis=1))][: len(head)].tolist()
    moved = tuple(replace(m, vertex=v) for m, v in zip(head, near, strict=True))
    return replace(plan, layout=replace(plan.layout, head=moved))


def half_clique(plan):
    return replace(plan, packing=replace(plan.packing, clique=plan.packing.clique[::2]))


@pytest.mark.parametrize(
    ("name", "decide", "named"),
    [
        ("budget", without_program, NO_COVER),
        ("budget", cut_short, "the budget is spent"),
        ("budget", weak_prices, "none can be raised alone"),
        ("cameras", without_rounds, NO_ROUND),
        ("cameras", heads_close_together, "around the face"),
        ("default", half_clique, "a clique"),
    ],
)
def test_what_a_method_owes_is_missed_where_it_is_left_out(made, name, decide, named):
    assert any(named in what for what in broken_by(made[name], decide))


@pytest.mark.parametrize("method", ["trivial", "distance"])
def test_several_places_are_promised_of_each_blendshape(made, method):
    plan, rig = read_plan(made["budget"]), sample_rig()
    asked = replace(plan.settings.landmarks, method=method, budget=None, rounds=3)
    task = check.task_of(check.see_face(rig, plan.audit.used, ()), asked)
    once = Solved(decided_in(plan.layout, task).programs[0].sites, 0.0)
    alone = dataclass_replace(decided_in(plan.layout, task), method=method, programs=(once,))
    assert not several_claim(task, alone).holds
    every = dataclass_replace(alone, programs=(Solved(task.open_, 0.0),))
    assert several_claim(task, every).holds


def test_a_budget_that_no_cover_is_proved_to_fit_says_so_or_is_counted_as_unchecked(made):
    plan = without_program(read_plan(made["budget"]))
    assert sum("can see every blendshape" in line for line in unchecked(plan, ())) == 1
    assert not any("can see every blendshape" in line for line in unchecked(plan, [claim(NO_COVER, True, "")]))


def test_a_single_cover_at_worse_places_is_none(made):
    plan, rig = read_plan(made["budget"]), sample_rig()
    task = check.task_of(check.see_face(rig, plan.audit.used, ()), plan.settings.landmarks)
    plain = single_cover_settings(task.settings)
    sites = task.face.sites(plain)
    covers = sites.covers(plain.epsilon)[:, np.arange(len(sites.size))]
    said = plan.layout.references[SINGLE_COVER]
    at = np.flatnonzero(np.isin(sites.vertices, said.vertices).all(axis=1))
    room = Room(covers[covers.any(axis=1)], np.ones(len(sites.size), dtype=bool), None)
    rest, subset = next(
        (rest, same) for rest, found in room.exchanges(at) if len(same := found[sites.size[found] == 2]) > 5
    )
    worst = subset[ranked(sites, plain, np.flatnonzero(covers.any(axis=1)))[subset].argmax()]
    vertices = tuple(sorted(sites.members(np.append(rest, worst)).tolist()))
    layout, others = plan.layout, plan.layout.references
    forged = replace(layout, references={**others, SINGLE_COVER: replace(said, vertices=vertices)})
    assert single_cover_claim(plan, task).holds
    assert "an exchange makes it cheaper" in single_cover_claim(replace(plan, layout=forged), task).found


@pytest.mark.parametrize("method", ["sequential", "minimum", "greedy"])
def test_an_order_that_an_exchange_refutes_is_not_proved(rig, method):
    used, settings = NAMES, PackingSettings(method=method)
    made = pack(rig, used, settings)
    problem, proved = again.state_problem(rig, used, settings, None, ()), replace(made, order_proven=True)
    chosen = [tuple(sorted(used.index(name) for name in one.blendshapes)) for one in made.expressions]
    given, turned = (again.Stated(rig, settings, problem, None, shots) for shots in (chosen, chosen[::-1]))
    assert again.order_stands(given, proved) == (method != "greedy") == made.order_proven
    assert not again.order_stands(turned, proved)
    assert not again.order_stands(given, replace(proved, unmoved=3))


def lists_of(path):
    """A plan, and its list as the problem has it."""
    plan = read_plan(path)
    return plan, again.stated_list(plan, PlanInputs(sample_rig()), apart=plan.packing.colliding)


def test_an_early_list_that_was_shaken_is_none_of_the_search(made):
    plan, given = lists_of(made["default"])
    model = given.model
    parts = given.problem.items_of(given.chosen)
    assert [one.holds for one in list_claims(plan, given)] == [True]
    shaken = [model.ordered(early.shaken(model, parts, np.random.default_rng(seed))) for seed in range(6)]
    assert all(early.can_be_lowered(model, one) for one in shaken)


def test_an_early_list_is_none_of_the_greedy_method(made):
    plan, given = lists_of(made["default"])
    settings = replace(plan.settings.expressions, method="greedy")
    called = replace(plan, settings=replace(plan.settings, expressions=settings))
    assert [one.holds for one in list_claims(called, given)] == [False]
    greedy = pack(given.rig, plan.audit.used, settings, apart=plan.packing.colliding)
    made_so = replace(called, packing=greedy)
    (claim,) = list_claims(made_so, again.stated_list(made_so, PlanInputs(given.rig), apart=greedy.colliding))
    assert claim.holds


def test_an_order_that_is_not_that_of_the_take_is_found_out(made):
    path, rig = made["motion of two people"], sample_rig()
    plan = read_plan(path)
    task = check.task_of(check.see_face(rig, plan.audit.used, ()), plan.settings.landmarks)
    takes = read_inputs(rig, plan.settings, path.parent).takes
    chosen = decided_in(plan.layout, task).further
    assert order_claim(task, takes, chosen).holds
    assert not order_claim(task, takes, chosen[::-1]).holds


def test_of_a_list_that_a_person_asked_for_nothing_is_claimed_but_that_nobody_checked_it(made):
    plan, rig = read_plan(made["default"]), sample_rig()
    other = other_plan(plan, rig)
    claims = check.check_plan(other, rig)
    assert all(one.holds for one in claims)
    assert any("whether a person changed the list" in line for line in unchecked(other, claims))


@pytest.mark.parametrize("sign", ["\x1b[2J", "\n", "\x9b1m", "\u202e", "\u2028", "\x7f"])
@pytest.mark.parametrize("place", [("versions", "numpy"), ("rig", "name"), ("audit", "note")])
def test_no_text_of_a_plan_steers_a_screen(made, tmp_path, sign, place):
    document = json.loads(made["default"].read_bytes())
    document[place[0]][place[1]] += sign
    (tmp_path / "plan.json").write_text(json.dumps(document))
    with pytest.raises(PlanError, match="control character in " + ".".join(place)) as refused:
        read_plan(tmp_path / "plan.json")
    assert str(refused.value).isprintable()


@pytest.mark.parametrize("number", ["", "two", "1.0 </script>", "1" * 60])
def test_a_version_is_one(made, number):
    plan = read_plan(made["default"])
    with pytest.raises(PlanError, match="is no version"):
        check.check_structure(replace(plan, versions=plan.versions | {"numpy": number}), sample_rig())


def test_a_key_that_stands_twice_is_refused_here_and_by_the_verifier(made, tmp_path):
    text = made["default"].read_text()
    twice = text.replace('"region": "', '"region": "chin", "region": "', 1)
    assert twice != text
    (tmp_path / "plan.json").write_text(twice)
    with pytest.raises(PlanError, match="'region' stands twice"):
        read_plan(tmp_path / "plan.json")
    with pytest.raises(SystemExit, match="stands twice"):
        json.loads(twice, object_pairs_hook=verify_plan.each_name_once)
