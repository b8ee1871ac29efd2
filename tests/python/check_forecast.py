"""What `vdbfrac sim -n` foretells, against runs: steps within 2 times, bytes on the disk within 1.2 times, on scenes that
tear, swing, touch and rest. Seconds are printed beside each other; they decide nothing here.

Usage: check_forecast.py PROGRAM SOURCE_FOLDER [--all]. Short forecasts of short runs, so that pilots on wider voxels are
needed; --all: twelve scenes, some of them minutes long, as a table in Markdown.
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
MOST_STEPS, MOST_BYTES = 2, 1.2

# Scene, settings, seconds to measure for.
SHORT = [("notched_block", ["grid.voxel_size=0.04", "time.frames=[1, 48]"], 1.5), ("bar", [], 0.5), ("two_bodies", [], 0.7),
         ("dog_bone", [], 1.0)]
ALL = [("notched_block", [], 3), ("notched_block", ["grid.voxel_size=0.025", "time.frames=[1, 40]"], 10),
       ("notched_block", ["grid.voxel_size=0.02", "time.frames=[1, 30]", "output.vdb=[\"surface\",\"vel\",\"fragment_id\"]"], 10),
       ("bar", ["grid.voxel_size=0.0125"], 5), ("dog_bone", [], 5), ("twist", [], 5), ("two_bodies", [], 3), ("slit_plate", [], 5),
       ("gingerbread_man", [], 5), ("delaunay", [], 3), ("tumble", [], 5), ("press", ["time.frames=[1, 40]"], 10)]
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
    line = re.search(r"time: about (.*) on \d+ threads?, (\d+) steps of .*; from (.*)\n.*disk: about (.*?):", said)
    return sum_of(line[1]), int(line[2]), sum_of(line[4]), line[3]


def measured(folder, seconds):
    steps = json.loads((folder / "run.json").read_text())["steps"]
    return seconds, steps, sum(f.stat().st_size for f in folder.rglob("*") if f.is_file() and f.name != "run.log")


def compare(name, settings, measure_for, top):
    scene, sets = SOURCE / f"data/scenes/{name}.toml", [a for s in settings for a in ("--set", s)]
    said = tool("sim", scene, "-n", "--measure", measure_for, *sets)
    folder = top / name
    began = time.monotonic()
    tool("sim", scene, "-o", folder, "-q", "--overwrite", *sets)
    found = measured(folder, time.monotonic() - began)
    told = foretold(said)
    ratios = [t / f for t, f in zip(told, found)]
    print(f"| {name} {' '.join(settings)} | {told[3]} | " + " | ".join(f"{t:.3g} / {f:.3g} = {r:.2f}" for t, f, r in zip(told, found, ratios)) + " |", flush=True)
    for what, ratio, most in ("steps", ratios[1], MOST_STEPS), ("bytes", ratios[2], MOST_BYTES):
        if not 1 / most <= ratio <= most:
            failures.append(f"{name}: {ratio:.2f} times the {what}, allowed {1 / most:.2f} to {most}")
    for what in "grip", "files:", "from (":
        if what not in said and not (what == "grip" and "[[grip]]" in said):
            failures.append(f"{name}: the plan says nothing of {what}")


with tempfile.TemporaryDirectory() as temporary:
    print("| scene | from | seconds | steps | bytes |\n|---|---|--:|--:|--:|")
    for case in ALL if "--all" in sys.argv else SHORT:
        compare(*case, Path(temporary))
print("\n".join(failures) or "forecasts are as they should be")
sys.exit(1 if failures else 0)
