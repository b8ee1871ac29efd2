#!/usr/bin/env python3
"""What `vdbfrac sim -n` foretells beside what runs take, on twelve scenes, as the table of docs/measured.md.

Usage: measure_forecasts.py PROGRAM SOURCE_FOLDER. Takes some six minutes. Exits with 1 where time or steps are beyond 2 times,
bytes beyond 1.2 times.
"""
import json
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

PROGRAM, SOURCE = sys.argv[1], Path(sys.argv[2])
UNITS = {"kB": 1e3, "MB": 1e6, "GB": 1e9, "s": 1, "min": 60, "h": 3600}
MOST, MOST_BYTES = 2, 1.2

ALL = [("notched_block", []), ("notched_block", ["grid.voxel_size=0.025", "time.frames=[1, 40]"]),
       ("notched_block", ["grid.voxel_size=0.02", "time.frames=[1, 30]", "output.vdb=[\"surface\",\"vel\",\"fragment_id\"]"]),
       ("bar", ["grid.voxel_size=0.0125"]), ("dog_bone", ["grid.voxel_size=0.02"]), ("twist", []), ("two_bodies", ["grid.voxel_size=0.02"]),
       ("slit_plate", []), ("gingerbread_man", []), ("delaunay", []), ("tumble", []), ("press", ["time.frames=[1, 40]"])]
failures = []


def tool(*arguments):
    run = subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True, timeout=1200)
    if run.returncode != 0:
        sys.exit(f"{arguments}: exit {run.returncode}\n{run.stdout}{run.stderr}")
    return run.stdout


def sum_of(text):
    """Of numbers with their units: "4 min 20 s", "169 MB"."""
    return sum(float(n) * UNITS[u] for n, u in re.findall(r"([\d.e+-]+) (\w+)", text))


def foretold(said):
    line = re.search(r"time: (?:about|between .* and) (.*) on \d+ threads?, (\d+) steps of .*; from (.*)\n.*disk: about (.*?):", said)
    return sum_of(line[1]), int(line[2]), sum_of(line[4]), line[3]


def measured(folder, seconds):
    steps = json.loads((folder / "run.json").read_text())["steps"]
    return seconds, steps, sum(f.stat().st_size for f in folder.rglob("*") if f.is_file() and f.name != "run.log")


def compare(name, settings, top):
    scene, sets = SOURCE / f"data/scenes/{name}.toml", [a for s in settings for a in ("--set", s)]
    said = tool("sim", scene, "-n", *sets)
    folder = top / name
    began = time.monotonic()
    tool("sim", scene, "-o", folder, "-q", "--overwrite", *sets)
    found = measured(folder, time.monotonic() - began)
    told = foretold(said)
    ratios = [t / f for t, f in zip(told, found)]
    print(f"| {name} {' '.join(settings)} | {told[3]} | " + " | ".join(f"{t:.3g} / {f:.3g} = {r:.2f}" for t, f, r in zip(told, found, ratios)) + " |", flush=True)
    for what, ratio, most in ("seconds", ratios[0], MOST), ("steps", ratios[1], MOST), ("bytes", ratios[2], MOST_BYTES):
        if not 1 / most <= ratio <= most:
            failures.append(f"{name}: {ratio:.2f} times the {what}, allowed {1 / most:.2f} to {most}")


with tempfile.TemporaryDirectory() as temporary:
    print("| scene | from | seconds | steps | bytes |\n|---|---|--:|--:|--:|")
    for case in ALL:
        compare(*case, Path(temporary))
print("\n".join(failures) or "forecasts are as they should be")
sys.exit(1 if failures else 0)
