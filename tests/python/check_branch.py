"""Branches as a user meets them: a run goes on from a checkpoint of another, with other settings or on a finer lattice.

Usage: check_branch.py PROGRAM SOURCE_FOLDER
"""
import csv
import json
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

PROGRAM, SCENE = sys.argv[1], Path(sys.argv[2]) / "data/scenes/notched_block.toml"
COARSE = ["--set", "grid.voxel_size=0.1"]
LAST, AT = 16, 9
failures = []


def check(name, holds, told=""):
    if not holds:
        failures.append(f"{name}: {told}")


def sim(folder, *arguments, code=0, texts=(), base=COARSE):
    run = subprocess.run([PROGRAM, "sim", SCENE, "-o", folder, "-f", str(LAST), *base, *map(str, arguments)], capture_output=True, text=True, timeout=200)
    said = run.stdout + run.stderr
    check(" ".join(map(str, arguments)), run.returncode == code and all(t in said for t in texts), f"exit {run.returncode}, expected {code} and {texts} in:\n{said}")
    return said


def manifest(folder):
    return json.loads((folder / "run.json").read_text())


def states(folder):
    return [f["state_hash"] for f in manifest(folder)["frames"]]


def surfaces(folder):
    return [w["xxh3"] for f in manifest(folder)["frames"] for w in f["files"] if w["path"].endswith(".obj")]


def steps(folder):
    with open(folder / "stats.csv", newline="") as file:
        return [(r["step"], r["time_s"], r["elastic_J"], r["load_top_y_N"]) for r in csv.DictReader(file)]


def is_whole(folder):
    run = subprocess.run([PROGRAM, "info", folder, "--verify"], capture_output=True, text=True)
    check(f"{folder.name} is whole", run.returncode == 0 and len(states(folder)) == LAST, run.stdout + run.stderr)


with tempfile.TemporaryDirectory() as temporary:
    top = Path(temporary)
    run = top / "run"
    sim(run, "--keep-checkpoints")
    check("kept checkpoints", len(list(run.glob("ckpt/*.ckpt"))) == LAST, list(run.glob("ckpt/*")))
    first_states = states(run)
    check("tears", len(manifest(run)["fragments"]) > 1, manifest(run)["fragments"])

    # Nothing changed: the same to the bit, from anywhere.
    for at in (2, AT):
        same = top / f"same_{at}"
        sim(same, "--branch", run, "--at", at, texts=["nothing is changed"])
        is_whole(same)
        check("same states", states(same) == states(run), at)
        check("same surfaces", surfaces(same) == surfaces(run), at)
        check("same steps", steps(same) == steps(run), at)
        check("branches", manifest(same)["branches"] == [{"frame": at, "step": manifest(same)["branches"][0]["step"], "from": str(run), "changes": []}], manifest(same)["branches"])

    # Other settings: told, kept in the manifest, the same up to the branch and another after it; killed, it goes on to the same.
    tough = ["--set", "fracture.toughness=4000"]
    branch = top / "tough"
    sim(branch, "--branch", run, "--at", AT, *tough, texts=["fracture.toughness = 4000 (was 2500)"])
    is_whole(branch)
    check("branch", states(branch)[:AT] == states(run)[:AT] and states(branch)[AT] != states(run)[AT], states(branch))
    check("manifest", [c for b in manifest(branch)["branches"] for c in b["changes"]] == [{"key": "fracture.toughness", "before": "2500", "after": "4000"}], manifest(branch)["branches"])
    killed = top / "killed"
    command = [PROGRAM, "sim", SCENE, "-o", killed, "-f", str(LAST), *COARSE, "--branch", run, "--at", str(AT), *tough, "--resume"]
    begun = subprocess.Popen(command, stderr=subprocess.DEVNULL)
    for _ in range(4000):
        if (killed / f"obj/notched_block.{AT + 2:04}.obj").exists() or begun.poll() is not None:
            break
        time.sleep(.005)
    begun.kill()
    begun.wait()
    check("the same command goes on", subprocess.run(command, capture_output=True).returncode == 0)
    check("killed and gone on with", states(killed) == states(branch), "other states")
    check("branched once", len(manifest(killed)["branches"]) == 1, manifest(killed)["branches"])

    # In the folder itself: later frames and their checkpoints go.
    sim(branch, f"--resume={AT - 2}", "--set", "fracture.toughness=2500", code=4, texts=["no whole checkpoint up to frame", "; the first is of frame "])
    sim(run, f"--resume={AT}", *tough, texts=["fracture.toughness = 4000 (was 2500)"])
    is_whole(run)
    check("in its own folder", states(run) == states(branch), "other states")
    check("all checkpoints are kept, none of what was dropped", len(list(run.glob("ckpt/*.ckpt"))) == LAST, list(run.glob("ckpt/*")))
    sim(run, "--resume", code=2, texts=["the scene is not that of the run", "--resume=FRAME"])
    (run / "run.json").unlink()
    sim(run, "--resume", *tough)
    check("nor where the manifest is lost", len(list(run.glob("ckpt/*.ckpt"))) == LAST, list(run.glob("ckpt/*")))
    check("made again without a manifest", states(run) == states(branch), "other states")

    # Killed before it has written a checkpoint of its own, a run that went back tells of no frames that are gone.
    back = top / "back"
    sim(back, "--keep-checkpoints")
    going = subprocess.Popen([PROGRAM, "sim", SCENE, "-o", back, "-f", str(LAST), *COARSE, "--resume=4", "--checkpoint-every", "0"], stderr=subprocess.DEVNULL)
    for _ in range(4000):
        if not (back / f"obj/notched_block.{LAST:04}.obj").exists() or going.poll() is not None:
            break
        time.sleep(.001)
    going.kill()
    going.wait()
    check("killed on its way", going.returncode != 0, going.returncode)
    sim(back, "--resume")
    is_whole(back)
    check("all frames are there", len(list(back.glob("obj/*.obj"))) == LAST and states(back) == first_states, list(back.glob("obj/*.obj")))

    # Another file of a collider is another scene, though its text is the same.
    floors = {}
    for name, height in (("low", -2), ("high", -0.42)):
        (top / name).mkdir()
        corners = [(x, height + y, z) for x in (-1, 1) for y in (-.3, 0) for z in (-1, 1)]
        faces = ("1 2 4 3", "5 7 8 6", "1 5 6 2", "3 4 8 7", "1 3 7 5", "2 6 8 4")
        (top / name / "floor.obj").write_text("".join("v %g %g %g\n" % c for c in corners) + "".join(f"f {f}\n" for f in faces))
        floors[name] = top / name / "s.toml"
        floors[name].write_text(SCENE.read_text().replace("[fracture]", '[[collider]]\nshape = { mesh = "floor.obj" }\n[fracture]'))
    def on_floor(name, *more):
        return subprocess.run([PROGRAM, "sim", floors[name], "-o", top / f"on_{name}", "-f", "8", *COARSE, "--set", "output.motion=true", *map(str, more)],
                              capture_output=True, text=True)
    check("on a floor", on_floor("low", "--keep-checkpoints").returncode == 0)
    went = on_floor("high", "--branch", top / "on_low", "--at", 5)
    check("another floor is told", went.returncode == 0 and "hash of the files of colliders = " in went.stdout + went.stderr, went.stdout + went.stderr)
    check("also for point caches", "drawn against these colliders in the frames before the branch too" in went.stdout + went.stderr, went.stdout + went.stderr)
    check("and kept", [c["key"] for c in manifest(top / "on_high")["branches"][0]["changes"]] == ["hash of the files of colliders"], manifest(top / "on_high")["branches"])
    with open(top / "on_high/stats.csv", newline="") as file:
        kinetic = [float(r["kinetic_J"]) for r in csv.DictReader(file)]
    check("it throws nothing", max(kinetic[5:]) < 2 * max(kinetic[:5]), kinetic)

    # What frames hold changes nothing else: pieces that lie on each other in a floor go on with the same bits.
    pile = top / "pile.toml"
    box = '[[body]]\nname = "{}"\nmaterial = "gel"\nshape = {{ box = {{ size = [0.4, 0.3, 0.4], center = [0, {}, 0] }} }}\n'
    pile.write_text('version = 1\nname = "pile"\n[time]\nframes = [1, 24]\n[grid]\nvoxel_size = 0.1\n' + box.format("lower", .2) + box.format("upper", .6) +
                    "[material.gel]\nyoungs_modulus = 2e4\npoisson_ratio = 0.3\ndensity = 1000\n[gravity]\nacceleration = [1, -9.81, 0]\n"
                    "[contact]\nfriction = 0.4\n[[collider]]\nshape = { halfspace = { normal = [0, -1, 0] } }\n[output]\nvdb = []\n")
    def piled(folder, *more):
        went = subprocess.run([PROGRAM, "sim", pile, "-o", top / folder, *map(str, more)], capture_output=True, text=True)
        check(f"pile {more}", went.returncode == 0, went.stdout + went.stderr)
        return states(top / folder)
    whole = piled("pile", "--keep-checkpoints")
    for k, drawn in enumerate(["output.ply=true", "material.gel.colour=[1, 0, 0]", "contact.drawn=apart", 'output.lips="as_simulated"']):
        check(f"states with {drawn}", piled(f"pile_{k}", "--branch", top / "pile", "--at", 16, "--set", drawn) == whole)
    check("states with other friction", piled("pile_rough", "--branch", top / "pile", "--at", 16, "--set", "contact.friction=0.5") != whole)

    # A finer lattice, but no Delaunay mesh.
    delaunay = ["--set", 'grid.lattice="delaunay"']
    sim(top / "delaunay", "--keep-checkpoints", base=[*COARSE, *delaunay])
    sim(top / "finer", "--branch", top / "delaunay", "--at", AT, base=["--set", "grid.voxel_size=0.05", *delaunay], code=2, texts=["Delaunay", "lattice six or five"])
    fine = top / "fine"
    said = sim(fine, "--branch", run, "--at", AT, base=["--set", "grid.voxel_size=0.05", *tough], texts=["grid.voxel_size = 0.05 (was 0.1)"])
    is_whole(fine)
    told = re.search(r"volume \S+ m\^3, was \S+ \((\S+) %\); elastic energy \S+ J, was \S+ \((\S+) %\)", said)
    check("jumps are told", told and abs(float(told[1])) < 1 and abs(float(told[2])) < 10, said)
    check("finer frames", states(fine)[:AT] == states(run)[:AT], "not the frames of the run")

    # Later frames go where a run goes on from a frame, whatever comes after.
    shorter = top / f"same_{AT}"
    pages = [shorter / name for name in ("report.html", "preview/contact_sheet.png", "preview/notched_block.turn.0001.png")]
    for page in pages:
        page.parent.mkdir(exist_ok=True)
        page.write_text("of all frames")
    went = subprocess.run([PROGRAM, "sim", SCENE, "-o", shorter, *COARSE, "-f", str(LAST - 1), f"--resume={LAST - 1}"], capture_output=True, text=True)
    check("made shorter", went.returncode == 0 and len(list(shorter.glob("obj/*.obj"))) == LAST - 1, f"{went.stderr}{list(shorter.glob('obj/*.obj'))}")

    check("pages of frames that are gone", not any(p.exists() for p in pages), pages)
    pages[0].write_text("of all frames")
    subprocess.run([PROGRAM, "sim", SCENE, "-o", shorter, *COARSE, "-f", str(LAST - 1), f"--resume={LAST - 1}"], capture_output=True)
    check("pages of frames that are there", pages[0].exists())

    moving = ["--set", "output.motion=true"]
    sim(top / "moving", "--keep-checkpoints", base=[*COARSE, *moving])
    sim(top / "moving_fine", "--branch", top / "moving", "--at", AT, base=["--set", "grid.voxel_size=0.05", *moving], code=2, texts=["output.motion", "finer lattice"])
    sim(top / "moving_fine", "--branch", top / "moving", "--at", AT, base=["--set", "grid.voxel_size=0.05"], texts=["output.motion = false (was true)"])

    # What has to stay is named, all of it, and nothing is written over.
    before = states(run)
    sim(top / "refused", "--branch", run, "--set", "time.fps=25", "--set", "body.0.velocity=[0,1,0]", code=2, texts=["time.fps = 25", "body.0.velocity", "cannot change in a branch"])
    sim(top / "jump", "--branch", run, "--at", AT, *tough, "--set", "grip.top.move.velocity=[0,0.9,0]", code=2, texts=["would jump by", "half a cell", "keys that pass through"])
    sim(top / "let_go", "--branch", run, "--at", AT, *tough, "--set", "grip.top.until=0.1", texts=["until = 0.1 (was not there)"])
    sim(top / "other", "--branch", top / "none", code=4, texts=["none"])
    sim(run, "--branch", run, code=4, texts=["is not empty"])
    sim(run, "--branch", run, "--overwrite", code=2, texts=["the folder that the branch would be written into"])
    kept = states(top / "same_2")
    sim(top / "same_2", "--branch", run, "--overwrite", "--set", "time.fps=25", code=2, texts=["cannot change in a branch"])
    check("what a refused branch would replace", states(top / "same_2") == kept, "is gone")
    is_whole(top / "same_2")
    sim(top / "start", "--branch", run, "--at", 1, *tough, texts=["branches at the start of"])
    sim(top / "before", "--branch", run, "--at", 0, *tough, code=2, texts=["no frame 0", "frames from 1 on"])
    sim(top / "alone", "--at", AT, code=2)
    check("nothing changed", states(run) == before)

    # Each run of a wedge branches.
    wedge = top / "wedge"
    made = subprocess.run([PROGRAM, "wedge", SCENE, "--local", "-o", wedge, *COARSE, "--set", f"time.frames=[1, {LAST}]", "--vary", "fracture.toughness=4000,6000", f"--sim=--branch={run}", f"--sim=--at={AT}"], capture_output=True, text=True)
    check("wedge", made.returncode == 0, made.stdout + made.stderr)
    check("wedge", states(wedge / "0000") == states(branch) and states(wedge / "0001")[:AT] == states(branch)[:AT], "other states")

print("\n".join(failures) or "branches are as they should be")
sys.exit(1 if failures else 0)
