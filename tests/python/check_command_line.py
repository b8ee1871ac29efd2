"""The program as a user meets it: help, plan, messages with their places, exit codes, nothing lost on failure."""
import contextlib
import csv
import fcntl
import json
import math
import os
import pty
import re
import resource
import shutil
import stat
import struct
import subprocess
import sys
import tempfile
import termios
from pathlib import Path

PROGRAM, SOURCE = sys.argv[1], Path(sys.argv[2])
SCENE = (SOURCE / "data/scenes/notched_block.toml").read_text()
failures = []


def expect(name, arguments, code, *texts, **how):
    """What the program says; `how` goes to subprocess.run. Nothing here takes long: what hangs fails."""
    run = subprocess.run([PROGRAM, *map(str, arguments)], **{"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True, "timeout": 120, **how})
    said = (run.stdout or "") + run.stderr
    missing = [t for t in texts if t not in said]
    if run.returncode != code or missing:
        failures.append(f"{name}: exit {run.returncode} (expected {code}), missing {missing} in:\n{said}")
    return said


def report(name, arguments, code=0):
    """The JSON that a command prints, or None."""
    run = subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True, timeout=120)
    if run.returncode == code:
        return json.loads(run.stdout)
    failures.append(f"{name}: exit {run.returncode} (expected {code}): {run.stdout + run.stderr}")
    return None


def at_a_terminal(arguments, columns):
    """What is drawn on a terminal of that width, and the exit code."""
    ours, its = pty.openpty()
    fcntl.ioctl(its, termios.TIOCSWINSZ, struct.pack("HHHH", 24, columns, 0, 0))
    run = subprocess.Popen([PROGRAM, *map(str, arguments)], stdout=subprocess.DEVNULL, stderr=its)
    os.close(its)
    drawn = b""
    while True:
        try:
            part = os.read(ours, 65536)
        except OSError:  # the other end is closed
            break
        if not part:
            break
        drawn += part
    os.close(ours)
    return drawn.decode(), run.wait()


def locale_with_commas(folder):
    """Environment of a locale whose decimals have commas: an installed one, or one that localedef makes. None where there is none."""
    installed = subprocess.run(["locale", "-a"], capture_output=True, text=True).stdout.split()
    for name in installed:
        if re.match(r"(de_DE|fr_FR|it_IT|pl_PL|ru_RU)\.utf-?8$", name, re.IGNORECASE):
            return {**os.environ, "LC_ALL": name}
    try:
        made = subprocess.run(["localedef", "--no-archive", "-i", "de_DE", "-f", "UTF-8", folder / "de_DE.UTF-8"], capture_output=True).returncode == 0
    except OSError:
        made = False
    return {**os.environ, "LC_ALL": "de_DE.UTF-8", "LOCPATH": str(folder)} if made else None


@contextlib.contextmanager
def open_folder(folder):
    """As a run has it that goes on."""
    descriptor = os.open(folder, os.O_RDONLY)
    fcntl.flock(descriptor, fcntl.LOCK_EX)
    yield
    os.close(descriptor)


with tempfile.TemporaryDirectory() as temporary:
    folder = Path(temporary)
    good, bad, out = folder / "good.toml", folder / "bad.toml", folder / "out"
    good.write_text(SCENE)
    expect("help", ["--help"], 0, "sim", "check", "scene", "preview")
    expect("help as a command", ["help"], 0, "sim", "check", "scene", "preview")
    expect("help of no command", ["help", "nonsense"], 2, "no command 'nonsense'")
    expect("help of a command", ["help", "sim"], 0, "Simulate a scene", "--resume")
    expect("no command", [], 2)
    expect("unknown option", ["sim", good, "--nonsense"], 2, "--nonsense")
    expect("version", ["--version"], 0, "vdbfrac")
    expect("defaults", ["scene", "--defaults"], 0, "voxel_size", "[fracture]", "kappa")
    expect("schema", ["scene", "--schema"], 0, "$schema")
    example = subprocess.run([PROGRAM, "scene", "--example"], capture_output=True, text=True, check=True).stdout
    (folder / "example.toml").write_text(example)
    expect("example is a scene", ["check", folder / "example.toml"], 0, "ok")
    (folder / "example.toml").write_text(example.replace("# [fracture]", "[fracture]").replace("# toughness", "toughness"))
    expect("example tears as it says", ["sim", folder / "example.toml", "-o", folder / "torn", "-f", "30", "-q"], 0)
    expect("example torn", ["info", folder / "torn"], 0, "id: 0", "id: 1")
    said = expect("nothing tears", ["sim", folder / "example.toml", "-o", folder / "whole", "-f", "12"], 0, "nothing tore: loads reached 0.")
    if not re.search(r"^12 frames, (\d+) steps: \1 converged, 0 cut back, 0 capped\n1 fragment; ", said, re.MULTILINE):
        failures.append(f"the summary of a run: {said}")
    expect("grips on all", ["sim", folder / "example.toml", "-o", folder / "held", "-f", "1", "--set", "grip.0.region.halfspace.offset=-1"], 0,
           "'top' holds all of body 'block'", "'top' and 'bottom' both have")
    crush = folder / "crush.toml"
    crush.write_text('grid = { voxel_size = 0.1 }\ntime = { frames = [1, 4] }\noutput = { obj = false }\n[material.m]\nyoungs_modulus = 1e3\npoisson_ratio = 0.45\n'
                     'density = 1000\n[[body]]\nname = "b"\nmaterial = "m"\nshape = { box = { size = [0.8, 0.8, 0.8] } }\n[[grip]]\nname = "foot"\nbody = "b"\n'
                     'region = { halfspace = { normal = "y", offset = -0.3 } }\nmove = { force = [0, 1, 0] }\n'
                     '[[collider]]\nname = "floor"\nshape = { halfspace = { normal = [0, -1, 0], offset = 0.45 } }\n'
                     '[[collider]]\nname = "plate"\nshape = { box = { size = [0.5, 0.4, 0.5], center = [0, 0.65, 0] } }\nmove = { velocity = [0, -5, 0] }\n')
    expect("what is crushed", ["sim", crush, "-o", folder / "crushed"], 0, " steps, down to ", "where something is crushed, [volume] takes fewer")
    both = ['--set', 'grip=[{ name = "foot", body = "b", region = { halfspace = { normal = "y", offset = -0.3 } }, move = { velocity = [0, 0, 0] } }, '
            '{ name = "push", body = "b", region = { halfspace = { normal = "y", offset = 0 } }, move = { force = [0, 9, 0] } }]']
    said = expect("[volume] helps, and a force on what is held", ["sim", crush, "-o", folder / "crushed", "--overwrite", "--set", "volume.least=0.9", *both], 0,
                  "'foot' and 'push' both have ", "'foot' holds them, and bears what of its force 'push' has there")
    if "[volume] takes fewer" in said:
        failures.append(f"advice that was followed: {said}")
    kept = (folder / "example.toml").read_bytes()
    expect("a scene is no log", ["sim", folder / "example.toml", "-o", folder / "logged", "-f", "1", "--log-file", folder / "example.toml"], 2, "is no log")
    expect("nor a page", ["report", folder / "whole", "-o", folder / "example.toml"], 2, ".html")
    torn = next((folder / "torn/obj").glob("*.obj"))
    expect("an option of other tets", ["mesh", torn, "-o", folder / "m.vtu", "--across", "8", "--sharp", "30"], 2, "--sharp", "--tets delaunay")
    expect("an option of surfaces, for tets", ["mesh", torn, "-o", folder / "m.vtu", "--adaptivity", "0.5"], 2, "--adaptivity", "the output is tets")
    expect("what is made is not written over", ["mesh", torn, "-o", folder / "m.vtu", "--across", "8", "--quality", folder / "m.vtu"], 2, "would be overwritten")
    if (folder / "example.toml").read_bytes() != kept:
        failures.append("the scene was written over")
    shutil.rmtree(folder / "held")
    for size, says in (("[2, 0.15, 2]", "nowhere more than about 3 lattice cells thick"), ("[2, 0.2, 2]", None), ("[0.25, 0.25, 0.25]", None)):
        plate = folder / "plate.toml"
        plate.write_text(f'version = 1\ngrid = {{ voxel_size = 0.05 }}\nmaterial = {{ m = {{ youngs_modulus = 1e5, poisson_ratio = 0.3, density = 1000 }} }}\n'
                         f'[[body]]\nname = "b"\nmaterial = "m"\nshape = {{ box = {{ size = {size} }} }}\n')
        said = expect(f"how thin {size} is", ["sim", plate, "-n", "--measure", "0"], 0, says or "")
        if not says and "thin" in said:
            failures.append(f"{size} is not thin: {said}")
        wide = ["--set", "grid.coarsening=2", "--set", "grid.voxel_size=0.025"]
        said = expect(f"how thin {size} is, of coarse cells", ["sim", plate, "-n", "--measure", "0", *wide], 0, says or "")
        if not says and "thin" in said:
            failures.append(f"{size} is not thin in coarse cells: {said}")
    through = "bodies pass through each other where they meet: there is no [contact]"
    expect("bodies without contact", ["sim", SOURCE / "data/scenes/two_bodies.toml", "-n", "--measure", "0"], 0, through)
    if through in expect("bodies with contact", ["sim", SOURCE / "data/scenes/press.toml", "-n", "--measure", "0"], 0):
        failures.append("a scene with contact is told that it has none")
    lost = folder / "lost.toml"
    lost.write_text(re.sub(r"shape = .*", 'shape = { mesh = { file = "lost.obj" } }', SCENE, count=1))
    expect("a lost mesh", ["sim", lost, "-n", "--measure", "0"], 4, "lost.toml:", "body 'block': ", "lost.obj: No such file")
    sunk = folder / "sunk.toml"
    sunk.write_text(SCENE + '\n[[collider]]\nname = "floor"\nshape = { halfspace = { normal = [0, 1, 0], offset = 0.1 } }\n')
    expect("a sunk body", ["sim", sunk, "-n", "--measure", "0"], 0, "body 'block' begins up to", "deep in collider 'floor'")
    voxel = float(re.search(r"voxel_size = ([0-9.]+)", SCENE)[1])
    for voxels, thin in ((1.5, True), (2.5, False)):
        blade = folder / "blade.toml"
        blade.write_text(SCENE + f'\n[[collider]]\nname = "blade"\nshape = {{ box = {{ size = [{voxels * voxel}, 1, 1], center = [9, 0, 0] }} }}\n')
        said = expect("a blade", ["sim", blade, "-n", "--measure", "0"], 0, "")
        if thin != ("collider 'blade' is" in said and "less than two voxels" in said):
            failures.append(f"a blade of {voxels} voxels: {said}")
    for degrees, thin in ((20, True), (45, False), (90, False)):  # a blade of 16 voxels, thick enough at its back
        half = 16 * voxel * math.tan(math.radians(degrees / 2))
        (folder / "wedge.obj").write_text("".join(f"v {x} {y} {z}\n" for x in (20, 21) for y, z in ((0, 0), (16 * voxel, -half), (16 * voxel, half)))
                                          + "f 1 3 2\nf 4 5 6\nf 1 2 5 4\nf 2 3 6 5\nf 3 1 4 6\n")
        wedge = folder / "wedge.toml"
        wedge.write_text(SCENE + '\n[[collider]]\nname = "wedge"\nshape = { mesh = "wedge.obj" }\n')
        said = expect("a wedge", ["sim", wedge, "-n", "--measure", "0"], 0, "")
        if thin != ("collider 'wedge' is less than two voxels thick behind" in said):
            failures.append(f"a wedge of {degrees} degrees: {said}")
    ends = "".join(f"v {x} {y} {z}\n" for x in (20, 20 + 1100 * voxel) for y, z in ((0, 0), (4 * voxel, 0), (0, 4 * voxel)))
    (folder / "needle.obj").write_text(ends + "f 1 3 2\nf 4 5 6\nf 1 2 5 4\nf 2 3 6 5\nf 3 1 4 6\n")
    long = folder / "long.toml"
    long.write_text(SCENE + '\n[[collider]]\nname = "needle"\nshape = { mesh = "needle.obj" }\n')
    expect("a collider in other units", ["sim", long, "-n", "--measure", "0"], 0, "collider 'needle' is 110", "voxels across", "units")

    bad.write_text(SCENE.replace("poisson_ratio = 0.3", "poisson_ratio = 0.5").replace("voxel_size", "voxel_siz"))
    expect("all errors at once", ["check", bad], 2, "bad.toml:", "did you mean", "voxel_size", "poisson_ratio", "0.5")
    expect("a field that nothing makes", ["check", good, "--set", 'output.vdb=["margin"]', "--set", 'fracture.driver="full"'], 2, "output.vdb", "nothing in this scene makes")
    expect("what effects do not support", ["check", good, "--set", 'solver.integrator="sdirk2"', "--set", "plasticity.yield_stress=1e3", "--set", "sleep.after=1"], 2,
           "plasticity does not support", "speed is not set")
    expect("two fields that nothing makes", ["check", good, "--set", 'output.vdb=["margin","arrival"]', "--set", 'fracture.driver="full"'], 2, "good.toml: output.vdb", "'margin'")
    for late in "grip.top.until=50", "fracture.keys=[{ time=0, scale=1 }, { time=24, scale=2 }]":
        expect("times that look like frames", ["check", good, "--set", late], 0, "times are in seconds, not in frames")
    expect("multigrid where there is none", ["check", "--quick", good, "--set", 'grid.lattice="delaunay"', "--set", 'solver.linear_solver="multigrid"'], 0, "not used on a Delaunay mesh")
    expect("cells without mean strains", ["check", "--quick", good, "--set", 'solver.volumetric="none"'], 0, "note: solver.mean_strain", "is not used")
    expect("the same in a plan", ["sim", good, "-n", "--measure", "0", "--set", 'output.vdb=["margin"]', "--set", 'fracture.driver="full"'], 2, "output.vdb", "nothing in this scene makes")
    expect("an index in brackets", ["check", good, "--set", "body[0].velocity=[1,0,0]"], 2, '"body[0].velocity=[1,0,0]" sets nothing', "by index (from 0) or name")
    expect("an entry that is not there", ["check", good, "--set", "body.none.velocity=[1,0,0]"], 2, '"none" leads nowhere', "a list of 1")
    expect("the text of a scene alone", ["check", "--quick", good, "--set", 'collider=[{ name = "hill", shape = { mesh = { file = "none.obj" } } }]'], 0, "ok")
    expect("more than there is memory", ["check", good, "--max-memory", "0.001"], 5, "the run needs about", "m long: is that meant")
    keys = 'move={ keys=[{ time=1 }, { time=48, translate=[0, 1, 0] }] }'
    expect("a grip between nodes", ["check", good, "--set", "grip.top.region={ box={ size=[1e-4, 1e-4, 1e-4], center=[0.0123, 0.0123, 0.0123] } }"], 2, "grip 'top' holds nothing of body")
    expect("a toughness in other units", ["check", good, "--set", "fracture.toughness=1e7"], 0, "a smooth bar tears at", "times its length", "check units")
    expect("a stiffness in other units", ["check", good, "--set", "material.gel.youngs_modulus=0.1"], 0, "faster than sound", "check its units")
    two = folder / "two.toml"
    box = '[[body]]\nname = "%s"\nshape = { box = { size = [0.4, 0.4, 0.4], center = [%g, 0, 0] } }\nmaterial = "gel"\n'
    two.write_text('name = "two"\ntime = { frames = [1, 3] }\ngrid = { voxel_size = 0.05 }\n[contact]\n[material.gel]\nyoungs_modulus = 1e5\npoisson_ratio = 0.3\ndensity = 1000\n' + box % ("a", 0) + box % ("b", 0.25))
    expect("bodies that begin in each other", ["sim", two, "-o", folder / "two"], 0, "overlap at rest", "overlap: surfaces were up to", "begin in each other stay so", "not joined")
    expect("keys in frames", ["check", good, "--set", 'grip.top.' + keys], 0, "note: grip 'top'", "48 s", "not in frames")
    expect("missing file", ["check", folder / "none.toml"], 4, "none.toml")
    expect("no output folder", ["sim", good], 2, "-o")
    expect("a missing argument", ["sim"], 2, "vdbfrac: error: SCENE is required", "hint: 'vdbfrac sim --help'")
    expect("an unknown option", ["mesh", "a.obj", "-o", "a.vtu", "--foo"], 2, "vdbfrac: error: ", "--foo", "hint: 'vdbfrac mesh --help'")
    expect("plan", ["sim", good, "-n", "--measure", "0"], 0, "solve", "fracture", "gravity", "off", "no [gravity] in the scene")
    expect("plan with time and disk", ["sim", good, "-n", "--measure", "1", "-f", "3"], 0, "nodes", "from (", "files: run.json", "time: ", "disk: about", "steps that take")
    expect("plan needs no folder and writes none", ["sim", good, "-n", "--measure", "0", "-o", out], 0)
    if out.exists():
        failures.append("a plan wrote files")

    expect("two frames", ["sim", good, "-o", out, "-f", "2", "-q"], 0)
    kept = sorted(p.relative_to(out) for p in out.rglob("*"))
    expect("a full folder is refused", ["sim", good, "-o", out, "-f", "2"], 4, "not empty", "--overwrite")
    if kept != sorted(p.relative_to(out) for p in out.rglob("*")):
        failures.append("a refused run changed the folder")
    foreign, elsewhere = out / "mine.txt", folder / "elsewhere"
    foreign.write_text("not of this program")
    elsewhere.mkdir()
    (out / "cache").symlink_to(elsewhere)
    (out / "motion").write_text("mine")
    expect("overwrite", ["sim", good, "-o", out, "-f", "1", "--overwrite", "-q"], 0)
    if not foreign.exists() or not (out / "cache").is_symlink() or not (out / "motion").exists():
        failures.append("--overwrite removed a file or a link that no run wrote")
    (out / "cache").unlink(), (out / "motion").unlink()
    if list(out.rglob("*.partial*")):
        failures.append("partial files are left")
    for frames in ("4294967300", "1-4294967300", "2-3", "1-", "3-1", "1-9x2"):
        expect(f"no frames are {frames}", ["sim", good, "-o", folder / "none", "-f", frames], 2, "--frames", f"'{frames}'")
    expect("six frames", ["sim", good, "-o", folder / "six", "-f", "6", "-q", "--keep-checkpoints"], 0)
    expect("shorter than it is", ["sim", good, "-o", folder / "six", "-f", "4", "--resume"], 2, "frames up to 6", "ends at 4", "--resume=4 goes back")
    expect("nothing is lost by that", ["info", folder / "six", "--verify"], 0, "frames: 1-6", "all checksums")
    expect("back on purpose", ["sim", good, "-o", folder / "six", "-f", "4", "--resume=4", "-q"], 0)
    if any(folder.glob("six/*/*.0005.*")):
        failures.append("--resume=4 leaves frames behind it")
    expect("a branch at no frame", ["sim", good, "-o", folder / "none", "--branch", folder / "six", "--at", "99"], 2, "ends at frame 4")
    cut = folder / "six/obj/notched_block.0003.obj"
    cut.write_bytes(cut.read_bytes()[:1000])
    expect("a frame that was cut off", ["preview", folder / "six", "-f", "3"], 4, "0003.obj", "has 1000 bytes, the run wrote")
    expect("neither is it a surface", ["mesh", folder / "six", "-o", folder / "s.####.ply", "-f", "3"], 4, "has 1000 bytes, the run wrote")
    expect("nor does a page show it", ["report", folder / "six", "--pictures", "0"], 4, "has 1000 bytes, the run wrote")
    expect("another format", ["embed", folder / "six", "-o", folder / "six.abc"], 2, "'.abc' is not what is written here")
    moving = folder / "moving"
    expect("a run to embed", ["sim", good, "-o", moving, "-f", "2", "-q", "--set", "output.motion=true"], 0)
    shutil.copytree(moving, folder / "take#3 $F %d")
    expect("signs for frames in the name of a folder", ["embed", folder / "take#3 $F %d", "-o", folder / "t.usda", "-q"], 0)
    first = next(moving.glob("obj/*.0001.obj"))
    frames = first.read_bytes()
    expect("frames stay", ["embed", moving, "-o", first], 2, "would overwrite")
    expect("frames stay to mesh", ["mesh", moving, "-o", moving / "obj/notched_block.####.obj"], 2, "would overwrite a file of the run in")
    expect("and to relevel", ["relevel", first, "--across", "10", "-o", next(moving.glob("vdb/*.0001.vdb"))], 2, "would overwrite")
    expect("its materials too", ["embed", moving, "-o", moving / "obj/notched_block.obj"], 2, "notched_block.mtl", "would overwrite")
    if first.read_bytes() != frames:
        failures.append("a frame was written over")
    (folder / "shared.mtl").write_text("newmtl a\nKd 1 0 0\nmap_Kd gone.png\n")
    cube = "".join(f"v {x} {y} {z}\n" for x in (-.5, .5) for y in (-.5, .5) for z in (-.5, .5)) + "f 1 2 4 3\nf 5 7 8 6\nf 1 5 6 2\nf 3 4 8 7\nf 1 3 7 5\nf 2 6 8 4\n"
    (folder / "cube.obj").write_text("mtllib shared.mtl\nusemtl a\n" + cube)
    expect("a run of a mesh", ["sim", good, "-o", folder / "cube", "-f", "2", "--set", "output.motion=true", "--set", f'body.0.shape={{mesh="{folder}/cube.obj"}}'], 0, f"{folder}/gone.png is not there: pictures show 'a' without its texture")
    (folder / "cube.obj").write_text("mtllib shared.mtl\nusemtl b\nvt 0 0\n" + cube.replace("f 1 2", "f 1/1 2/2"))
    expect("another mesh of the same shape", ["sim", good, "-o", folder / "cube", "-f", "3", "--resume", "--set", "output.motion=true", "--set", f'body.0.shape={{mesh="{folder}/cube.obj"}}'], 0, "a mesh has changed since", "23 of 24 corners of faces without texture coordinates")
    expect("its materials stay", ["embed", folder / "cube", "-o", folder / "shared.obj"], 2, "shared.mtl", "would be overwritten")
    (folder / "large.obj").write_text("".join(f"v {x} {y} {z}\n" for x in (-2, 2) for y in (-2, 2) for z in (-2, 2))
                                      + "f 1 2 4 3\nf 5 7 8 6\nf 1 5 6 2\nf 3 4 8 7\nf 1 3 7 5\nf 2 6 8 4\n")
    expect("far too large", ["embed", moving, folder / "large.obj", "-o", folder / "large.usda"], 2, "times as large as body", "a tenth to three times")
    for command in ["sim", "-n", "-o", folder / "none"], ["check"]:
        expect("a scene behind --set", [*command, "--set", "time.fps=24", good], 0)
    late = "grip.0.move={ keys = [{ time = 1, translate = [0, 0.5, 0] }] }"
    expect("a key away from rest", ["sim", good, "-o", folder / "late", "-f", "1", "--set", late], 0, "by 0.5 m in the first step", "at time 0")
    expect("no frame to go on from", ["sim", good, "-o", out, "--resume=4294967299"], 2, "'4294967299' is not a frame")
    expect("a file in place of the folder", ["sim", good, "-o", foreign, "-f", "1"], 4, "mine.txt")
    expect("grip beside the body", ["sim", good, "-o", folder / "o2", "--set", "grip.0.region.halfspace.offset=9"], 2, "holds nothing", "good.toml:")
    expect("memory limit", ["sim", good, "-o", folder / "o3", "--max-memory", "0.001"], 5, "--max-memory")
    expect("field that nothing makes", ["sim", good, "-o", folder / "o4", "-f", "1", "--set", 'output.vdb=["phi","arival"]'], 2, "arrival")
    expect("preview", ["preview", out, "--count", "1", "--width", "64", "--height", "64"], 0, "contact_sheet.png")
    said = expect("preview of frames, quietly", ["preview", out, "-f", "1-1x2", "-q", "-j", "1", "--width", "64", "--height", "64"], 0)
    if said:
        failures.append(f"preview -q says {said}")
    expect("preview elsewhere", ["preview", out, "-o", folder / "pictures", "--count", "1", "--width", "64", "--height", "64"], 0, "pictures/contact_sheet.png")
    expect("preview of no list", ["preview", out, "-f", "1,x"], 2, "is no list of frames", "1-96x2")
    expect("preview by values that are not there", ["preview", out, "--colour", "margin"], 2, "--colour", "output.ply = true")
    expect("preview with no colour", ["preview", out, "--torn", "#12345"], 2, "--torn", "#rrggbb")
    expect("preview at a point without an eye", ["preview", out, "--look-at", "0", "0", "0"], 2, "--eye")
    expect("preview from where it looks", ["preview", out, "--eye", "1", "1", "1", "--look-at", "1", "1", "1"], 2, "--look-at")
    expect("preview of where it began", ["preview", out, "--count", "1", "--width", "64", "--height", "64", "--fit", "first"], 0, "contact_sheet.png")
    expect("preview from a place", ["preview", out, "--count", "1", "--width", "64", "--height", "64", "--eye", "2", "1", "4", "--look-at", "0", "0", "0", "--angle", "30", "--torn", "as_others"], 0, "contact_sheet.png")
    looks = []
    for at in [], ["--look-at", "0", "0", "0"]:
        expect("preview from an eye alone", ["preview", out, "-f", "1", "--width", "64", "--height", "64", "--eye", "-2", "1", "-4", *at], 0)
        looks.append((out / "preview/contact_sheet.png").read_bytes())
    if looks[0] != looks[1]:
        failures.append("an eye alone does not look at the middle of the body")
    expect("preview from a place that fits", ["preview", out, "--eye", "2", "1", "4", "--fit", "run"], 2, "--fit excludes --eye")
    expect("preview of nothing", ["preview", folder], 4, "run.json")
    for eye in ("nan", "inf", "1e19"):
        expect(f"preview from {eye}", ["preview", out, "--eye", eye, "0", "0"], 2, "--eye", "no number from")
    turns = ["preview", out, "--width", "16", "--height", "16", "--samples", "1", "--turntable"]
    for turn in (3, 2):
        expect("turntable", [*turns, str(turn)], 0)
        if len(list(Path(out).glob("preview/*.turn.*.png"))) != turn:
            failures.append(f"turntable: {turn} pictures asked for, {sorted(Path(out).glob('preview/*'))}")
    for picture in Path(out).glob("preview/*.turn.0002.png"):
        (folder / "shots").mkdir()
        own = folder / "shots" / picture.name.replace("0002", "0003")
        own.write_text("mine")
        expect("turntable elsewhere", [*turns, "2", "-o", own.parent], 0)
        if own.read_text() != "mine":
            failures.append("a turntable removed a picture that was in another folder")
    expect("preview looking nowhere", ["preview", out, "--direction", "0", "0", "0"], 2, "--direction")
    expect("preview from a side with a bare point", ["preview", out, "--count", "1", "--width", "64", "--height", "64", "--direction", "1", "-.4", "1"], 0, "contact_sheet.png")

    # What a run could not do is told, in the summary and in stats.csv; --strict makes an error of what was not solved.
    def statuses(run):
        with open(run / "stats.csv", newline="") as rows:
            return list(csv.DictReader(rows))

    quick = ["--set", "grid.voxel_size=0.1", "--set", "time.substeps=1"]
    never = [*quick, "-f", "2", "--set", "solver.newton_iterations=1", "--set", "solver.newton_tolerance=1e-14"]
    capped = folder / "capped"
    expect("capped steps", ["sim", good, "-o", capped, *never], 0, "hit its caps", "capped: relative residuals", "of the best iterates")
    expect("capped steps under --strict", ["sim", good, "-o", capped, *never, "--strict", "--overwrite"], 3, " capped")
    told = statuses(capped)
    if {s["status"] for s in told} != {"capped"} or not all(0 < float(s["min_residual"]) <= float(s["residual"]) for s in told):
        failures.append(f"capped: {told}")
    if len(told) > 512:
        failures.append(f"capped: {len(told)} steps for a frame, each shorter than the one before")
    if json.loads((capped / "run.json").read_text())["status"] != "done, not converged everywhere":
        failures.append("capped: run.json does not say so")
    # A frame of which so many steps fail stops the run, with advice and a checkpoint from which it can be tried again.
    stuck = folder / "stuck"
    nowhere = ["sim", good, "-o", stuck, *never, "--set", "time.substeps=2"]
    expect("a run that gets nowhere", nowhere, 3, "gets nowhere", "newton_tolerance", "--resume")
    steps = len(statuses(stuck))
    if steps != 300 or json.loads((stuck / "run.json").read_text())["status"] != "stuck" or not (stuck / "ckpt/notched_block.000300.ckpt").exists():
        failures.append(f"stuck: {steps} steps, {sorted(p.name for p in (stuck / 'ckpt').iterdir())}")
    expect("which is tried again", [*nowhere, "--resume"], 0, "resumes after step 300")
    # What flies apart is an error; the steps that lead there are kept.
    apart = folder / "apart"
    expect("a run that flies apart", ["sim", good, "-o", apart, "--set", "grid.voxel_size=0.1", "--set", 'solver.integrator="symplectic_euler"',
                                      "--set", "time.substeps=6"], 5, "beyond what a number can hold")
    steps, run = statuses(apart), json.loads((apart / "run.json").read_text())
    if run["status"] != "failed" or not 0 < len(steps) or "failed: step" not in (apart / "run.log").read_text():
        failures.append(f"apart: {run['status']}, {len(steps)} steps")
    elif len(steps) <= 6 * (len(run["frames"]) - 1) or not float(steps[-1]["kinetic_J"]) > 1e6 * float(steps[0]["kinetic_J"]):
        failures.append(f"apart: the last steps are not told: {len(steps)} of {len(run['frames'])} frames")
    held = folder / "held"
    expect("a front held back", ["sim", good, "-o", held, *quick, "-f", "24", "--set", "fracture.keys=[{ time = 0, scale = 1e-3 }]", "--strict"], 0, "held back: in ")
    if not any(int(s["fracture_held_back"]) for s in statuses(held)):
        failures.append("held back: not in stats.csv")
    # Energy that has no account is told, in the log, the summary, stats.csv and run.json.
    loose = folder / "loose"
    expect("energies that do not add up", ["sim", good, "-o", loose, *quick, "-f", "8", "--set", "solver.newton_tolerance=0.5", "--set", "material.gel.youngs_modulus=1e5"], 0, "has no account", "energy: up to")
    for run, adds_up in ((held, True), (loose, False)):
        share = json.loads((run / "run.json").read_text())["max_unnamed_share"]
        if share != max(float(s["unnamed_share"]) for s in statuses(run)) or (share <= 0.01) != adds_up:
            failures.append(f"{run.name}: {share} of the work has no account")
    expect("forces beyond numbers", ["sim", good, "-o", folder / "o5", "-f", "2", *quick, "--set", "grip.0.move.velocity=[0,1e200,0]"], 5, "step 1", "beyond what a number can hold")

    measured = folder / "verify.json"
    expect("verify", ["verify", "--hard", "--only", "bad_numbers,contact", "--json", measured], 0, "holds", "2 cases hold")
    cases = json.loads(measured.read_text())["cases"]
    if [c["id"] for c in cases] != ["bad_numbers", "contact"] or not all(m["holds"] for m in cases[0]["measured"]):
        failures.append(f"verify: {cases}")
    expect("verify what", ["verify"], 2, "--hard")
    expect("verify torture", ["verify", "--torture", "--quick", "--only", "moving_plane"], 0, "1 case holds, 0 do not")
    expect("verify in newtons", ["verify", "--newtons", "--quick", "--only", "slits"], 0, "1 case holds, 0 do not")
    expect("verify both", ["verify", "--hard", "--random", 2], 2, "--random")
    expect("random scenes", ["verify", "--random", 2, "--seed", 7, "--json", measured], 0, "seeds 7 to 8", "0 scenes break a law")
    if [c["seed"] for c in json.loads(measured.read_text())["scenes"]] != [7, 8]:
        failures.append(f"verify --random: {measured.read_text()}")
    expect("verify an unknown case", ["verify", "--hard", "--only", "nonsense"], 2, "nonsense")
    expect("verify a case of the other table", ["verify", "--hard", "--only", "bad_numbers,moving_plane"], 2, "moving_plane goes with --torture")
    for option in ["--seed", 7], ["--keep", folder]:
        expect("verify hard cases as if random", ["verify", "--hard", *option], 2, option[0], "--random")
    for option in ["--quick"], ["--only", "bad_numbers"]:
        expect("verify random scenes as if hard cases", ["verify", "--random", 1, *option], 2, option[0], "--random")

    # A cube of 1 m without its top, one face turned: repaired, levelled, and levelled again.
    cube, ball, again = folder / "cube.obj", folder / "cube.vdb", folder / "again.vdb"
    points = "".join(f"v {i & 1} {i >> 1 & 1} {i >> 2}\n" for i in range(8))
    faces = ["1 3 4 2", "1 2 6 5", "3 7 8 4", "1 5 7 3", "6 8 4 2"]
    cube.write_text(points + "".join(f"f {f}\n" for f in faces))
    said = report("relevel a surface", ["relevel", cube, "-o", ball, "--across", 32, "--json", "-q"])
    if said and not (said["repair"]["filled_holes"] == said["repair"]["turned_faces"] == 1 and not said["repair"]["wrapped"]):
        failures.append(f"relevel: not the gentlest repair: {said['repair']}")
    if said and abs(said["after"]["volume"] - 1) > 0.01:  # edges are rounded by half a voxel
        failures.append(f"relevel: volume {said['after']['volume']} of a unit cube")
    more = report("relevel a grid", ["relevel", ball, "-o", again, "--json", "-q"])
    if said and more and abs(more["after"]["volume"] / said["after"]["volume"] - 1) > 1e-3:
        failures.append(f"relevel moved the surface: {more['before']} {more['after']}")
    wrapped = report("relevel by a wrap", ["relevel", cube, "-o", ball, "--across", 32, "--wrap", 0.7, "--json", "-q"])
    if wrapped and not (wrapped["repair"]["wrapped"] and abs(wrapped["after"]["volume"] - 1) < 0.1):
        failures.append(f"relevel --wrap: {wrapped}")
    expect("relevel without a size", ["relevel", cube, "-o", ball], 2, "--voxel", "--across")
    expect("relevel into a mesh", ["relevel", cube, "-o", folder / "x.obj", "--across", 8], 2, ".vdb")
    expect("relevel too fine", ["relevel", cube, "-o", ball, "--voxel", 2e-5, "--max-memory", 1], 5, "memory limit")
    expect("relevel of microns", ["relevel", cube, "-o", ball, "--voxel", 1e-5], 2, "voxel size 1e-05 m")
    sheet = folder / "sheet.obj"
    sheet.write_text(points + "f 1 2 4 3\n")
    expect("relevel of an open sheet", ["relevel", sheet, "-o", folder / "y.vdb", "--across", 16], 2, "sheet.obj")
    expect("relevel of nothing", ["relevel", folder / "none.stl", "-o", ball, "--across", 8], 4, "none.stl")
    expect("wraps are for surfaces", ["relevel", ball, "-o", again, "--wrap", 0.1], 2, "--wrap")

    grids = report("info of a .vdb", ["info", ball, "--json"])
    if grids and not (grids["grids"][0]["class"] == "level set" and grids["grids"][0]["metadata"]["length_unit"] == "m"):
        failures.append(f"info of a .vdb: {grids}")
    expect("info of nothing", ["info", folder / "nothing"], 4, "No such file")
    expect("info of a surface", ["info", cube], 0, "open_edges: 4", "faces: 5")
    expect("info of a run", ["info", out, "--verify"], 0, "frames: 1", "frames_with_flaws: none", "frames_missing: none", "rest_volume")
    stopped = folder / "stopped"
    shutil.copytree(out, stopped)
    manifest = json.loads((stopped / "run.json").read_text())
    manifest["frame_range"], manifest["status"] = [1, 9], "running"
    (stopped / "run.json").write_text(json.dumps(manifest))
    expect("info of a run that was stopped", ["info", stopped], 0, "frames: 1", "frames_missing: 2-9", "status: running, but nothing on this machine writes into it")
    with open_folder(stopped):
        expect("info of a run that goes on", ["info", stopped], 0, "status: running\n")
    shutil.copy(ball, folder / "BALL.VDB")
    expect("info of a name in capitals", ["info", folder / "BALL.VDB"], 0, "level set")
    expect("tets of a name in capitals", ["mesh", folder / "BALL.VDB", "-o", folder / "ball.vtu"], 0, "ball.vtu")
    expect("a .vdb above the limit", ["mesh", ball, "-o", folder / "ball.vtu", "--max-memory", 1e-6], 5, ball.name, "memory limit")
    def box(size, first, order):
        corners = [(x, y, z) for z in (-size, size) for y in (-size, size) for x in (-size, size)]
        faces = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
        return "".join(f"v {x} {y} {z}\n" for x, y, z in corners) + "".join("f " + " ".join(str(first + c) for c in f[::order]) + "\n" for f in faces)
    hollow = folder / "hollow.obj"
    hollow.write_text(box(1, 1, 1) + box(0.5, 9, -1))
    expect("a hollow is filled, and said to be", ["mesh", hollow, "-o", folder / "hollow.vtu", "--across", 16], 0, "encloses 7 m^3", "hollows")
    frame = next((out / "vdb").glob("*.vdb"))
    content = bytearray(frame.read_bytes())
    content[len(content) // 2] ^= 1
    frame.write_bytes(content)
    expect("a flipped bit has the right size", ["info", out], 0, "frames: 1")
    expect("and another checksum", ["info", out, "--verify"], 4, frame.name, "checksum")
    frame.unlink()
    gone = report("info of a run with a missing file", ["info", out, "--json"], 4)
    if gone and [f["flaw"] for f in gone["flaws"]] != ["missing"]:
        failures.append(f"info: missing file not told: {gone}")
    expect("info of no run", ["info", folder], 4, "run.json")
    frame.write_bytes(content[:1000])
    expect("info of half a .vdb", ["info", frame], 4, "damaged")

    # Numbers that make no sense, and words that are no command.
    said = expect("unknown command", ["simulate", good], 2, "no command 'simulate'", "sim", "check", "relevel", "preview")
    for threads in -3, 1025:
        said = expect("threads out of range", ["sim", good, "-n", "--measure", "0", "-j", threads], 2, "0 to 1024", str(threads))
        if len(said) > 200:
            failures.append(f"-j {threads} is answered by {len(said)} characters")
    for amount in "nan", "inf", "1e12", "-1", "0":
        expect(f"--max-memory {amount}", ["sim", good, "-n", "--measure", "0", "--max-memory", amount], 2, "--max-memory")
    for frames in "1-10000000", "10000000", "99999999999999999999":
        expect(f"frames {frames}", ["sim", good, "-n", "--measure", "0", "-f", frames], 2, "--frames", "999999")

    # A standard output that takes nothing.
    for arguments in ["scene", "--defaults"], ["check", good], ["--help"], ["sim", good, "-n", "--measure", "0"]:
        with open("/dev/full", "w") as full:
            expect(f"{arguments} into a full disk", arguments, 4, "standard output", "No space left", stdout=full)

    # What is not a file, is too large, or can not be read.
    fifo, loop, large = folder / "fifo.toml", folder / "loop.toml", folder / "large.toml"
    os.mkfifo(fifo)
    loop.symlink_to(folder / "pool.toml")
    (folder / "pool.toml").symlink_to(loop)
    large.write_text("#" * 20_000_000)
    expect("an endless device as scene", ["check", "/dev/zero"], 4, "/dev/zero", timeout=10)
    expect("a FIFO as scene", ["check", fifo], 4, fifo.name, timeout=10)
    for ending in "vdb", "obj":
        silent = folder / f"fifo.{ending}"
        os.mkfifo(silent)
        expect("a FIFO as input", ["relevel", silent, "-o", folder / "never.vdb", "--across", 8], 4, silent.name, "pipe", timeout=10)
    expect("a loop of links as scene", ["check", loop], 4, loop.name, timeout=10)
    expect("a scene that is too large", ["check", large], 4, large.name, "at most", timeout=10)
    unreadable = folder / "unreadable.obj"
    unreadable.symlink_to("/proc/self/mem")  # its first page is not there: an error of reading
    for arguments in ["info", unreadable], ["relevel", unreadable, "-o", folder / "z.vdb", "--across", 8]:
        expect(f"{arguments[0]} of a file with an error of reading", arguments, 4, unreadable.name, timeout=10)

    # A limit of file sizes is an error of writing, as a full disk is.
    def limited():
        resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))
    limit = folder / "limit"
    expect("a limit of file sizes", ["sim", good, "-o", limit, *quick, "-f", "2", "-q"], 4, str(limit), "cannot be written", preexec_fn=limited)
    told = json.loads((limit / "run.json").read_text())
    if told["status"] != "failed" or "cannot be written" not in told.get("error", "") or "failed: " not in (limit / "run.log").read_text().splitlines()[-1]:
        failures.append(f"a run that failed does not say why: {told}")
    expect("info tells why", ["info", limit], 0, "status: failed", "error: ", "cannot be written")
    left = [str(p) for p in limit.rglob("*") if ".partial" in p.name]
    if left:
        failures.append(f"a limit of file sizes leaves {left}")

    # Steps before an error of the writer are those that led to it.
    (limit / "obj/notched_block.0003.obj").mkdir(parents=True)
    expect("a folder in the place of a frame", ["sim", good, "-o", limit, *quick, "-f", "6", "--overwrite", "-v"], 4, "0003.obj")
    made = sum(": step " in line or " step " in line for line in (limit / "run.log").read_text().splitlines())
    rows = len((limit / "stats.csv").read_text().splitlines()) - 1
    told = json.loads((limit / "run.json").read_text())["steps"]
    if not 0 < made == rows == told:
        failures.append(f"a run that failed has made {made} steps, {rows} are in stats.csv, {told} in run.json")

    # Output where something is: a link leads to what is written, devices and FIFOs stay.
    target, link, pipe, null = folder / "target.vdb", folder / "link.vdb", folder / "pipe.vdb", folder / "null.vdb"
    target.write_text("before")
    link.symlink_to(target)
    os.mkfifo(pipe)
    null.symlink_to("/dev/null")
    ball_again = ["relevel", cube, "--across", 16, "-q", "-o"]
    expect("output through a link", [*ball_again, link], 0)
    if not link.is_symlink() or target.is_symlink() or target.stat().st_size < 1000:
        failures.append("output through a link: the link is gone, or its target is not written")
    expect("output into a FIFO", [*ball_again, pipe], 4, pipe.name, timeout=20)
    expect("output into a device", [*ball_again, null], 4, timeout=20)
    if not (stat.S_ISFIFO(pipe.stat().st_mode) and stat.S_ISCHR(os.stat("/dev/null").st_mode) and null.is_symlink()):
        failures.append("a FIFO or a device was replaced by output")

    # The bar fits its terminal; the table adds up.
    for columns in 60, 30, 200:
        drawn, code = at_a_terminal(["sim", good, "-o", folder / "bar", "--overwrite", *quick, "-f", "24", "--progress", "bar"], columns)
        lines = [re.sub("\x1b\\[[0-9;]*[A-Za-z]", "", part) for part in drawn.split("\r") if "\x1b[K" in part and "[" in part[3:]]
        bars = [line for line in lines if re.match(r"\[[#.]", line)]
        if code != 0 or len(bars) < 3:
            failures.append(f"a bar of {columns} columns: exit {code}, {len(bars)} drawings in:\n{drawn}")
        if any(len(line.split("\n")[0]) > columns - 1 for line in bars):
            failures.append(f"a bar of {columns} columns is too long: {max(bars, key=len)}")
    said = expect("table of stages", ["sim", good, "-o", folder / "bar", "--overwrite", *quick, "-f", "24"], 0, "stage ", "seconds")
    rows = dict(re.findall(r"^(\w+) +(\d+\.\d\d)(?= |$)", said[said.index("stage "):], re.MULTILINE))
    parts = [float(seconds) for name, seconds in rows.items() if name not in ("all", "output")]
    if "output" not in rows or len(parts) < 4 or abs(float(rows.get("all", -1)) - sum(parts)) > 0.005 * (len(parts) + 1):  # each is rounded
        failures.append(f"table of stages: 'all' is not the sum of the stages but output: {rows}")

    # A locale with decimal commas changes nothing.
    (folder / "locales").mkdir()
    commas = locale_with_commas(folder / "locales")
    if commas is None:
        print("left out: the program in a locale with decimal commas, of which none is installed")
    else:
        runs = []
        for env in {**os.environ, "LC_ALL": "C"}, commas:
            run = folder / f"locale_{env['LC_ALL']}"
            plan = expect("plan in a locale", ["sim", good, *quick, "-n", "--measure", "0"], 0, env=env)
            expect("run in a locale", ["sim", good, "-o", run, *quick, "-f", "3", "-q", "--time-limit", "1.5h"], 0, env=env)
            if not (run / "stats.csv").exists():
                continue  # told above
            rows = statuses(run)
            told = [[value for key, value in row.items() if not key.endswith("_s") or key in ("time_s", "dt_s")] for row in rows]
            frames = json.loads((run / "run.json").read_text())["frames"]
            runs.append((plan, told, [f["state_hash"] for f in frames], (run / "scene.toml").read_text()))
        if len(runs) == 2 and runs[0] != runs[1]:
            failures.append(f"a locale with decimal commas changes a run: {runs}")

print("\n".join(failures) or "all as expected")
sys.exit(1 if failures else 0)
