"""What is drawn: the surface as it was given, closed fragments, and one topology over a run.

Usage: check_drawn.py PROGRAM. A block is given as a mesh of quads with texture coordinates, groups and materials, and is
torn in two.
"""
import csv
import json
import re
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path

import numpy as np

from drawn_files import Obj, edge_counts, read_mdd
from ply_frames import read_ply

PROGRAM = sys.argv[1]
FRAMES, FPS, VOXEL = 14, 24, 0.049
failures = []


def check(name, good, detail=""):
    if not good:
        failures.append(f"{name}: {detail}")


def vdbfrac(*arguments, code=0, **how):
    run = subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True, timeout=600, **how)
    check(" ".join(map(str, arguments)), run.returncode == code, f"exit {run.returncode}\n{run.stdout}{run.stderr}")
    return run.stdout + run.stderr


def write_block(file, n):
    """A block of 1 x .6 x .6 of n quads along x, each side a group with texture coordinates and a material of its own."""
    size, count = np.array([1, 0.6, 0.6]), np.array([n, n // 2, n // 2])
    number, lines, faces, uvs = {}, [], [], []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        for side in (0, 1):
            faces.append(f"g side_{axis}{side}\nusemtl {'skin' if axis else 'end'}")
            for j in range(count[v]):
                for i in range(count[u]):
                    quad = [(0, 0), (1, 0), (1, 1), (0, 1)]
                    corners = []
                    for du, dv in quad if side else reversed(quad):
                        at = [0, 0, 0]
                        at[axis], at[u], at[v] = side * count[axis], i + du, j + dv
                        key = tuple(at)
                        if key not in number:
                            number[key] = len(number) + 1
                            x = (np.array(at) / count - 0.5) * size
                            x[1:] *= 0.65 + 1.4 * x[0] ** 2  # a waist
                            lines.append("v " + " ".join(f"{c:.6f}" for c in x))
                        uvs.append(f"vt {(i + du) / count[u]:.6f} {(j + dv) / count[v]:.6f}")
                        corners.append(f"{number[key]}/{len(uvs)}")
                    faces.append("f " + " ".join(corners))
    file.write_text("mtllib block.mtl\n" + "\n".join(lines + uvs + faces) + "\n")


def scene(file, mesh):
    file.write_text(f"""version = 1
name = "block"
time = {{ frames = [1, {FRAMES}], fps = {FPS} }}
grid = {{ voxel_size = {VOXEL} }}
[[body]]
name = "block"
shape = {{ mesh = "{mesh}" }}
cut = []
material = "gel"
[material.gel]
youngs_modulus = 1e5
poisson_ratio = 0.3
density = 1000
[[grip]]
body = "block"
region = {{ halfspace = {{ normal = "x", offset = 0.35 }} }}
move = {{ velocity = [0.4, 0.1, 0] }}
[[grip]]
body = "block"
region = {{ halfspace = {{ normal = [-1, 0, 0], offset = 0.35 }} }}
move = {{ velocity = [-0.4, 0, 0] }}
[damping]
stiffness = 0.002
[fracture]
toughness = 100
[output]
vdb = []
point_cache = ["mdd", "usda"]
""")


def check_first_frame(given, drawn):
    check("points as read", given.points.shape == drawn.points.shape and np.abs(given.points - drawn.points).max() < 1e-12)
    check("faces as read", [f[0] for f in given.faces] == [f[0] for f in drawn.faces])
    check("groups and materials as read", [f[3:] for f in given.faces] == [f[3:] for f in drawn.faces])
    same = all(given.uvs[a] == drawn.uvs[b] for f, g in zip(given.faces, drawn.faces) for a, b in zip(f[1], g[1]))
    check("texture coordinates as read", same and all(len(f[1]) == len(f[0]) for f in drawn.faces))


def check_frames(run, given):
    """Every fragment is closed; torn faces have the place at rest; what is outside lies on the given surface."""
    for frame in range(1, FRAMES + 1):
        drawn = Obj(run / f"obj/block.{frame:04}.obj")
        check(f"frame {frame} is closed", drawn.open_edges() == 0, drawn.open_edges())
    check("it is in two", len({f[2] for f in drawn.faces}) == 2)
    torn = [f for f in drawn.faces if f[4] == "inside"]
    rest = np.array([drawn.uvs[uv] for f in torn for uv in f[1]])
    check("torn faces know where they were", len(torn) > 200 and rest.shape[1] == 3 and (np.abs(rest) < [0.3, 0.24, 0.24]).all(), np.abs(rest).max(axis=0))
    uv = np.array([drawn.uvs[uv][:2] for f in drawn.faces if f[4] != "inside" for uv in f[1]])
    check("texture coordinates stay on the texture", (uv > -0.2).all() and (uv < 1.2).all(), (uv.min(), uv.max()))
    check("closed lips lose no volume", abs(drawn.volume() / Obj(given).volume() - 1) < 0.03, drawn.volume())  # as it is deformed
    return drawn


def rims_apart(faces, points):
    """How far each point of a rim is from the rim of the other side."""
    sides, kinds = list(range(len(points))), {}

    def side(p):
        while sides[p] != p:
            sides[p] = sides[sides[p]]
            p = sides[p]
        return p

    for f in faces:
        for a, b in zip(f[0], f[0][1:] + f[0][:1]):
            sides[side(a)] = side(b)
            kinds.setdefault((min(a, b), max(a, b)), set()).add(f[4] == "inside")
    rims = {}
    for edge, kind in kinds.items():
        if kind == {False, True}:
            rims.setdefault(side(edge[0]), []).append(edge)
    check("two sides, and no specks", len(rims) == 2, len(rims))
    apart = []
    for mine in rims:
        a, b = points[np.array([e for other in rims if other != mine for e in rims[other]]).T]
        along = b - a
        for p in points[sorted({p for e in rims[mine] for p in e})]:
            t = np.clip(((p - a) * along).sum(axis=1) / np.maximum((along * along).sum(axis=1), 1e-30), 0, 1)
            apart.append(np.linalg.norm(a + t[:, None] * along - p, axis=1).min())
    return apart


def first_tear(run):
    """Time of the first step after which less material was left."""
    with open(run / "stats.csv") as file:
        rows = list(csv.DictReader(file))
    return next(float(row["time_s"]) for row in rows if float(row["volume_m3"]) < float(rows[0]["volume_m3"]))


def check_missing_materials(folder):
    """What a mesh names and does not have is told."""
    (folder / "lost.obj").write_text("mtllib lost.mtl\n" + (folder / "block.obj").read_text().replace("mtllib", "# mtllib"))
    (folder / "lost.toml").write_text((folder / "s.toml").read_text().replace("block.obj", "lost.obj"))
    said = vdbfrac("sim", folder / "lost.toml", "-o", folder / "lost", "-f", 1)
    check("a missing .mtl is told", "lost.mtl is not there" in said, said)


def parted(mesh, last):
    """Faces of a point cache: covers of the skin, which lie in one point once the cracks have come, and the others."""
    parts = [], []
    for f in mesh.faces:
        parts[int(np.abs(last[f[0]] - last[f[0][0]]).max() > 0)].append(f)
    return parts


def check_embedded(folder, run, last):
    vdbfrac("embed", run, "-o", folder / "e.obj")
    mesh = Obj(folder / "e.obj")
    times, positions = read_mdd(folder / "e.mdd")
    check("a time for each frame", np.allclose(times, np.arange(FRAMES) / FPS))
    check("the .obj is the first frame", positions.shape[1] == len(mesh.points) and np.abs(positions[0] - mesh.points).max() < 1e-6)
    covers, left = parted(mesh, positions[-1])
    check("the one topology is closed", not [1 for n in edge_counts(left).values() if n != 2])
    check("covers of the skin are few", len(covers) < 0.05 * len(left), (len(covers), len(left)))
    order = lambda points: points[np.lexsort(np.rint(1e4 * points).T)]
    apart = np.abs(order(positions[-1][sorted({p for f in left for p in f[0]})].astype(float)) - order(last.points)).max(axis=1)
    check("the last frame is as it was drawn", (apart < 1e-6).mean() > 0.98, np.sort(apart)[-5:])  # but for ties of rounding
    # Before the crack comes the surface shows no line where it will: rims lie on each other.
    apart = [np.quantile(rims_apart(left, frame.astype(float)), [0.5, 0.95]) / VOXEL for frame in positions]
    whole = int(first_tear(run) * FPS) + 1  # frames
    check("lips are together until they tear", 1 < whole < FRAMES and max(a[1] for a in apart[:whole]) < 0.02, apart[:whole])
    check("and then part", apart[-1][0] > 1, apart[-1])

    (folder / "ply").mkdir()
    vdbfrac("embed", run, "-o", folder / "ply/e.####.ply")
    for frame in (1, FRAMES):
        points, velocities, rest, *_ = values_of(folder / f"ply/e.{frame:04}.ply")
        check(f".ply of frame {frame}", np.abs(points - positions[frame - 1]).max() < 1e-6)
        check(f"rest of frame {frame}", np.abs(rest - positions[0]).max() < 1e-6)
    check("velocities are those of the grips", abs(np.median(velocities[points[:, 0] > 0.6][:, 0]) - 0.4) < 0.05)

    vdbfrac("embed", run, "-o", folder / "e.usda")
    text = (folder / "e.usda").read_text()
    counts = text.split("faceVertexCounts = [")[1].split("]")[0].split(",")
    indices = text.split("faceVertexIndices = [")[1].split("]")[0].split(",")
    check(".usda has all faces", len(counts) == len(mesh.faces) and sum(map(int, counts)) == len(indices) and max(map(int, indices)) == len(mesh.points) - 1)
    subsets = {part.split('"')[0]: list(map(int, part.split("indices = [")[1].split("]")[0].split(","))) for part in text.split('def GeomSubset "')[1:]}
    check(".usda binds faces to materials", set(subsets) == {"skin", "end", "inside"} and all([f[4] for f in mesh.faces].count(name) == len(faces) for name, faces in subsets.items()), list(subsets))
    check("each once", sorted(sum(subsets.values(), [])) == list(range(len(mesh.faces))))
    check(".usda has textures", f"asset inputs:file = @{folder}/weave.png@" in text and "inputs:scale = (2, 2)" in text and f"float4 inputs:scale = ({int(0.2**2.2 * 1e5) / 1e5}" in text)
    for name in ("obj", "mdd", "mtl", "usda"):
        check(f"the run's own .{name}", (run / f"cache/block.{name}").read_bytes().replace(b"block.mtl", b"e.mtl") == (folder / f"e.{name}").read_bytes())
    check(".usda has boxes round each frame", all(np.abs(box - [p.min(0), p.max(0)]).max() < 1e-6 for box, p in zip(samples(text, "extent"), samples(text, "points"), strict=True)))
    check(".usda has all frames", text.count(": [(") == 3 * FRAMES and text.count("{") == text.count("}") and text.count("(") == text.count(")"))


def values_of(path):
    """Points, velocities and places at rest, then other values one by one."""
    _, table, _, _ = read_ply(path)
    return table[:, :3], table[:, 3:6], table[:, 6:9], *table[:, 9:].T


def check_ply(folder):
    """Frames as .ply: the points of the .obj, and values of them. A bar pulled evenly has e^2 E / 2 everywhere."""
    bar = folder / "bar.toml"
    bar.write_text("""version = 1
name = "bar"
[time]
frames = [1, 3]
fps = 10
[grid]
voxel_size = 0.1
[[body]]
name = "b"
shape = { box = { size = [0.4, 1, 0.4] } }
material = "m"
[material.m]
youngs_modulus = 1e5
poisson_ratio = 0
density = 1
[solver]
integrator = "static"
[output]
vdb = ["phi", "energy"]
ply = true
""" + "".join(f'[[grip]]\nbody = "b"\nregion = {{ halfspace = {{ normal = [0, {s}1, 0], offset = {o} }} }}\nmove = {{ velocity = [0, {s}0.1, 0] }}\n' for s, o in (("", 0.45), ("-", 0.45))))
    vdbfrac("sim", bar, "-o", folder / "bar", "-q", "--set", "time.substeps=1")
    points, velocities, rest, energy = values_of(folder / "bar/ply/bar.0003.ply")
    drawn = Obj(folder / "bar/obj/bar.0003.obj")
    check(".ply has the points of the .obj", points.shape == drawn.points.shape and np.abs(points - drawn.points).max() < 1e-6)
    check("rest is the first frame", np.abs(rest - Obj(folder / "bar/obj/bar.0001.obj").points).max() < 1e-6)
    strain = 2 * 0.1 * 2 / 10 / 1.0
    said = vdbfrac("preview", folder / "bar", "--colour", "energy", "--count", 2, "--width", 200, "--height", 200)
    check("pictures by energy", "bar.0003.png" in said, said)
    frames = json.loads((folder / "bar/run.json").read_text())["frames"]
    check("bounds in the manifest", all(np.allclose(f["bounds"], [p.min(0), p.max(0)], atol=1e-6) for f in frames for p in [Obj(folder / f"bar/obj/bar.{f['frame']:04}.obj").points]))
    check("energy of points is that of the strain", np.abs(energy / (0.5e5 * strain**2) - 1).max() < 0.01, (energy.min(), energy.max()))


def normals_off(path):
    """How many corners of a drawn .obj have a normal that looks into the material, of how many; the farthest from unit length."""
    points, normals, off, corners = [], [], 0, 0
    for line in Path(path).read_text().splitlines():
        key, _, rest = line.partition(" ")
        if key == "v":
            points.append([float(x) for x in rest.split()])
        elif key == "vn":
            normals.append([float(x) for x in rest.split()])
        elif key == "f":
            p = np.array([points[int(c.split("/")[0]) - 1] for c in rest.split()])
            area = sum(np.cross(p[k - 1] - p[0], p[k] - p[0]) for k in range(2, len(p)))
            own = [normals[int(c.split("/")[2]) - 1] for c in rest.split()]
            off, corners = off + sum(np.dot(n, area) < 0 for n in own), corners + len(own)
    return off, corners, np.abs(np.linalg.norm(normals, axis=1) - 1).max()


def check_soup(folder):
    """Each quad has points of its own: they are drawn as they were read, and equal ones move and part together."""
    block = Obj(folder / "block.obj")
    points = [p for f in block.faces for p in block.points[f[0]]]
    faces = [[4 * i + k for k in range(4)] for i in range(len(block.faces))]
    (folder / "soup.obj").write_text("".join("v %.6f %.6f %.6f\n" % tuple(p) for p in points) +
                                     "".join("f " + " ".join(str(k + 1) for k in f) + "\n" for f in faces))
    scene(folder / "soup.toml", folder / "soup.obj")
    run = folder / "soup"
    vdbfrac("sim", folder / "soup.toml", "-o", run, "-q", "--set", "output.point_cache=[]")
    first, last = Obj(run / "obj/block.0001.obj"), Obj(run / f"obj/block.{FRAMES:04}.obj")
    check("points of a soup as read", np.abs(first.points - np.array(points)).max() < 1e-9 and [f[0] for f in first.faces] == faces)
    edges, joined = Counter(), {}
    for f in last.faces:
        own = [joined.setdefault((f[2], *last.points[p]), p) for p in f[0]]
        for a, b in zip(own, own[1:] + own[:1]):
            edges[a, b] += 1
    open_edges = sum(n != edges[b, a] for (a, b), n in list(edges.items()))
    check("a torn soup is closed where its points are joined", open_edges == 0, open_edges)
    check("it is in two too", len({f[2] for f in last.faces}) == 2)


def check_shells(folder):
    """Two blocks that reach into each other in one mesh, every third face turned inward: drawn as one, and torn so."""
    block = Obj(folder / "block.obj")
    points = np.concatenate([block.points, block.points * [0.9, 0.8, 0.8] + [0.02, 0.11, 0.07]])
    faces = [[p + first for p in f[0]] for first in (0, len(block.points)) for f in block.faces]
    faces = [f[::-1] if i % 3 == 0 else f for i, f in enumerate(faces)]
    (folder / "shells.obj").write_text("".join("v %.6f %.6f %.6f\n" % tuple(p) for p in points) +
                                       "".join("f " + " ".join(str(k + 1) for k in f) + "\n" for f in faces))
    scene(folder / "shells.toml", folder / "shells.obj")
    said = vdbfrac("sim", folder / "shells.toml", "-o", folder / "shells", "--set", "output.point_cache=[]")
    turned = sum(i % 3 == 0 for i in range(len(faces)))
    check("faces that look inward are told", f"{turned} of {len(faces)} faces that look inward" in said, said)
    check("shells that are made one are told", "2 shells that reach into each other" in said, said)
    for frame in range(1, FRAMES + 1):
        drawn = Obj(folder / f"shells/obj/block.{frame:04}.obj")
        check(f"shells are closed in frame {frame}", drawn.open_edges() == 0, drawn.open_edges())
    check("shells are in two", len({f[2] for f in drawn.faces}) == 2)
    first = Obj(folder / "shells/obj/block.0001.obj").volume()
    stats = json.loads((folder / "shells/run.json").read_text())
    check("one volume is drawn and simulated", abs(first / stats["start_volume"] - 1) < 0.02, (first, stats["start_volume"]))


def check_covers(folder):
    """A ball goes through a slab and takes material with it: until then the holes in the skin of a point cache are covered."""
    (folder / "plug.toml").write_text("""version = 1
name = "plug"
time = { frames = [1, 10], fps = 24 }
grid = { voxel_size = 0.05 }
[[body]]
name = "slab"
shape = { box = { size = [1, 0.3, 1] } }
material = "gel"
[material.gel]
youngs_modulus = 1e5
poisson_ratio = 0.3
density = 1000
[[collider]]
name = "ball"
shape = { sphere = { radius = 0.12, center = [0, 0.4, 0] } }
move = { keys = [{ time = 0 }, { time = 0.3, translate = [0, -1, 0] }] }
[damping]
stiffness = 0.002
[fracture]
toughness = 60
[output]
vdb = []
obj = false
point_cache = ["mdd"]
""" + "".join(f'[[grip]]\nbody = "slab"\nregion = {{ halfspace = {{ normal = [{s}1, 0, 0], offset = 0.42 }} }}\nmove = {{ velocity = [0, 0, 0] }}\n' for s in ("", "-")))
    vdbfrac("sim", folder / "plug.toml", "-o", folder / "plug", "-q")
    mesh = Obj(folder / "plug/cache/plug.obj")
    _, positions = read_mdd(folder / "plug/cache/plug.mdd")
    skin = [f[0] for f in mesh.faces if f[4] != "inside"]
    covers = [f[0] for f in parted(mesh, positions[-1])[0]]
    check("there are covers", len(covers) > 20, len(covers))
    area = lambda points, faces: sum(np.cross(points[f[k - 1]] - points[f[0]], points[f[k]] - points[f[0]]) for f in faces for k in range(2, len(f))) / 2
    volume = lambda points, faces: sum(np.dot(points[f[0]], np.cross(points[f[k - 1]], points[f[k]])) for f in faces for k in range(2, len(f))) / 6
    whole, away = positions[0].astype(float), np.array([0.3, 0.7, 0.2])
    folds = 1.5 * 0.05**2  # m^2: where lips pass each other the skin lies double
    check("the skin of the first frame is closed", np.abs(area(whole, skin)).max() < folds, area(whole, skin))
    check("round all of the slab", abs(volume(whole + away, skin) / 0.3 - 1) < 4e-3, volume(whole + away, skin))
    opened = area(whole, [f for f in skin if f not in covers])
    check("but for its covers it is not", np.abs(opened).max() > 4 * folds, opened)


def check_arrivals(folder):
    """Covers go as the cracks come: none in a frame before the first torn face is drawn, most of what goes first in that."""
    (folder / "arrivals.toml").write_text((folder / "plug.toml").read_text().replace('name = "plug"', 'name = "arrivals"')
                                          .replace("obj = false", 'obj = true\nlips = "as_simulated"').replace("fps = 24 }", "fps = 24, substeps = 1 }"))
    vdbfrac("sim", folder / "arrivals.toml", "-o", folder / "arrivals", "-q")
    torn = [any(f[4] == "inside" for f in Obj(folder / f"arrivals/obj/arrivals.{k:04}.obj").faces) for k in range(1, 11)]
    mesh = Obj(folder / "arrivals/cache/arrivals.obj")
    _, positions = read_mdd(folder / "arrivals/cache/arrivals.mdd")
    covers = [f[0] for f in parted(mesh, positions[-1])[0] if np.abs(positions[0][f[0]] - positions[0][f[0][0]]).max() > 0]
    gone = [sum(np.abs(frame[f] - frame[f[0]]).max() == 0 for f in covers) for frame in positions]
    first = torn.index(True)
    few = 0.01 * len(covers)  # at nodes whose phi has begun to move, but not far enough to be drawn
    check("no cover goes before a crack comes", first > 1 and max(gone[:first]) < few, (first, gone))
    check("some go as it comes, and others later", few < gone[first + 1] < len(covers) and sorted(gone[first:]) == gone[first:], (first, gone))


def check_carved(folder):
    """A score across the block: it is closed, faces beside the score are as they were read, and another mesh gets it too."""
    scene(folder / "c.toml", folder / "block.obj")
    (folder / "c.toml").write_text((folder / "c.toml").read_text().replace("cut = []", "cut = [{ box = { size = [0.1, 0.1, 1], center = [0, 0.2, 0] } }]"))
    run = folder / "carved"
    said = vdbfrac("sim", folder / "c.toml", "-o", run, "-f", 2, "--set", "fracture.toughness=1e6")
    check("nothing is noted of a closed mesh", "is drawn as its level set" not in said, said)
    given, drawn = Obj(folder / "block.obj"), Obj(run / "obj/block.0001.obj")
    check("a scored mesh is closed", drawn.open_edges() == 0, drawn.open_edges())
    check("a score takes its volume", abs((given.volume() - drawn.volume()) / (0.1 * 0.045 * 0.39) - 1) < 0.1, given.volume() - drawn.volume())
    scored = {f[3:] for f in drawn.faces} - {f[3:] for f in given.faces}
    check("a score brings one group", [g[1] for g in scored] == ["outside"], scored)
    quads = sum(len(f[0]) == 4 for f in drawn.faces)
    check("faces beside a score are as they were", len(given.faces) - 60 < quads < len(given.faces), (quads, len(given.faces)))
    check("what is left of faces has texture coordinates", all(len(f[1]) == len(f[0]) for f in drawn.faces if f[4] != "outside"))
    vdbfrac("embed", run, folder / "fine.obj", "-o", folder / "fine_carved.obj")
    fine = Obj(folder / "fine_carved.obj")
    before = (folder / "fine.obj").read_bytes()
    said = vdbfrac("embed", run, folder / "fine.obj", "-o", folder / "fine.obj", code=2)
    check("what is read is not written over", "would be overwritten" in said and (folder / "fine.obj").read_bytes() == before, said)
    taken = Obj(folder / "fine.obj").volume() - fine.volume()
    check("another mesh is scored too", abs(taken / (0.1 * 0.045 * 0.39) - 1) < 0.1, taken)
    (folder / "open.obj").write_text("\n".join((folder / "fine.obj").read_text().splitlines()[:-1]) + "\n")
    said = vdbfrac("embed", run, folder / "open.obj", "-o", folder / "no.obj", code=2)
    check("a mesh that cannot be scored is refused", "a closed mesh that does not meet itself" in said, said)


def check_level_set(folder, hashes):
    """A body that is a level set: closed fragments, and normals that look outward. However it is drawn, the state is the same."""
    vdbfrac("relevel", folder / "block.obj", "-o", folder / "block.vdb", "--voxel", 0.049)
    scene(folder / "v.toml", folder / "block.obj")
    text = (folder / "v.toml").read_text().replace(f'mesh = "{folder}/block.obj"', f'vdb = "{folder}/block.vdb"')
    (folder / "v.toml").write_text(text)
    run = folder / "level_set"
    vdbfrac("sim", folder / "v.toml", "-o", run, "-q", "--set", "output.point_cache=[]")
    for frame in (1, FRAMES):
        file = run / f"obj/block.{frame:04}.obj"
        drawn = Obj(file)
        check(f"a level set is closed in frame {frame}", drawn.open_edges() == 0, drawn.open_edges())
        off, corners, longest = normals_off(file)
        check(f"normals look outward in frame {frame}", off <= 0.03 * corners and longest < 1e-6, (off, corners, longest))
    check("a level set is torn", len({f[2] for f in drawn.faces}) == 2 and any(f[4] == "inside" for f in drawn.faces))
    rough = folder / "rough"
    vdbfrac("sim", folder / "s.toml", "-o", rough, "-q", "--set", 'output.lips="as_simulated"', "--set", "output.torn_detail=0.01", "--set", "output.point_cache=[]")
    own = [f["state_hash"] for f in json.loads((rough / "run.json").read_text())["frames"]]
    check("the state does not know how it is drawn", own == hashes)
    check("but it is drawn otherwise", (rough / f"obj/block.{FRAMES:04}.obj").read_bytes() != (folder / f"run/obj/block.{FRAMES:04}.obj").read_bytes())


def check_colours(folder):
    """Two boxes of two materials, of which one has a colour."""
    bodies = "".join(f"""[[body]]
name = "{name}"
shape = {{ box = {{ size = [0.4, 0.4, 0.4], center = [{x}, 0, 0] }} }}
material = "{name}"
[material.{name}]
youngs_modulus = 1e5
poisson_ratio = 0.3
density = 1000
""" + colour for name, x, colour in (("red", 0, "colour = [0.9, 0.25, 0.125]\n"), ("plain", 1, "")))
    (folder / "c.toml").write_text('version = 1\nname = "c"\n[time]\nframes = [1, 2]\n[grid]\nvoxel_size = 0.1\n' + bodies + "[output]\nvdb = []\n")
    vdbfrac("sim", folder / "c.toml", "-o", folder / "colours", "-q")
    drawn = Obj(folder / "colours/obj/c.0001.obj")
    materials = {material: {x > 0.5 for points, _, _, _, m in drawn.faces if m == material for x in drawn.points[points, 0]} for material in {f[4] for f in drawn.faces}}
    check("each box has its material", materials == {"red": {False}, "outside": {True}}, materials)
    library = (folder / "colours/obj/c.mtl").read_text()
    check("with its colour", "newmtl red\nKa 0 0 0\nKd 0.9 0.25 0.125\n" in library and "newmtl plain" not in library, library)
    (folder / "inside.toml").write_text((folder / "c.toml").read_text().replace("red", "inside"))
    said = vdbfrac("check", folder / "inside.toml", code=2)
    check("a colour may not have the name of torn faces", "inside.toml:11:" in said and "material.inside has a colour" in said and "another name" in said, said)
    said = vdbfrac("check", folder / "c.toml", "--set", "material.red.colour=[1,1.5,0]", code=2)
    check("a colour out of range is told", "material.red.colour" in said and "each from 0 to 1" in said, said)


def numbers(text, name):
    return np.array(text.split(f"{name} = [")[1].split("]")[0].split(","), int)


def samples(text, name):
    """Vectors of each frame in a .usda."""
    lines = text.split(f"{name}.timeSamples = {{")[1].split("}")[0].strip().splitlines()
    return [np.array(re.findall(r"[-+.\de]+", line.split(":", 1)[1]), float).reshape(-1, 3) for line in lines]


def check_same_names(folder):
    """Two meshes whose libraries have one name for two materials, and one that looks the same in both; a scene's material of the first name."""
    for body, colour in (("a", "1 0 0"), ("b", "0 1 0")):
        (folder / body).mkdir()
        (folder / body / "block.obj").write_bytes((folder / "block.obj").read_bytes())
        (folder / body / "block.mtl").write_text(f"newmtl skin\nKd {colour}\nnewmtl end\nKd 1 1 0\nnewmtl inside\nKd 0 0 1\n" + ("newmtl skin_b\nKd 0 1 1\n" if body == "b" else ""))
    bodies = "".join(f'[[body]]\nname = "{body}"\nshape = {shape}\nmaterial = "skin"\n' for body, shape in (
        ("a", '{ mesh = "a/block.obj" }'), ("b", '{ mesh = { file = "b/block.obj", translate = [3, 0, 0] } }'), ("c", "{ box = { size = [1, 1, 1], center = [6, 0, 0] } }")))
    (folder / "names.toml").write_text('version = 1\nname = "n"\n[time]\nframes = [1, 4]\n[grid]\nvoxel_size = 0.1\n' + bodies + "angular_velocity = [0, 9, 0]\n"
                                       "[material.skin]\nyoungs_modulus = 1e5\npoisson_ratio = 0.3\ndensity = 1000\ncolour = [0, 0, 0.5]\n[output]\nvdb = []\nmotion = true\n")
    said = vdbfrac("sim", folder / "names.toml", "-o", folder / "names")
    check("materials of one name are told", "the material 'skin' of the mesh for body 'b' looks otherwise" in said and "'skin_b'" in said, said)
    library = (folder / "names/obj/n.mtl").read_text()
    looks = {name: re.search(rf"newmtl {name}\n(?:[^n].*\n)*?Kd (.*)\n", library)[1] for name in re.findall("newmtl (.*)", library)}
    check("each with its look", looks == {"outside": looks["outside"], "inside": looks["inside"], "skin": "1 0 0", "end": "1 1 0", "skin_b": "0 1 0", "skin_b_b": "0 1 1", "skin_scene": "0 0 0.5"}, looks)
    check("torn faces keep theirs", looks["inside"] != "0 0 1", looks)
    drawn = Obj(folder / "names/obj/n.0001.obj")
    at = {material: {round(x / 3) for points, _, _, _, m in drawn.faces if m == material for x in drawn.points[points, 0]} for material in {f[4] for f in drawn.faces}}
    check("on its own body", at == {"skin": {0}, "skin_b": {1}, "end": {0, 1}, "skin_scene": {2}}, at)
    vdbfrac("embed", folder / "names", folder / "b/block.obj", "--body", "b", "--placed", "-o", folder / "another.obj")
    check("a mesh in place of another has its names", {f[4] for f in Obj(folder / "another.obj").faces} == {"skin", "skin_b", "end", "skin_scene"}, {f[4] for f in Obj(folder / "another.obj").faces})
    vdbfrac("embed", folder / "names", "-o", folder / "names.usda")
    text = (folder / "names.usda").read_text()
    turning = text.split('def Mesh "c"')[1]  # the solid; the meshes have no normals
    counts, corner, of = (numbers(turning, name) for name in ("faceVertexCounts", "faceVertexIndices", "primvars:normals:indices"))
    first = np.cumsum(counts) - counts  # corner of each face
    check(".usda has normals where the surface has them", len(of) == len(corner) and text.count("primvars:normals.timeSamples") == 1, text.count("primvars:normals"))
    for points, normals in zip(samples(turning, "points"), samples(turning, "primvars:normals"), strict=True):
        a, b, c = (points[corner[first + k]] for k in range(3))
        along = (np.cross(b - a, c - a) * normals[of[first]]).sum(1) / np.linalg.norm(np.cross(b - a, c - a), axis=1)
        check("those of the frame", along.min() > 0.99, along.min())
    # Colours of libraries are those of a screen, those of USD are light.
    check(".usda has light", f"inputs:diffuseColor = (0, 0, {0.5 ** 2.2:.9g}" in text, re.findall("diffuseColor = .*", text))


def check_placed(folder):
    """A mesh for `embed` is put where the scene puts the file of its body."""
    text = """version = 1
name = "p"
[time]
frames = [1, 2]
[grid]
voxel_size = 0.1
[[body]]
name = "b"
shape = { mesh = { file = "block.obj", scale = 2, rotate = [20, -35, 70], translate = [1, 2, 3] } }
material = "m"
[material.m]
youngs_modulus = 1e5
poisson_ratio = 0.3
density = 1000
[output]
vdb = []
motion = true
"""
    (folder / "p.toml").write_text(text)
    run = folder / "placed"
    vdbfrac("sim", folder / "p.toml", "-o", run, "-q")
    vdbfrac("embed", run, "-o", folder / "own.obj")
    vdbfrac("embed", run, folder / "block.obj", "--placed", "-o", folder / "put.obj")
    own, put = Obj(folder / "own.obj").points, Obj(folder / "put.obj").points
    check("a mesh is put where the scene puts the body's file", own.shape == put.shape and np.abs(own - put).max() < 1e-6)
    (folder / "p.toml").write_text("\n".join("shape = { box = { size = [1, 1, 1] } }" if l.startswith("shape") else l for l in text.splitlines()))
    vdbfrac("sim", folder / "p.toml", "-o", run, "-q", "--overwrite")
    said = vdbfrac("embed", run, folder / "block.obj", "--placed", "-o", folder / "no.obj", code=2)
    check("there is no place where the body is no file", "body 'b' is of no file that the scene moves" in said, said)


def main(folder):
    write_block(folder / "block.obj", 20)
    write_block(folder / "fine.obj", 60)
    scene(folder / "s.toml", folder / "block.obj")
    (folder / "block.mtl").write_text("newmtl skin\nKd 0.2 0.4 0.6\nmap_Kd -s 2 2 1 weave.png\nnewmtl end\nKd 1 1 0\n")
    run = folder / "run"
    vdbfrac("sim", folder / "s.toml", "-o", run, "-q")
    materials = (run / "obj/block.mtl").read_text()
    check("materials are those of the mesh", all(f"newmtl {m}\n" in materials for m in ("outside", "inside", "skin", "end")))
    check("textures are found from anywhere", f"map_Kd -s 2 2 1 {folder}/weave.png\n" in materials, materials)
    said = vdbfrac("preview", run, "--count", 2, "--width", 64, "--height", 64, "--samples", 1)
    check("a texture that is not there is told once", said.count(f"note: texture {folder}/weave.png: ") == 1 and "drawn without it" in said, said)
    check_first_frame(Obj(folder / "block.obj"), Obj(run / "obj/block.0001.obj"))
    last = check_frames(run, folder / "block.obj")
    check_ply(folder)
    check_colours(folder)
    check_placed(folder)
    check_same_names(folder)
    check_embedded(folder, run, last)
    check_missing_materials(folder)

    vdbfrac("embed", run, folder / "fine.obj", "-o", folder / "fine_out.obj")
    check("another mesh rides along", len(Obj(folder / "fine_out.obj").faces) > 7000)
    (folder / "own").mkdir()
    (folder / "own/own.obj").write_text((folder / "fine.obj").read_text().replace("block.mtl", "own.mtl").replace("usemtl skin", "usemtl fur"))
    (folder / "own/own.mtl").write_text("newmtl fur\nKd 0.2 0.4 0.6\n")
    vdbfrac("embed", run, folder / "own/own.obj", "-o", folder / "own_out.obj")
    library = (folder / "own_out.mtl").read_text()
    check("with its own materials", "newmtl fur\nKd 0.2 0.4 0.6" in library and "fur" in {f[4] for f in Obj(folder / "own_out.obj").faces}, library)
    lines = [l.split() for l in (folder / "fine.obj").read_text().splitlines()]
    (folder / "away.obj").write_text("\n".join(" ".join(["v", str(float(l[1]) + 9), *l[2:]] if l[:1] == ["v"] else l) for l in lines) + "\n")
    (folder / "small.obj").write_text("\n".join(" ".join(["v", *(str(float(x) / 9) for x in l[1:4])] if l[:1] == ["v"] else l) for l in lines[:-1]) + "\n")
    said = vdbfrac("embed", run, folder / "small.obj", "-o", folder / "small_out.obj", "-q")
    check("a mesh of another size is told", "is 0.1" in said and "times as large as body 'block' at rest" in said, said)
    check("an open mesh is told", "small.obj has 4 open edges" in said and "small_out" not in said, said)
    said = vdbfrac("embed", run, folder / "away.obj", "-o", folder / "no.obj", code=2)
    check("a mesh elsewhere is refused with a hint", "away.obj" in said and "where the body lies at rest" in said, said)

    # The same after a stop, to the byte; and the state does not know what is drawn.
    half = folder / "half"
    vdbfrac("sim", folder / "s.toml", "-o", half, "-q", "-f", 6)
    (folder / "elsewhere").mkdir()
    vdbfrac("sim", folder / "s.toml", "-o", half, "-q", "--resume", cwd=folder / "elsewhere")
    said = vdbfrac("info", half, "--verify")
    check("a cache is verified", "verified: all checksums" in said, said)
    vdbfrac("embed", half, "-o", folder / "new/half.obj")
    (half / "cache/block.mdd").write_bytes(b"")
    check("and missed", "cache/block.mdd" in vdbfrac("info", half, code=4))
    check("embedded alike after a resume", (folder / "new/half.mdd").read_bytes() == (folder / "e.mdd").read_bytes())
    check("drawn alike after a resume", (half / f"obj/block.{FRAMES:04}.obj").read_bytes() == (run / f"obj/block.{FRAMES:04}.obj").read_bytes())
    bare = folder / "bare"
    said = vdbfrac("sim", folder / "s.toml", "-o", bare, "-j", 1, "--set", "output.obj=false", "--set", "output.ply=false", "--set", "output.point_cache=[]", "--set", 'output.vdb=["phi"]')
    check("nor is there a cache", not (bare / "cache").exists())
    hashes = [[f["state_hash"] for f in json.loads((r / "run.json").read_text())["frames"]] for r in (run, bare)]
    check("the state does not know what is drawn", hashes[0] == hashes[1])
    check("what is not drawn is no work", "\ndraw " not in said)
    check_soup(folder)
    check_shells(folder)
    check_covers(folder)
    check_arrivals(folder)
    check_carved(folder)
    check_level_set(folder, hashes[0])
    said = vdbfrac("embed", bare, "-o", folder / "no.obj", code=2)
    check("what lacks is said", "output.motion = true" in said, said)


with tempfile.TemporaryDirectory() as name:
    try:
        main(Path(name))
    except OSError as e:  # of a command that failed
        failures.append(str(e))
for failure in failures:
    print(f"check_drawn: {failure}")
sys.exit(bool(failures))
