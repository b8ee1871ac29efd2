"""vdbfrac study as a user meets it: the same for any number of threads, failures with their reasons, resumed runs, files."""
import csv
import json
import re
import subprocess
import sys
import tempfile
import time
import tomllib
import xml.etree.ElementTree as xml
from pathlib import Path

PROGRAM, SOURCE = sys.argv[1], Path(sys.argv[2])
BAR = SOURCE / "data/scenes/studies/bar.toml"
ASYMPTOTIC = 0.15  # how far an observed order may be from the expected one
failures = []


def study(name, arguments, code=0, *texts):
    run = subprocess.run([PROGRAM, "study", *map(str, arguments)], capture_output=True, text=True, timeout=240)
    said = run.stdout + run.stderr
    missing = [t for t in texts if t not in said]
    if run.returncode != code or missing:
        failures.append(f"{name}: exit {run.returncode} (expected {code}), missing {missing} in:\n{said}")
    return run


def expect(name, holds):
    if not holds:
        failures.append(name)


def report(folder):
    return json.loads((folder / "study.json").read_text())


def outcome(folder):
    """What must not depend on threads or on what was reused."""
    return [(r["values"], r["work"], r["state"]) for r in report(folder)["runs"]]


def result_of(folder, run):
    """The file of a run's result."""
    return folder / f"runs/{report(folder)['runs'][run]['fingerprint']}.json"


def wait_for(what, seconds=20):
    """What becomes true, or None."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if found := what():
            return found
        time.sleep(0.05)
    return None


def children_of(process):
    return [int(c) for c in Path(f"/proc/{process}/task/{process}/children").read_text().split()]


def is_alive(process):
    try:
        return Path(f"/proc/{process}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except OSError:
        return False


with tempfile.TemporaryDirectory() as temporary:
    folder = Path(temporary)
    a, b, c = folder / "a", folder / "b", folder / "c"

    # Values, and the order of backward Euler.
    said = study("bar", [BAR, "-o", a, "-j", "2", "--rounds", "2"], 0, "cheapest setting", "observed order", "round 2").stdout
    bar = report(a)
    orders = {o["series"]: o for o in bar["measures"][0]["orders"]}
    order = orders["time step"]["differences"]
    expect(f"backward Euler is of first order: {order}", order and abs(order - orders["time step"]["expected"]) < ASYMPTOTIC)
    expect("series that start at the same scene share a run", len(bar["settings"]) == len(bar["runs"]) + 1)
    expect("every run was timed twice", all(len(r["round_seconds"]) == 2 for r in bar["runs"]))
    expect("time is relative to the first", bar["settings"][0]["time_ratio"]["median"] == 1)
    with open(a / "study.csv", newline="") as rows:
        table = list(csv.DictReader(rows))
    expect("a row for each setting", [r["setting"] for r in table] == [s["setting"] for s in bar["settings"]])
    expect("work is the sum of both", all(int(r["work"]) == int(r["evaluated_tets"]) + int(r["product_tets"]) for r in table))
    circles = [e for e in xml.parse(a / "study.svg").iter() if e.tag.endswith("circle")]
    expect("points of the first series in both panels, and its key", len(circles) == 2 * 5 + 1)

    # docs/accuracy.md is made of what its files hold, and this build does the same work. Units without fused
    # multiply-add round differently.
    stored = json.loads((SOURCE / "docs/accuracy/bar.json").read_text())
    fused = all(d["machine"]["vector_unit"].startswith("AVX") for d in (bar, stored))
    work = [[r["work"] for r in d["runs"]] for d in (bar, stored)]
    expect(f"work counts are those of docs/accuracy/bar.json: {work}", work[0] == work[1] or not fused)
    made = subprocess.run(["/usr/bin/python3", str(SOURCE / "docs/make_accuracy.py"), "--check"], capture_output=True, text=True, timeout=60)
    expect("docs/accuracy.md is what docs/make_accuracy.py makes: " + made.stderr, made.returncode == 0)

    # What cannot be meant ends at once; a run that gets nowhere ends as it does with sim.
    study("no such key", [BAR, "-o", folder / "no_key", "--vary", "no_such=1,2"], 2, "--vary", "no_such")
    grid = ["--grid", "--vary", "time.substeps=1,2", "--vary", "material.gel.poisson_ratio=0.3,0.5", "--rounds", "0"]
    study("one of a grid is refused", [BAR, "-o", folder / "grid", *grid], 0, "0.5")
    study("what is no question of accuracy", [BAR, "-o", folder / "looks", "--vary", "material.gel.density=1000,1100", "--rounds", "0"], 0,
          "material.gel.density says what is simulated, not how exactly", "vdbfrac wedge")
    # What is handed to a queue is a copy, under a name of its own.
    own = folder / "own"
    own.mkdir()
    (own / "scene.toml").write_text(BAR.read_text())
    subprocess.run([PROGRAM, "study", "scene.toml", "-o", ".", "--slurm", "--sbatch=--test-only"], cwd=own, capture_output=True, timeout=60)
    expect("the scene is left as it was", (own / "scene.toml").read_text() == BAR.read_text() and (own / "study.scene.toml").is_file())
    (own / "other.toml").write_text(BAR.read_text().replace("gel", "gum"))
    study("another study's folder", [own / "other.toml", "-o", own, "--slurm", "--sbatch=--test-only"], 2, "is the scene of another study")
    stuck = ["--vary", "fracture.toughness=1e-3,1e-4", "--set", "grid.voxel_size=0.1", "--set", "solver.newton_iterations=1", "--rounds", "0", "--time-limit", "2m"]
    study("stuck runs", [SOURCE / "data/scenes/notched_block.toml", "-o", folder / "stuck", *stuck], 3, "gets nowhere")

    # The same bits, however it was run.
    study("one thread", [BAR, "-o", b, "-j", "1", "--rounds", "0"])
    study("threads per run", [BAR, "-o", c, "-j", "2", "--threads-per-run", "--rounds", "0"])
    expect("same values and work side by side and one by one", outcome(a) == outcome(b))
    expect("same values and work on two threads", outcome(a) == outcome(c))

    # Resumed: what is there is not run again, what is lost or damaged is.
    before = outcome(a)
    result_of(a, 1).unlink()
    result_of(a, 2).write_text("{")
    study("resumed", [BAR, "-o", a, "-j", "2", "--rounds", "2"], 0, "5 of 7 runs reused, and 2 rounds")
    expect("same after resuming", outcome(a) == before)
    two, three = (["--vary", f"time.substeps={values}", "--rounds", "1", "-j", "2"] for values in ("1,2", "4,1,2"))
    study("two values", [BAR, "-o", folder / "more", *two])
    study("one more before them", [BAR, "-o", folder / "more", *three], 0, "2 of 3 runs reused")
    study("another scene", [BAR, "-o", b, "--set", "gravity.acceleration=[0,-2,0]", "--rounds", "0"])
    expect("nothing of another scene is reused", outcome(b) != before)

    # A file that a collider is read from counts as the scene does.
    floor, scene = folder / "floor.obj", folder / "bar.toml"
    corners = "".join(f"v {x} {y} {z}\n" for x in (8, 9) for y in (0, 1) for z in (0, 1))
    faces = "f 1 2 4 3\nf 5 7 8 6\nf 1 5 6 2\nf 3 4 8 7\nf 1 3 7 5\nf 2 6 8 4\n"
    scene.write_text(BAR.read_text() + '\n[[collider]]\nshape = { mesh = { file = "floor.obj" } }\n')
    for height, reused in (("0", 0), ("0", 7), ("0.5", 0)):
        floor.write_text(corners.replace(" 0 ", f" {height} ") + faces)
        run = study("collider", [scene, "-o", folder / "collider", "--rounds", "0", "-j", "2"])
        found = re.search(r"(\d+) of 7 runs reused", run.stdout + run.stderr)
        expect(f"of a collider at {height} m, {reused} runs are reused", reused == (int(found[1]) if found else 0))

    # One run by itself, as a farm would.
    study("one run", [BAR, "-o", folder / "farm", "--run", "0"])
    alone = json.loads(next((folder / "farm/runs").glob("*.json")).read_text())
    expect("one run is as in the study", (alone["values"], alone["work"], alone["state"]) == before[0])
    study("farmed", [BAR, "-o", folder / "farm", "--rounds", "0", "-j", "2"], 0, "1 of 7 runs reused")

    # Work that is not the same again is an error.
    forged = json.loads(result_of(c, 0).read_text())
    forged["work"]["steps"] += 1
    result_of(c, 0).write_text(json.dumps(forged))
    study("other work", [BAR, "-o", c, "-j", "1", "--rounds", "1"], 1, "not the same again", "steps 48, at first 49")

    # A folder of something else is left as it is.
    (folder / "other").mkdir()
    (folder / "other/mine.txt").write_text("mine")
    study("a folder of something else", [BAR, "-o", folder / "other"], 2, "holds no study")
    expect("nothing is added", [p.name for p in (folder / "other").iterdir()] == ["mine.txt"])

    # A setting that fails is a row with its reason.
    wrong = [BAR, "--vary", "grid.voxel_size=0.05,0", "--vary", "grip.wall.region.halfspace.offset=0.2,9", "--rounds", "0"]
    study("refused", [*wrong, "-o", folder / "d"], 0, "failed:", "greater than 0", "holds nothing")
    expect("reasons in the plot", (folder / "d/study.svg").read_text().count("Not shown") == 2)
    study("memory", [BAR, "-o", folder / "e", "--rounds", "0", "--max-memory", "0.0001"], 3, "GiB, the limit is", "no setting has a result")
    study("time", [BAR, "-o", folder / "f", "--rounds", "0", "--time-limit", "0.001"], 3, "took longer than --time-limit")
    hasty = ["--set", "solver.newton_iterations=1", "--set", "solver.newton_tolerance=1e-14"]
    study("capped", [BAR, "-o", folder / "g", "--vary", "time.substeps=1,2", *hasty, "--rounds", "0"], 3, "steps did not converge")

    # A study that is killed takes its runs along.
    endless = ["--set", "time.frames=[1,100000]", "--set", "time.fps=1000", "--vary", "time.substeps=1,2"]
    killed = subprocess.Popen([PROGRAM, "study", str(BAR), "-o", str(folder / "k"), *endless, "-j", "2"], stderr=subprocess.DEVNULL)
    children = wait_for(lambda: (lambda c: c if len(c) == 2 else None)(children_of(killed.pid)))
    killed.kill()
    killed.wait()
    expect("two runs side by side", bool(children))
    expect("no run outlives its study", wait_for(lambda: not any(is_alive(c) for c in children or [])))

    # The command line.
    study("texts and combinations", [BAR, "-o", folder / "h", "--vary", "solver.linear_solver=jacobi,direct", "--vary", "time.substeps=1,2",
                                     "--grid", "--rounds", "0"], 0, 'solver.linear_solver, time.substeps=2', '"direct"')
    data = re.findall(r"AccuracyData k(\w+)\{(.*)\};", (SOURCE / "tools/cli/src/accuracy_data.h").read_text())
    levels = {name.lower(): dict(zip(("bending", "peak_load", "work", "time"), map(float, numbers.split(",")))) for name, numbers in data}
    expect("three levels", list(levels) == ["draft", "normal", "fine"])
    for scene in ("cantilever", "notched_block_resolution"):
        measured = SOURCE / f"data/scenes/studies/{scene}.toml"
        series = next(s for s in tomllib.loads(measured.read_text())["study"]["series"] if s["name"] == "accuracy")
        for (level, found), voxel, substeps, tolerance in zip(levels.items(), series["values"], *(t["values"] for t in series["tied"]), strict=True):
            sized = subprocess.run([PROGRAM, "sim", str(measured), "-n", "--measure", "0", "--accuracy", level], capture_output=True, text=True, timeout=60).stdout
            said = [f"accuracy {level}: voxels of {voxel:.3g} m, {substeps} steps a frame, Newton tolerance {tolerance:.1g}.",
                    f"off by {100 * found['bending']:.2g} % of the elastica", f"{found['time']:.2g} times the time"]
            expect(f"{level} is what was measured, in {scene}", all(t in sized for t in said))
            torn = f"{100 * found['peak_load']:.2g} % in peak load" in sized
            expect(f"{level} speaks of tearing where something can tear", torn == (scene != "cantilever"))
    plan = subprocess.run([PROGRAM, "sim", str(BAR), "-n"], capture_output=True, text=True, timeout=60)
    expect("a simulation takes no notice of a study", plan.returncode == 0 and "study" not in plan.stdout)
    study("nothing varied", [SOURCE / "data/scenes/bar.toml", "-o", folder / "i"], 2, "--vary")
    study("unknown quantity", [BAR, "-o", folder / "i", "--measure", "volum"], 2, "--measure: ", "did you mean 'volume'")
    study("no values", [BAR, "-o", folder / "i", "--vary", "grid.voxel_size=[1,2]"], 2, "--vary: ", "a list of at least one number")
    study("unknown measure", [BAR, "-o", folder / "i", "--by", "tipp"], 2, "one of tip, energy")
    study("no such run", [BAR, "-o", folder / "i", "--run", "99"], 2, "0 to 6")

for failure in failures:
    print(failure)
sys.exit(bool(failures))
