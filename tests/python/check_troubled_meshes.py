"""vdbfrac relevel and mesh on shapes with the troubles of real meshes, at 64 voxels across: what docs/make_meshing.py promises.

Usage: check_troubled_meshes.py PROGRAM SOURCE_FOLDER. The meshes of the folder that VDBFRAC_MESHES names are judged too.
"""
import importlib.util
import os
import sys
import tempfile
from pathlib import Path

import numpy as np

PROGRAM, SOURCE = sys.argv[1], Path(sys.argv[2])
ACROSS = 64
POT = [(0.5, 0), (0.7, 0.3), (0.6, 0.7), (0.35, 0.8)]  # radius and height [m]
VASE = [(0.3, 0), (0.4, 0.2), (0.2, 0.5), (0.25, 0.8), (0.3, 1)]
TIMEOUT = 600  # s, of a command


def make_meshing():
    spec = importlib.util.spec_from_file_location("make_meshing", SOURCE / "docs/make_meshing.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def box(lower, upper, open_at=()):
    """Points and quads, outward; without the sides named: 0 and 1 along x, 2 and 3 along y, 4 and 5 along z."""
    points = [[(lower, upper)[c >> a & 1][a] for a in range(3)] for c in range(8)]
    sides = [(0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6)]
    return points, [side for i, side in enumerate(sides) if i not in open_at]


def revolved(profile, sides=40, closed=True):
    """A profile of (radius, z) from bottom to top turned about z, outward; lids at both ends if closed."""
    angles = 2 * np.pi * np.arange(sides) / sides
    points = [(r * np.cos(a), r * np.sin(a), z) for r, z in profile for a in angles]
    rings = [[i * sides + k for k in range(sides)] for i in range(len(profile))]
    faces = [(a[k], a[(k + 1) % sides], b[(k + 1) % sides], b[k]) for a, b in zip(rings, rings[1:]) for k in range(sides)]
    return points, faces + ([tuple(reversed(rings[0])), tuple(rings[-1])] if closed else [])


def together(*parts):
    points, faces = [], []
    for more, theirs in parts:
        faces += [tuple(len(points) + corner for corner in face) for face in theirs]
        points += list(more)
    return points, faces


def pot():
    """Open at the top, its walls without thickness at the rim; a spout goes through the wall, open at its end."""
    body = revolved(POT, closed=False)
    bottom = ([(0.5 * np.cos(a), 0.5 * np.sin(a), 0) for a in 2 * np.pi * np.arange(40) / 40], [tuple(range(39, -1, -1))])
    return together(body, bottom, box((0.3, -0.12, 0.35), (1.1, 0.12, 0.55), open_at=(1,)))


def wedge():
    """A prism with edges of 30, 60 and 90 degrees, its faces flat."""
    outline = [(0, 0), (1, 0), (1, 1 / np.sqrt(3))]
    points = [(x, y, z) for z in (0, 0.4) for x, y in outline]
    return points, [(2, 1, 0), (3, 4, 5), *((k, (k + 1) % 3, 3 + (k + 1) % 3, 3 + k) for k in range(3))]


def table():
    """A top and four legs three voxels thick, of boxes that reach into each other."""
    t = 3 / ACROSS
    legs = [box((x, y, 0), (x + t, y + t, 0.5)) for x in (0.1, 0.9 - t) for y in (0.1, 0.5 - t)]
    return together(box((0, 0, 0.5 - t), (1, 0.6, 0.5)), *legs)


def vase():
    """A vase with three holes, polygons that share no points, and one of them turned."""
    points, faces = revolved(VASE, sides=24)
    faces = [face for i, face in enumerate(faces) if i not in (30, 31, 70, 97)]  # two neighbours, one, and the lid at the top
    loose = [points[corner] for face in faces for corner in face]
    starts = np.cumsum([0] + [len(face) for face in faces])
    parts = [tuple(range(a, b)) for a, b in zip(starts, starts[1:])]
    parts[10] = parts[10][::-1]
    return loose, parts


def sheet():
    return [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], [(0, 1, 2, 3)]


def polyhedron_volume(shape):
    points, faces = np.array(shape[0], float), shape[1]
    return sum(np.dot(points[f[0]], np.cross(points[f[k]], points[f[k + 1]])) / 6 for f in faces for k in range(1, len(f) - 1))


def write(file, shape):
    points, faces = shape
    file.write_text("".join(f"v {x:.17g} {y:.17g} {z:.17g}\n" for x, y, z in points) + "".join("f " + " ".join(str(c + 1) for c in f) + "\n" for f in faces))


SPOUT = 0.24 * 0.2 * (1.1 - 0.66)  # m^3, outside of the wall
TOP, LEG = 3 / ACROSS * 0.6, (3 / ACROSS) ** 2 * (0.5 - 3 / ACROSS)
SHAPES = {
    # name: shape, whether its surface is closed, volume [m^3] and how near the level set comes to it [relative] (None: it is refused)
    "pot": (pot(), False, polyhedron_volume(revolved(POT)) + SPOUT, 0.02),  # as a wrap closes it: rim and end of the spout flat
    "wedge": (wedge(), True, 0.2 / np.sqrt(3), 0.01),
    "table": (table(), True, TOP + 4 * LEG, 0.05),  # edges are rounded off, and these parts are little else
    "vase": (vase(), False, polyhedron_volume(revolved(VASE, sides=24)), 0.02),  # holes in curved sides are closed flat
    "sheet": (sheet(), False, None, None),
}


def runs_of(meshing, folder, surfaces, sharp):
    rows = []
    for surface in surfaces:
        with tempfile.TemporaryDirectory() as scratch:
            runner = meshing.Runner(PROGRAM, folder, Path(scratch), TIMEOUT, sharp=sharp)
            runner.mesh(surface, ACROSS, meshing.TETS)
            rows += runner.rows
    return rows


def wrong_with_shapes(meshing, rows):
    """What is known of the shapes made here: which commands end well, and the volume."""
    rows = {meshing.key_of(row): row for row in rows}
    for name, (_, closed, volume, near) in SHAPES.items():
        expected = {"relevel": ("surface", volume is not None), "delaunay": ("surface", closed), "delaunay --sharp 40": ("surface", closed)}
        for what, (source, well) in expected.items():
            row = rows[name, ACROSS, what, source]
            if row["exit"] != (0 if well else 2) or not well and f"{name}.obj" not in row["message"]:
                yield f"{name}, {what}: exit {row['exit']}, expected {'0' if well else '2 and the name of the file'}: {row.get('message', '')}"
        if volume is None:
            continue
        for kind in (*meshing.LATTICES, "delaunay"):
            if rows[name, ACROSS, kind, "level set"]["exit"] != 0:
                yield f"{name}, {kind}: {rows[name, ACROSS, kind, 'level set']['message']}"
        found = rows[name, ACROSS, "relevel", "surface"].get("volume", 0)
        print(f"{name}: level set of {found:.5g} m^3, {found / volume - 1:+.2%} of what is expected")
        if not abs(found / volume - 1) <= near:
            yield f"{name}: its level set has {found:.5g} m^3, expected {volume:.5g} m^3 to within {near:.0%}"


def main():
    meshing = make_meshing()
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        for name, (shape, *_) in SHAPES.items():
            write(folder / f"{name}.obj", shape)
        rows = runs_of(meshing, folder, meshing.surfaces_of(folder), sharp=("wedge",))
    wrong = [*wrong_with_shapes(meshing, rows), *meshing.broken_promises(rows)]
    given = os.environ.get("VDBFRAC_MESHES")
    if given:
        surfaces = meshing.surfaces_of(given)
        print(f"VDBFRAC_MESHES: {', '.join(s.name for s in surfaces)}")
        more = runs_of(meshing, Path(given).resolve(), surfaces, sharp=())
        wrong += [f"{meshing.name_of(row)}: {what}" for row in more for what in meshing.wrong_with(row)]
        rows += more
    else:
        print("VDBFRAC_MESHES is not set: no other meshes than the shapes made here were tried")
    print(f"{len(rows)} commands, {sum(row['exit'] == 0 for row in rows)} ended well")
    print("\n".join(wrong) or "all as expected")
    return int(bool(wrong))


if __name__ == "__main__":
    sys.exit(main())
