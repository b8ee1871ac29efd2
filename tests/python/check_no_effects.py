"""Counts the instructions of an elastic scene in two builds, with all effects and with none: they may differ by 0.5 %.
The second knows no effect.

Only what main() does counts. Loading takes several times as many, and how many depends on how the names of a program fall into
the linker's hash table.
"""
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

LIMIT = 0.005
SCENE = """
version = 1
name = "elastic"
[time]
frames = [1, 3]
substeps = 2
[grid]
voxel_size = 0.1
[[body]]
name = "bar"
shape = { box = { size = [0.4, 1, 0.4] } }
material = "gel"
[material.gel]
youngs_modulus = 1e5
poisson_ratio = 0.3
density = 1000
[[grip]]
body = "bar"
region = { halfspace = { normal = [0, 1, 0], offset = 0.5 } }
move = { velocity = [0, 0.5, 0] }
[output]
vdb = []
obj = false
"""


def instructions(program: str, folder: Path) -> int:
    scene = folder / "scene.toml"
    scene.write_text(SCENE)
    run = subprocess.run(
        ["valgrind", "--tool=callgrind", f"--callgrind-out-file={folder}/profile", "--toggle-collect=main", program, "sim", str(scene), "-j", "1",
         "-o", str(folder / Path(program).name), "--progress", "none"],
        capture_output=True, text=True, env={**os.environ, "LD_BIND_NOW": "1"})
    found = re.search(r"Collected : (\d+)", run.stderr)
    if run.returncode != 0 or not found:
        sys.exit(f"{program}: exit {run.returncode}\n{run.stderr}")
    return int(found.group(1))


with tempfile.TemporaryDirectory() as name:
    torn = Path(name) / "torn.toml"
    torn.write_text(SCENE + "[fracture]\nkappa = 1\n")
    known = [subprocess.run([program, "check", str(torn)], capture_output=True).returncode for program in sys.argv[1:3]]
    if known != [0, 2]:
        sys.exit(f"[fracture]: exit {known[0]} with all effects, {known[1]} with none")
    everything, nothing = (instructions(program, Path(name)) for program in sys.argv[1:3])
difference = abs(everything - nothing) / nothing
print(f"with all effects {everything}, with none {nothing} instructions: {100 * difference:.4f} % apart")
if difference > LIMIT:
    sys.exit(f"more than {100 * LIMIT} %")
