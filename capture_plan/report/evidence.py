"""What a browser needs to check a plan without a network, a rig and us: figures of the rig, nothing that the plan says.

moved    r[m, k]  share of its largest movement by which blendshape k moves the skin under marker m
sites    each set of blendshapes that a place on the skin can stand for, once, with how many landmarks it costs
shared   pairs of blendshapes that share skin, with the number of vertices;  barred  pairs that no face does at once
places   where markers lie, millimetres
The script `assets/check.js` does the sums: cover, prices, distances, sides, disjointness, clique.
"""

import json
from itertools import combinations
from typing import Any

import numpy as np

from capture_plan.errors import CapturePlanError
from capture_plan.exports.verify import given_arrays
from capture_plan.exports.verify_plan import Face, Scans
from capture_plan.plan.files import plan_bytes
from capture_plan.plan.inputs import PlanInputs, inputs_for
from capture_plan.plan.record import Plan
from capture_plan.rig import Rig

DIGITS = 6  # of a share: finer than the difference that a float32 delta makes


def evidence(plan: Plan, inputs: Rig | PlanInputs) -> dict[str, Any]:
    """What `check.js` reads; `{"missing": why}` where inputs are missing or the settings cannot be followed."""
    try:
        arrays = given_arrays(plan, inputs_for(inputs, plan.settings, takes=False, carried=plan.cameras))
    except CapturePlanError as error:
        return {"missing": str(error)}
    face = Face(json.loads(plan_bytes(plan)), arrays)
    return {"used": face.used, **_places(plan, face), **sites(face), **skin_shared(Scans(face))}


def _places(plan: Plan, face: Face) -> dict[str, Any]:
    """Where each marker's vertex lies, and what moves it."""
    at = {m.name: m.vertex for m in plan.layout.markers if 0 <= m.vertex < len(face.x)}
    return {
        "places": {name: np.round(face.x[vertex], 3).tolist() for name, vertex in at.items()},
        "moved": {
            name: np.round(face.relative_displacement[:, vertex].astype(float), DIGITS).tolist()
            for name, vertex in at.items()
        },
        "middle": [float(face.rig["midline_mm"]), float(face.rig["middle_mm"])],
    }


def sites(face: Face) -> dict[str, Any]:
    """What places can stand for: sets that are alike once."""
    covers = face.covers[:, face.sites].any(axis=2).T[face.open]
    distinct = {
        (int(n), tuple(np.flatnonzero(row).tolist())) for n, row in zip(face.size[face.open], covers, strict=True)
    }
    return {"sites": sorted(distinct)}


def skin_shared(scans: Scans) -> dict[str, Any]:
    """Who shares skin with whom, who is barred from whom, and who is performed as one."""
    shared = [
        [a, b, int((scans.active[a] & scans.active[b]).sum())]
        for a, b in combinations(scans.names, 2)
        if (scans.active[a] & scans.active[b]).any()
    ]
    return {
        "names": scans.names,
        "shared": shared,
        "barred": sorted(sorted(pair) for pair in scans.barred),
        "partners": scans.rules["pairs"] + scans.rules["local"],
        "together": scans.together,
        "numbers": scans.number,
        "pairs": scans.rules["pairs"],
        "most": scans.most,
    }
