"""The standard block on PETSc and MPI: one linear system needs as many iterations, to the same result, on 1, 2 and 4 processes.

Usage: check_petsc.py SOURCE_FOLDER SCRATCH. Builds tests/petsc/standard_block.cpp in SCRATCH; prints the table of docs/scaling.md.
Exits with 77 where PETSc or MPI is not installed. No time decides anything here.
"""
import itertools
import json
import math
import os
import shutil
import subprocess
import sys
from pathlib import Path

PROCESSES = 1, 2, 4
CELLS, FEW_CELLS = 32, 8     # along an edge; few: the direct solution takes a second
SAME = 1e-12                 # 12 digits of each number: sums of processes end in other bits
BALANCE = 1e-10              # relative to the load
DIRECT = 1e-10               # relative to the largest displacement: assembled in another way, by another program
RESIDUAL = 1e-12             # computed anew; the solver stops at 1e-13 by its own count
MAX_BYTES = 1.3 * 24         # a halo node and product: three doubles, and what the library adds

# The block as standard_block.cpp has it.
EDGE, YOUNGS_MODULUS, POISSONS_RATIO, DENSITY, DT = 1, 1e6, 0.3, 1000, 1 / 240
GRAVITY, PULL = (0, -9.81, 0), (2000, 5000, 3000)

# Containers run as root, on fewer cores than processes, often without ssh and without reads of each other's memory.
ENVIRONMENT = os.environ | {
    "OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1", "OMPI_MCA_plm": "isolated",
    "OMPI_MCA_btl_vader_single_copy_mechanism": "none", "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}


def missing():
    """What is not installed, with its Debian package; None: nothing."""
    for program, package in (("mpicxx", "libopenmpi-dev"), ("mpirun", "openmpi-bin"), ("pkg-config", "pkg-config")):
        if not shutil.which(program):
            return f"{program} (Debian: {package})"
    for library, package in (("petsc", "libpetsc-real-dev"), ("eigen3", "libeigen3-dev")):
        if subprocess.run(["pkg-config", "--exists", library]).returncode:
            return f"{library} (Debian: {package})"
    try:
        import numpy  # noqa: F401
    except ImportError:
        return "numpy (Debian: python3-numpy)"


def build(source, program):
    flags = subprocess.run(["pkg-config", "--cflags", "--libs", "petsc", "eigen3"], check=True, capture_output=True, text=True).stdout
    flags = [f.replace("-I", "-isystem", 1) if f.startswith("-I") else f for f in flags.split()]
    subprocess.run(["mpicxx", "-std=c++20", "-O2", "-DNDEBUG", "-Wall", "-Wextra", "-Werror", source / "tests/petsc/standard_block.cpp",
                    "-o", program, *flags], check=True)


def solve(program, processes, cells, *options):
    command = ["mpirun", "--oversubscribe", "-n", processes, program, "-cells", cells, *options]
    run = subprocess.run(list(map(str, command)), env=ENVIRONMENT, capture_output=True, text=True, timeout=120)
    if run.returncode:
        sys.exit(f"{' '.join(map(str, command))}: exit {run.returncode}\n{run.stdout}{run.stderr}")
    try:
        return json.loads(run.stdout)
    except json.JSONDecodeError:  # nan, for one
        sys.exit(f"{' '.join(map(str, command))}: printed no valid JSON\n{run.stdout}{run.stderr}")


def halo_nodes(run):
    """Nodes beside the box of each process, marked one by one: not what the program says that it has."""
    import numpy as np
    counts = []
    for box in run["processes"]:
        beside = np.zeros([run["cells"] + 1] * 3, bool)
        beside[tuple(slice(max(0, low - 1), high + 1) for low, high in zip(box["low"], box["high"]))] = True
        beside[tuple(map(slice, box["low"], box["high"]))] = False
        counts.append(int(beside.sum()))
    return counts


def numbers(run):
    return [run["work"], *itertools.chain(*run["probes"])]


def difference(run, other):
    return max(abs(a / b - 1) for a, b in zip(numbers(run), numbers(other)))


def largest(values):
    return max(map(abs, values))


def complaints(run, alone):
    """What is wrong with a run on some processes, by kind; alone: the one on a single process."""
    wrong, halos = {}, halo_nodes(run)
    if (run["iterations"], run["iterations_1e6"]) != (alone["iterations"], alone["iterations_1e6"]):
        wrong["iterations"] = f"{run['iterations_1e6']} and {run['iterations']}, alone {alone['iterations_1e6']} and {alone['iterations']}"
    if not run["residual"] < RESIDUAL:
        wrong["residual"] = f"{run['residual']:g}, allowed {RESIDUAL:g}"
    if not difference(run, alone) < SAME:
        wrong["result"] = f"differs by {difference(run, alone):.1e} from that of one process, allowed {SAME:g}"
    if run["product_hash"] != alone["product_hash"]:
        wrong["product"] = f"its bits have the hash {run['product_hash']}, alone {alone['product_hash']}"
    given = [DENSITY * EDGE**3 * g + EDGE**2 * p for g, p in zip(GRAVITY, PULL)]
    off = largest(l - g for l, g in zip(run["load"], given)) / largest(given)
    left = largest(g + r - i for g, r, i in zip(given, run["reaction"], run["inertia"])) / largest(given)
    if not max(off, left) < BALANCE:
        wrong["balance"] = f"load off by {off:.1e}, load + reaction - inertia {left:.1e} of the load, allowed {BALANCE:g}"
    if halos != [p["halo"] for p in run["processes"]]:
        wrong["halo"] = f"{[p['halo'] for p in run['processes']]} nodes, by its boxes {halos}"
    if not 24 * sum(halos) <= run["bytes_a_product"] <= MAX_BYTES * sum(halos):
        wrong["bytes"] = f"{run['bytes_a_product']:.0f} a product for {sum(halos)} halo nodes, allowed {24 * sum(halos)} to {MAX_BYTES * sum(halos):.0f}"
    return wrong


def direct_probes(cells):
    """The same block by a dense factorisation, each tet by its strain-displacement matrix."""
    import numpy as np
    h, n = EDGE / cells, cells + 1
    number = lambda node: (node[2] * n + node[1]) * n + node[0]
    nu, shear = POISSONS_RATIO, YOUNGS_MODULUS / (2 * (1 + POISSONS_RATIO))
    law = np.diag([0.0] * 3 + [shear] * 3)
    law[:3, :3] = YOUNGS_MODULUS / ((1 + nu) * (1 - 2 * nu)) * (nu * np.ones((3, 3)) + (1 - 2 * nu) * np.eye(3))
    matrix, force = np.zeros((3 * n**3, 3 * n**3)), np.zeros((n**3, 3))
    for axes in itertools.permutations(range(3)):
        corners = np.cumsum([np.zeros(3, int), *(np.eye(3, dtype=int)[a] for a in axes)], axis=0)
        gradients = np.linalg.inv(np.hstack([np.ones((4, 1)), h * corners]))[1:]
        strain = np.zeros((6, 12))
        for v, (x, y, z) in enumerate(gradients.T):
            strain[:, 3 * v:3 * v + 3] = [x, 0, 0], [0, y, 0], [0, 0, z], [0, z, y], [z, 0, x], [y, x, 0]
        mass = DENSITY * h**3 / 6 / 4  # of a quarter of a tet
        element = h**3 / 6 * strain.T @ law @ strain + mass / DT**2 * np.eye(12)
        for cell in itertools.product(range(cells), repeat=3):
            nodes = [number(c) for c in cell + corners]
            rows = [3 * a + c for a in nodes for c in range(3)]
            matrix[np.ix_(rows, rows)] += element
            force[nodes] += mass * np.array(GRAVITY)
    for x, z in itertools.product(range(cells), repeat=2):
        force[[number((x + i, cells, z + k)) for i in (0, 1) for k in (0, 1)]] += h * h / 4 * np.array(PULL)
    free = [3 * number((x, y, z)) + c for z in range(n) for y in range(1, n) for x in range(n) for c in range(3)]
    moved = np.zeros(3 * n**3)
    moved[free] = np.linalg.solve(matrix[np.ix_(free, free)], force.ravel()[free])
    probes = (0, cells, cells), (cells // 2, 3 * cells // 4, cells // 2), (cells, cells // 2, cells // 4)
    return moved.reshape(-1, 3)[[number(p) for p in probes]]


def table(runs):
    print("| processes | boxes | iterations to 1e-6 | to 1e-13 | same digits | halo nodes, in all | at most, of one process | bytes a product | of 24 B a halo node |")
    print("|--:|---|--:|--:|--:|--:|--:|--:|--:|")
    for run in runs:
        halos = halo_nodes(run)
        boxes = " x ".join(str(len({p["low"][a] for p in run["processes"]})) for a in range(3))
        row = [len(halos), boxes, run["iterations_1e6"], run["iterations"]]
        apart = difference(run, runs[0])
        row += ["" if run is runs[0] else "all" if apart == 0 else f"{-math.log10(apart):.1f}", sum(halos), max(halos)]
        row += [f"{run['bytes_a_product']:.0f}", f"{run['bytes_a_product'] / (24 * sum(halos)):.3f}" if sum(halos) else ""]
        print("| " + " | ".join(map(str, row)) + " |")


def main(source, scratch):
    scratch.mkdir(parents=True, exist_ok=True)
    program = scratch / "standard_block"
    build(source, program)
    wrong = []
    for cells in (FEW_CELLS, CELLS):
        runs = [solve(program, n, cells) for n in PROCESSES]
        for run in runs:
            wrong += [f"{cells} cells, {len(run['processes'])} processes: {k}: {v}" for k, v in complaints(run, runs[0]).items()]
        if cells == FEW_CELLS:
            alone, direct = runs[0], direct_probes(cells)
            off = abs(direct - alone["probes"]).max() / abs(direct).max()
            print(f"{cells} cells: probes are within {off:.1e} of a direct solution")
            if not off < DIRECT:
                wrong.append(f"{cells} cells: probes {alone['probes']}, a direct solution has {direct.tolist()}")
    print(f"\n{CELLS} cells, {(CELLS + 1)**3} nodes, as one linear system:\n")
    table(runs)

    # A halo that nobody sends: a check that does not see it checks nothing.
    for processes in PROCESSES[1:]:
        seen = complaints(solve(program, processes, FEW_CELLS, "-skip_exchange"), alone)
        blind = {"result", "product", "balance", "bytes"} - set(seen)
        if blind:
            wrong.append(f"no halo was exchanged between {processes} processes, which {', '.join(sorted(blind))} did not show")
    return wrong


if __name__ == "__main__":
    lacking = missing()
    if lacking:
        print(f"skipped: there is no {lacking}")
        sys.exit(77)
    found = main(Path(sys.argv[1]).resolve(), Path(sys.argv[2]).resolve())
    print(*found, sep="\n")
    sys.exit(bool(found))
