"""The .vdb files of vdbfrac relevel, opened by programs that are not ours: pyopenvdb reads what 'vdbfrac info' says, and the
distances themselves; vdb_print lists it.

Usage: check_relevel_files.py PROGRAM.
"""
import json
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import pyopenvdb

PROGRAM = sys.argv[1]
VDB_PRINT = shutil.which("vdb_print")
RADIUS, CENTER = 0.5, np.array([0.1, -0.2, 0.3])  # m
# The ball is made of flat triangles: they lie up to RADIUS * (1 - cos of half their width) below it.
FACETS = 48
SAG = RADIUS * (1 - np.cos(2 * np.pi / FACETS))
failures = []


def check(name, good, detail=""):
    if not good:
        failures.append(f"{name}: {detail}")


def vdbfrac(*arguments):
    run = subprocess.run([PROGRAM, *map(str, arguments), "--json"], capture_output=True, text=True, timeout=300)
    if run.returncode != 0:
        sys.exit("\n".join([*failures, f"vdbfrac {' '.join(map(str, arguments))}: exit {run.returncode}\n{run.stderr}"]))
    return json.loads(run.stdout)


def write_ball(file, rings_left_out=0):
    """A ball of triangles and quads, outward; without its first rings it has a hole at the top."""
    rings, rows = FACETS // 2, []
    for i in range(1, rings):
        around = 2 * np.pi * np.arange(FACETS) / FACETS
        z, r = np.cos(np.pi * i / rings), np.sin(np.pi * i / rings)
        rows += [(r * np.cos(a), r * np.sin(a), z) for a in around]
    points = CENTER + RADIUS * np.array([*rows, (0, 0, 1), (0, 0, -1)])
    top, bottom = len(points) - 1, len(points)
    faces = [] if rings_left_out else [(top, 1 + k, 1 + (k + 1) % FACETS) for k in range(FACETS)]
    for i in range(max(rings_left_out - 1, 0), rings - 2):
        at = [1 + i * FACETS + k for k in range(FACETS)]
        faces += [(at[k], at[k] + FACETS, at[(k + 1) % FACETS] + FACETS, at[(k + 1) % FACETS]) for k in range(FACETS)]
    last = 1 + (rings - 2) * FACETS
    faces += [(bottom, last + (k + 1) % FACETS, last + k) for k in range(FACETS)]
    file.write_text("".join(f"v {x:.6f} {y:.6f} {z:.6f}\n" for x, y, z in points) + "".join("f " + " ".join(map(str, f)) + "\n" for f in faces))


def check_distances(name, grid, said, most):
    """Every voxel of the band holds its distance to the ball; inside the background is negative, outside positive."""
    lower, upper = said["lower_voxel"], said["upper_voxel"]
    values = np.empty([upper[a] - lower[a] + 3 for a in range(3)], np.float32)
    grid.copyToArray(values, ijk=tuple(x - 1 for x in lower))
    x, y, z = (said["voxel_size"] * (np.arange(values.shape[a]) + lower[a] - 1) - CENTER[a] for a in range(3))
    exact = np.sqrt(x[:, None, None] ** 2 + y[:, None] ** 2 + z**2) - RADIUS
    background = said["background"]
    worst = np.abs(values - np.clip(exact, -background, background)).max()
    check(f"{name} holds distances", worst < most, f"off by {worst} m, at most {most}")
    in_band = int((np.abs(values) < np.float32(background)).sum())
    check(f"{name} has just its band active", in_band == said["active_voxels"], (in_band, said["active_voxels"]))


def check_grid(name, file, report, half_width, most):
    said = vdbfrac("info", file)["grids"]
    grids, _ = pyopenvdb.readAll(str(file))
    check(f"{name} holds one grid", len(grids) == len(said) == 1, (len(grids), said))
    grid, said = grids[0], said[0]
    check(f"{name} is named", grid.name == said["name"] == "phi", grid.name)
    check(f"{name} is a level set of floats", isinstance(grid, pyopenvdb.FloatGrid) and grid.gridClass == pyopenvdb.GridClass.LEVEL_SET
          and said["class"] == "level set" and said["type"] == "float", (grid.gridClass, said))
    check(f"{name} has its voxels", grid.activeVoxelCount() == said["active_voxels"] == report["active_voxels"] > 0, grid.activeVoxelCount())
    voxels = {*grid.transform.voxelSize(), said["voxel_size"], report["voxel_size"]}
    check(f"{name} has its voxel size", max(voxels) - min(voxels) < 1e-12 * max(voxels), voxels)
    check(f"{name} has its background", grid.background == said["background"] == np.float32(half_width * said["voxel_size"]), grid.background)
    check(f"{name} has its box", list(map(list, grid.evalActiveVoxelBoundingBox())) == [said["lower_voxel"], said["upper_voxel"]],
          grid.evalActiveVoxelBoundingBox())
    check(f"{name} lies where it says", np.allclose(grid.transform.indexToWorld(tuple(said["lower_voxel"])), said["lower"], rtol=1e-12), said)
    check(f"{name} tells its metadata", {k: str(v) for k, v in grid.metadata.items()}.items() >= {"length_unit": "m", "units": "m"}.items(), grid.metadata)
    check_distances(name, grid, said, most)
    check_with_vdb_print(name, file, said)


def check_with_vdb_print(name, file, said):
    shown = subprocess.run([VDB_PRINT, "-l", str(file)], capture_output=True, text=True)
    check(f"vdb_print of {name}", shown.returncode == 0, shown.stderr)
    found = {key: value.strip() for key, value in re.findall(r"^\s*(.+?): (.+)$", shown.stdout, re.MULTILINE)}
    expected = {"Name": said["name"], "Type": "Tree_float_5_4_3", "class": "level set", "Number of active voxels": f"{said['active_voxels']:,}",
                "Bounding box of active voxels": f"{said['lower_voxel']} -> {said['upper_voxel']}"}
    for key, value in expected.items():
        check(f"vdb_print tells the {key.lower()} of {name}", found.get(key) == value, (value, found.get(key)))
    check(f"vdb_print tells the background of {name}", abs(float(found["Background value"]) / said["background"] - 1) < 1e-5, found["Background value"])


with tempfile.TemporaryDirectory() as temporary:
    folder = Path(temporary)
    check("vdb_print is installed (Debian package libopenvdb-tools)", VDB_PRINT)
    whole, holed = folder / "whole.obj", folder / "holed.obj"
    write_ball(whole)
    write_ball(holed, rings_left_out=2)
    hole = RADIUS * (1 - np.cos(2 * np.pi / (FACETS // 2)))  # how deep a flat lid lies below the ball
    steps = (
        # name, input, options, half width [voxels], largest error [m]
        ("a ball", whole, ["--voxel", 0.025], 3, 2 * SAG),
        ("a ball with a hole", holed, ["--across", 40, "--half-width", 5], 5, hole + SAG),
        ("a grid", folder / "a ball.vdb", [], 3, 2 * SAG),
        ("a grid made coarser", folder / "a ball.vdb", ["--voxel", 0.04, "--half-width", 4], 4, 2 * SAG),
    )
    # What is going on is said, and what was lost; numbers that are none are refused.
    run = lambda *arguments: subprocess.run([PROGRAM, "relevel", *map(str, arguments)], capture_output=True, text=True, timeout=300)
    coarse = run(whole, "-o", folder / "coarse.vdb", "--voxel", 0.3, "--json")
    report = json.loads(coarse.stdout)
    for word in ("reading", "cleaning", "making a level set", "measuring", "note: the input encloses"):
        check(f"relevel says '{word}'", word in coarse.stderr, coarse.stderr)
    lost = report["after"]["volume"] / report["input_volume"] - 1
    check("what is lost is told", lost < -0.03 and abs(report["volume_change"] - lost) < 1e-12 and len(report["notes"]) == 1, report)
    check("no gaps in a ball", report["filled_gaps"] == 0, report)
    check("relevel -q says nothing", run(whole, "-o", folder / "coarse.vdb", "--voxel", 0.3, "-q").stderr == "")
    check("a voxel larger than the ball is refused", (refused := run(whole, "-o", folder / "x.vdb", "--voxel", 5)).returncode == 2
          and "larger than the whole surface" in refused.stderr, refused.stderr)
    for option in ("--voxel", "--wrap", "--max-memory"):
        for number in ("1e300", "nan", "inf", "1e999", "0", "-1"):
            refused = run(whole, "-o", folder / "x.vdb", "--across", 10, f"{option}={number}") if option != "--voxel" else run(whole, "-o", folder / "x.vdb", f"{option}={number}")
            check(f"{option} {number} is refused", refused.returncode == 2 and "finite number above 0" in refused.stderr, (refused.returncode, refused.stderr))
    for name, source, options, half_width, most in steps if VDB_PRINT else ():
        file = folder / f"{name}.vdb"
        check_grid(name, file, vdbfrac("relevel", source, "-o", file, "-q", *options), half_width, most)

print("\n".join(failures) or "all as expected")
sys.exit(1 if failures else 0)
