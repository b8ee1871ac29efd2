"""Stopped and resumed runs as a user meets them: signals, time limits, kill -9 at any time, damaged checkpoints, messages."""
import csv
import json
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

PROGRAM, SOURCE = sys.argv[1], Path(sys.argv[2])
SETTINGS = ["--set", "grid.voxel_size=0.05", "--set", "time.substeps=2", "-f", "16", "--progress", "none"]
SCENE = SOURCE / "data/scenes/notched_block.toml"
SEED = 1  # of when a run is killed
failures = []


def command(folder, *more):
    return [PROGRAM, "sim", SCENE, "-o", folder, *SETTINGS, *more]


def expect(name, arguments, code, *texts):
    run = subprocess.run([*map(str, arguments)], capture_output=True, text=True, timeout=120)
    missing = [t for t in texts if t not in run.stdout + run.stderr]
    if run.returncode != code or missing:
        failures.append(f"{name}: exit {run.returncode} (expected {code}), missing {missing} in:\n{run.stdout + run.stderr}")


def wait_for(condition, what):
    for _ in range(1000):
        if condition():
            return
        time.sleep(0.02)
    raise TimeoutError(what)


def hashes(folder):
    """State, and bytes of the surface, of each frame."""
    frames = json.loads((folder / "run.json").read_text())["frames"]
    return [(f["frame"], f["state_hash"], [w["xxh3"] for w in f["files"] if w["path"].endswith(".obj")]) for f in frames]


def rows(folder):
    """stats.csv without seconds, which no two runs share."""
    with open(folder / "stats.csv", newline="") as file:
        return [{k: v for k, v in row.items() if not k.endswith("_s") or k in ("time_s", "dt_s")} for row in csv.DictReader(file)]


def same(name, folder, whole):
    if hashes(folder) != hashes(whole):
        failures.append(f"{name}: other frames than those of the run that was not interrupted")
    if rows(folder) != rows(whole):
        failures.append(f"{name}: other steps in stats.csv")
    if left := [str(p) for p in folder.rglob(".partial*")]:
        failures.append(f"{name}: partial files are left: {left}")
    if len(list((folder / "ckpt").glob("*.ckpt"))) != 2:
        failures.append(f"{name}: not two checkpoints")
    expect(f"{name}: verified", [PROGRAM, "info", folder, "--verify"], 0)


def started(folder, *more):
    """A run that has written its first frame."""
    run = subprocess.Popen(command(folder, *more), stderr=subprocess.PIPE, text=True)
    wait_for(lambda: list(folder.glob("obj/notched_block.*.obj")) or run.poll() is not None, "the first frame")
    return run


def expect_log(folder):
    """What is left of the log tells of all frames that are there."""
    shown = [int(f.stem.split(".")[-1]) for f in folder.glob("obj/[!.]*.obj")]
    told = [int(n) for n in re.findall(r" frame (\d+)  state ", (folder / "run.log").read_text())] if shown else []
    if shown and max(shown) > max(told, default=0) + 1:  # a frame is told as its files are begun
        failures.append(f"{folder.name}: run.log ends before frame {max(shown)}: {told[-3:]}")


def kill(folder, run_again, whole, whole_seconds):
    """Killed at any time, as often as it takes: at first within a fifth of a whole run, so that it is several times."""
    chance, kills = random.Random(SEED), 0
    folder.mkdir()
    (folder / ".partial-run.json").write_text("of a run that was killed at once")
    while True:
        run = subprocess.Popen(run_again, stderr=subprocess.PIPE, text=True)
        try:
            said = run.communicate(timeout=whole_seconds * (0.05 + 0.15 * chance.random()) * (1 + kills / 4))[1]
            break
        except subprocess.TimeoutExpired:
            run.kill()
            run.communicate()
            kills += 1
            expect_log(folder)
            if (folder / "obj").exists():
                (folder / f"obj/.partial-{Path(run_again[2]).stem}.0003.obj").write_text("of a killed run")
    if run.returncode != 0 or kills < 3:
        failures.append(f"{folder.name}, {kills} times: exit {run.returncode}: {said}")
    same(f"{folder.name}, {kills} times", folder, whole)
    print(f"{folder.name}, {kills} times")


with tempfile.TemporaryDirectory() as temporary:
    top = Path(temporary)
    whole = top / "whole"
    began = time.monotonic()
    expect("a whole run", command(whole), 0)
    whole_seconds = time.monotonic() - began

    for heard in signal.SIGTERM, signal.SIGINT, signal.SIGUSR1, signal.SIGUSR2, signal.SIGHUP, signal.SIGXCPU:
        folder = top / heard.name
        run = started(folder)
        run.send_signal(heard)
        said = run.communicate(timeout=60)[1]
        if run.returncode != 75 or f"stopped by {heard.name}" not in said or "--resume" not in said:
            failures.append(f"{heard.name}: exit {run.returncode}: {said}")
        if json.loads((folder / "run.json").read_text())["status"] != "stopped":
            failures.append(f"{heard.name}: run.json does not say stopped")
        expect(f"resumed after {heard.name}", command(folder, "--resume", "-j", "1"), 0, "resumes after step")
        same(heard.name, folder, whole)

    # While a run that goes on still reads and builds, there is nothing to lose.
    early = subprocess.Popen(command(top / "early", "--resume", "--set", "grid.voxel_size=0.01"), stderr=subprocess.PIPE, text=True)
    time.sleep(0.3)
    early.send_signal(signal.SIGTERM)
    said = early.communicate(timeout=60)[1]
    if early.returncode != 75 or list((top / "early").rglob("*.ckpt")):
        failures.append(f"SIGTERM before the first step: exit {early.returncode}: {said}")

    run = started(top / "twice", "--set", "grid.voxel_size=0.02", "-j", "1")
    run.send_signal(signal.SIGINT)
    time.sleep(0.05)  # far less than a step takes
    run.send_signal(signal.SIGINT)
    if run.wait(timeout=60) != 130:
        failures.append(f"a second Ctrl-C: exit {run.returncode}")

    kill(top / "killed", command(top / "killed", "--resume"), whole, whole_seconds)

    # What a step leaves for its frame alone, wherever the run stops.
    margin = [PROGRAM, "sim", SCENE, "--set", "grid.voxel_size=0.1", "--set", "time.substeps=1", "--set", "output.ply=true", "--set", 'output.vdb=["margin"]',
              "--set", "output.motion=true", "-f", "10", "--progress", "none"]
    def plys(folder):
        return [w["xxh3"] for f in json.loads((folder / "run.json").read_text())["frames"] for w in f["files"] if w["path"].endswith(".ply")]
    expect("a run with margins", [*margin, "-o", top / "margins"], 0)
    for _ in range(20):
        if subprocess.run([*margin, "-o", top / "halting", "--resume", "--time-limit", "0.001s"], capture_output=True).returncode == 0:
            break
    if plys(top / "halting") != plys(top / "margins"):
        failures.append("stopped again and again: other margins")
    # run.json of a killed run may lag, and its newest checkpoint be damaged.
    lagging = json.loads((top / "halting/run.json").read_text())
    lagging["frames"] = lagging["frames"][:3]
    (top / "halting/run.json").write_text(json.dumps(lagging))
    expect("embed of a killed run", [PROGRAM, "embed", top / "halting", "-o", top / "killed.obj"], 0)
    newest = max((top / "halting/ckpt").glob("*.ckpt"))
    newest.write_bytes(newest.read_bytes()[:-9])
    expect("embed from an older checkpoint", [PROGRAM, "embed", top / "halting", "-o", top / "older.obj"], 0, "an older checkpoint is taken")

    # Things that touch, slide, and fall asleep.
    tumble = [PROGRAM, "sim", SOURCE / "data/scenes/tumble.toml", "--set", "grid.voxel_size=0.1", "--set", "sleep={ speed = 0.1 }",
              "-f", "50", "--progress", "none"]
    touching = top / "touching"
    began = time.monotonic()
    expect("a run with contact", [*tumble, "-o", touching], 0)
    touching_seconds = time.monotonic() - began
    steps = rows(touching)
    if not sum(int(row["contact_active"]) for row in steps) or int(steps[-1]["asleep"]) == 0:
        failures.append("a run with contact: nothing touches, or nothing falls asleep")
    # From each frame to the next: what a run knows of the steps before is in each checkpoint, down to its counters.
    expect("a run that keeps its checkpoints", [*tumble, "-o", top / "kept", "--keep-checkpoints"], 0)
    for frame in range(1, 50):
        again = shutil.copytree(top / "kept", top / "again")
        to_next = [str(frame + 1) if a == "50" else a for a in tumble]
        expect(f"from frame {frame}", [*to_next, "-o", again, f"--resume={frame}"], 0)
        if hashes(again) != hashes(touching)[:frame + 1]:
            failures.append(f"from frame {frame} to the next: another frame")
        # Columns of what has not happened yet are not there.
        if any(row.items() - step.items() for row, step in zip(rows(again), rows(touching))):
            failures.append(f"from frame {frame} to the next: other steps in stats.csv")
        shutil.rmtree(again)

    kill(top / "killed_touching", [*tumble, "-o", top / "killed_touching", "--resume"], touching, touching_seconds)

    stopped = top / "stopped"
    expect("time limit", command(stopped, "--time-limit", f"{whole_seconds / 3:.3f}s", "--checkpoint-every", "0"), 75, "stopped by --time-limit")
    expect("without --resume", command(stopped), 4, "--resume", "--overwrite")
    expect("resume of another scene", command(stopped, "--resume", "--set", "solver.newton_tolerance=0.5"), 2, "newton_tolerance", "--overwrite")
    expect("resume of a run of another name", command(stopped, "--resume", "--set", 'name="other"'), 2, 'was \'name = "', "--overwrite")
    expect("no checkpoint so early", command(whole, "--resume=3"), 4, "no whole checkpoint up to frame 3")
    expect("resume what", command(stopped, "--resume=soon"), 2, "soon")
    expect("resume and overwrite", command(stopped, "--resume", "--overwrite"), 2, "--overwrite")
    expect("no time", command(stopped, "--resume", "--time-limit", "a while"), 2, "a while", "3h50m")
    newest = sorted((stopped / "ckpt").glob("*.ckpt"))[-1]
    damaged = bytearray(newest.read_bytes())
    damaged[len(damaged) // 2] ^= 1
    newest.write_bytes(damaged)
    expect("info of a damaged checkpoint", [PROGRAM, "info", stopped, "--verify"], 4, newest.name, "checksum")
    expect("a damaged checkpoint", command(stopped, "--resume"), 0, newest.name, "checksum", "an older checkpoint is taken")
    same("a damaged checkpoint", stopped, whole)
    records = stopped / "ckpt/notched_block.records"
    whole_records = records.read_bytes()
    records.write_bytes(whole_records[:200] + b"?" + whole_records[201:])
    expect("damaged records", command(stopped, "--resume"), 4, records.name, "damaged")
    expect("info of damaged records", [PROGRAM, "info", stopped, "--verify"], 4, records.name, "damaged")
    records.write_bytes(whole_records)
    # Without the manifest, or frames that it made, a run goes on; what is lost is told.
    for damage in (lambda f: f.unlink()), (lambda f: f.write_text("")):
        damage(stopped / "run.json")
        expect("no manifest", command(stopped, "--resume"), 0)
        same("no manifest", stopped, whole)
    lost = stopped / "obj/notched_block.0003.obj"
    text = lost.read_bytes()
    lost.write_bytes(text[:-10])
    expect("a frame that was cut off", command(stopped, "--resume"), 4, "1 file of earlier frames", lost.name)
    expect("and without a word else", command(stopped, "--resume", "-q"), 4, "1 file of earlier frames", lost.name)
    lost.write_bytes(text)
    for checkpoint in (stopped / "ckpt").glob("*.ckpt"):
        checkpoint.write_bytes(b"no more than this")
    expect("no whole checkpoint", command(stopped, "--resume"), 4, "is not a checkpoint")
    shutil.rmtree(stopped / "ckpt")
    expect("frames without a checkpoint", command(stopped, "--resume"), 4, "--overwrite")
    foreign = top / "foreign"
    foreign.mkdir()
    (foreign / "mine.txt").write_text("not of a run")
    expect("resume of no run", command(foreign, "--resume"), 4, "no run")
    expect("overwriting no run", command(foreign, "--overwrite"), 4, "no run")

    # What is not the run's stays, and what the scene needs is never removed or written over.
    own = top / "own"
    def short(last, *more):
        return [last if a == "16" else a for a in command(own, *more)]
    expect("a run", short("2"), 0)
    kept = {own / "obj/mine.obj": "o", own / "vdb/notched_block.0001.vdb.old": "v", own / "notes.txt": "n", own / "preview/mine.png": "p"}
    for file, text in kept.items():
        file.parent.mkdir(exist_ok=True)
        file.write_text(text)
    expect("overwrite", short("1", "--overwrite"), 0)
    if lost := [str(f) for f, text in kept.items() if not f.exists() or f.read_text() != text]:
        failures.append(f"--overwrite removed what is not the run's: {lost}")
    if left := [str(f) for f in own.rglob("*.0002.*")]:
        failures.append(f"--overwrite left frames of the earlier run: {left}")
    inside = own / "scene.toml"
    text = inside.read_text()
    expect("overwriting the scene", [PROGRAM, "sim", inside, "-o", own, "--overwrite"], 2, "scene.toml", "would remove")
    expect("resuming the scene in the folder", [PROGRAM, "sim", inside, "-o", own, "--resume", "-f", "2", "-q"], 0)
    if inside.read_text() != text:
        failures.append("--resume replaced the scene it was given")
    expect("other settings of the scene in the folder", [PROGRAM, "sim", inside, "-o", own, "--resume=2", "-f", "3", "-q", "--set", "fracture.toughness=3000"], 0)
    if "toughness = 3000" not in inside.read_text():
        failures.append("the scene in the folder is not that of the run any more")
    (own / "vdb/other.0001.vdb").write_bytes((own / "vdb/notched_block.0001.vdb").read_bytes())
    other = top / "other.toml"
    other.write_text(SCENE.read_text().replace('name = "notched_block"', 'name = "other"').replace("{ box = { size = [1, 1, 1] } }", '{ vdb = "own/vdb/other.0001.vdb" }'))
    expect("writing over an input", [PROGRAM, "sim", other, "-o", own, "--overwrite"], 2, "other.0001.vdb", "would write over")
    collider = '\n[[collider]]\nshape = {{ {} }}\nmove = {{ keys = [{{ time = 0, translate = [0, -9, 0] }}] }}\n'
    other.write_text(SCENE.read_text().replace('name = "notched_block"', 'name = "other"') + collider.format('vdb = "own/vdb/other.0001.vdb"'))
    expect("writing over a collider", [PROGRAM, "sim", other, "-o", own, "--overwrite"], 2, "other.0001.vdb", "would write over")
    wall, walled = top / "wall.obj", top / "walled.toml"
    corners = [(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)]
    faces = [(1, 2, 4, 3), (5, 7, 8, 6), (1, 5, 6, 2), (3, 4, 8, 7), (1, 3, 7, 5), (2, 6, 8, 4)]
    def write_wall(size):
        wall.write_text("".join("v {} {} {}\n".format(*(size * c for c in corner)) for corner in corners)
                        + "".join("f {} {} {} {}\n".format(*face) for face in faces))
    write_wall(1)
    walled.write_text(SCENE.read_text() + collider.format('mesh = "wall.obj"'))
    expect("a collider of a file", [PROGRAM, "sim", walled, "-o", top / "walled", "-f", "1", "-q"], 0)
    write_wall(2)
    expect("a collider that has changed", [PROGRAM, "sim", walled, "-o", top / "walled", "--resume", "-f", "2", "-q"], 2, "colliders")
    write_wall(1)
    expect("a collider that is as it was", [PROGRAM, "sim", walled, "-o", top / "walled", "--resume", "-f", "2", "-q"], 0)
    alone = top / "alone"
    (alone / "obj").mkdir(parents=True)
    (alone / "scene.toml").write_text(SCENE.read_text())
    (alone / "obj/mine.obj").write_text("o")
    for how in "--overwrite", "--resume":
        expect("the scene's own folder", [PROGRAM, "sim", alone / "scene.toml", "-o", alone, how], 4, "no run")
    if (alone / "scene.toml").read_text() != SCENE.read_text() or not (alone / "obj/mine.obj").exists():
        failures.append("a folder that holds no run was changed")
    shorter, longer = ([a if a != "16" else last for a in command(whole, "--resume")] for last in ("9", "18"))
    expect("fewer frames", shorter, 2, "frames up to 16", "--resume=9 goes back")
    expect("more frames", longer, 0, "with frame 17")
    if len(hashes(whole)) != 18:
        failures.append("more frames: not there")
    # What goes wrong before the first step is on record too, in the folder that the run has begun; a mistake changes none.
    def record(folder):
        manifest = json.loads((folder / "run.json").read_text())
        return manifest["status"], manifest.get("error", "")
    before = record(whole)
    expect("other settings", [*longer, "--set", "fracture.toughness=3000"], 2, "toughness")
    if record(whole) != before:
        failures.append(f"a mistake changed the status of a run: {record(whole)}")
    damaged = whole / "obj/notched_block.0003.obj"
    damaged.write_bytes(damaged.read_bytes()[:-10])
    expect("a branch of damaged frames", [a if a != "16" else "18" for a in command(top / "branched", "--branch", whole)], 4, damaged.name, "is not what the run")
    if record(top / "branched")[0] != "failed" or damaged.name not in record(top / "branched")[1]:
        failures.append(f"a branch that failed is not on record: {record(top / 'branched')}")
    shutil.rmtree(whole)

print("\n".join(failures))
sys.exit(bool(failures))
