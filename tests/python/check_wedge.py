"""Wedges as a user meets them: lists, runs side by side, stopping and going on, tables, bad input; and what render managers read.

Usage: check_wedge.py PROGRAM SOURCE_FOLDER
"""
import csv
import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

PROGRAM, SOURCE = sys.argv[1], Path(sys.argv[2])
SCENE = SOURCE / "data/scenes/dog_bone.toml"
COARSE = ["--set", "grid.voxel_size=0.06", "--set", "time.frames=[1, 6]"]
failures = []


def check(name, holds, told=""):
    if not holds:
        failures.append(f"{name}: {told}")


def tool(*arguments, timeout=200):
    return subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True, timeout=timeout)


def expect(name, code, texts, *arguments):
    run = tool(*arguments)
    said = run.stdout + run.stderr
    check(name, run.returncode == code and all(t in said for t in texts), f"exit {run.returncode}, expected {code} and {texts} in:\n{said}")
    return run


def states(folder):
    """State hashes of all frames of all runs."""
    return {run.name: [f["state_hash"] for f in json.loads((run / "run.json").read_text())["frames"]]
            for run in sorted(folder.glob("0???"))}


def table(folder):
    with open(folder / "table.csv", newline="") as file:
        return list(csv.DictReader(file))


def check_list():
    run = expect("list", 0, ["fracture.toughness", "material.rubber.youngs_modulus", "GiB"], "wedge", SCENE, "--list")
    rows = [line.split()[:3] for line in run.stdout.splitlines()[1:]]
    expected = [[f"{k:04}", t, e] for k, (t, e) in enumerate((t, e) for t in ("400", "800") for e in ("1e+05", "2e+05", "4e+05"))]
    check("list", rows == expected, rows)
    run = expect("list of pairs", 0, [], "wedge", SCENE, "--list", "--together", "--vary", "fracture.toughness=1,2", "--vary", "time.fps=24,25")
    check("list of pairs", [line.split()[:3] for line in run.stdout.splitlines()[1:]] == [["0000", "1", "24"], ["0001", "2", "25"]], run.stdout)


def check_local(top):
    """Six runs of the scene's own wedge: stopped, gone on with, and each as `sim` makes it."""
    folder = top / "wedge"
    command = ["wedge", SCENE, "--local", "-j", "2", "--threads", "1", "-o", folder, *COARSE]
    begun = subprocess.Popen([PROGRAM, *map(str, command)], stderr=subprocess.PIPE, text=True)
    for _ in range(2000):
        if list(folder.glob("0001/obj/*.obj")) or begun.poll() is not None:
            break
        time.sleep(.01)
    begun.send_signal(signal.SIGTERM)
    said = begun.communicate(timeout=100)[1]
    check("stopped", begun.returncode == 75 and "stopped" in said, f"exit {begun.returncode}: {said}")
    expect("gone on with", 0, ["done"], *command)
    expect("all are done", 0, ["was done"], *command)
    alone = top / "alone"
    expect("alone", 0, [], "sim", SCENE, "-o", alone, "-q", *COARSE, "--set", "fracture.toughness=800", "--set", "material.rubber.youngs_modulus=1e5")
    all_states = states(folder)
    check("states", len(all_states) == 6 and len({tuple(s) for s in all_states.values()}) >= 4, f"{all_states}")
    check("states", all_states["0003"] == [f["state_hash"] for f in json.loads((alone / "run.json").read_text())["frames"]],
          "run 0003 is not what sim makes of its settings")
    check_table(folder)
    for name in ("contact_sheet.png", "report.html", "0005/report.html", "logs/0005.log", "scenes/0005.toml"):
        check("files", (folder / name).stat().st_size > 0, name)
    expect("other values", 2, ["holds another wedge"], *command, "--vary", "time.fps=24,25")
    # More values: what is there keeps its names, what is new gets the next ones. Fewer are refused.
    few = ["wedge", SCENE, "--local", "-o", top / "more", *COARSE, "--set", "time.frames=[1, 2]"]
    values = "--vary", "fracture.toughness=400,800", "--vary", "material.rubber.youngs_modulus=1e5,2e5"
    more = "--vary", "fracture.toughness=600,400,800", "--vary", "material.rubber.youngs_modulus=1e5,2e5"
    expect("few values", 0, [], *few, *values)
    before = states(top / "more")
    expect("more values", 0, ["was done"], *few, *more)
    check("more values", [(r["run"], r["fracture.toughness"], r["status"]) for r in table(top / "more")]
          == [(f"{k:04}", t, "done") for k, t in enumerate(("400", "400", "800", "800", "600", "600"))], table(top / "more"))
    check("runs that were there stay", dict(list(states(top / "more").items())[:4]) == before, "they are others")
    twice = ["wedge", SCENE, "--local", "-o", top / "twice", *COARSE, "--set", "time.frames=[1, 1]", "--vary", "fracture.toughness=400,400"]
    for again in range(2):
        expect("values that come twice", 0, ["was done"] if again else [], *twice)
    expect("fewer values", 2, ["holds another wedge"], *few, *values)
    for place in "scenes", "logs":
        (top / "half" / place).mkdir(parents=True)
    (top / "half/scenes/0000.toml").write_text("as far as it came")
    (top / "half/scenes/.partial-1-0-0001.toml").write_text("")
    killed = ["wedge", SCENE, "--local", "-o", top / "half", *COARSE, "--set", "time.frames=[1, 1]", "--vary", "fracture.toughness=400"]
    expect("killed while it was laid out", 0, [], *killed)
    check("killed while it was laid out", [p.name for p in (top / "half/scenes").iterdir()] == ["0000.toml"], "is left over")
    return folder


def check_failures(top):
    """What ended before it could write anything is told as failed, here and as a task, and can be begun again."""
    folder = top / "failing"
    command = ["wedge", SCENE, "--local", "-o", folder, *COARSE, "--set", "time.frames=[1, 2]", "--together", "--vary", "fracture.toughness=400,800"]
    told = expect("too little memory", 5, ["ended with 5"], *command, "--sim=--max-memory=0.001")
    check("failed", [r["status"] for r in table(folder)] == ["failed (5)"] * 2, f"{table(folder)} {told.stderr}")
    expect("no such option of sim", 2, ["ended with 2: ", "--nonsense"], *command, "--sim=--nonsense")
    expect("one begun again", 0, [], "wedge", "-o", folder, "--run", "1")
    other = top / "other_queue"
    expect("laid out", 0, ["2 runs are laid out", f"wedge -o {other} --run K"], "wedge", SCENE, "--prepare", "-o", other, *command[5:])
    expect("one of another queue", 0, [], "wedge", "-o", other, "--run", "1")
    check("only what was asked for ran", (other / "0001" / "run.json").exists() and not (other / "0000" / "run.json").exists(), other)
    expect("collected", 0, [], "wedge", "-o", folder, "--collect")
    check("failed and done", [r["status"] for r in table(folder)] == ["failed (2)", "done"], table(folder))
    expect("failing task", 5, [], "wedge", "-o", folder, "--run", "0", "--sim=--max-memory=0.001")
    expect("all begun again", 0, [], *command)
    check("all done", [r["status"] for r in table(folder)] == ["done"] * 2, table(folder))
    for damage in ('{"status": 5}', "{", '{"status": "done"}'):
        (folder / "0000/run.json").write_text(damage)
        expect("collected with one damaged", 0, [], "wedge", "-o", folder, "--collect")
        rows = table(folder)
        check("one damaged", "cannot be read" in rows[0]["status"] and rows[1]["status"] == "done" and rows[1]["Steps"], f"{damage} {rows}")


def check_killed(top):
    """Runs of a wedge that is killed stop, and the same command goes on with them."""
    folder = top / "killed"
    command = ["wedge", SCENE, "--local", "-j", "2", "--threads", "1", "-o", folder, "--set", "grid.voxel_size=0.04", "--set", "time.frames=[1, 30]", "--together", "--vary", "fracture.toughness=400,800"]
    begun = subprocess.Popen([PROGRAM, *map(str, command)], stderr=subprocess.DEVNULL)
    runs = []
    for _ in range(2000):
        runs = Path(f"/proc/{begun.pid}/task/{begun.pid}/children").read_text().split()
        if len(runs) == 2 and all(list((folder / name).glob("obj/*.obj")) for name in ("0000", "0001")):
            break
        time.sleep(.01)
    begun.kill()
    begun.wait()
    check("killed amid its runs", len(runs) == 2, runs)
    def is_alive(run):
        stat = Path(f"/proc/{run}/stat")
        return stat.exists() and stat.read_text().rsplit(")", 1)[1].split()[0] != "Z"
    for _ in range(6000):
        if not any(map(is_alive, runs)):
            break
        time.sleep(.01)
    stopped = [json.loads((folder / name / "run.json").read_text()) for name in ("0000", "0001")]
    check("runs end with their wedge", all(r["status"] == "stopped" and len(r["frames"]) < 30 for r in stopped), [(r["status"], len(r["frames"])) for r in stopped])
    expect("gone on with after a kill", 0, [], *command)
    check("all done after a kill", [r["status"] for r in table(folder)] == ["done"] * 2, table(folder))


def check_interrupted(top):
    """A terminal that interrupts reaches the runs too, with another signal than the wedge passes on, and before they listen."""
    folder = top / "interrupted"
    command = ["wedge", SCENE, "--local", "-j", "2", "--threads", "1", "-o", folder, "--set", "grid.voxel_size=0.025", "--together", "--vary", "fracture.toughness=400,800"]
    begun = subprocess.Popen([PROGRAM, *map(str, command)], stderr=subprocess.PIPE, text=True, start_new_session=True)
    for _ in range(2000):
        if len(Path(f"/proc/{begun.pid}/task/{begun.pid}/children").read_text().split()) == 2:
            break
        time.sleep(.005)
    time.sleep(.1)
    os.killpg(begun.pid, signal.SIGINT)
    said = begun.communicate(timeout=60)[1]
    check("interrupted", begun.returncode == 75 and not list(folder.glob("logs/*.failed")), f"exit {begun.returncode}: {said}")


def check_table(folder):
    rows = table(folder)
    check("table", [(r["run"], float(r["fracture.toughness"]), float(r["material.rubber.youngs_modulus"]), r["status"], int(r["Frames"])) for r in rows]
          == [(f"{k:04}", t, e, "done", 6) for k, (t, e) in enumerate((t, e) for t in (400, 800) for e in (1e5, 2e5, 4e5))], rows)
    # Before anything tears the load goes with Young's modulus.
    loads = [float(r["Peak load on top [N]"]) for r in rows]
    check("table", all(abs(b / a - 2) < .2 for a, b in zip(loads, loads[1:]) if b > a), loads)
    with open(folder / "0002/stats.csv", newline="") as file:
        steps = list(csv.DictReader(file))
    peak = max(sum(float(s[f"load_top_{k}_N"]) ** 2 for k in "xyz") ** .5 for s in steps)
    check("table", abs(loads[2] / peak - 1) < 1e-9 and int(rows[2]["Steps"]) == len(steps), (loads[2], peak))


def check_bad_input(top, wedge):
    expect("nothing varied", 2, ["nothing is varied", "--vary"], "wedge", SOURCE / "data/scenes/bar.toml", "--list")
    expect("no way to run", 2, [], "wedge", SCENE)
    expect("no wedge to run one of", 4, ["holds no wedge", "--prepare"], "wedge", SCENE, "--run", "0", "-o", top / "nowhere")
    expect("no wedge to collect", 4, ["holds no wedge", "--prepare"], "wedge", "--collect", "-o", top / "nowhere")
    expect("bad values of all runs", 2, ["run 0000", "run 0001", "poisson_ratio"], "wedge", SCENE, "--list", "--vary", "material.rubber.poisson_ratio=.6,.7")
    expect("pairs that do not pair", 2, ["has 2 values", "has 3"], "wedge", SCENE, "--list", "--together", "--vary", "time.fps=1,2,3", "--vary", "fracture.toughness=1,2")
    expect("varied twice", 2, ["time.fps is varied twice"], "wedge", SCENE, "--list", "--vary", "time.fps=1,2", "--vary", "time.fps=3")
    expect("a scene behind --set", 0, ["0001"], "wedge", "--list", "--vary", "time.fps=24,25", "--set", "time.frames=[1, 2]", SCENE)
    expect("too many", 2, ["10000"], "wedge", SCENE, "--list", *(a for k in ("fps", "node_cfl") for a in ("--vary", f"time.{k}=" + ",".join(map(str, range(1, 102))))))
    other = top / "other"
    other.mkdir()
    (other / "mine.txt").write_text("mine")
    expect("a folder of something else", 2, ["holds no wedge"], "wedge", SCENE, "--local", "-o", other)
    check("a folder of something else", [p.name for p in other.iterdir()] == ["mine.txt"], "it was touched")
    expect("settings of a run that is laid out", 2, ["no SCENE, --vary"], "wedge", "-o", wedge, "--run", "1", "--set", "time.fps=3")
    expect("no such run", 2, ["0 to 5"], "wedge", "-o", wedge, "--run", "6")
    expect("no sbatch", 4, ["sbatch"], "wedge", SCENE, "--slurm", "-o", top / "slurm") if not has_slurm() else None
    odd = top / 'a "100%" folder'
    expect("no sbatch", 4, ["sbatch"], "wedge", SCENE, "--slurm", "-o", odd, "--time", "1-00:30:00", "--set", 'name="two words"') if not has_slurm() else None
    if not has_slurm():
        text = (odd / "array.sh").read_text()
        place = str(top) + '/a \\"100%%\\" folder/logs/%a.slurm.log'
        check("names with blanks", '--job-name="two words"\n' in text and f'--output="{place}"\n' in text and "--time=24:30:00\n" in text, text)
    script = (top / "slurm" / "array.sh") if not has_slurm() else None
    if script:
        check("array.sh", re.search(r"--array=0-5\n.*--mem=\d+M\n.*--time=00:1\d:\d\d\n", script.read_text(), re.S), script.read_text())


def has_slurm():
    return subprocess.run(["sh", "-c", "command -v sbatch"], capture_output=True).returncode == 0


def check_progress(top):
    """Percentages that rise to 100 on stdout."""
    for kind, pattern in (("openjd", r"^openjd_progress: (\d+(?:\.\d+)?)$"), ("alf", r"^ALF_PROGRESS (\d+)%$")):
        run = tool("sim", SOURCE / "data/scenes/bar.toml", "-o", top / kind, "-f", "5", "--progress", kind)
        told = [float(m) for m in re.findall(pattern, run.stdout, re.M)]
        check(kind, told and told == sorted(told) and told[-1] == 100 and len(told) >= 5, run.stdout)


with tempfile.TemporaryDirectory() as temporary:
    check_list()
    wedge_folder = check_local(Path(temporary))
    check_bad_input(Path(temporary), wedge_folder)
    check_failures(Path(temporary))
    check_killed(Path(temporary))
    check_interrupted(Path(temporary))
    check_progress(Path(temporary))
print("\n".join(failures) or "wedges are as they should be")
sys.exit(1 if failures else 0)
