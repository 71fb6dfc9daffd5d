"""Run by a Python that has bpy: runs an export's script and prints what stands in the scene, as JSON."""

import json
import runpy
import sys

import bpy

script, *names = sys.argv[1:]
bpy.ops.wm.read_factory_settings(use_empty=True)
runpy.run_path(script, run_name="__main__")
scene = bpy.context.scene
said = {"end": scene.frame_end, "unit": scene.unit_settings.scale_length, "frames": [], "head": []}
head = bpy.data.objects["capture_plan_head"]
said["polygons"] = len(head.data.polygons)
said["empties"] = [o.name for o in bpy.data.objects if o.type == "EMPTY"]
for frame in range(scene.frame_end + 1):
    scene.frame_set(frame)
    said["frames"].append([list(bpy.data.objects[name].matrix_world.translation) for name in said["empties"]])
    if frame < 2:
        posed = head.evaluated_get(bpy.context.evaluated_depsgraph_get())
        said["head"].append([list(posed.matrix_world @ v.co) for v in posed.data.vertices])
print(f"\n{json.dumps(said)}")
