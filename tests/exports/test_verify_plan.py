"""The checker that nobody has to trust: true plans pass, forged ones fail with the lie named, `check` agrees."""

import ast
import copy
import json
import re
import subprocess
import sys
from itertools import chain
from pathlib import Path

import msgspec
import numpy as np
import pytest

from capture_plan.camera import recorded
from capture_plan.exports import verify_plan
from capture_plan.exports.verify import write_verifier
from capture_plan.plan.files import inputs_of, read_plan
from tests.camera import test_precision as camera_sets
from tests.lies import LIES as CONSISTENT
from tests.lies import shorter_lens, source_vertices_zero, surer_cameras
from tests.tampering import KINDS, answers_kept, is_free, tampered, verdict

# What the checker leaves to `check`, as its docstring says.
LEFT = (
    r"session(\..*)?",
    r"settings(\..*)?",
    r"rig(\.(name|path|names|up|facing|unit_mm|skin))?",
    r"packing\.expressions\.#\.sentence",
    r"packing\.(method|overlaps.*|hard.*|kept|order_proven|edits.*)",
    r"layout\.(landmarks|head)\.#\.(region|label|views.*)",
    r"layout\.(references\.[^.]*\.)?predictions(\..*)?",
    r"(meetings|actor|unread)(\..*)?",
    r"cameras\.#\.(name|size_px|optics).*",
    r"layout\.programs\.#\.blendshapes.*",
    r"layout\.motion\.(missing|notes|rank|tail_mm|curve_mm)(\..*)?",
)
CHANGES = 6  # of each plan


@pytest.fixture(scope="module", autouse=True)
def asked_once():
    """What both checkers find slowly is found once for the same arguments: shells and how markers bend them."""
    shells, bent = {}, {}

    def stiffness(x, triangles, found=verify_plan.stiffness):
        key = (x.tobytes(), triangles.tobytes())
        return shells.get(key) or shells.setdefault(key, found(x, triangles))

    def bend(K, held, given, found=verify_plan.bend):
        key = (id(K), held.tobytes(), given.tobytes())
        if key not in bent:
            bent[key] = found(K, held, given)
        return bent[key]

    with answers_kept(), pytest.MonkeyPatch.context() as patch:
        patch.setattr(verify_plan, "stiffness", stiffness)
        patch.setattr(verify_plan, "bend", bend)
        yield


@pytest.fixture(scope="module")
def folders(made, tmp_path_factory):
    """Where each plan lies with its rig and the checker."""
    folder = tmp_path_factory.mktemp("checked")
    for name, path in made.items():
        plan = read_plan(path)
        write_verifier(plan, inputs_of(plan, path), folder / name)
    return {name: folder / name for name in made}


@pytest.fixture(scope="module")
def given(folders):
    """Plan and rig of each, as the checker reads them."""
    return {
        name: (json.loads((folder / "plan.json").read_bytes()), dict(np.load(folder / "rig.npz")))
        for name, folder in folders.items()
    }


def failed(plan, rig):
    """What the checker says of what does not hold."""
    return [f"{what}: {found}" for what, holds, found in verify_plan.verify(plan, rig) if not holds]


@pytest.mark.parametrize("kind", KINDS)
def test_a_true_plan_holds(given, kind):
    assert failed(*given[kind]) == []


def test_it_runs_alone_where_the_plan_lies(folders):
    folder = folders["default"]
    command = [sys.executable, "-P", "-S", "verify_plan.py"]
    numpy_alone = f"import sys; sys.path.append({str(np.__path__[0]).removesuffix('numpy')!r})"
    run = [sys.executable, "-c", f"{numpy_alone}; import runpy; runpy.run_path({command[-1]!r}, run_name='__main__')"]
    done = subprocess.run(run, cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[-1].endswith("checks hold")


def test_a_forged_plan_ends_in_exit_code_1(folders, tmp_path, capsys):
    for path in folders["default"].iterdir():
        (tmp_path / path.name).write_bytes(path.read_bytes())
    plan = json.loads((tmp_path / "plan.json").read_bytes())
    plan["layout"]["certificate"]["landmarks"] += 1
    (tmp_path / "plan.json").write_text(json.dumps(plan))
    assert verify_plan.main(tmp_path) == 1
    assert "FAIL  proved: no fewer than 13 landmarks" in capsys.readouterr().out


def test_it_imports_nothing_but_numpy_and_the_standard_library():
    tree = ast.parse(Path(verify_plan.__file__).read_text())
    named = {
        alias.name.split(".")[0] for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names
    }
    named |= {node.module.split(".")[0] for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) and node.module}
    assert named - set(sys.stdlib_module_names) == {"numpy"}


# Forgeries: each takes a plan and makes a lie of it.


def one_more_expression(plan):
    """19 where 18 is the fewest."""
    packing = plan["packing"]
    packing["bound"] = packing["solver_bound"] = packing["objective"] = 19
    shot = packing["expressions"][-1]
    pair = next(e for e in packing["expressions"] if len(e["blendshapes"]) > 2)
    moved = [name for name in pair["blendshapes"] if name not in chain.from_iterable(packing["pairs"])][:1] or pair[
        "blendshapes"
    ][:1]
    pair["blendshapes"] = [name for name in pair["blendshapes"] if name not in moved]
    packing["expressions"].append({**shot, "name": "E19", "blendshapes": moved, "weights": [1.0], "drivers": []})


def higher_minimum(plan):
    plan["layout"]["certificate"]["landmarks"] = 30


def inflated_prices(plan):
    bound = plan["layout"]["certificate"]
    bound["weights"] = [2.5 * weight for weight in bound["weights"]]
    bound["landmarks"] = 30


def negative_price(plan):
    bound = plan["layout"]["certificate"]
    bound["weights"] = [-bound["weights"][0], *bound["weights"][1:]]


def other_side_in_labels(plan):
    swap = {"left": "right", "right": "left"}
    for m in plan["layout"]["landmarks"]:
        m["label"] = " ".join(swap.get(word, word) for word in m["label"].split(" "))


def other_sides(plan):
    other_side_in_labels(plan)
    for m in plan["layout"]["landmarks"]:
        m["side"] = {"left": "right", "right": "left"}.get(m["side"], "middle")


def moved_marker(plan):
    plan["layout"]["landmarks"][0]["position"][0] += 5.0


def other_corner(plan):
    plan["layout"]["landmarks"][0]["barycentric"].reverse()
    plan["layout"]["landmarks"][1]["barycentric"] = [0.3, 0.3, 0.4]


def empty_clique(plan):
    plan["packing"]["clique"] = []


def longer_clique(plan):
    packing = plan["packing"]
    packing["clique"].append(
        next(n for e in packing["expressions"] for n in e["blendshapes"] if n not in packing["clique"])
    )
    packing["bound"] = len(packing["clique"])


def dropped_landmark(plan):
    layout = plan["layout"]
    gone = layout["landmarks"].pop(3)
    for number, m in enumerate(layout["landmarks"], start=1):
        m["name"] = f"M{number:02d}"
    layout["information"]["landmarks"] -= 1
    layout["order"] = layout["order"][:-1]
    layout["curve_mm"] = layout["curve_mm"][:-1]
    assert gone["name"] == "M04"


def wider_spacing(plan):
    plan["settings"]["landmarks"]["spacing_mm"] = 11.0


def two_exchanged(plan):
    """Of two blendshapes that exclude each other, one takes the place of what the other is performed with."""
    of = {name: e["blendshapes"] for e in plan["packing"]["expressions"] for name in e["blendshapes"]}
    pairs = [pair for a, b in plan["packing"]["exclusive"] for pair in ((a, b), (b, a))]
    a, b = next((a, b) for a, b in pairs if a in of and b in of and len(of[a]) > 1)
    beside = next(i for i, name in enumerate(of[a]) if name != a)
    of[a][beside], of[b][of[b].index(b)] = b, of[a][beside]


def all_in_one(plan):
    """Two expressions told as one, and the number proved by it."""
    first, second, *rest = plan["packing"]["expressions"]
    first["blendshapes"] += second["blendshapes"]
    first["weights"] += second["weights"]
    plan["packing"]["expressions"] = [first, *rest]


def smaller_error(plan):
    plan["layout"]["information"]["error_mm"] *= 0.8


def higher_rank(plan):
    information = plan["layout"]["information"]
    information["rank"], information["full_rank"] = information["rank"] - 1, information["full_rank"] - 1


def better_curve(plan):
    plan["layout"]["curve_mm"] = [0.9 * mm for mm in plan["layout"]["curve_mm"]]


def worse_rival(plan):
    for one in plan["layout"]["references"].values():
        one["error_mm"] *= 2


def rival_elsewhere(plan):
    """68 points heaped on one vertex, told as such."""
    for one in plan["layout"]["references"].values():
        one["vertices"] = [one["vertices"][0]] * len(one["vertices"])


def higher_error_bound(plan):
    plan["layout"]["error_bound"]["error_mm"] += 0.05


def more_needed_for_the_target(plan):
    plan["layout"]["target_landmarks"] += 1


def weaker_proof_of_the_target(plan):
    plan["layout"]["target_bound"]["shares"] = [0.0] * len(plan["layout"]["target_bound"]["shares"])


def target_out_of_reach(plan):
    plan["layout"]["target_landmarks"] = None


def made_up_importance(plan):
    plan["packing"]["expressions"][0]["gain"] = plan["packing"]["expressions"][0]["covered"] = 0.99


def hidden_finding(plan):
    plan["audit"]["findings"] = plan["audit"]["findings"][1:]


def barred_pair_allowed(plan):
    plan["packing"]["exclusive"] = plan["packing"]["exclusive"][1:]


def blendshape_on_no_landmark(plan):
    plan["layout"]["landmarks"][0]["blendshapes"] = plan["layout"]["landmarks"][0]["blendshapes"][1:]


def edit_forgotten(plan):
    shots = plan["packing"]["expressions"]
    here = next(e for e in shots if "jawOpen" in e["blendshapes"])
    there = next(e for e in shots if "jawOpen" not in e["blendshapes"] and e["name"] != "E02")
    for key in ("blendshapes", "weights", "sentence", "gain", "covered", "drivers"):
        here[key], there[key] = there[key], here[key]


def surer_head(plan):
    plan["layout"]["head_pose"]["surface_mm"] /= 2


def take_lost_less(plan):
    plan["layout"]["motion"]["rmse_mm"] *= 0.9


def people_alike(plan):
    for one in plan["layout"]["motion"]["subjects"]:
        one["rmse_mm"] = plan["layout"]["motion"]["rmse_mm"]


def steeper_take_curve(plan):
    curve = plan["layout"]["motion"]["curve_mm"]
    curve[len(curve) // 2 - 1] *= 0.9


def softer_shell(plan):
    plan["layout"]["motion"]["bending"] = 1.0


def another_rig(plan):
    plan["rig"]["fingerprint"] = "0" * 16


LIES = [
    ("default", one_more_expression, "proved: no list has fewer than 19 expressions"),
    ("default", higher_minimum, "proved: no fewer than 30 landmarks"),
    ("default", inflated_prices, "over the limit at"),
    ("default", negative_price, "proved: no fewer than"),
    ("default", other_side_in_labels, "called left lie on the left"),
    ("default", other_sides, "called left lie on the left"),
    ("default", source_vertices_zero, "M01 source_vertex 0, not"),
    ("default", moved_marker, "on skin, gives: M01 position"),
    ("default", other_corner, "M02 barycentric"),
    ("default", empty_clique, "a clique of 0"),
    ("default", longer_clique, "fit together: "),
    ("default", dropped_landmark, "has its mirror twin"),
    ("budget", dropped_landmark, "has its mirror twin"),
    ("default", wider_spacing, "at least 11 mm apart, straight and so along the skin: M"),
    ("default", two_exchanged, "share skin or exclude each other: E0"),
    ("default", all_in_one, "share skin or exclude each other: E01"),
    ("default", smaller_error, "the layout: rank 51 of 51, upper estimate 0.1"),
    ("default", higher_rank, "the layout: rank 50 of 50"),
    ("budget", better_curve, "the curve is the error of the first landmarks"),
    ("default", worse_rival, "68 points (iBUG): rank"),
    ("default", rival_elsewhere, "68 points (iBUG) stand where they belong"),
    ("budget", higher_error_bound, "proved: no layout of 16 landmarks has an upper estimate below 0.28"),
    (
        "default",
        more_needed_for_the_target,
        "proved: no layout of fewer than 28 landmarks has an upper estimate of 0.184 mm",
    ),
    ("budget", weaker_proof_of_the_target, "proved: no layout of fewer than"),
    ("default", target_out_of_reach, "no number of landmarks here has an upper estimate of 0.184 mm"),
    ("default", made_up_importance, "importance of the expressions"),
    ("default", hidden_finding, "the audit is that of the rig"),
    ("default", barred_pair_allowed, "partners, rules and correctives are those of the rig: exclusive"),
    ("default", blendshape_on_no_landmark, "on skin, gives: M01 blendshapes"),
    ("edited", edit_forgotten, "the artist's edits are kept: jawOpen"),
    ("cameras", shorter_lens, "the cameras measure markers as exactly as stated: M"),
    ("cameras", surer_cameras, "the layout: rank"),
    ("cameras", surer_head, "the head's pose is as exact as stated"),
    ("motion of two people", take_lost_less, " mm: rmse_mm 2."),
    ("motion of two people", people_alike, "the takes are of 2 people"),
    ("motion of two people", steeper_take_curve, "the curve is what the first landmarks lose"),
    ("motion of two people", softer_shell, "frames and shell are those of the takes"),
    ("default", another_rig, "the plan is for this rig"),
]


@pytest.mark.parametrize(("kind", "forge", "named"), LIES, ids=[f"{kind}-{forge.__name__}" for kind, forge, _ in LIES])
def test_a_forged_plan_fails_with_the_lie_named(given, made, kind, forge, named):
    plan, rig = given[kind]
    lie = copy.deepcopy(plan)
    forge(lie)
    message = failed(lie, rig)
    assert any(named in line for line in message), message
    assert verdict(lie, read_plan(made[kind]), made[kind], resealed=True) in ("caught", "refused")


@pytest.mark.parametrize(
    ("kind", "lie"), [one[:2] for one in CONSISTENT if one[2]], ids=[one[1].__name__ for one in CONSISTENT if one[2]]
)
def test_lies_that_agree_with_themselves_fail(given, kind, lie):
    plan, rig = given[kind]
    document = copy.deepcopy(plan)
    lie(document)
    assert failed(document, rig)


@pytest.mark.parametrize("kind", KINDS)
def test_the_checker_and_check_agree_on_plans_with_one_value_changed(given, made, kind):
    (document, rig), path = given[kind], made[kind]
    plan, apart = read_plan(path), []
    for number in range(0, 17 * CHANGES, 17):  # kinds of fields far apart, so that all parts of a plan have a turn
        field, changed = tampered(document, number, 3)
        said = verdict(changed, plan, path, resealed=True)
        left = is_free(field) or any(re.fullmatch(pattern, field) for pattern in LEFT)
        if said != "same" and not left and (said == "uncaught") != (not failed(changed, rig)):
            apart.append((field, said, failed(changed, rig)))
    assert apart == []


@pytest.mark.parametrize("name", camera_sets.SETS)
def test_the_checker_has_lenses_of_its_own_that_agree(name):
    for one in camera_sets.SETS[name]:
        points = camera_sets.places()
        said = json.loads(msgspec.json.encode(recorded(one)))
        np.testing.assert_allclose(verify_plan.pixels(said, points), one.project(points), atol=1e-6)


@pytest.mark.parametrize("size", [5, 8, 12, 14])
def test_every_lens_of_opencv_is_known_to_the_checker(size):
    lens = 0.01 * np.random.default_rng(size).normal(size=size)
    one = camera_sets.camera((30, 60, 250), tuple(lens))
    said = json.loads(msgspec.json.encode(recorded(one)))
    np.testing.assert_allclose(verify_plan.pixels(said, points := camera_sets.places()), one.project(points), atol=1e-6)
