"""A plan for who trusts nobody: plan, rig and a checker of one file that imports nothing of ours.

Written    plan.json, rig.npz and verify_plan.py, whose docstring says what each array is taken for
rig.npz    the rig as it is, and what a reader could not compute in one evening: what is seen, where keep-outs lie,
           partners and rules, what each blendshape is worth, recorded motion. All of it is found anew from the rig and
           the settings; nothing is copied from what the plan claims
"""

import io
from importlib.resources import files
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from capture_plan.anatomy.regions import MIDDLE
from capture_plan.audit.audit_cache import audit_once
from capture_plan.exports.delivery import Delivery
from capture_plan.expressions.listing import blendshape_importance
from capture_plan.expressions.problem import state_problem
from capture_plan.layout.face import Face, see_face
from capture_plan.layout.naming import seen_with_the_head
from capture_plan.layout.problem import Task, task_of
from capture_plan.mesh.mirror import mirror_plane
from capture_plan.output import write_whole
from capture_plan.plan.collide import collide
from capture_plan.plan.files import plan_bytes
from capture_plan.plan.inputs import PlanInputs, inputs_for
from capture_plan.plan.record import Plan
from capture_plan.rig import Rig
from capture_plan.shell.takes import Takes

Arrays = dict[str, Any]


def write(of: Delivery, folder: Path) -> list[Path]:
    """Write plan, rig and checker of a plan that is delivered."""
    return write_verifier(of.plan, of.inputs, folder)


def write_verifier(plan: Plan, inputs: Rig | PlanInputs, folder: Path) -> list[Path]:
    """Write plan, rig and checker into `folder`.

    Raises:
        PlanError: the plan's settings name a file that is not among the inputs, or the place cannot be written.
        InfeasibleError: the settings cannot be followed on this rig.
    """
    packed = io.BytesIO()
    np.savez_compressed(packed, **given_arrays(plan, inputs_for(inputs, plan.settings, carried=plan.cameras)))
    script = files("capture_plan.exports").joinpath("verify_plan.py").read_bytes()
    contents = {"plan.json": plan_bytes(plan), "rig.npz": packed.getvalue(), "verify_plan.py": script}
    for name, content in contents.items():
        write_whole(folder / name, content)
    return [folder / name for name in contents]


def given_arrays(plan: Plan, inputs: PlanInputs) -> Arrays:
    """Everything in rig.npz, an array by its name."""
    rig = inputs.rig
    report = audit_once(rig)
    face = see_face(rig, report.used, inputs.cameras, inputs.zones)
    task = task_of(face, plan.settings.landmarks)
    return {
        "neutral": rig.neutral,
        "triangles": rig.triangles,
        "deltas": rig.deltas,
        "names": np.array(rig.names),
        "meanings": np.array(rig.meanings, dtype=str).reshape(-1, 2),
        "skin": rig.skin,
        "source_index": rig.source_index,
        "used": np.array(report.used),
        "audit": np.array(msgspec.json.encode(report).decode()),
        **place_arrays(task),
        **(camera_arrays(face, plan.settings.landmarks.dot_mm) if face.cameras else {}),
        **rule_arrays(plan, inputs, report.used),
        **(take_arrays(inputs.takes) if inputs.takes else {}),
    }


def place_arrays(task: Task) -> Arrays:
    """What is seen, what is shut, what mirrors what, and where the middle of the face is."""
    face = task.face
    shut = np.zeros(len(face.rig.neutral), dtype=bool)
    shut[np.delete(task.sites.vertices, task.open_, axis=0)] = True
    return {
        "visibility": seen_with_the_head(face) if task.settings.head_markers else face.visibility,
        "opened": face.relaxed(task.settings),
        "places": face.places,
        "shut": shut,
        "mirror": face.mirror,
        "mirror_x_mm": np.array(mirror_plane(face.rig.neutral)),
        "midline_mm": np.array(face.regions.anchors.midline),
        "middle_mm": np.array(MIDDLE * face.regions.anchors.pupils),
        "sided": np.array(face.regions.sided),
        "points68": np.empty(0, dtype=int) if face.points68 is None else face.points68,
    }


def camera_arrays(face: Face, dot_mm: float) -> Arrays:
    """The share of the blendshapes with which each camera reads a dot at each vertex, and how blurred it is."""
    shape, skin = (len(face.cameras), len(face.rig.neutral)), face.rig.skin
    share, blur = np.zeros(shape), np.zeros(shape)
    share[:, skin], blur[:, skin] = face.views(dot_mm).share, face.blur(dot_mm)
    return {"read_share": share, "blur": blur}


def rule_arrays(plan: Plan, inputs: PlanInputs, used: tuple[str, ...]) -> Arrays:
    """Who is performed with whom, who never is, and how much of the whole importance each blendshape has."""
    rig, settings = inputs.rig, plan.settings.expressions
    apart = collide(rig, used, settings)
    problem = state_problem(rig, used, settings, inputs.rules, apart)
    importance = blendshape_importance(rig, problem.names, settings, inputs.target)
    share = dict(zip(problem.names, importance / importance.sum(), strict=True))
    kinds = ("pairs", "local", "relaxed", "exclusive", "colliding", "drivers")
    return {
        **{kind: np.array(getattr(problem, kind), dtype=str).reshape(-1, 2) for kind in kinds},
        "most_things": np.array(problem.most_things or 0),
        "importance": np.array([share.get(name, 0.0) for name in used]),
    }


def take_arrays(takes: Takes) -> Arrays:
    """The shell of the skin that takes move, and each take as shapes and how much of each is in every frame."""
    first = takes.first
    found = [(p, person, one) for p, person in enumerate(takes.subjects) for one in person.recordings]
    own = {f"person{p}_neutral": person.shell.vertices for p, person in enumerate(takes.subjects)}
    for q, (_, _, one) in enumerate(found):
        own |= {f"take{q}_weights": one.weights, f"take{q}_shapes": one.shapes[:, np.searchsorted(one.at, first.at)]}
    return own | {
        "take_person": np.array([p for p, _, _ in found]),
        "take_share": np.array([one.share for _, _, one in found]),
        "take_name": np.array([one.sequence.name for _, _, one in found]),
        "shell_at": first.at,
        "shell_triangles": first.shell.triangles,
        "shell_fixed": first.shell.fixed,
        "shell_importance": takes.s[first.at],
    }
