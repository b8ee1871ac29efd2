"""The program as a user meets it: help, plan, messages with their places, exit codes, nothing lost on failure."""
import subprocess
import sys
import tempfile
from pathlib import Path

PROGRAM, SOURCE = sys.argv[1], Path(sys.argv[2])
SCENE = (SOURCE / "data/scenes/notched_block.toml").read_text()
failures = []


def expect(name, arguments, code, *texts):
    run = subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True, timeout=120)
    said = run.stdout + run.stderr
    missing = [t for t in texts if t not in said]
    if run.returncode != code or missing:
        failures.append(f"{name}: exit {run.returncode} (expected {code}), missing {missing} in:\n{said}")


with tempfile.TemporaryDirectory() as temporary:
    folder = Path(temporary)
    good, bad, out = folder / "good.toml", folder / "bad.toml", folder / "out"
    good.write_text(SCENE)
    expect("help", ["--help"], 0, "sim", "check", "scene", "preview")
    expect("no command", [], 2)
    expect("unknown option", ["sim", good, "--nonsense"], 2, "--nonsense")
    expect("version", ["--version"], 0, "vdbfrac")
    expect("defaults", ["scene", "--defaults"], 0, "voxel_size", "[fracture]", "kappa")
    expect("schema", ["scene", "--schema"], 0, "$schema")
    example = subprocess.run([PROGRAM, "scene", "--example"], capture_output=True, text=True, check=True).stdout
    (folder / "example.toml").write_text(example)
    expect("example is a scene", ["check", folder / "example.toml"], 0, "ok")

    bad.write_text(SCENE.replace("poisson_ratio = 0.3", "poisson_ratio = 0.5").replace("voxel_size", "voxel_siz"))
    expect("all errors at once", ["check", bad], 2, "bad.toml:", "did you mean", "voxel_size", "poisson_ratio", "0.5")
    expect("missing file", ["check", folder / "none.toml"], 4, "none.toml")
    expect("no output folder", ["sim", good], 2, "-o")
    expect("plan", ["sim", good, "-n"], 0, "solve", "fracture", "gravity", "off", "no [gravity] in the scene")
    expect("plan needs no folder and writes none", ["sim", good, "-n", "-o", out], 0)
    if out.exists():
        failures.append("a plan wrote files")

    expect("two frames", ["sim", good, "-o", out, "-f", "2", "-q"], 0)
    kept = sorted(p.relative_to(out) for p in out.rglob("*"))
    expect("a full folder is refused", ["sim", good, "-o", out, "-f", "2"], 4, "not empty", "--overwrite")
    if kept != sorted(p.relative_to(out) for p in out.rglob("*")):
        failures.append("a refused run changed the folder")
    foreign = out / "mine.txt"
    foreign.write_text("not of this program")
    expect("overwrite", ["sim", good, "-o", out, "-f", "1", "--overwrite", "-q"], 0)
    if not foreign.exists():
        failures.append("--overwrite removed a file that no run wrote")
    if list(out.rglob("*.partial*")):
        failures.append("partial files are left")
    expect("a file in place of the folder", ["sim", good, "-o", foreign, "-f", "1"], 4, "mine.txt")
    expect("grip beside the body", ["sim", good, "-o", folder / "o2", "--set", "grip.0.region.halfspace.offset=9"], 2, "holds nothing", "good.toml:")
    expect("memory limit", ["sim", good, "-o", folder / "o3", "--max-memory", "0.001"], 5, "--max-memory")
    expect("field that nothing makes", ["sim", good, "-o", folder / "o4", "-f", "1", "--set", 'output.vdb=["phi","arival"]'], 2, "arrival")
    expect("preview", ["preview", out, "--count", "1", "--width", "64", "--height", "64"], 0, "contact_sheet.png")
    expect("preview of nothing", ["preview", folder], 4, "run.json")
    expect("preview looking nowhere", ["preview", out, "--direction", "0", "0", "0"], 2, "--direction")

print("\n".join(failures) or "all as expected")
sys.exit(1 if failures else 0)
