"""The memory that a plan foretells against the peak of the run, for what decides about it: shapes, lattices, integrators, solvers, output."""
import re
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

PROGRAM, SOURCE = sys.argv[1], Path(sys.argv[2])
SCENE = (SOURCE / "data/scenes/notched_block.toml").read_text()
OFF_BY = 1.25  # what is promised, either way
PLAN_BYTES = 1 << 30  # of address space, whatever the size
WORLD = 'output.vdb=["phi","energy","arrival","surface","vel","fragment_id"]'
failures = []


def shaped(shape):
    return re.sub(r"cut = .*", "", SCENE.replace("{ box = { size = [1, 1, 1] } }", shape))


# A closed cube, 3 m wide, away from the block.
CRATE = "".join(f"v {x} {y} {z}\n" for z in (3, 6) for y in (-1, 2) for x in (-1, 2)) + "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n"
FAR = """version = 1
name = "far"
time = { frames = [1, 2], fps = 24 }
grid = { voxel_size = 0.05, lattice = "delaunay" }
[[body]]
name = "block"
shape = { box = { size = [1, 1, 1], center = [250, 250, 250] } }
material = "gel"
[material.gel]
youngs_modulus = 1e5
poisson_ratio = 0.3
density = 1000
[fracture]
kappa = 1000
"""
CASES = [  # name, scene, settings
    ("block", SCENE, ["grid.voxel_size=0.02"]),
    ("finer block", SCENE, ["grid.voxel_size=0.014"]),
    ("block-Jacobi", SCENE, ["grid.voxel_size=0.02", 'solver.linear_solver="jacobi"']),
    ("explicit", SCENE, ["grid.voxel_size=0.02", 'solver.integrator="symplectic_euler"', "damping.stiffness=0", "time.substeps=160"]),
    ("five tets", SCENE, ["grid.voxel_size=0.02", 'grid.lattice="five"']),
    ("coarsening 2", SCENE, ["grid.voxel_size=0.01", "grid.coarsening=2"]),
    ("all grids", SCENE, ["grid.voxel_size=0.02", WORLD]),
    ("wide band", SCENE, ["grid.voxel_size=0.02", "grid.half_width=8"]),
    ("ball", shaped("{ sphere = { radius = 0.55 } }"), ["grid.voxel_size=0.02"]),
    ("plate", shaped("{ box = { size = [2, 1, 0.08] } }"), ["grid.voxel_size=0.014"]),
    ("Delaunay", SCENE, ["grid.voxel_size=0.05", 'grid.lattice="delaunay"']),
    ("far Delaunay", FAR, []),
    ("collider", SCENE, ["grid.voxel_size=0.02", 'collider=[{ name = "crate", shape = { mesh = { file = "crate.obj" } } }]']),
    ("plasticity", SCENE, ["grid.voxel_size=0.02", "plasticity.yield_stress=100"]),
    ("direct", SCENE, ["grid.voxel_size=0.07", 'solver.linear_solver="direct"']),
]


def run(*arguments, before=None):
    return subprocess.run([PROGRAM, "sim", *map(str, arguments)], capture_output=True, text=True, timeout=300, preexec_fn=before)


with tempfile.TemporaryDirectory() as temporary:
    top = Path(temporary)
    (top / "crate.obj").write_text(CRATE)
    for name, text, settings in CASES:
        scene = top / f"{name}.toml".replace(" ", "_")
        scene.write_text(text)
        sets = [part for s in settings for part in ("--set", s)]
        plan = run(scene, "-n", "--measure", 0, *sets)
        foretold = float(re.search(r"memory: about ([\d.]+) GiB", plan.stdout)[1])
        fixed = [] if any("substeps" in s for s in settings) else ["--set", "time.substeps=1"]
        done = run(scene, "-o", top / "out", "--overwrite", "-f", 2, "-j", 2, "--progress", "none", *sets, *fixed)
        peak = re.search(r"peak memory ([\d.]+) GiB", done.stderr)
        if done.returncode or not peak:
            failures.append(f"{name}: exit {done.returncode}: {done.stderr}")
            continue
        ratio = foretold / float(peak[1])
        print(f"{name:14} {foretold:.2f} GiB foretold, {float(peak[1]):.2f} used: {ratio:.2f}")
        if not 1 / OFF_BY <= ratio <= OFF_BY:
            failures.append(f"{name}: {foretold} GiB foretold, {peak[1]} used")

    # Whatever the voxels: in little memory, and with an end.
    def little():
        resource.setrlimit(resource.RLIMIT_AS, (PLAN_BYTES, PLAN_BYTES))

    scene = top / "block.toml"
    for voxel in 1e-3, 1e-4, 2e-5:
        said = run(scene, "-n", "--measure", 0, "-j", 2, "--max-memory", 3, "--set", f"grid.voxel_size={voxel}", before=little)
        if said.returncode != 5 or "--max-memory" not in said.stderr or "memory: about" not in said.stdout:
            failures.append(f"voxel {voxel}: exit {said.returncode}: {said.stdout + said.stderr}")
    refused = run(scene, "-o", top / "none", "--max-memory", 0.5, "--set", "grid.voxel_size=0.003")
    if refused.returncode != 5 or (top / "none").exists():
        failures.append(f"above the limit: exit {refused.returncode}: {refused.stderr}")

print("\n".join(failures))
sys.exit(bool(failures))
