"""vdbfrac mesh: every format is read back by meshio, every direction works, what is refused says why."""
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import meshio
import numpy as np

PROGRAM, SOURCE = sys.argv[1], Path(sys.argv[2])
failures = []


def check(name, good, detail=""):
    if not good:
        failures.append(f"{name}: {detail}")


def mesh(*arguments, code=0, says=()):
    run = subprocess.run([PROGRAM, "mesh", *map(str, arguments)], capture_output=True, text=True, timeout=300)
    said = run.stdout + run.stderr
    check(f"mesh {' '.join(map(str, arguments))}", run.returncode == code and all(s in said for s in says),
          f"exit {run.returncode}, expected {code} and {says} in:\n{said}")
    return run.stdout.split()


def cube(file, lower, upper):
    """A closed box as an .obj of quads, outward."""
    p = [[(lower, upper)[c >> a & 1][a] for a in range(3)] for c in range(8)]
    quads = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    file.write_text("".join(f"v {x} {y} {z}\n" for x, y, z in p) + "".join("f " + " ".join(str(i + 1) for i in q) + "\n" for q in quads))


def volumes(points, tets):
    a, b, c, d = (points[tets[:, k]] for k in range(4))
    return np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a) / 6


def tets_of(read):
    return next(block.data for block in read.cells if block.type == "tetra")


def field_of(read, name):
    index = next(i for i, block in enumerate(read.cells) if block.type == "tetra")
    return np.asarray(read.cell_data[name][index]).ravel()


with tempfile.TemporaryDirectory() as temporary:
    folder = Path(temporary)
    box = folder / "box.obj"
    cube(box, (0, 0, 0), (1, 0.6, 0.4))
    exact = 1 * 0.6 * 0.4

    # Every kind of tets: not inverted, of the right volume, with a report that says the same.
    vtu = {}
    for kind in ("lattice", "five", "cut", "delaunay"):
        report = folder / f"{kind}.json"
        mesh(box, "-o", folder / f"{kind}.vtu", "--tets", kind, "--size", "0.05", "--quality", report)
        read = vtu[kind] = meshio.read(folder / f"{kind}.vtu")
        said = json.loads(report.read_text())
        v = volumes(read.points, tets_of(read))
        material = v @ field_of(read, "fraction") if kind in ("lattice", "five") else v.sum()
        check(f"{kind} is not inverted", v.min() > 0, v.min())
        # The surface of the level set rounds the edges of a box off by about a voxel's square.
        check(f"{kind} has the volume", abs(material / exact - 1) < 0.02, material)
        check(f"{kind} reports the volume", abs(said["material_volume"] / material - 1) < 1e-12, said)
        check(f"{kind} is that of the level set", abs(said["volume_error"]) < 0.01, said["volume_error"])
        check(f"{kind} reports the tets", said["tets"] == len(v) and said["points"] == len(read.points) and said["inverted"] == 0, said)
        check(f"{kind} counts six angles a tet", sum(said["dihedral_degrees"]["histogram"]) == 6 * len(v), said)
        check(f"{kind} uses every point", len(np.unique(tets_of(read))) == len(read.points))
    check("no slivers in Delaunay tets", json.loads((folder / "delaunay.json").read_text())["dihedral_degrees"]["smallest"] >= 10)

    # Every format holds the same, to the bit.
    reference = vtu["lattice"]
    for name, options, has_field, has_triangles in (
        ("a.vtk", [], True, False),
        ("a.msh", [], True, True),
        ("b.msh", ["--msh-version", "2.2"], True, False),
        ("a.mesh", [], False, True),
        ("a.node", [], False, False),
        ("b.ele", [], False, False),
    ):
        written = mesh(box, "-o", folder / name, "--size", "0.05", *options)
        read = meshio.read(folder / name, file_format="gmsh") if name.endswith(".msh") else meshio.read(folder / name)
        check(f"{name} has the points", np.array_equal(read.points, reference.points))
        check(f"{name} has the tets", np.array_equal(tets_of(read), tets_of(reference)))
        if has_field:
            check(f"{name} has the field", np.array_equal(field_of(read, "fraction"), field_of(reference, "fraction")))
        if has_triangles:
            triangles = next(block.data for block in read.cells if block.type == "triangle")
            p = read.points[triangles]
            inside = np.einsum("ij,ij->i", p[:, 0], np.cross(p[:, 1], p[:, 2])).sum() / 6
            v = volumes(read.points, tets_of(read)).sum()
            check(f"{name} has its boundary, outward", abs(inside / v - 1) < 1e-10, (inside, v))
    mesh(box, "-o", folder / "c.msh", "--tets", "cut", "--size", "0.05", "--msh-version", "2.2")
    check("2.2 has triangles where there are no fields", {b.type for b in meshio.read(folder / "c.msh", file_format="gmsh").cells} == {"triangle", "tetra"})
    check(".node comes with .ele", written == [str(folder / "b.node"), str(folder / "b.ele")], written)

    # --across; sharp edges make the box exact.
    mesh(box, "-o", folder / "across.vtu", "--across", 20)
    check("20 across is 0.05", np.array_equal(meshio.read(folder / "across.vtu").points, reference.points))
    mesh(box, "-o", folder / "sharp.vtu", "--tets", "delaunay", "--size", "0.05", "--sharp", "40")
    sharp = volumes((read := meshio.read(folder / "sharp.vtu")).points, tets_of(read)).sum()
    blunt = volumes(vtu["delaunay"].points, tets_of(vtu["delaunay"])).sum()
    check("sharp edges bring the volume nearer", abs(sharp - exact) < 0.5 * abs(blunt - exact), (sharp, blunt))
    corners = [min(np.linalg.norm(read.points - np.array(c), axis=1)) for c in ((0, 0, 0), (1, 0.6, 0.4))]
    check("sharp corners are points", max(corners) < 1e-12, corners)

    # A run's frames and level sets to surfaces.
    run = folder / "run"
    scene = (SOURCE / "data/scenes/notched_block.toml").read_text()
    (folder / "s.toml").write_text(scene)
    subprocess.run([PROGRAM, "sim", folder / "s.toml", "-o", run, "-f", "3", "-q", "--set", 'output.vdb=["phi","surface"]'], check=True, timeout=300)
    names = mesh(run, "-o", folder / "f.##.ply", "-f", "1-3x2")
    check("frame names", names == [str(folder / "f.01.ply"), str(folder / "f.03.ply")], names)
    # meshio cannot read .ply files whose faces have properties; the header says how they are laid out.
    ply = Path(names[1]).read_bytes()
    head, body = ply.split(b"end_header\n", 1)
    counts = {w.split()[1]: int(w.split()[2]) for w in head.decode().splitlines() if w.startswith("element")}
    faces = np.frombuffer(body, dtype=[("n", "u1"), ("v", "<i4", 3), ("fragment", "<i4"), ("torn", "u1")], offset=24 * counts["vertex"])
    obj = meshio.read(next((run / "obj").glob("*.0003.obj")))
    triangles = np.vstack([block.data for block in obj.cells if block.type == "triangle"])
    points = np.frombuffer(body, dtype="<f8", count=3 * counts["vertex"]).reshape(-1, 3)
    check(".ply has the points of the frame", np.array_equal(points, obj.points))
    check(".ply has its triangles", len(faces) == counts["face"] == len(triangles) and (faces["n"] == 3).all() and {tuple(f) for f in faces["v"]} == {tuple(t) for t in triangles})
    check(".ply tells fragments", faces["fragment"].max() + 1 == (next((run / "obj").glob("*.0003.obj"))).read_text().count("\no "), faces["fragment"].max())
    vdb = next((run / "vdb").glob("*.0003.vdb"))
    pattern = str(vdb).replace(".0003.", ".$F4.")
    for extension in ("obj", "ply", "stl"):
        (name,) = mesh(pattern, "-o", folder / f"phi.%04d.{extension}", "-f", "3", "--grid", "surface")
        surface = meshio.read(name) if extension != "ply" else None
        if surface is None:
            continue
        triangles = np.vstack([block.data for block in surface.cells if block.type == "triangle"])
        p = surface.points[triangles]
        volume = np.einsum("ij,ij->i", p[:, 0].astype(float), np.cross(p[:, 1], p[:, 2])).sum() / 6
        check(f".{extension} is outward and of the block's size", 0.5 < volume < 1.2, volume)
    text = (folder / "phi.0003.obj").read_text()
    check(".obj has groups by fragment", "o fragment_0000" in text and "g fragment_0000_outside" in text)
    mesh(vdb, "-o", folder / "from_vdb.vtu", "--grid", "phi", "--tets", "cut", says=["tets (cut)"])

    # What is refused, and with which code.
    open_box = folder / "open.obj"
    open_box.write_text("".join(box.read_text().splitlines(keepends=True)[:-1]))
    mesh(open_box, "-o", folder / "x.vtu", code=2, says=["open edges", "vdbfrac relevel"])
    mesh(box, "-o", folder / "x.foo", code=2, says=[".vtu", "x.foo"])
    mesh(box, "-o", folder / "x.obj", code=2, says=["tets"])
    mesh(folder / "none.obj", "-o", folder / "x.vtu", code=4, says=["none.obj"])
    mesh(box, "-o", folder / "no" / "x.vtu", code=4, says=["x.vtu"])
    mesh(box, "-o", folder / "x.vtu", "--size", "1e-4", "--max-memory", "0.5", code=5, says=["memory limit"])
    mesh(box, "-o", folder / "x.vtu", "--size", "0.01", "--max-memory", "0.05", code=5, says=["--max-memory"])
    mesh(box, "-o", folder / "x.vtu", "--size", "0.05", "--across", "3", code=2)
    mesh(run, "-o", folder / "one.obj", code=2, says=["####"])
    mesh(run, "-o", folder / "a.####.obj", "-f", "9", code=2, says=["has no frame 9"])
    mesh(run, "-o", folder / "a.####.obj", "-f", "9-1", code=2, says=["1-96x2"])
    check("nothing is left of what failed", not list(folder.glob("x*")) and not list(folder.glob(".partial*")))

print("\n".join(failures) or "all as expected")
sys.exit(1 if failures else 0)
