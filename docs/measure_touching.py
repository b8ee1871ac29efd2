#!/usr/bin/env python3
"""What scenes that touch cost, and how deep things go into each other, as the table of docs/gallery.md.

Usage: measure_touching.py PROGRAM SOURCE_FOLDER. Takes some ten minutes on two cores. Exits with 1 where, in a frame, two
fragments are in each other by more than MOST voxels, or where anything in `shot` is by more than MOST_SHOT, in any step.
"""
import csv
import re
import subprocess
import sys
import tempfile
from pathlib import Path

PROGRAM, SOURCE = sys.argv[1], Path(sys.argv[2])
MOST, MOST_SHOT = .2, .1
ALL = [("cheese", .01), ("cheese", .008), ("press", .05), ("press", .036), ("shot", .0125), ("shot", .01), ("released", .05), ("released", .033),
       ("splat", .025), ("torn_over_table", .04), ("torn_over_table", .025)]
STAGES = [("solve",), ("contact", "collider"), ("draw",), ("energy", "fracture", "relevel", "cut", "rebuild")]
DEPTHS = ["contact_depth_m", "contact_self_depth_m", "collider_depth_m"]


def seconds_of(log):
    """By stage, and in all."""
    return {name: float(s) for name, s in re.findall(r"^(\w+) +([\d.]+)(?: |$)", log[log.rindex("\nstage "):], re.MULTILINE)}


def depths_of(folder, fps, dx):
    """Of each kind, in voxels: the deepest in frames, and in any step."""
    with open(folder / "stats.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    at_frames = [r for r in rows if abs(float(r["time_s"]) * fps - round(float(r["time_s"]) * fps)) < 1e-6]
    return [tuple(max(float(r[kind]) for r in some) / dx for some in (at_frames, rows)) if kind in rows[0] else None for kind in DEPTHS]


def row(name, dx, top):
    folder = top / f"{name}{dx}"
    command = [PROGRAM, "sim", SOURCE / f"data/scenes/{name}.toml", "-o", folder, "-q", "--set", f"grid.voxel_size={dx}"]
    subprocess.run([str(c) for c in command], check=True, timeout=3600)
    log = (folder / "run.log").read_text()
    took = seconds_of(log)
    frames = len(list((folder / "obj").glob("*.obj")))
    nodes = next(csv.DictReader(open(folder / "stats.csv", newline="")))["nodes"]
    fps = float(re.search(r"^fps = ([\d.]+)", (folder / "scene.toml").read_text(), re.MULTILINE)[1])
    depths = depths_of(folder, fps, dx)
    shares = ["" if not any(s in took for s in some) else f"{sum(took.get(s, 0) for s in some) / took['all']:.0%}".replace("%", " %") for some in STAGES]
    told = ["" if d is None else f"{d[0]:.2f} ({d[1]:.2f})" for d in depths]
    print("| " + " | ".join([f"`{name}`", str(dx), nodes, f"{took['all'] / frames:.2f}", *shares, *told]) + " |", flush=True)
    wrong = []
    if depths[0] and depths[0][0] > MOST:
        wrong.append(f"{name} at {dx} m: {depths[0][0]:.2f} voxels")
    if name == "shot" and (most := max(d[1] for d in depths)) > MOST_SHOT:
        wrong.append(f"{name} at {dx} m: {most:.2f} voxels in a step")
    return wrong


with tempfile.TemporaryDirectory() as temporary:
    print("| scene | voxel, m | nodes at the start | seconds a frame | solve | contact, colliders | drawing | fracture, cut "
          "| depth, voxels: others | themselves | colliders |\n|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|")
    deep = [wrong for name, dx in ALL for wrong in row(name, dx, Path(temporary))]
print("\n".join(deep) or f"no two fragments are in each other by more than {MOST} voxels in any frame, nothing in shot by {MOST_SHOT} in any step")
sys.exit(1 if deep else 0)
