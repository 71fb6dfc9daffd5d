"""Markers of a capture plan in Blender: run this file in Blender's text editor, or `blender --python FILE`.

One unit is a metre, +z up, the face looks along -y. Frame 0 is the neutral, frame i expression i: empties and, where
the meshes of `capture-plan export --only meshes` lie beside this file, the head move together as the frame changes.
"""

import json
from pathlib import Path

import bpy  # pyright: ignore[reportMissingImports]
from mathutils import Matrix  # pyright: ignore[reportMissingImports]

PLAN = json.loads(r"""PLAN_AS_JSON""")


def add_head(folder):
    """The head of the meshes beside this file, each expression a shape key."""
    neutral = folder / f"{PLAN['poses'][0]}.obj"
    points = places(neutral)
    shown = {i for first, last in PLAN["shown"] for i in range(first, last + 1)}
    mesh = bpy.data.meshes.new("capture_plan_head")
    mesh.from_pydata(points, [], [face for face in faces(neutral, len(points)) if shown.issuperset(face)])
    head = bpy.data.objects.new("capture_plan_head", mesh)
    head.matrix_world = Matrix(PLAN["mesh_to_blender"])
    head.shape_key_add(name="Basis")
    for frame, name in enumerate(PLAN["poses"][1:], start=1):
        key = head.shape_key_add(name=name)
        key.data.foreach_set("co", [x for point in places(folder / f"{name}.obj") for x in point])
        for at in (frame - 1, frame, frame + 1):
            key.value = float(at == frame)
            key.keyframe_insert("value", frame=at)
    return head


def faces(path, count):
    """The polygons of an OBJ file of so many vertices, counted from 0; -1 is its last vertex."""
    with open(path, encoding="utf-8", errors="replace") as file:
        rows = [[int(word.split("/")[0]) for word in line.split()[1:]] for line in file if line.startswith("f ")]
    return [[i - 1 if i > 0 else count + i for i in row] for row in rows]


def places(path):
    """The vertices of an OBJ file in its own unit and axes."""
    with open(path, encoding="utf-8", errors="replace") as file:
        rows = [line.replace(",", ".").split()[1:4] for line in file if line.startswith("v ")]
    return [tuple(map(float, row)) for row in rows]


def add_marker(name, label, frames):
    """An empty that stands where the marker is in each pose."""
    empty = bpy.data.objects.new(name, None)
    empty.empty_display_type = "SPHERE"
    empty.empty_display_size = PLAN["dot_radius"]
    empty["place"] = label
    for frame, place in enumerate(frames):
        empty.location = place
        empty.keyframe_insert("location", frame=frame)
    return empty


def main():
    """Add a collection with the head and the markers to the scene."""
    collection = bpy.data.collections.new("capture_plan")
    collection["of"] = PLAN["of"]
    scene = bpy.context.scene
    scene.collection.children.link(collection)
    for marker in PLAN["markers"]:
        collection.objects.link(add_marker(marker["name"], marker["label"], marker["frames"]))
    folder = Path(__file__).resolve().parent / PLAN["meshes"]
    if (folder / f"{PLAN['poses'][0]}.obj").is_file():
        collection.objects.link(add_head(folder))
    else:
        print(f"no head: {folder} has no meshes; capture-plan export --only meshes writes them")
    scene.frame_start, scene.frame_end = 0, len(PLAN["poses"]) - 1
    scene.frame_set(0)


main()
