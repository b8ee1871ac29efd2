"""The Debian package: what dpkg says of it, what is in it, and its program at work where only the package is.

Usage: check_package.py BUILD_FOLDER SOURCE_FOLDER
"""
import re
import subprocess
import sys
import tempfile
from pathlib import Path

BUILD, SOURCE = Path(sys.argv[1]).resolve(), Path(sys.argv[2]).resolve()
VERSION = re.search(r"VERSION (\S+)", (SOURCE / "CMakeLists.txt").read_text().split("project(")[1])[1]
ARCHITECTURE = subprocess.run(["dpkg", "--print-architecture"], capture_output=True, text=True, check=True).stdout.strip()
FIELDS = {
    "Package": "vdbfrac",
    "Version": re.escape(VERSION),
    "Architecture": ARCHITECTURE,
    "Section": "graphics",
    "Maintainer": r".+ <\S+@\S+>",
    "Depends": r"(?s)(?=.*libopenvdb\d)(?=.*libtbb\d)(?=.*libpng\d)(?=.*libcholmod\d)(?=.*libc6 \(>= ).*",
    "Description": r"(?s)\S.*\n \S.*",
}
FILES = """usr/bin/vdbfrac usr/lib/libvdbfrac_effects.a usr/lib/libvdbfrac_base.a usr/include/vdbfrac/effects/effects.h
usr/include/vdbfrac/core/version.h usr/lib/cmake/vdbfrac/vdbfracConfig.cmake usr/lib/cmake/vdbfrac/vdbfracTargets.cmake
usr/share/doc/vdbfrac/copyright usr/share/doc/vdbfrac/README.md usr/share/doc/vdbfrac/docs/scene.md
usr/share/vdbfrac/scenes/gingerbread_man.toml usr/share/vdbfrac/meshes/gingerbread_man.obj
usr/share/vdbfrac/meshes/koi.mtl usr/share/vdbfrac/meshes/koi.png""".split()
failures = []


def run(*command, **how):
    done = subprocess.run([*map(str, command)], capture_output=True, text=True, **how)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, command))}: exit {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout


def check_fields(package):
    for field, pattern in FIELDS.items():
        value = run("dpkg-deb", "-f", package, field).strip()
        if not re.fullmatch(pattern, value):
            failures.append(f"{field}: {value!r}, expected {pattern}")
    for line in run("dpkg-deb", "-c", package).splitlines():
        if " root/root " not in line or not re.match(r"drwxr-xr-x|-rw-r--r--|-rwxr-xr-x", line):
            failures.append(f"not root's, or its rights are not the usual ones: {line}")


def check_files(root):
    failures.extend(f"{name} is missing" for name in FILES if not (root / name).is_file())
    for file in root.rglob("*"):
        if file.is_file() and any(bytes(folder) in file.read_bytes() for folder in (BUILD, SOURCE)):
            failures.append(f"{file.relative_to(root)} names a folder of this machine")


def check_program(root, scratch):
    """With no variables of the environment, from a folder of its own."""
    program = root / "usr/bin/vdbfrac"
    bare = {"cwd": scratch, "env": {"PATH": "/usr/bin:/bin"}}
    if VERSION not in run(program, "--version", **bare):
        failures.append("--version does not say " + VERSION)
    run(program, "sim", root / "usr/share/vdbfrac/scenes/gingerbread_man.toml", "-o", "frames", "-f", "1-3", **bare)
    for frame in range(1, 4):
        for kind in ("vdb", "obj"):
            if not list((scratch / "frames" / kind).glob(f"*.{frame:04}.{kind}")):
                failures.append(f"no .{kind} of frame {frame}")


with tempfile.TemporaryDirectory() as temporary:
    scratch = Path(temporary)
    run("cpack", "--config", BUILD / "CPackConfig.cmake", "-B", scratch / "made")
    packages = [p.name for p in (scratch / "made").glob("*.deb")]
    if packages != [f"vdbfrac_{VERSION}_{ARCHITECTURE}.deb"]:
        sys.exit(f"cpack made {packages}")
    package = scratch / "made" / packages[0]
    run("dpkg-deb", "-x", package, scratch / "root")
    check_fields(package)
    check_files(scratch / "root")
    check_program(scratch / "root", scratch)

print("\n".join(failures))
sys.exit(1 if failures else 0)
