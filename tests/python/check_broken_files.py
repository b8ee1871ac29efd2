"""Broken files on the command line: every command that reads them ends with success, bad data (2) or a damaged file (4).

Takes the program and fuzz_driver, which makes the files: the first of the mutations that it runs by itself.
"""
import collections
import resource
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

PROGRAM, DRIVER = (str(Path(argument).resolve()) for argument in sys.argv[1:])
COUNT = 24  # files of a kind
SECONDS = 10
MEMORY = 2 << 30  # bytes
NAMED = {0, 2, 4}  # exit codes of success and of errors that name what is wrong with a file
COMMANDS = {".toml": [["check"]], ".ckpt": [["sim"]]}
OF_SHAPES = [["info"], ["relevel", "-o", "out.vdb"], ["mesh", "-o", "out.vtu"]]


def arguments(command, file):
    given = [command[0], str(file), *command[1:]]
    if command[0] == "info" or command[0] == "check":
        return given
    given += ["--max-memory", "0.2", "-q"]
    return given + ([] if file.suffix == ".vdb" else ["--across", "12"])


def resumed(file, folder):
    """Goes on with a run of the example scene that has this checkpoint only."""
    scene, run = folder / "example.toml", folder / "run"
    scene.write_bytes(subprocess.run([PROGRAM, "scene", "--example"], capture_output=True, check=True).stdout)
    shutil.rmtree(run, ignore_errors=True)
    (run / "ckpt").mkdir(parents=True)
    shutil.copy(file, run / "ckpt/example.000001.ckpt")
    return ["sim", scene, "-o", run, "--resume", "-q", "--set", "grid.voxel_size=0.1"]


def limit_memory():
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))


def ending(command, file, folder):
    """The exit code, or what is wrong with the way the command ended."""
    given = resumed(file, folder) if command[0] == "sim" else arguments(command, file)
    try:
        run = subprocess.run([PROGRAM, *given], capture_output=True, cwd=folder, timeout=SECONDS, preexec_fn=limit_memory)
    except subprocess.TimeoutExpired:
        return f"runs for more than {SECONDS} s"
    said = run.stderr.decode(errors="replace")
    if run.returncode not in NAMED:
        return f"exit {run.returncode}: {said}"
    if run.returncode != 0 and not said.strip():
        return f"exit {run.returncode} without a word"
    return run.returncode


failures = []
counts = collections.defaultdict(collections.Counter)
with tempfile.TemporaryDirectory() as temporary:
    folder = Path(temporary)
    files = folder / "files"
    files.mkdir()
    subprocess.run([DRIVER, "broken", files, str(COUNT)], check=True)
    for file in sorted(files.iterdir()):
        for command in COMMANDS.get(file.suffix, OF_SHAPES):
            code = ending(command, file, folder)
            counts[file.suffix, command[0]][code if isinstance(code, int) else "failed"] += 1
            if not isinstance(code, int):
                failures.append(f"{command[0]} {file.name}: {code}")

for (kind, command), codes in counts.items():
    print(kind, command, *(f"exit {code}: {n}," for code, n in sorted(codes.items(), key=str)))
    if sum(codes.values()) != COUNT or codes[0] == COUNT:
        failures.append(f"{command} {kind}: no {COUNT} files of which some are refused")
if len(counts) != 2 + 5 * len(OF_SHAPES):
    failures.append(f"not every kind of file was made: {sorted(counts)}")
print("\n".join(failures) or "all as expected")
sys.exit(1 if failures else 0)
