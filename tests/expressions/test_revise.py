"""An artist's edits, lists that are as good, and what curves say."""

import re
from collections import Counter

import numpy as np
import pytest
from msgspec.structs import replace as change

from capture_plan.errors import InfeasibleError, RigError
from capture_plan.evaluation.carrigan2020.mu_sweep import importance_ablation, mu_sweep
from capture_plan.expressions import PackingSettings, packing_faults
from capture_plan.expressions.active_sets import active_sets, vertex_roles
from capture_plan.expressions.pack import pack
from capture_plan.expressions.revise import another, repack
from capture_plan.expressions.settings import Edits
from capture_plan.plan.revise import renumbered_words


@pytest.fixture(scope="module")
def used(rig):
    return tuple(name for name, moved in zip(rig.names, rig.displacement @ rig.skin, strict=True) if moved > 1)


@pytest.fixture(scope="module")
def packing(rig, used):
    return pack(rig, used, PackingSettings())


def place_of(packing):
    return {name: e.name for e in packing.expressions for name in e.blendshapes}


def moved(a, b):
    return {name for name in place_of(a) if place_of(b).get(name) != place_of(a)[name]}


EDITS = [
    Edits(locked={"jawOpen": 4}),
    Edits(locked={"jawOpen": 2, "browInnerUp": 2, "noseSneerLeft": 5}),
    Edits(locked={"jawOpen": ("browInnerUp",)}),
    Edits(together=(("browDownLeft", "jawOpen"),)),
    Edits(apart=(("eyeBlinkLeft", "eyeBlinkRight"),)),
    Edits(dropped=("mouthPucker", "jawRight")),
]


@pytest.mark.parametrize("edits", EDITS)
@pytest.mark.parametrize("method", ["minimum", "sequential", "greedy", "former"])
def test_edits_are_followed(rig, used, packing, edits, method):
    settings = PackingSettings()
    if method == "former":
        edited = repack(rig, used, settings, packing, edits)
    else:
        edited = pack(rig, used, change(settings, method=method, edits=edits))
    place = place_of(edited)
    assert all(place[name] == f"E{number:02d}" for name, number in edits.numbers.items())
    assert all(len({place[name] for name in group}) == 1 for group in edits.companions)
    assert all(place[a] != place[b] for a, b in edits.apart)
    assert set(place) == set(used) - set(edits.dropped)
    assert packing_faults(rig, used, edited, 0.3) == ()


@pytest.mark.parametrize("method", ["minimum", "former"])
def test_what_is_kept_apart_is_not_held_for_a_corrective_either(rig, used, packing, method):
    edits = Edits(apart=(("jawOpen", "noseSneerLeft"), ("jawOpen", "eyeBlinkLeft")))
    settings = PackingSettings(method="minimum", edits=edits)
    edited = repack(rig, used, settings, packing, edits) if method == "former" else pack(rig, used, settings)
    for a, b in edits.apart:
        assert not any({a, b} <= {*e.blendshapes, *e.drivers} for e in edited.expressions)
    assert ("mouthClose", "jawOpen") in edited.drivers
    assert packing_faults(rig, used, edited, 0.3) == ()


def test_without_an_edit_nothing_changes(rig, used, packing):
    again = repack(rig, used, PackingSettings(), packing, Edits())
    assert place_of(again) == place_of(packing)
    assert again.unmoved is None
    assert again.order_proven


def test_an_edited_list_is_as_short_as_any_that_follows_the_edits(rig, used, packing):
    for edits in EDITS:
        fresh = pack(rig, used, PackingSettings(method="minimum", edits=edits))
        edited = repack(rig, used, PackingSettings(), packing, edits)
        assert edited.objective == edited.solver_bound == fresh.objective
        assert (edited.unmoved or 0) >= len(used) - len(moved(packing, fresh))


def test_keeping_two_apart_moves_only_one_of_them_and_its_partner(rig, used, packing):
    pair = packing.expressions[0].blendshapes[0], packing.expressions[0].blendshapes[-1]
    edited = repack(rig, used, PackingSettings(), packing, Edits(apart=(pair,)))
    family = {name for p in packing.pairs for name in p if set(p) & set(pair)} | set(pair)
    assert 0 < len(moved(packing, edited)) <= 2
    assert moved(packing, edited) <= family


@pytest.mark.parametrize(
    ("edits", "fault"),
    [
        (
            Edits(together=(("jawOpen", "mouthPucker"),)),
            r"'jawOpen' and 'mouthPucker' share [\d,]+ vertices and are asked",
        ),
        (Edits(together=(("eyeBlinkLeft", "eyeLookUpLeft"),)), "and are asked to be together"),
        (Edits(locked={"jawOpen": 90}), "'jawOpen' is locked to E90, the list ends with"),
        (Edits(locked={"nobody": 1}), "'nobody', which is no blendshape in use: see what the audit lists"),
        (Edits(locked={"jawOpn": 1}), "'jawOpn', which is no blendshape in use; did you mean 'jawOpen'?"),
        (Edits(dropped=("jawOpen",), locked={"jawOpen": 1}), "'jawOpen' is dropped and another edit"),
        (Edits(apart=(("mouthClose", "jawOpen"),)), "'mouthClose' is performed on 'jawOpen', and"),
        (Edits(together=(("jawOpen", "browInnerUp"),), apart=(("jawOpen", "browInnerUp"),)), "asked to be apart"),
        (
            Edits(locked={"jawOpen": 1, "browInnerUp": 2}, together=(("jawOpen", "browInnerUp"),)),
            "locked to E02 and E01",
        ),
    ],
)
def test_an_impossible_edit_is_named(rig, used, packing, edits, fault):
    with pytest.raises(InfeasibleError, match=fault):
        repack(rig, used, PackingSettings(), packing, edits)
    with pytest.raises(InfeasibleError, match=fault):
        pack(rig, used, PackingSettings(edits=edits))


def test_expressions_that_have_other_numbers_are_named(rig, used, packing):
    """Where one falls away, those behind it move up; where two change places, both are named; else nothing is."""
    first, *others = packing.expressions
    last = len(packing.expressions)
    cut = change(packing, expressions=tuple(others))
    swapped = change(packing, expressions=(others[0], first, *others[1:]))
    assert renumbered_words(packing, packing) == ()
    assert renumbered_words(packing, cut) == (
        f"E02 to E{last:02d} are E01 to E{last - 1:02d} now: print the pages again.",
    )
    assert renumbered_words(packing, swapped) == ("E01 is E02, E02 is E01 now: print the pages again.",)


def test_dropping_everything_is_refused(rig):
    with pytest.raises(InfeasibleError, match="every blendshape is dropped"):
        pack(rig, ("jawOpen",), PackingSettings(edits=Edits(dropped=("jawOpen",))))


def test_an_edit_that_is_not_followed_is_found_out(rig, used, packing):
    for edits in EDITS[:3]:
        forged = change(packing, edits=edits)
        faults = packing_faults(rig, used, forged, 0.3)
        assert any("an edit" in line for line in faults), faults
    faults = packing_faults(rig, used, change(packing, edits=EDITS[-1]), 0.3)
    assert any(re.search("is listed 1 times, expected 0", line) for line in faults)


def test_other_lists_are_as_short_nearly_as_good_and_all_different(rig, used, packing):
    lists = [packing]
    for _ in range(3):
        lists.append(another(rig, used, PackingSettings(), lists))
    groupings = {frozenset(e.blendshapes for e in one.expressions) for one in lists}
    assert len(groupings) == 4
    information = [np.mean([e.covered for e in one.expressions]) for one in lists]
    assert min(information) >= 0.99 * information[0] - 1e-3
    for one in lists:
        assert one.objective == packing.objective
        assert packing_faults(rig, used, one, 0.3) == ()


def test_where_there_is_no_other_list_it_is_said(rig):
    some = ("jawOpen", "jawLeft")
    with pytest.raises(InfeasibleError, match="no other list of 2 expressions"):
        another(rig, some, PackingSettings(), [pack(rig, some, PackingSettings())])


def test_a_row_of_the_sweep_is_what_packing_gives(rig, used, packing):
    rows = mu_sweep(rig, used, PackingSettings(limit=3), (0.3, 0.5))
    assert [row.mu for row in rows] == [0.3, 0.5]
    assert (rows[0].minimum, rows[0].bound) == (packing.objective, packing.solver_bound)
    assert all(row.bound <= row.minimum <= min(row.sequential, row.greedy) for row in rows)


def test_importance_brings_strength_forward_and_its_absence_brings_blendshapes(rig, used):
    rows = {row.terms: row for row in importance_ablation(rig, used, PackingSettings(method="sequential"))}
    assert set(rows) == {"none", "displacement", "uniqueness", "expected error"}
    assert rows["displacement"].strength[0] >= rows["none"].strength[0]
    assert rows["none"].shown[0] >= rows["displacement"].shown[0]
    assert all(row.shown[-1] == len(used) and row.strength[-1] == pytest.approx(1, abs=1e-5) for row in rows.values())
    with_target = importance_ablation(rig, used, PackingSettings(), target=rig.neutral * [0.6, 1, 1])
    assert {row.terms for row in with_target} > {"distortion", "all"}


def test_roles_are_those_that_the_packing_sees(rig, used):
    roles = vertex_roles(rig, used, PackingSettings(mu=0.4), "jawOpen")
    assert Counter(roles.tolist()).keys() == {0, 1, 2}
    assert ((roles == 2) == active_sets(rig, ("jawOpen",), 0.4)[0]).all()
    with pytest.raises(RigError, match="'nobody' is no blendshape in use"):
        vertex_roles(rig, used, PackingSettings(), "nobody")
