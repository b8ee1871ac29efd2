"""Runs the quick bench: all keys are there, counts of work and states repeat, and the page on performance can be made of it.

No time is judged. Usage: check_bench.py PROGRAM DOCS_FOLDER.
"""
import json
import math
import subprocess
import sys
import tempfile
from pathlib import Path

PROGRAM, DOCS = sys.argv[1], Path(sys.argv[2])
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
    counts = [[run[key] for key in ("newton_iterations", "linear_iterations", "evaluations", "products")] for run in block["runs"]]
    require(len(counts) == 2 and counts[0] == counts[1], f"block: work depends on the number of threads: {counts}")


def check_part(part, stages, where):
    require_positive(part, ["steps", "seconds_a_step"], where)
    names = [stage["stage"] for stage in part["stages"]]
    require(set(stages) <= set(names), f"{where}: stages {names}, expected at least {stages}")
    for stage in part["stages"]:
        require_positive(stage["work"], ["calls"], f"{where}, stage {stage['stage']}")


def check_tear(tear):
    require_positive(tear, ["voxels", "threads", "steps", "frames", "simulated_seconds", "nodes", "tets", "fragments", "newton_iterations",
                            "linear_iterations", "memory_before_bytes", "peak_memory_bytes"], "tear")
    require(tear["peak_memory_bytes"] >= tear["memory_before_bytes"], "tear: the peak is below what was in use before")
    check_part(tear["all_steps"], ["solve", "energy", "fracture", "relevel", "cut", "output"], "tear.all_steps")
    check_part(tear["tearing_steps"], ["solve", "energy", "fracture", "relevel", "cut"], "tear.tearing_steps")


def check_stages(stages):
    require_positive(stages, ["voxels_across", "threads"], "stages")
    names = [stage["stage"] for stage in stages["stages"]]
    expected = ["level set", "relevel", "cut", "re-cut", "surface", "write .obj", "write .vdb"]
    require(sorted(names) == sorted(expected), f"stages {names}, expected {expected}")
    for stage in stages["stages"]:
        require_positive(stage, ["count", "seconds", "ns_a_unit"], f"stage {stage['stage']}")


def make_page(*arguments):
    return subprocess.run(["/usr/bin/python3", str(DOCS / "make_performance.py"), *map(str, arguments)], capture_output=True, text=True)


with tempfile.TemporaryDirectory() as temporary:
    folder = Path(temporary)
    first, second, page = folder / "first.json", folder / "second.json", folder / "performance.md"
    bench("--set", "quick", "-j", "2", "-q", "-o", str(first))
    result = json.loads(first.read_text())
    if require_keys(result, ["program", "version", "set", "machine", "floors", "block", "tear", "stages"], "result"):
        require_keys(result["machine"], ["processor", "cores", "threads", "vector_unit", "memory_bytes", "system", "compiler", "build_type"], "machine")
        check_floors(result["floors"])
        check_block(result["block"][0])
        check_tear(result["tear"][0])
        check_stages(result["stages"])

    # A part of it, on stdout, on one thread: the same state to the bit, and nothing that was not asked for.
    part = json.loads(bench("--set", "quick", "--only", "tear", "-j", "1").stdout)
    require(part["tear"][0]["state_hash"] == result["tear"][0]["state_hash"], "tear: the state depends on the number of threads")
    require(not {"floors", "block", "stages"} & set(part), "--only tear: more than that was measured")
    bench("--only", "nonsense", code=2)
    bench("--set", "quick", "--only", "stages", "-o", str(folder / "none" / "out.json"), code=4)

    # The page: of one file, of two that complete each other, with the memory table only where there is something for it.
    made = make_page(first, "-o", page)
    require(made.returncode == 0, f"make_performance.py failed:\n{made.stderr}")
    text = page.read_text() if page.exists() else ""
    for heading in ("Generated by", "## Machine", "## Floors", "## Standard block", "## Iteration", "## Tearing", "## Stages"):
        require(heading in text, f"page: no '{heading}'")
    require("## Memory" not in text, "page: a table of memory that nothing was measured for")
    require("nan" not in text and "None" not in text, "page: numbers that are none")
    second.write_text(json.dumps({"machine": result["machine"], "memory": [{"what": "tangent", "bytes": 123000000, "per": "tet", "bytes_each": 60}]}))
    made = make_page(first, second, "-o", page)
    require(made.returncode == 0 and "## Memory" in page.read_text() and "tangent" in page.read_text(), f"page of two files:\n{made.stderr}")
    require(make_page(first, second, "-o", page, "--check").returncode == 0, "--check rejects the page that was just made")
    page.write_text(page.read_text() + "by hand\n")
    require(make_page(first, second, "-o", page, "--check").returncode == 1, "--check accepts a page that was edited")
    second.write_text("{")
    require(make_page(second, "-o", page).returncode == 2, "a broken file is not refused")

    # What is published is what the script makes of the published numbers.
    made = make_page(DOCS / "performance.json", "-o", DOCS / "performance.md", "--check")
    require(made.returncode == 0, f"docs/performance.md is not what make_performance.py makes of docs/performance.json:\n{made.stderr}")

print("\n".join(failures) or "all as expected")
sys.exit(1 if failures else 0)
