"""What an actor can do at once: rule files, and what they do to a list."""

import re
from dataclasses import replace

import numpy as np
import pytest
from msgspec.structs import replace as change

from capture_plan.errors import InfeasibleError, RigError
from capture_plan.expressions import PackingSettings, packing_faults
from capture_plan.expressions.compatibility import driven, groups, hard_together, never_together
from capture_plan.expressions.explain import why_apart
from capture_plan.expressions.pack import pack
from capture_plan.expressions.rules import Hard, Rules, default_rules, read_rules
from capture_plan.expressions.settings import Edits

FREE = Rules()
SHORTEST = PackingSettings(method="minimum")  # rules are about which lists there may be, not which is best


@pytest.fixture(scope="module")
def used(rig):
    return tuple(name for name, moved in zip(rig.names, rig.displacement @ rig.skin, strict=True) if moved > 1)


def place_of(packing):
    return {name: e.name for e in packing.expressions for name in e.blendshapes}


def movements(packing, expression):
    return len(groups(expression.blendshapes, list(packing.pairs)))


def test_our_rules_are_about_names_that_exist_and_read_back_from_a_file(rig, used, tmp_path):
    ours = default_rules()
    assert pack(rig, used, SHORTEST, rules=ours) == pack(rig, used, SHORTEST)
    mine = tmp_path / "mine.toml"
    mine.write_text('most_things = 2\n[any_side]\nbrowInnerUp = ["jawOpen"]\n', encoding="utf-8")
    assert read_rules(mine) == Rules(any_side={"browInnerUp": ("jawOpen",)}, most_things=2)
    settings = PackingSettings(rules=str(mine))
    packing = pack(rig, used, settings)
    assert packing.most_things == 2
    assert packing.exclusive == (
        ("browInnerUp", "jawOpen"),
        ("browInnerUp", "mouthClose"),  # lips closed over a jaw
        ("eyeLookOutLeft", "eyeLookOutRight"),  # nobody's rules allow both eyes to turn outwards
    )
    assert packing_faults(rig, used, packing, settings.mu, read_rules(mine)) == ()
    assert packing_faults(rig, used, packing, settings.mu) != ()


def test_rules_are_read_both_ways_and_on_the_side_that_they_say(rig, used):
    never = never_together(rig, used, Rules(same_side={"eyeWide": ("browDown",)}))
    assert set(never) == {("browDownLeft", "eyeWideLeft"), ("browDownRight", "eyeWideRight")}
    assert len(never_together(rig, used, Rules(any_side={"eyeWide": ("browDown",)}))) == 4
    assert len(never_together(rig, used, Rules(any_side={"eyeWideLeft": ("browDown",)}))) == 2


def test_what_a_corrective_needs_excludes_what_excludes_it(rig, used):
    never = never_together(
        rig, used, Rules(any_side={"jawOpen": ("browInnerUp",)}, requires={"mouthClose": ("jawOpen",)})
    )
    assert set(never) == {("browInnerUp", "jawOpen"), ("browInnerUp", "mouthClose")}


def test_a_sound_that_opens_the_jaw_too_is_not_needed_besides_the_jaw(rig, used):
    deltas, k = rig.deltas.copy(), rig.names.index("mouthShrugUpper")
    deltas[k] = 0.4 * rig.deltas[rig.names.index("jawOpen")]
    names = tuple("viseme_aa" if name == "mouthShrugUpper" else name for name in rig.names)
    planned = tuple("viseme_aa" if name == "mouthShrugUpper" else name for name in used)
    sounding = replace(rig, names=names, deltas=deltas)
    assert [pair for pair in driven(sounding, planned) if pair[0] == "mouthClose"] == [("mouthClose", "jawOpen")]
    silent = tuple(name for name in planned if name != "jawOpen")
    assert ("mouthClose", "viseme_aa") in driven(sounding, silent)


def test_requirements_come_from_rules_as_well_as_from_geometry(rig, used):
    assert ("noseSneerLeft", "browDownLeft") in driven(rig, used, Rules(requires={"noseSneerLeft": ("browDownLeft",)}))
    rules = Rules(requires={"mouthSmile": ("cheekPuff",)})
    packing = pack(rig, used, SHORTEST, rules=rules)
    shot = next(e for e in packing.expressions if "mouthSmileLeft" in e.blendshapes)
    assert "cheekPuff" in shot.drivers
    assert "cheekPuff" not in shot.blendshapes
    assert packing_faults(rig, used, packing, 0.3, rules) == ()


def test_rules_know_a_rigs_own_names_and_pass_over_what_it_lacks(rig, used):
    own = replace(rig, names=tuple(f"shape{k}" for k in range(len(rig.names))))
    rules = Rules(any_side={"shape0": ("shape30",), "tongueOut": ("eyeBlink",)})
    assert never_together(own, own.names, rules) == (("shape0", "shape30"),)
    with pytest.raises(RigError, match=r"a rule names 'shape0', which is neither"):
        pack(rig, used, SHORTEST, rules=rules)


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("most_things = 0", "not a rule file"),
        ("most = 3", "not a rule file"),
        ('[[hard]]\nnames = ["jawOpen", "eyeWide"]\ncost = 9', "not a rule file"),
        ("= nonsense", "is not TOML"),
    ],
)
def test_a_rule_file_that_makes_no_sense_is_refused(tmp_path, text, fault):
    path = tmp_path / "rules.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(RigError, match=fault):
        read_rules(path)
    with pytest.raises(RigError, match="does not exist"):
        read_rules(tmp_path / "missing.toml")


@pytest.mark.parametrize("method", ["minimum", "sequential", "greedy"])
@pytest.mark.parametrize("most", [1, 2, 3])
def test_no_expression_asks_for_more_than_is_allowed(rig, used, method, most):
    packing = pack(rig, used, PackingSettings(method=method, most_things=most))
    assert max(movements(packing, e) for e in packing.expressions) <= most
    assert packing_faults(rig, used, packing, 0.3) == ()


def test_one_movement_at_a_time_is_one_expression_for_each(rig, used):
    packing = pack(rig, used, PackingSettings(method="minimum", most_things=1), rules=FREE)
    assert packing.objective == packing.bound == packing.things == len(used) - len(packing.pairs)
    assert packing.bound_from == "count"


def test_more_rules_never_make_a_list_shorter(rig, used):
    numbers = [pack(rig, used, SHORTEST, rules=rules).objective for rules in (FREE, default_rules())]
    numbers.append(pack(rig, used, PackingSettings(method="minimum", most_things=2)).objective)
    numbers.append(
        pack(
            rig, used, PackingSettings(method="minimum", most_things=2), apart=(("browInnerUp", "mouthSmileLeft"),)
        ).objective
    )
    assert numbers == sorted(numbers)


def test_what_is_hard_is_avoided_where_it_costs_no_expression(rig, used):
    plain = pack(rig, used, SHORTEST, rules=FREE)
    first, last = plain.expressions[0].blendshapes[0], plain.expressions[0].blendshapes[-1]
    rules = Rules(hard=(Hard((first, last), 3),))
    assert hard_together(rig, used, rules)
    eased = pack(rig, used, SHORTEST, rules=rules)
    assert eased.objective == plain.objective
    assert place_of(eased)[first] != place_of(eased)[last]
    assert eased.hard == ()
    assert packing_faults(rig, used, eased, 0.3, rules) == ()


def test_what_collides_is_kept_apart(rig, used):
    plain = pack(rig, used, SHORTEST)
    pair = (plain.expressions[0].blendshapes[0], plain.expressions[0].blendshapes[-1])
    packing = pack(rig, used, SHORTEST, apart=(pair,))
    assert packing.colliding == (pair,)
    assert place_of(packing)[pair[0]] != place_of(packing)[pair[1]]
    assert packing_faults(rig, used, packing, 0.3) == ()
    together = change(plain, colliding=(pair,))
    assert any("cannot be performed" in line for line in packing_faults(rig, used, together, 0.3))


def test_only_the_pair_that_blocks_is_split(rig, used):
    packing = pack(rig, used, SHORTEST, apart=(("eyeBlinkLeft", "eyeBlinkRight"),))
    assert packing.relaxed == (("eyeBlinkLeft", "eyeBlinkRight"),)
    place = place_of(packing)
    assert place["eyeBlinkLeft"] != place["eyeBlinkRight"]
    assert all(place[a] == place[b] for a, b in packing.pairs if (a, b) not in packing.relaxed)
    assert packing_faults(rig, used, packing, 0.3) == ()


def test_a_person_refuses_what_the_greedy_method_proposes(rig, used):
    settings = PackingSettings(method="greedy")
    free = pack(rig, used, settings)

    def not_with_the_jaw(chosen, proposed):
        return "jawOpen" not in (*chosen, proposed)

    refused = pack(rig, used, settings, accept=not_with_the_jaw)
    assert len(next(e for e in free.expressions if "jawOpen" in e.blendshapes).blendshapes) > 1
    assert next(e for e in refused.expressions if "jawOpen" in e.blendshapes).blendshapes == ("jawOpen",)
    alone = pack(rig, used, settings, accept=lambda chosen, proposed: False)
    assert alone.objective == alone.things
    assert free.objective <= alone.objective
    for packing in (free, refused, alone):
        assert packing_faults(rig, used, packing, 0.3) == ()


@pytest.mark.parametrize(
    ("a", "b", "words"),
    [
        ("jawOpen", "mouthPucker", r"share \d+ active vertices"),
        ("eyeBlinkLeft", "eyeWideLeft", "a rule says"),
        ("browInnerUp", "mouthSmileLeft", "collide"),
        ("eyeBlinkLeft", "eyeBlinkRight", "performed together"),
        ("noseSneerLeft", "jawRight", "too many at once: 2 movements, 1 are allowed"),
        ("browInnerUp", "mouthSmileRight", "partners are performed together"),
        ("jawOpen", "browDownLeft", "asked to be apart"),
        ("tongue", "jawOpen", ""),
    ],
)
def test_every_conflict_is_explained(rig, used, a, b, words):
    settings = PackingSettings(method="minimum", most_things=1, edits=Edits(apart=(("jawOpen", "browDownLeft"),)))
    apart = (("browInnerUp", "mouthSmileLeft"),)
    if a not in used:
        with pytest.raises(RigError, match="no blendshape in use"):
            why_apart(rig, used, settings, a, b)
        return
    said = why_apart(rig, used, settings, a, b, apart=apart)
    assert re.search(words, said), said


def test_two_blendshapes_are_in_one_expression_or_a_reason_is_given(rig, used):
    place = place_of(pack(rig, used, SHORTEST))
    rng = np.random.default_rng(0)
    for _ in range(10):
        a, b = rng.choice(used, 2, replace=False).tolist()
        said = why_apart(rig, used, SHORTEST, a, b)
        assert (place[a] == place[b]) <= ("together" in said or "can be performed at once" in said)


@pytest.mark.parametrize(("cost", "words"), [(None, ""), (1, ", though it is hard (cost 1 of 3)")])
def test_what_can_be_performed_at_once_is_called_hard_only_where_a_rule_says_so(rig, used, cost, words):
    rules = Rules(hard=(Hard(("jawOpen", "browInnerUp"), cost),)) if cost else FREE
    said = why_apart(rig, used, SHORTEST, "browInnerUp", "jawOpen", rules=rules)
    assert said == f"'browInnerUp' and 'jawOpen' can be performed at once{words}: others made a better list"


def test_a_group_that_asks_for_too_much_is_refused(rig, used):
    edits = Edits(together=(("browInnerUp", "jawOpen"),))
    with pytest.raises(InfeasibleError, match="2 movements at once, 1 are allowed"):
        pack(rig, used, PackingSettings(method="minimum", most_things=1, edits=edits))
