"""Runs the quick bench: all keys are there, counts of work and states repeat, and the page on performance can be made of it.

No time is judged. Usage: check_bench.py PROGRAM DOCS_FOLDER.
"""
import csv
import json
import math
import subprocess
import sys
import tempfile
from pathlib import Path

PROGRAM, DOCS = sys.argv[1], Path(sys.argv[2])
MOST_MULTIGRID_GROWTH = 2  # iterations, from the smallest block on
MOST_BYTES_A_NODE = 2048  # of a whole simulation at rest
failures = []


def require(condition, message):
    if not condition:
        failures.append(message)


def bench(*arguments, code=0):
    run = subprocess.run([PROGRAM, "bench", *arguments], capture_output=True, text=True)
    require(run.returncode == code, f"bench {' '.join(arguments)}: exit {run.returncode}, expected {code}\n{run.stderr}")
    return run


def require_keys(holder, keys, where):
    for key in keys:
        require(key in holder, f"{where}: no key '{key}'")
    return all(key in holder for key in keys)


def require_positive(holder, keys, where):
    if require_keys(holder, keys, where):
        for key in keys:
            value = holder[key]
            require(isinstance(value, (int, float)) and math.isfinite(value) and value > 0, f"{where}: {key} is {value}")


def check_floors(floors):
    for row in floors["memory"]:
        require_positive(row, ["threads", "footprint_bytes", "read_gb_per_s", "triad_gb_per_s"], "floors.memory")
    for row in floors["arithmetic"]:
        require_positive(row, ["threads", "double_gflop_per_s"], "floors.arithmetic")
    threads = {row["threads"] for row in floors["memory"]}
    require(threads == {1, 2}, f"floors for {threads} threads, expected 1 and 2")


def check_block(block):
    require_positive(block, ["n", "nodes", "tets", "steps", "probe_m", "reference_probe_m", "speed_up"], "block")
    require(block["nodes"] == block["n"] ** 3 and block["tets"] == 6 * (block["n"] - 1) ** 3, "block: wrong counts of nodes and tets")
    keys = ["threads", "seconds_a_step", "seconds_of_fastest_step", "newton_iterations", "linear_iterations", "evaluations", "products",
            "evaluation_ns_a_tet", "iteration_ns_a_node", "bytes_a_node_and_iteration", "gb_per_s", "floor_gb_per_s", "floor_ns_a_node",
            "share_of_floor"]
    for run in block["runs"]:
        require_positive(run, keys, "block.runs")
        require(run["newton_iterations"] == block["steps"], "block: not one Newton iteration a step")
        require(run["products"] >= run["linear_iterations"], "block: fewer products than iterations")
    multigrid = block["multigrid"]
    require_positive(multigrid, ["threads", "seconds_a_step", "seconds_of_fastest_step", "linear_iterations", "products"], "block.multigrid")
    require(abs(multigrid["probe_m"] - block["probe_m"]) < 1e-5 * block["probe_m"], "block: multigrid comes to another answer")
    counts = [[run[key] for key in ("newton_iterations", "linear_iterations", "evaluations", "products")] for run in block["runs"]]
    require(len(counts) == 2 and counts[0] == counts[1], f"block: work depends on the number of threads: {counts}")


def check_part(part, stages, where):
    require_positive(part, ["steps", "seconds_a_step"], where)
    names = [stage["stage"] for stage in part["stages"]]
    require(set(stages) <= set(names), f"{where}: stages {names}, expected at least {stages}")
    for stage in part["stages"]:
        if stage["stage"] != "wait":  # for the writer of frames: time without work
            require_positive(stage["work"], ["calls"], f"{where}, stage {stage['stage']}")


def check_tear(tear):
    require_positive(tear, ["voxels", "threads", "steps", "frames", "simulated_seconds", "nodes", "tets", "fragments", "newton_iterations",
                            "linear_iterations", "memory_before_bytes", "peak_memory_bytes"], "tear")
    require(tear["peak_memory_bytes"] >= tear["memory_before_bytes"], "tear: the peak is below what was in use before")
    check_part(tear["all_steps"], ["solve", "energy", "fracture", "relevel", "cut", "output"], "tear.all_steps")
    check_part(tear["tearing_steps"], ["solve", "energy", "fracture", "relevel", "cut"], "tear.tearing_steps")


def check_touch(touch):
    require_positive(touch, ["voxels", "threads", "nodes", "steps", "couplings_a_step", "newton_iterations_a_step", "linear_iterations_a_system",
                             "linear_iterations_a_system_without", "seconds_a_step", "contact_seconds_a_step", "seconds_a_step_without"], "touch")
    require(touch["contact_seconds_a_step"] < touch["seconds_a_step"], "touch: contact takes more than all of a step")
    require(touch["couplings_a_step"] > touch["voxels"] ** 2, "touch: fewer couplings than voxels of the faces that are pressed together")


def check_stages(stages):
    require_positive(stages, ["voxels_across", "threads"], "stages")
    names = [stage["stage"] for stage in stages["stages"]]
    expected = ["level set", "relevel", "cut", "re-cut", "energy", "transfer", "Griffith", "surface", "write .obj", "write .vdb", "tets, cut",
                "tets, Delaunay"]
    require(sorted(names) == sorted(expected), f"stages {names}, expected {expected}")
    for stage in stages["stages"]:
        require_positive(stage, ["count", "seconds", "ns_a_unit", "floor_seconds", "share_of_floor"], f"stage {stage['stage']}")


def check_scaling(scaling, exponents):
    """Jacobi takes more iterations the more nodes there are; multigrid does not, not across a crack either."""
    series = {}
    for row in scaling:
        require_positive(row, ["n", "nodes", "linear_iterations", "products", "seconds", "first_seconds"], f"solvers.scaling, n = {row['n']}")
        require(row["newton_iterations"] == 1, f"solvers.scaling: the linear solver failed: {row}")
        series.setdefault((row["method"], row["problem"], row["crack"]), []).append(row)
    require(len(series) == 10, f"solvers.scaling: {sorted(series)}")
    for key, rows in series.items():
        iterations = [row["linear_iterations"] for row in rows]
        if key[0] == "multigrid":
            require(max(iterations) <= iterations[0] + MOST_MULTIGRID_GROWTH, f"solvers.scaling {key}: iterations grow: {iterations}")
        else:
            require(iterations == sorted(iterations), f"solvers.scaling {key}: iterations {iterations}")
        require([row["nodes"] > row["n"] ** 3 for row in rows] == [key[2] != "none"] * len(rows), f"solvers.scaling {key}: wrong numbers of nodes")
    require(len(exponents) == len(series) and all(math.isfinite(fit["seconds"]) for fit in exponents), "solvers.exponents: not one for each")


def check_residuals(runs):
    settings = {(run["method"], run["linear"]) for run in runs}
    require(len(settings) == 5 and len(runs) == 3 * len(settings), f"solvers.time_to_residual: {sorted(settings)}, {len(runs)} runs")
    for run in runs:
        require_positive(run, ["n", "target", "residual", "seconds", "newton_iterations", "linear_iterations"], f"solvers.time_to_residual {run}")
        require((run["products"] == 0) == (run["method"] == "direct"), f"solvers.time_to_residual: products of {run}")
        require(run["residual"] < run["target"], f"solvers.time_to_residual: not reached: {run}")


def check_kernels(kernels):
    require_positive(kernels, ["n", "nodes", "tets", "svd_ns", "svd_over_force"], "kernels")
    require([run["threads"] for run in kernels["runs"]] == [1, 2], "kernels: not on one and two threads")
    for run in kernels["runs"]:
        require_positive(run, ["force_ns_a_tet", "product_ns_a_node", "product_single_ns_a_node", "product_of_means_ns_a_node", "product_ns_a_tet"], "kernels.runs")
    for cut in kernels["cut"]:
        require_positive(cut, ["cells", "cut_cells", "cut_elements", "cut_tets", "whole_tets", "all_ns_a_tet", "whole_ns_a_tet", "cut_ns_a_tet"],
                         f"kernels.cut, {cut['body']}")
    require([cut["duplicated_cells"] > 0 for cut in kernels["cut"]] == [False, True], "kernels.cut: a ball has no cells twice, a sliced one has")


def check_memory(memory):
    for row in memory:
        require_positive(row, ["bytes", "bytes_each"], f"memory, {row.get('what')}")
    for end in ("operator", "tangent", "jacobi", "all levels", "at rest", "at its peak"):
        require(any(row["what"].endswith(end) for row in memory), f"memory: nothing on '{end}'")
    at_rest = [row["bytes_each"] for row in memory if row["what"].endswith("in all at rest")]
    require(at_rest and max(at_rest) <= MOST_BYTES_A_NODE, f"memory: {at_rest} bytes a node at rest, at most {MOST_BYTES_A_NODE} are allowed")


def check_published(tear, scene, vector_unit, folder):
    """The program does the work that the page says it does. Without AVX2 sums round otherwise, and an iteration more or less is right too."""
    if vector_unit == "baseline":
        print("published counts of work: not compared, this processor has no AVX2")
        return
    published = next(row for row in tear if row["voxels"] == 20)
    run = subprocess.run([PROGRAM, "sim", str(scene), "-o", str(folder), "-q"], capture_output=True, text=True)
    require(run.returncode == 0, f"sim {scene}: exit {run.returncode}\n{run.stderr}")
    with open(folder / "stats.csv", newline="") as file:
        steps = list(csv.DictReader(file))
    counts = {"steps": len(steps), "newton_iterations": sum(int(row["newton_iterations"]) for row in steps),
              "linear_iterations": sum(int(row["linear_iterations"]) for row in steps)}
    counts.update({key: int(steps[-1][key]) for key in ("fragments", "nodes", "tets")})
    for key, count in counts.items():
        require(count == published[key], f"performance.json says {published[key]} {key} of the notched block, a run has {count}: measure again")


def make_page(*arguments):
    return subprocess.run(["/usr/bin/python3", str(DOCS / "make_performance.py"), *map(str, arguments)], capture_output=True, text=True)


with tempfile.TemporaryDirectory() as temporary:
    folder = Path(temporary)
    first, second, page = folder / "first.json", folder / "second.json", folder / "performance.md"
    bench("--set", "quick", "-j", "2", "-q", "-o", str(first))
    result = json.loads(first.read_text())
    if require_keys(result, ["program", "version", "set", "machine", "floors", "block", "tear", "touch", "stages", "solvers", "kernels", "memory"], "result"):
        require_keys(result["machine"], ["processor", "cores", "threads", "vector_unit", "memory_bytes", "system", "compiler", "build_type"], "machine")
        check_floors(result["floors"])
        check_block(result["block"][0])
        check_tear(result["tear"][0])
        check_touch(result["touch"][0])
        check_stages(result["stages"])
        check_scaling(result["solvers"]["scaling"], result["solvers"]["exponents"])
        check_residuals(result["solvers"]["time_to_residual"])
        check_kernels(result["kernels"])
        check_memory(result["memory"])

    # A part of it, on stdout, on one thread: the same state to the bit, and nothing that was not asked for.
    part = json.loads(bench("--set", "quick", "--only", "tear", "-j", "1").stdout)
    require(part["tear"][0]["state_hash"] == result["tear"][0]["state_hash"], "tear: the state depends on the number of threads")
    require(not {"floors", "block", "touch", "stages", "solvers", "kernels", "memory"} & set(part), "--only tear: more than that was measured")
    bench("--only", "nonsense", code=2)
    bench("--set", "quick", "--only", "stages", "-o", str(folder / "none" / "out.json"), code=4)

    # The page: of one file, of two that complete each other, with a table only where there is something for it.
    made = make_page(first, "-o", page)
    require(made.returncode == 0, f"make_performance.py failed:\n{made.stderr}")
    text = page.read_text() if page.exists() else ""
    for heading in ("Generated by", "## Machine", "## Floors", "## Standard block", "## Iteration", "## More threads", "## Linear solvers",
                    "## Time to a residual", "## Inner loops", "## Tearing", "## Pressed", "## Stages", "## Memory"):
        require(heading in text, f"page: no '{heading}'")
    require("nan" not in text and "None" not in text, "page: numbers that are none")
    second.write_text(json.dumps(part))
    made = make_page(second, "-o", page)
    require(made.returncode == 0 and "## Tearing" in page.read_text(), f"page of a part:\n{made.stderr}")
    require("## Memory" not in page.read_text() and "## Linear" not in page.read_text(), "page: tables that nothing was measured for")
    second.write_text(json.dumps({"machine": result["machine"], "memory": [{"what": "measured later", "bytes": 123000000, "per": "tet", "bytes_each": 60}]}))
    made = make_page(first, second, "-o", page)
    require(made.returncode == 0 and "## Linear" in page.read_text() and "measured later" in page.read_text(), f"page of two files:\n{made.stderr}")
    require("in all at rest" not in page.read_text(), "page of two files: of two measurements of memory the later one does not count")
    require(make_page(first, second, "-o", page, "--check").returncode == 0, "--check rejects the page that was just made")
    page.write_text(page.read_text() + "by hand\n")
    require(make_page(first, second, "-o", page, "--check").returncode == 1, "--check accepts a page that was edited")
    second.write_text("{")
    require(make_page(second, "-o", page).returncode == 2, "a broken file is not refused")

    published = json.loads((DOCS / "performance.json").read_text())
    check_published(published["tear"], DOCS.parent / "data" / "scenes" / "notched_block.toml", result["machine"]["vector_unit"], folder / "run")

    # What is published is what the script makes of the published numbers.
    made = make_page(DOCS / "performance.json", "-o", DOCS / "performance.md", "--check")
    require(made.returncode == 0, f"docs/performance.md is not what make_performance.py makes of docs/performance.json:\n{made.stderr}")

print("\n".join(failures) or "all as expected")
sys.exit(1 if failures else 0)
