"""Blender, without a display, imports what is written for it: .obj with .mdd, .ply, .vdb. (Debian's Blender reads no USD.)

Usage: check_blender.py PROGRAM SOURCE_FOLDER. Exits with 77 where Blender is not installed.
"""
import json
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

FRAMES = 16

INSIDE_BLENDER = '''
import bpy, json, sys
folder, frames = sys.argv[-2], int(sys.argv[-1])
bpy.ops.wm.read_factory_settings(use_empty=True)
told = {}

def box(mesh):
    return [[f(v.co[k] for v in mesh.vertices) for k in range(3)] for f in (min, max)]

bpy.ops.wm.obj_import(filepath=folder + "/e.obj")
(obj,) = bpy.data.objects
told["materials"] = [m.name for m in obj.data.materials]
told["colours"] = [list(m.diffuse_color)[:3] for m in obj.data.materials]
told["uv_layers"] = len(obj.data.uv_layers)
told["points"], told["faces"] = len(obj.data.vertices), len(obj.data.polygons)
cache = obj.modifiers.new("motion", "MESH_CACHE")
cache.cache_format, cache.filepath = "MDD", folder + "/e.mdd"
told["boxes"] = []
for frame in (1, frames):
    bpy.context.scene.frame_set(frame - 1)  # Blender counts the frames of a cache from 0
    told["boxes"].append(box(obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).data))
bpy.ops.import_mesh.ply(filepath=f"{folder}/e.{frames:04}.ply")
told["ply"] = [len(bpy.context.object.data.vertices), box(bpy.context.object.data)]
bpy.ops.object.volume_import(filepath=f"{folder}/run/vdb/notched_block.{frames:04}.vdb", files=[{"name": f"notched_block.{frames:04}.vdb"}], directory=folder + "/run/vdb")
volume = bpy.context.object.data
volume.grids.load()
told["grids"] = sorted(grid.name for grid in volume.grids)
print("TOLD" + json.dumps(told))
'''


def near(a, b, by=1e-4):
    return all(abs(x - y) < by for p, q in zip(a, b) for x, y in zip(p, q))


def main(program, source, folder):
    scene, run = source / "data/scenes/notched_block.toml", folder / "run"
    tool = lambda *a: subprocess.run([program, *map(str, a)], check=True, capture_output=True, timeout=300)
    tool("sim", scene, "-o", run, "-q", "-f", FRAMES, "--set", "output.motion=true",
         "--set", 'output.vdb=["phi","surface","vel"]')
    tool("embed", run, "-o", folder / "e.obj")
    tool("embed", run, "-o", folder / "e.####.ply")
    if not shutil.which("blender"):
        return None
    script = folder / "inside.py"
    script.write_text(INSIDE_BLENDER)
    said = subprocess.run(["blender", "--background", "--python-exit-code", "3", "--python", script, "--", folder, str(FRAMES)],
                          capture_output=True, text=True, timeout=300)
    told = [line[4:] for line in said.stdout.splitlines() if line.startswith("TOLD")]
    if said.returncode or not told:
        return [f"Blender: exit {said.returncode}\n{said.stdout}{said.stderr}"]
    told = json.loads(told[0])
    lines = (folder / "e.obj").read_text().splitlines()
    points = [list(map(float, l.split()[1:])) for l in lines if l.startswith("v ")]
    first = [[f(p[k] for p in points) for k in range(3)] for f in (min, max)]
    wrong = []
    if told["materials"] != ["gel", "inside"] or not near([told["colours"][0]], [[0.45, 0.68, 0.7]]):
        wrong.append(f"materials {told['materials']} of {told['colours']}")
    if told["uv_layers"] != 1 or told["points"] != len(points) or told["faces"] != sum(l.startswith("f ") for l in lines):
        wrong.append(f"counts {told}")
    if not near(told["boxes"][0], first):
        wrong.append(f"the first frame fills {told['boxes'][0]}, not {first}")
    opened = 0.1 * (FRAMES - 1) / 24  # m that either grip has moved
    if abs(told["boxes"][1][1][1] - first[1][1] - opened) > 1e-3:
        wrong.append(f"the last frame fills {told['boxes'][1]}")
    if told["ply"][0] != len(points) or not near(told["ply"][1], told["boxes"][1]):
        wrong.append(f".ply: {told['ply']}, not {told['boxes'][1]}")
    if told["grids"] != ["phi", "surface", "vel"]:
        wrong.append(f"grids {told['grids']}")
    return wrong


with tempfile.TemporaryDirectory() as name:
    wrong = main(sys.argv[1], Path(sys.argv[2]), Path(name))
if wrong is None:  # what it imports is made all the same, as nobody would see otherwise that it can't be any more
    print("skipped: Blender is not installed (Debian package blender)")
    sys.exit(77)
for line in wrong:
    print(f"check_blender: {line}")
sys.exit(bool(wrong))
