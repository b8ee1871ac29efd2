"""vdbfrac mesh: every format is read back by meshio, every direction works, what is refused says why."""
import json
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import meshio
import numpy as np
import pyopenvdb

from obj_frames import read_obj

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


def slit_block(file, width, at):
    """A block of 1 x 1 x 0.5 with a slit from its top to its middle, around x = at."""
    x, a = 0.51, width / 2
    outline = [(-x, -0.5), (x, -0.5), (x, 0), (x, 0.5), (a, 0.5), (a, 0), (-a, 0), (-a, 0.5), (-x, 0.5), (-x, 0)]
    caps = [(0, 1, 2, 5, 6, 9), (2, 3, 4, 5), (9, 6, 7, 8)]
    faces = [tuple(reversed(c)) for c in caps] + [tuple(i + 10 for i in c) for c in caps] + [(i, (i + 1) % 10, 10 + (i + 1) % 10, 10 + i) for i in range(10)]
    file.write_text("".join(f"v {p + at} {q} {z}\n" for z in (-0.24, 0.26) for p, q in outline)
                    + "".join("f " + " ".join(str(i + 1) for i in f) + "\n" for f in faces))


def volumes(points, tets):
    a, b, c, d = (points[tets[:, k]] for k in range(4))
    return np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a) / 6


def tets_of(read):
    return next(block.data for block in read.cells if block.type == "tetra")


def triangles_of(read):
    return np.vstack([block.data for block in read.cells if block.type == "triangle"])


def field_of(read, name):
    index = next(i for i, block in enumerate(read.cells) if block.type == "tetra")
    return np.asarray(read.cell_data[name][index]).ravel()


def ply_by_header(file):
    """Points and faces of a binary .ply of triangles, laid out as its header says; the header's lines of properties."""
    numpy_types = {"double": "<f8", "int": "<i4", "uchar": "u1"}
    head, body = file.read_bytes().split(b"end_header\n", 1)
    counts, layouts, element = {}, {}, None
    for words in (line.split() for line in head.decode().splitlines()):
        if words[0] == "element":
            element, counts[words[1]], layouts[words[1]] = words[1], int(words[2]), []
        elif words[:2] == ["property", "list"]:
            layouts[element] += [("corners", numpy_types[words[2]]), (words[4], numpy_types[words[3]], 3)]
        elif words[0] == "property":
            layouts[element].append((words[2], numpy_types[words[1]]))
    points = np.frombuffer(body, np.dtype(layouts["vertex"]), counts["vertex"])
    faces = np.frombuffer(body, np.dtype(layouts["face"]), offset=points.nbytes)
    return points, faces, head.decode()


def read_ply(file):
    """A .ply as meshio reads it. Of binary ones with fields of faces meshio 5.0 makes nothing: it takes all lists to stand
    before all fields. So the numbers are written as text first, under the header as it is."""
    points, faces, head = ply_by_header(file)
    check(f"{file.name} has as many faces as it says, all triangles", f"element face {len(faces)}\n" in head and (faces["corners"] == 3).all(), head)
    text = head.replace("binary_little_endian", "ascii") + "end_header\n"
    text += "".join(" ".join(repr(float(x)) for x in p) + "\n" for p in points)
    text += "".join(f"3 {' '.join(map(str, f[1]))} {' '.join(str(int(x)) for x in list(f)[2:])}\n" for f in faces)
    (as_text := file.with_suffix(".text.ply")).write_text(text)
    return meshio.read(as_text)


def obj_fields(file):
    """Fragment and side (1: torn) of each face of an .obj, by the objects and groups they stand in."""
    fragment, torn, fields = None, None, []
    for key, _, rest in (line.partition(" ") for line in file.read_text().splitlines()):
        if key == "o":
            fragment = int(rest.removeprefix("fragment_"))
        elif key == "g":
            torn = int(rest.endswith("_inside"))
        elif key == "f":
            fields.append((fragment, torn))
    return np.array(fields)


def corners_of(read, precision=np.float64):
    """A row for each triangle: the coordinates of its corners. Files may number the points in an order of their own."""
    return read.points.astype(precision)[triangles_of(read)].reshape(-1, 9)


def check_ply(name, ply, obj_file, precision=np.float64):
    """Faces and fields of a .ply are those of the .obj of the same surface, its points too, in this precision."""
    obj = read_obj(obj_file)
    fields = np.column_stack([np.concatenate(ply.cell_data[field]).ravel() for field in ("fragment", "torn")])
    rows = [np.unique(np.column_stack(both), axis=0)
            for both in ((corners_of(ply, precision), fields), (corners_of(obj, precision), obj_fields(obj_file)))]
    check(f"{name} has the points", ply.points.shape == obj.points.shape, (ply.points.shape, obj.points.shape))
    check(f"{name} has the triangles, each with its fragment and side", len(rows[0]) == len(triangles_of(obj)) and np.array_equal(*rows))


def check_stl(name, stl, obj):
    """Triangles of an .stl are those of the .obj, in single precision."""
    rows = [np.unique(corners_of(read, np.float32), axis=0) for read in (stl, obj)]
    check(f"{name} has the triangles", len(rows[0]) == len(triangles_of(obj)) and np.array_equal(*rows), [len(r) for r in rows])


def outward_volume(read):
    p = read.points.astype(float)[triangles_of(read)]
    return np.einsum("ij,ij->i", p[:, 0], np.cross(p[:, 1], p[:, 2])).sum() / 6


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
        check(f"{kind} is that of the level set", abs(said["level_set_volume_error"]) < 0.01, said)
        check(f"{kind} knows the volume of its input", abs(said["input_volume"] / exact - 1) < 1e-12, said)
        check(f"{kind} reports its error against the input", abs(said["volume_error"] - (material / exact - 1)) < 1e-10, said)
        check(f"{kind} counts points that lie on others", said["coincident_points"] == len(read.points) - len(np.unique(read.points, axis=0)), said)
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
            v = volumes(read.points, tets_of(read)).sum()
            check(f"{name} has its boundary, outward", abs(outward_volume(read) / v - 1) < 1e-10, (outward_volume(read), v))
        if name.endswith(".msh"):
            groups = {"material": [1, 3], "surface": [1, 2]}  # number and dimension
            check(f"{name} names its groups", {key: list(value) for key, value in read.field_data.items()} == groups, read.field_data)
    mesh(box, "-o", folder / "c.msh", "--tets", "cut", "--size", "0.05", "--msh-version", "2.2")
    check("2.2 has triangles where there are no fields", {b.type for b in meshio.read(folder / "c.msh", file_format="gmsh").cells} == {"triangle", "tetra"})
    check(".node comes with .ele", written == [str(folder / "b.node"), str(folder / "b.ele")], written)

    # The report names the input's volume; points of one node that are there more often are counted, and explained.
    mesh(box, "-o", folder / "coarse.vtu", "--size", "0.19", says=["the input has 0.24 m^3 (", "its level set", "note: the input encloses"])
    mesh(box, "-o", folder / "coarse.vtu", "--size", "0.05", says=["the input has 0.24 m^3 ("])
    slit = folder / "slit.obj"
    slit_block(slit, 0.03, 0)
    mesh(slit, "-o", folder / "slit.vtu", "--size", "0.05", "--quality", folder / "slit.json", says=["points lie on another one", "slits"])
    points = meshio.read(folder / "slit.vtu").points
    copies = len(points) - len(np.unique(points, axis=0))
    check("both sides of a slit have points of their own", copies > 50 and json.loads((folder / "slit.json").read_text())["coincident_points"] == copies, copies)
    slit_block(slit, 0.01, 0.025)
    mesh(slit, "-o", folder / "slit.vtu", "--size", "0.05", says=["note: ", "pairs of neighbouring voxels have a gap between them"])

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
    last = 22  # the block is in two by then, with torn faces
    subprocess.run([PROGRAM, "sim", folder / "s.toml", "-o", run, "-f", str(last), "-q", "--set", 'output.vdb=["phi","surface"]'], check=True, timeout=300)
    names = mesh(run, "-o", folder / "f.##.ply", "-f", f"1-{last}x{last - 1}")
    check("frame names", names == [str(folder / "f.01.ply"), str(folder / f"f.{last}.ply")], names)
    frame_obj = next((run / "obj").glob(f"*.00{last}.obj"))
    check("the frame has fragments and torn faces", len(np.unique(obj_fields(frame_obj), axis=0)) >= 4)
    check_ply(".ply of a frame", read_ply(Path(names[1])), frame_obj)
    mesh(run, "-o", folder / "g.##.stl", "-f", last)
    check_stl(".stl of a frame", meshio.read(folder / f"g.{last}.stl"), read_obj(frame_obj))
    mesh(run, "-o", folder / "g.##.obj", "-f", last)
    again = meshio.read(folder / f"g.{last}.obj")
    check(".obj of a frame is the frame's", np.array_equal(again.points, read_obj(frame_obj).points)
          and np.array_equal(triangles_of(again), triangles_of(read_obj(frame_obj)))
          and np.array_equal(obj_fields(folder / f"g.{last}.obj"), obj_fields(frame_obj)))
    vdb = next((run / "vdb").glob(f"*.00{last}.vdb"))
    pattern = str(vdb).replace(f".00{last}.", ".$F4.")
    surfaces = {}
    for extension in ("obj", "ply", "stl"):
        (name,) = mesh(pattern, "-o", folder / f"phi.%04d.{extension}", "-f", last, "--grid", "surface")
        surfaces[extension] = read_ply(Path(name)) if extension == "ply" else meshio.read(name)
        volume = outward_volume(surfaces[extension])
        check(f".{extension} is outward and of the block's size", 0.5 < volume < 1.2, volume)
    check_ply(".ply of a level set", surfaces["ply"], folder / f"phi.00{last}.obj", precision=np.float32)  # that of a .vdb; an .obj has nine digits
    check_stl(".stl of a level set", surfaces["stl"], surfaces["obj"])
    text = (folder / f"phi.00{last}.obj").read_text()
    check(".obj has groups by fragment", "o fragment_0000" in text and "g fragment_0000_outside" in text)
    mesh(vdb, "-o", folder / "from_vdb.vtu", "--grid", "phi", "--tets", "cut", says=["tets (cut)"])

    # What is refused, and with which code.
    open_box = folder / "open.obj"
    open_box.write_text("".join(box.read_text().splitlines(keepends=True)[:-1]))
    nothing = pyopenvdb.FloatGrid(0.3)
    nothing.gridClass, nothing.transform = pyopenvdb.GridClass.LEVEL_SET, pyopenvdb.createLinearTransform(0.1)
    pyopenvdb.write(str(folder / "empty.vdb"), grids=[nothing])
    mesh(folder / "empty.vdb", "-o", folder / "x.obj", code=2, says=["has no surface"])
    mesh(open_box, "-o", folder / "x.vtu", code=2, says=["open edges", "vdbfrac relevel"])
    mesh(box, "-o", folder / "x.foo", code=2, says=[".vtu", "x.foo"])
    mesh(box, "-o", folder / "x.obj", code=2, says=["tets"])
    mesh(folder / "none.obj", "-o", folder / "x.vtu", code=4, says=["none.obj"])
    mesh(box, "-o", folder / "no" / "x.vtu", code=4, says=["x.vtu"])
    mesh(box, "-o", folder / "x.vtu", "--size", "1e-4", "--max-memory", "0.5", code=5, says=["memory limit"])
    mesh(box, "-o", folder / "x.vtu", "--size", "0.01", "--max-memory", "0.05", code=5, says=["--max-memory"])
    mesh(box, "-o", folder / "x.vtu", "--size", "0.05", "--across", "3", code=2)
    mesh(run, "-o", folder / "one.obj", code=2, says=["####"])
    mesh(run, "-o", folder / "x.vtu", code=2, says=["frames of a run become surfaces", ".obj, .ply, .stl", ".vdb"])
    mesh(folder, "-o", folder / "a.####.obj", code=4, says=["holds no run"])
    mesh(run, "-o", folder / "a.####.obj", "-f", "1-10000000", code=2, says=["up to 100000"])
    mesh(box, "-o", folder / "x.vtu", "--size", "5", code=2, says=["larger than the whole surface"])
    for number in ("1e300", "nan", "inf", "1e999", "0", "-1"):
        for option in ("--size", "--max-memory", "--facet-size"):
            mesh(box, "-o", folder / "x.vtu", f"{option}={number}", code=2, says=[option, "finite number above 0"])

    # A picture of what is far from the origin is that of what is near it.
    preview = lambda of: subprocess.run([PROGRAM, "preview", of, "-f", str(last), "--width", "64", "--height", "64"], capture_output=True, text=True)
    shutil.copytree(run, far := folder / "far")
    frame = next((far / "obj").glob(f"*.00{last}.obj"))
    frame.write_text("".join(f"v {float(w[1]) + 1e4} {w[2]} {w[3]}\n" if (w := line.split())[0] == "v" else line + "\n" for line in frame.read_text().splitlines()))
    shown = preview(far)
    check("preview 10 km from the origin", shown.returncode == 0 and "contact_sheet.png" in shown.stdout, shown.stderr)
    shown = preview(folder)
    nowhere = subprocess.run([PROGRAM, "preview", folder / "nowhere"], capture_output=True, text=True)
    check("preview of nothing", nowhere.returncode == 4 and "nowhere: is not there; give the folder" in nowhere.stderr, nowhere.stderr)
    check("preview of no run", shown.returncode == 4 and "holds no run" in shown.stderr, shown.stderr)
    mesh(run, "-o", folder / "new/a.####.obj", "-f", "1")
    check("the folder of a sequence is made", list((folder / "new").glob("a.*.obj")), "")
    mesh(run, "-o", folder / "a.####.obj", "-f", "99", code=2, says=["has no frame 99"])
    mesh(run, "-o", folder / "a.####.obj", "-f", "9-1", code=2, says=["1-96x2"])
    check("nothing is left of what failed", not list(folder.glob("x*")) and not list(folder.glob(".partial*")))

print("\n".join(failures) or "all as expected")
sys.exit(1 if failures else 0)
