"""What is delivered in tests: the bundled head's plan, also with names no program likes, and as an artist's file."""

from dataclasses import replace
from functools import cache

import numpy as np
from msgspec import structs

from capture_plan.exports.delivery import Delivery, dots_mm, posed_dots_mm
from capture_plan.plan.inputs import PlanInputs
from capture_plan.sample import sample_rig
from tests.once import QUICK, plan_of

BAD_NAMES = (
    "M 01",
    "M_01",
    "m_01",
    "lèvre supérieure",
    "眉",
    "頬",
    "9",
    "a" * 70,
    "a" * 69 + "b",
    "x|y:z",
    "",
    "M01\t",
)
Z_UP = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])  # (x, -z, y)


@cache
def sample():
    """The bundled head and its plan."""
    return Delivery(plan_of(QUICK), PlanInputs(sample_rig()))


@cache
def badly_named(count=None):
    """The sample's delivery with `count` markers whose names are unusual, far too long or alike."""
    of = sample()
    markers = of.plan.layout.markers
    named = tuple(
        structs.replace(markers[i % len(markers)], name=BAD_NAMES[i % len(BAD_NAMES)])
        for i in range(count or len(markers))
    )
    plan = structs.replace(of.plan, layout=structs.replace(of.plan.layout, landmarks=named, head=()))
    return replace(of, plan=plan)


def dots(of):
    """Where the dots are on the neutral, millimetres, y up."""
    return dots_mm(of.plan, of.inputs)


def posed_dots(of):
    """Where the dots are on the neutral and in each expression, millimetres, y up."""
    return posed_dots_mm(of.plan, of.inputs)


def quads_of(triangles):
    """Polygons of which these triangles are fans: two in a row that share first corner and an edge are one quad."""
    polygons = []
    for a, b, c in triangles.tolist():
        last = polygons[-1] if polygons else ()
        if len(last) == 3 and (last[0], last[2]) == (a, b):
            last.append(c)
        else:
            polygons.append([a, b, c])
    return polygons


def as_artists_obj(folder):
    """The sample as an artist's neutral.obj: centimetres, z up, a hat before it that no expression needs, other vertex
    numbers, polygons, groups and texture coordinates. Returns its delivery and the polygons as the file has them."""
    of = sample()
    rig = of.inputs.rig
    number = 3 + np.random.default_rng(3).permutation(len(rig.neutral))
    vertices = np.zeros((3 + len(number), 3))
    vertices[number] = rig.neutral @ Z_UP.T / 10
    vertices[:3] = [[0, 0, 100], [5, 0, 100], [0, 5, 100]]
    polygons = [[0, 1, 2], *([int(number[i]) for i in polygon] for polygon in quads_of(rig.triangles))]
    lines = [
        "mtllib head.mtl",
        *(f"v {x:.6f} {y:.6f} {z:.6f} 0.5 0.25 1" for x, y, z in vertices),
        "vt 0 0",
        "usemtl skin",
        "g hat",
    ]
    faces = ["f " + " ".join(f"{i + 1}/1" for i in polygon) for polygon in polygons]
    lines += [faces[0], "g head", *faces[1:]]
    folder.mkdir(exist_ok=True)
    (folder / "neutral.obj").write_text("\r\n".join(lines) + "\r\n")
    turned = replace(
        rig, source_index=number, unit_mm=10.0, up="+z", facing="-y", turn=(1.0, 0, 0, 0, 0, 1.0, 0, -1.0, 0)
    )
    return replace(of, inputs=PlanInputs(turned), rig_file=folder), polygons
