#!/usr/bin/python3
"""Reads the frames of a run with programs that are not ours: pyopenvdb, meshio, vdb_print.

Usage: check_frames.py RUN_FOLDER. Exits with 1 and says what is wrong, or with 0 and one line of numbers.
"""

import json
import math
import re
import shutil
import subprocess
import sys
import tomllib
from collections import Counter
from pathlib import Path

import meshio
import numpy as np
import pyopenvdb

from obj_frames import read_obj
from ply_frames import read_ply

REST_GRIDS = ("phi", "energy", "arrival", "margin", "plastic_strain")  # one for each body
LEVEL_SETS = ("phi", "surface")
VECTOR_GRIDS = ("vel",)
UNITS = {"phi": "m", "energy": "J/m^3", "arrival": "s", "margin": "1", "plastic_strain": "1", "surface": "m", "vel": "m/s"}
FILE_METADATA = ("creator", "scene", "frame", "time", "fps", "length_unit", "up_axis")


SURFACES = 16  # frames of a run whose surfaces are read, spread over it: there may be hundreds, in text


class Wrong(Exception):
    pass


def require(condition, message):
    if not condition:
        raise Wrong(message)


def grid_names(scene):
    """Expected grids: name in the file -> kind of grid."""
    bodies = [body["name"] for body in scene["body"]]
    names = {}
    for kind in scene["output"]["vdb"]:
        if kind in REST_GRIDS and len(bodies) > 1:
            names.update({f"{kind}_{body}": kind for body in bodies})
        else:
            names[kind] = kind
    return names


def check_finite(grid, where):
    """All values in the bounding box of the active ones, a slab at a time."""
    lower, upper = grid.evalActiveVoxelBoundingBox()
    size = [upper[a] - lower[a] + 1 for a in range(3)]
    vector = isinstance(grid, pyopenvdb.Vec3SGrid)
    slab = np.empty([1] + size[1:] + ([3] if vector else []), dtype=np.float32)
    for x in range(lower[0], upper[0] + 1):
        grid.copyToArray(slab, ijk=(x, lower[1], lower[2]))
        require(np.isfinite(slab).all(), f"{where}: values that are not finite at x = {x}")


def check_metadata(metadata, scene, frame, where):
    for key in FILE_METADATA:
        require(key in metadata, f"{where}: no metadata '{key}'")
    require(metadata["creator"].startswith("vdbfrac "), f"{where}: creator is '{metadata['creator']}'")
    require(metadata["scene"] == scene["name"], f"{where}: scene is '{metadata['scene']}'")
    require(metadata["frame"] == frame["frame"], f"{where}: frame is {metadata['frame']}, not {frame['frame']}")
    require(math.isclose(metadata["time"], frame["time"], abs_tol=1e-12), f"{where}: time is {metadata['time']}")
    require(metadata["fps"] == scene["time"]["fps"], f"{where}: fps is {metadata['fps']}")
    require(metadata["length_unit"] == "m" and metadata["up_axis"] == "y", f"{where}: wrong unit or up axis")


def check_grid(grid, kind, scene, frame, where):
    check_metadata(grid.metadata, scene, frame, where)
    expected_class = pyopenvdb.GridClass.LEVEL_SET if kind in LEVEL_SETS else pyopenvdb.GridClass.UNKNOWN
    require(grid.gridClass == expected_class, f"{where}: grid class '{grid.gridClass}'")
    expected_type = pyopenvdb.Vec3SGrid if kind in VECTOR_GRIDS else pyopenvdb.FloatGrid
    require(isinstance(grid, expected_type), f"{where}: type {type(grid).__name__}")
    require(grid.metadata.get("units", "") == UNITS.get(kind, ""), f"{where}: wrong units")
    voxel = grid.transform.voxelSize()
    require(np.allclose(voxel, scene["grid"]["voxel_size"], rtol=1e-12), f"{where}: voxel size {voxel}")
    active = grid.activeVoxelCount()
    if active == 0:
        # empty until something tears or flows, the fields of the surface when all material is gone
        require(kind in ("arrival", "margin", "plastic_strain") or frame["all_gone"], f"{where}: no active voxels")
        return
    check_finite(grid, where)
    if kind in LEVEL_SETS:
        low, high = grid.evalMinMax()
        require(high > 0 and (low < 0 or frame["all_gone"]), f"{where}: values from {low} to {high} do not change sign")
    if kind in ("energy", "margin", "plastic_strain"):
        require(grid.evalMinMax()[0] >= 0, f"{where}: below 0")
    if kind == "arrival":
        low, high = grid.evalMinMax()
        require(0 <= low and high <= frame["time"] * (1 + 1e-6), f"{where}: times from {low} to {high} s")


def check_vdb(path, scene, frame):
    grids, metadata = pyopenvdb.readAll(str(path))
    check_metadata(metadata, scene, frame, path)
    expected = grid_names(scene)
    found = sorted(grid.name for grid in grids)
    require(found == sorted(expected), f"{path}: holds {found}, the scene asks for {sorted(expected)}")
    for grid in grids:
        check_grid(grid, expected[grid.name], scene, frame, f"{path}, grid '{grid.name}'")


def check_obj_text(path):
    """Structure that meshio does not keep: objects, groups, materials. Returns the fragments, points and triangles."""
    name = group = material = None
    count = {"v": 0, "vt": 0, "vn": 0}
    triangles = 0
    fragments = []
    library = None
    for number, line in enumerate(path.read_text().splitlines(), 1):
        key, _, rest = line.partition(" ")
        where = f"{path}:{number}"
        if key == "mtllib":
            library = rest
        elif key in count:
            count[key] += 1
            if key == "vn":
                length = math.hypot(*map(float, rest.split()))
                require(abs(length - 1) < 1e-6, f"{where}: a normal of length {length}")
        elif key == "o":
            require(re.fullmatch(r"fragment_\d{4,}", rest), f"{where}: object '{rest}'")
            name, group, material = rest, None, None
            fragments.append(int(rest.split("_")[1]))
        elif key == "g":
            require(name is not None and rest, f"{where}: group '{rest}'")
            group = rest
        elif key == "usemtl":
            require(group is not None and (rest == "inside" or rest.startswith("inside_")) == group.endswith("_inside"),
                    f"{where}: material '{rest}' in group '{group}'")
            material = rest
        elif key == "f":
            require(material is not None, f"{where}: a face outside of a group with a material")
            corners = [corner.split("/") for corner in rest.split()]
            require(len(corners) >= 3 and len({c[0] for c in corners}) == len(corners), f"{where}: no polygon: {rest}")
            for corner in corners:
                for of, index in zip(("v", "vt", "vn"), corner):
                    require(not index or 1 <= int(index) <= count[of],
                            f"{where}: index out of 1 to {count[of]}: {rest}")
            triangles += len(corners) - 2
        else:
            raise Wrong(f"{where}: unexpected '{line}'")
    require(len(fragments) == len(set(fragments)), f"{path}: an object comes twice")
    require(library and (path.parent / library).is_file(), f"{path}: its material library '{library}' is not there")
    return fragments, count["v"], triangles


def check_obj(path, frame):
    fragments, points, faces = check_obj_text(path)
    require(faces > 0 or frame["all_gone"], f"{path}: no faces")
    if faces == 0:
        return set(fragments)
    mesh = read_obj(path)
    require(len(mesh.points) == points, f"{path}: meshio reads {len(mesh.points)} of {points} points")
    require(np.isfinite(mesh.points).all(), f"{path}: points that are not finite")
    read = 0
    for block in mesh.cells:
        require(block.type in ("triangle", "quad", "polygon"), f"{path}: meshio reads cells of type {block.type}")
        read += len(block.data) * (block.data.shape[1] - 2)
        require(block.data.min() >= 0 and block.data.max() < points, f"{path}: indices out of range")
    require(read == faces, f"{path}: meshio reads {read} of {faces} triangles")
    return set(fragments)


def check_closed(path):
    """Each fragment is closed: along every edge of it as many faces run one way as the other."""
    edges = Counter()
    fragment = None
    for line in path.read_text().splitlines():
        key, *words = line.split()
        if key == "o":
            fragment = words[0]
        elif key == "f":
            corners = [word.split("/")[0] for word in words]
            edges.update((fragment, a, b) for a, b in zip(corners, corners[1:] + corners[:1]))
    gaps = sum(n != edges[name, b, a] for (name, a, b), n in list(edges.items()))
    require(gaps == 0, f"{path}: {gaps} edges at which a fragment is open")


def check_ply(path, scene):
    """As docs/output.md has it. Where there is an .obj of the frame, vertex k is its point k. Returns the fragments."""
    names, table, faces, body = read_ply(path)
    points, at, fragments = len(table), 0, set()
    values = [n for n in scene["output"]["vdb"] if n in ("energy", "arrival", "margin", "plastic_strain")]
    require(names == ["x", "y", "z", "vx", "vy", "vz", "rest_x", "rest_y", "rest_z", *values], f"{path}: {names}")
    require(np.isfinite(table).all(), f"{path}: a value is not finite")
    for _ in range(faces):
        corners = np.frombuffer(body, "<i4", body[at], at + 1)
        require(((corners >= 0) & (corners < points)).all(), f"{path}: a face without points")
        at += 1 + 4 * len(corners) + 5
        fragments.add(int.from_bytes(body[at - 5:at - 1], "little"))
        require(body[at - 1] in (0, 1), f"{path}: torn is {body[at - 1]}")
    require(at == len(body), f"{path}: {len(body) - at} bytes behind its faces")
    obj = path.parent.parent / "obj" / (path.stem + ".obj")
    if obj.is_file():
        own = read_obj(obj).points
        require(own.shape == (points, 3) and np.allclose(own, table[:, :3], rtol=1e-6, atol=1e-6), f"{path}: other points than {obj}")
    return fragments


def check_files(folder, run):
    """Every file of the manifest is there with its size, and no other frame is."""
    listed = set()
    for frame in run["frames"]:
        require(frame["files"], f"run.json: frame {frame['frame']} has no files")
    for files in [frame["files"] for frame in run["frames"]] + [run.get("point_cache", [])]:
        for entry in files:
            path = folder / entry["path"]
            require(path.is_file(), f"run.json names {entry['path']}, which is not there")
            size = path.stat().st_size
            require(size == entry["bytes"], f"{path}: {size} bytes, run.json says {entry['bytes']}")
            listed.add(path)
    present = {file for place in ("vdb", "obj", "ply", "motion", "cache") for file in folder.glob(f"{place}/*") if file.name != run["scene"] + ".mtl" or place == "cache"}
    require(present == listed, f"files that run.json does not name: {sorted(map(str, present - listed))}")


def check_numbers(scene, run):
    first, last = run["frame_range"]
    numbers = [frame["frame"] for frame in run["frames"]]
    require(numbers == list(range(first, last + 1)), f"run.json: frames {numbers}, the range is {first} to {last}")
    for frame in run["frames"]:
        time = (frame["frame"] - first) / scene["time"]["fps"]
        require(abs(frame["time"] - time) <= 1e-6 / scene["time"]["fps"], f"run.json: frame {frame['frame']} at {frame['time']} s")


def check_with_vdb_print(path, scene):
    program = shutil.which("vdb_print")
    require(program, "vdb_print is not installed (Debian package libopenvdb-tools)")
    result = subprocess.run([program, str(path)], capture_output=True, text=True)
    require(result.returncode == 0, f"vdb_print {path}: {result.stderr.strip()}")
    for name in grid_names(scene):
        require(re.search(rf"\b{re.escape(name)}\b", result.stdout), f"vdb_print {path}: does not list '{name}'")


def check_run(folder):
    scene = tomllib.loads((folder / "scene.toml").read_text())
    run = json.loads((folder / "run.json").read_text())
    require(run["status"].startswith("done"), f"run.json: status '{run['status']}'")
    check_files(folder, run)
    check_numbers(scene, run)
    known = {fragment["id"] for fragment in run["fragments"]}
    vdbs = objs = 0
    last_vdb = None
    last = len(run["frames"]) - 1
    read = {round(i * last / (SURFACES - 1)) for i in range(SURFACES)}
    for number, frame in enumerate(run["frames"]):
        frame["all_gone"] = run["volume"] == 0  # by the end of the run: then a frame may be without material
        for entry in frame["files"]:
            path = folder / entry["path"]
            if path.suffix == ".vdb":
                check_vdb(path, scene, frame)
                vdbs, last_vdb = vdbs + 1, path
                continue
            objs += path.suffix == ".obj"
            if path.suffix == ".motion" or number not in read:
                continue
            fragments = check_ply(path, scene) if path.suffix == ".ply" else check_obj(path, frame)
            require(fragments <= known, f"{path}: fragments {sorted(fragments - known)} are not in run.json")
            if path.suffix == ".obj":
                check_closed(path)
    expected = len(run["frames"])
    require(vdbs == (expected if scene["output"]["vdb"] else 0), f"{vdbs} .vdb frames of {expected}")
    require(objs == (expected if scene["output"]["obj"] else 0), f"{objs} .obj frames of {expected}")
    if last_vdb:
        check_with_vdb_print(last_vdb, scene)
    return f"{vdbs} .vdb frames are sound, and {objs} .obj frames there, of which {len(read)} were read"


def main():
    if len(sys.argv) != 2:
        print(__doc__, file=sys.stderr)
        return 2
    try:
        print(check_run(Path(sys.argv[1])))
    except (Wrong, OSError, KeyError, ValueError, RuntimeError, meshio.ReadError) as error:
        print(f"check_frames: {type(error).__name__}: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
