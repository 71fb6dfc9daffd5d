"""Plans built as lies: each changes several fields together, so that they agree with each other, and not with the rig.

A lie takes a plan as JSON gives it, and changes it. `LIES` has the plan of `tests.tampering` that each is told of, and
whether the checker of one file looks at what it changes.
"""

from collections.abc import Callable, Iterator
from typing import Any

Document = dict[str, Any]
OTHER = {"left": "right", "right": "left", "Left": "Right", "Right": "Left"}


def informations(plan: Document) -> Iterator[Document]:
    """What the layout and all that stand beside it are worth."""
    yield from (plan["layout"]["information"], *plan["layout"]["references"].values())


def expected(plan: Document) -> Iterator[Document]:
    """Every predicted error."""
    layout = plan["layout"]
    yield from (one for several in (layout, *layout["references"].values()) for one in several["predictions"])


def scaled(record: Document, share: float) -> None:
    """All lengths of a record, each by the same share."""
    for name, value in record.items():
        if name.endswith("_mm") and name != "noise_mm" and isinstance(value, float):
            record[name] = round(share * value, 4)
        elif name.endswith("_mm") and isinstance(value, list):
            record[name] = [round(share * one, 5) for one in value]


def renamed(value: Any, names: dict[str, str]) -> Any:
    """The value with every text changed, word by word."""
    if isinstance(value, dict):
        return {renamed(name, names): renamed(one, names) for name, one in value.items()}
    if isinstance(value, list):
        return [renamed(one, names) for one in value]
    return names.get(value, value) if isinstance(value, str) else value


def without(value: Any, names: set[str]) -> Any:
    """The value without every entry of these names, and without pairs and records that are about them."""
    if isinstance(value, list):
        retained = [one for one in value if not (isinstance(one, str) and one in names)]
        return [without(one, names) for one in retained if not (isinstance(one, dict) and one.get("name") in names)]
    return {name: without(one, names) for name, one in value.items()} if isinstance(value, dict) else value


def merged(plan: Document, a: int, b: int) -> None:
    """Two expressions told as one, in the list, in its count and in the session."""
    packing, session = plan["packing"], plan["session"]
    shots = packing["expressions"]
    for key in ("blendshapes", "weights", "drivers"):
        shots[a][key] = [*shots[a][key], *shots[b][key]]
    shots[a]["gain"] = round(shots[a]["gain"] + shots[b]["gain"], 6)
    del shots[b]
    covered = 0.0
    for number, shot in enumerate(shots, start=1):
        covered += shot["gain"]
        shot["name"], shot["covered"] = f"E{number:02d}", round(min(covered, 1.0), 6)
    packing["objective"] -= 1
    packing["clique"] = packing["clique"][: packing["objective"]]
    packing["bound"] = packing["solver_bound"] = len(packing["clique"])
    packing["proven_optimal"] = packing["bound"] == packing["objective"]
    session["items"] = [one for one in session["items"] if one["name"] != f"E{len(shots) + 1:02d}"]


def one_expression_less(plan: Document) -> None:
    merged(plan, 0, 1)


def forbidden_together(plan: Document) -> None:
    """What no face does at once is performed at once, and the rule that says so is left out."""
    merged(plan, 0, len(plan["packing"]["expressions"]) - 1)
    plan["packing"]["exclusive"] = plan["packing"]["colliding"] = []


def all_errors_smaller(plan: Document) -> None:
    """A fifth less error: of the layout, its curve, its predictions and its bound."""
    layout = plan["layout"]
    for record in (layout["information"], *layout["predictions"], layout["error_bound"], layout):
        scaled(record, 0.8)


def rivals_worse(plan: Document) -> None:
    """Half as much again for every other layout."""
    for one in plan["layout"]["references"].values():
        for record in (one, *one["predictions"]):
            scaled(record, 1.5)


def rivals_elsewhere(plan: Document) -> None:
    """Other layouts stand at fewer vertices, and are worth as much less."""
    for one in plan["layout"]["references"].values():
        one["vertices"] = one["vertices"][::2]
        one["landmarks"] = len(one["vertices"])


def more_told_apart(plan: Document) -> None:
    """One mix more that the rig and every layout tell apart."""
    for one in informations(plan):
        one["rank"], one["full_rank"] = one["rank"] + 1, one["full_rank"] + 1
    plan["audit"]["rank"] += 1


def quieter_markers(plan: Document) -> None:
    """Half the noise, at the same error."""
    plan["settings"]["landmarks"]["noise_mm"] /= 2
    for one in (*informations(plan), *expected(plan)):
        one["noise_mm"] /= 2


def sides_exchanged(plan: Document) -> None:
    """Left and right exchanged in every name, label, side and sentence."""
    swap = {name: "".join(OTHER.get(part, part) for part in _parts(name)) for name in plan["audit"]["used"]}
    plan["packing"], plan["layout"] = renamed(plan["packing"], swap), renamed(plan["layout"], swap)
    for m in plan["layout"]["landmarks"]:
        m["label"] = " ".join(OTHER.get(word, word) for word in m["label"].split(" "))
        m["side"] = OTHER.get(m["side"], m["side"])
    for shot in plan["packing"]["expressions"]:
        shot["sentence"] = " ".join(OTHER.get(word, word) for word in shot["sentence"].split(" "))


def _parts(name: str) -> list[str]:
    for side in ("Left", "Right"):
        if name.endswith(side):
            return [name.removesuffix(side), side]
    return [name]


def one_blendshape_forgotten(plan: Document) -> None:
    """A blendshape is planned for nowhere, and nothing says that it was there."""
    for part in ("audit", "layout", "packing", "session"):
        plan[part] = without(plan[part], {"tongueOut"} & {*plan["audit"]["used"]} or {plan["audit"]["used"][0]})
    plan["audit"]["blendshapes"] -= 1


def first_covers_most(plan: Document) -> None:
    """The first expression is worth 99 %, and the others share the rest."""
    shots = plan["packing"]["expressions"]
    rest, covered = sum(shot["gain"] for shot in shots[1:]), 0.0
    for number, shot in enumerate(shots):
        shot["gain"] = round(0.01 * shot["gain"] / rest, 6) if number else 0.99
        covered += shot["gain"]
        shot["covered"] = round(min(covered, 1.0), 6)
    for item in plan["session"]["items"]:
        item["covered"] = max(item["covered"], 0.99)


def minimum_of_thirty(plan: Document) -> None:
    """More landmarks are needed than there are, by prices that are scaled, of a program that says so too."""
    layout, many = plan["layout"], len(plan["layout"]["landmarks"])
    share = many / sum(layout["certificate"]["weights"])
    layout["certificate"]["weights"] = [share * weight for weight in layout["certificate"]["weights"]]
    layout["certificate"]["landmarks"] = many
    for program in layout["programs"]:
        program["landmarks"] = program["objective"] = program["bound"] = many


def proved_by_nothing(plan: Document) -> None:
    """A number that is proved by a clique of names that stand there twice."""
    packing = plan["packing"]
    packing["clique"] = (packing["clique"] * 2)[: packing["objective"]]
    packing["clique"][-1] = packing["clique"][0]
    packing["bound"] = packing["solver_bound"] = packing["objective"]
    packing["proven_optimal"] = True


def sound_rig(plan: Document) -> None:
    """No finding, and a face that is its own mirror image."""
    audit = plan["audit"]
    audit["findings"] = [one for one in audit["findings"] if one["left_out"]]
    audit["symmetry"] = dict.fromkeys(audit["symmetry"], 0.0)
    audit["note"] = ""


def another_name(plan: Document) -> None:
    """The head of another person, everywhere that it is named."""
    plan["rig"]["name"] = plan["audit"]["name"] = "the actor of today"


def dots_moved(plan: Document) -> None:
    """The first two landmarks stand 5 mm lower, on other vertices of the artist's file, by their own word."""
    for m in plan["layout"]["landmarks"][:2]:
        m["position"][1] -= 5.0
        m["source_vertex"] += 7


def source_vertices_zero(plan: Document) -> None:
    for m in (*plan["layout"]["landmarks"], *plan["layout"]["head"]):
        m["source_vertex"] = 0


def order_turned(plan: Document) -> None:
    """The least telling landmark first, with the curve of the true order."""
    plan["layout"]["order"] = plan["layout"]["order"][::-1]


def hurried_session(plan: Document) -> None:
    """Half the time for everything, by settings that say the same."""
    for settings in (plan["settings"]["session"], plan["session"]["settings"]):
        settings["explain_s"] /= 2
    for item in plan["session"]["items"]:
        item["seconds"] /= 2
        item["minutes"] = round(item["minutes"] / 2, 3)
    plan["session"]["minutes"] = round(plan["session"]["minutes"] / 2, 3)


def another_method(plan: Document) -> None:
    """A budget's plan that says it was asked for nothing but a cover."""
    plan["settings"]["landmarks"] |= {"method": "adaptive", "budget": None}


def seen_by_all(plan: Document) -> None:
    """Every camera always sees every marker, twice as large."""
    for m in (*plan["layout"]["landmarks"], *plan["layout"]["head"]):
        m["views"] = [view | {"always": True, "pixels": 2 * view["pixels"]} for view in m["views"]]


def shorter_lens(plan: Document) -> None:
    """The first camera has half the focal length, and nothing else is changed."""
    fx, fy = plan["cameras"][0]["intrinsics"][0], plan["cameras"][0]["intrinsics"][1]
    fx[0], fy[1] = fx[0] / 2, fy[1] / 2


def surer_cameras(plan: Document) -> None:
    """Every camera finds a dot four times as exactly, and every figure of a dot says so."""
    for camera in plan["cameras"]:
        camera["noise_px"] /= 4
    for m in (*plan["layout"]["landmarks"], *plan["layout"]["head"]):
        m["measured_mm"] = [round(x / 4, 4) for x in m["measured_mm"]]


def nothing_unread(plan: Document) -> None:
    """Every camera reads every marker in every expression of the plan."""
    plan["unread"] = []


def surer_head(plan: Document) -> None:
    """Head markers that fix the pose twice as well."""
    plan["layout"]["head_pose"] = {name: value / 2 for name, value in plan["layout"]["head_pose"].items()}


def takes_lose_less(plan: Document) -> None:
    """A tenth less for the layout, its curve and each person."""
    motion = plan["layout"]["motion"]
    for record in (motion, *motion["subjects"]):
        scaled(record, 0.9)


def one_person_alone(plan: Document) -> None:
    """Two people's takes told as those of one."""
    plan["layout"]["motion"]["subjects"] = []


def edit_not_kept(plan: Document) -> None:
    """Another place for a locked blendshape than the list has, in settings and list alike."""
    for edits in (plan["settings"]["expressions"]["edits"], plan["packing"]["edits"]):
        edits["locked"] = {name: where + 1 for name, where in edits["locked"].items()}


LIES: tuple[tuple[str, Callable[[Document], None], bool], ...] = (
    ("default", one_expression_less, True),
    ("default", forbidden_together, True),
    ("default", all_errors_smaller, True),
    ("default", rivals_worse, True),
    ("default", rivals_elsewhere, True),
    ("default", more_told_apart, True),
    ("default", quieter_markers, True),
    ("default", sides_exchanged, True),
    ("default", one_blendshape_forgotten, True),
    ("default", first_covers_most, True),
    ("default", minimum_of_thirty, True),
    ("default", proved_by_nothing, True),
    ("default", sound_rig, True),
    ("default", another_name, True),
    ("default", dots_moved, True),
    ("cameras", source_vertices_zero, True),
    ("budget", order_turned, True),
    ("default", hurried_session, False),
    ("budget", another_method, True),
    ("cameras", seen_by_all, False),
    ("cameras", shorter_lens, True),
    ("cameras", surer_cameras, True),
    ("cameras", nothing_unread, False),
    ("cameras", surer_head, True),
    ("motion of two people", takes_lose_less, True),
    ("motion of two people", one_person_alone, True),
    ("edited", edit_not_kept, True),
)
