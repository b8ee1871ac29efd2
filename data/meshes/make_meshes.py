#!/usr/bin/python3
"""Makes the meshes of this folder and their textures. Needs numpy only; the same files come out each time.

The gingerbread man is a function that is negative inside. Surface nets make a closed mesh of it: a vertex in each cube of a
grid that the surface passes through, a quadrilateral across each edge that crosses it. The vertices are then moved onto the
surface. The koi is a tube: rings round its body from the tail to the nose, a vertex at each end. Its texture is unrolled
from it, cut open along the belly; each pixel has the colour of its place on the body, so nothing is seen of the seam.
"""

import os
import struct
import zlib

import numpy as np

HERE = os.path.dirname(os.path.abspath(__file__))


def capsule(p, a, b, ra, rb):
    """Distance to a segment, less a radius that goes from ra to rb."""
    a, b = np.array(a, float), np.array(b, float)
    t = np.clip(((p - a) @ (b - a)) / ((b - a) @ (b - a)), 0, 1)
    return np.sqrt(((p - a - t[..., None] * (b - a)) ** 2).sum(-1)) - (ra + (rb - ra) * t)


def smooth_union(a, b, k):
    """The smaller of two distances, rounded off where they differ by less than k."""
    h = np.maximum(k - np.abs(a - b), 0) / k
    return np.minimum(a, b) - h * h * k / 4


def gingerbread_man(p):
    """A gingerbread man in the plane z = 0, feet at y = -0.9, head up to y = 0.9."""
    flat = p * [1, 1, 1.5]
    head = capsule(flat, [0, 0.62, 0], [0, 0.64, 0], 0.26, 0.26)
    d = capsule(flat, [0, 0.1, 0], [0, -0.2, 0], 0.22, 0.24)
    for side in (-1, 1):
        arm = capsule(flat, [0.1 * side, 0.14, 0], [0.62 * side, 0.2, 0], 0.15, 0.17)
        leg = capsule(flat, [0.1 * side, -0.25, 0], [0.3 * side, -0.72, 0], 0.17, 0.18)
        d = smooth_union(smooth_union(d, arm, 0.1), leg, 0.1)
    return smooth_union(d, head, 0.12)


def surface_net(shape, low, high, step):
    """Vertices and quadrilaterals, normals outward, of the surface of shape within the box low, high."""
    size = np.ceil((np.array(high) - low) / step).astype(int) + 1
    index = np.stack(np.meshgrid(*map(np.arange, size), indexing="ij"), -1)
    value = shape(np.array(low) + step * index)
    inside = value < 0

    # A vertex in each mixed cube, at the mean of the crossings of its edges.
    corners = [np.array([i, j, k]) for i in (0, 1) for j in (0, 1) for k in (0, 1)]
    shifted = lambda grid, c: grid[tuple(slice(o, n - 1 + o) for o, n in zip(c, size))]
    count = sum(shifted(inside, c).astype(int) for c in corners)
    cubes = np.argwhere((count > 0) & (count < 8))
    number = np.full(size - 1, -1)
    number[tuple(cubes.T)] = np.arange(len(cubes))
    total, crossings = np.zeros((len(cubes), 3)), np.zeros(len(cubes))
    for a in corners:
        for axis in range(3):
            if a[axis]:
                continue
            b = a + np.eye(3, dtype=int)[axis]
            va, vb = value[tuple((cubes + a).T)], value[tuple((cubes + b).T)]
            crossed = (va < 0) != (vb < 0)
            t = np.where(crossed, va / np.where(crossed, va - vb, 1), 0)
            total += crossed[:, None] * (cubes + a + t[:, None] * (b - a))
            crossings += crossed
    points = np.array(low) + step * total / crossings[:, None]

    # A quadrilateral across each edge that is crossed, from the four cubes round it.
    faces = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        a = index[tuple(slice(0, n - 1) if d == axis else slice(1, n - 1) for d, n in enumerate(size))].reshape(-1, 3)
        e = np.eye(3, dtype=int)
        ia, ib = inside[tuple(a.T)], inside[tuple((a + e[axis]).T)]
        for edges, order in ((a[ia & ~ib], (0, 1, 2, 3)), (a[~ia & ib], (0, 3, 2, 1))):
            around = (-e[u] - e[v], -e[v], 0 * e[u], -e[u])
            faces.append(np.stack([number[tuple((edges + around[o]).T)] for o in order], -1))
    faces = np.concatenate(faces)

    # Smooth along the surface, then back onto it along the gradient.
    sides = np.concatenate([faces[:, [i, (i + 1) % 4]] for i in range(4)])
    for _ in range(10):
        mean, degree = np.zeros_like(points), np.zeros(len(points))
        np.add.at(mean, sides[:, 0], points[sides[:, 1]])
        np.add.at(degree, sides[:, 0], 1)
        points = (points + mean / degree[:, None]) / 2
        for _ in range(3):
            h = 1e-4 * step
            slope = np.stack([shape(points + h * a) - shape(points - h * a) for a in np.eye(3)], -1) / (2 * h)
            points = points - (shape(points) / (slope**2).sum(-1))[:, None] * slope
    return points, faces


def check(points, faces):
    """Closed and oriented: each directed side is there once, and so is its reverse; normals point outward."""
    sides = np.concatenate([faces[:, [i, (i + 1) % 4]] for i in range(4)])
    key = sides[:, 0] * len(points) + sides[:, 1]
    back = sides[:, 1] * len(points) + sides[:, 0]
    assert len(np.unique(key)) == len(key) and np.array_equal(np.sort(key), np.sort(back)), "not closed"
    a, b, c, d = (points[faces[:, i]] for i in range(4))
    volume = (np.einsum("ij,ij->", a, np.cross(b, c)) + np.einsum("ij,ij->", a, np.cross(c, d))) / 6
    assert volume > 0, "inside out"
    genus = 1 - (len(points) - len(sides) // 2 + len(faces)) // 2
    return volume, genus


def smooth_step(low, high, x):
    """From 0 at low to 1 at high."""
    t = np.clip((x - low) / (high - low), 0, 1)
    return t * t * (3 - 2 * t)


def bell(x, middle, width):
    return np.exp(-(((x - middle) / width) ** 2))


def curve(x, knots):
    """A smooth curve through knots (x, y): cubics whose slope at a knot is that between its neighbours."""
    kx, ky = np.array(knots, float).T
    slope = np.gradient(ky, kx)
    k = np.clip(np.searchsorted(kx, x) - 1, 0, len(kx) - 2)
    h = kx[k + 1] - kx[k]
    t = (x - kx[k]) / h
    return ((1 + 2 * t) * (1 - t) ** 2 * ky[k] + t * (1 - t) ** 2 * h * slope[k]
            + t**2 * (3 - 2 * t) * ky[k + 1] - t**2 * (1 - t) * h * slope[k + 1])


# Half the height and the width of the koi along x, from the tail to the nose; both ends are rounded off.
KOI_LENGTH = 0.9
KOI_HEIGHT = [(-0.9, 0.25), (-0.8, 0.225), (-0.68, 0.155), (-0.56, 0.105), (-0.46, 0.1), (-0.34, 0.13), (-0.15, 0.195),
              (0.1, 0.245), (0.3, 0.25), (0.5, 0.22), (0.7, 0.165), (0.82, 0.125), (0.9, 0.1)]
KOI_WIDTH = [(-0.9, 0.05), (-0.75, 0.052), (-0.6, 0.065), (-0.46, 0.082), (-0.3, 0.115), (-0.1, 0.155), (0.15, 0.185),
             (0.4, 0.185), (0.6, 0.165), (0.75, 0.135), (0.9, 0.1)]
# Fins and eyes: where along x and round the body (degrees, 90 is the back), how wide there, what stands out in x, y, z [m].
KOI_BACK_FIN = (0.02, 0.2, 90, 17, (-0.07, 0.15, 0))
KOI_FINS = [KOI_BACK_FIN, (-0.37, 0.075, -90, 22, (-0.07, -0.1, 0))]
KOI_FINS += [(x, width, 90 + side * (90 - angle), round_it, (out[0], out[1], -side * out[2])) for side in (-1, 1)
             for x, width, angle, round_it, out in ((0.4, 0.075, -32, 17, (-0.13, -0.09, 0.13)),
                                                    (-0.08, 0.065, -55, 17, (-0.08, -0.09, 0.04)))]
KOI_EYES = [(0.7, 0.05, 90 + side * 66, 16, (0, 0, -0.02 * side)) for side in (-1, 1)]


def turned(angle, middle):
    """Degrees from middle to angle, the shorter way."""
    return (angle - middle + 180) % 360 - 180


def koi_part(part, x, angle):
    """How far a place is on a fin or an eye: 1 at its tip."""
    along = ((x - part[0]) / part[1]) ** 2
    return np.exp(-(along**2 if part is KOI_BACK_FIN else along)) * bell(turned(angle, part[2]), 0, part[3])


def koi_ends(x):
    """1, and 0 at both ends: what rounds them off."""
    return np.sqrt(np.maximum(1 - np.abs(x / KOI_LENGTH) ** np.where(x < 0, 14, 5), 0))


def koi_place(x, angle, bent=True):
    """The surface at x along the body, angle [degrees] round it: -90 is the belly, 0 the right side. `bent`: as it swims."""
    a = np.radians(angle)
    p = np.stack([x + 0 * a, curve(x, KOI_HEIGHT) * koi_ends(x) * np.sin(a), curve(x, KOI_WIDTH) * koi_ends(x) * np.cos(a)], -1)
    for part in KOI_FINS + KOI_EYES:
        p += (koi_part(part, x, angle) * koi_ends(x))[..., None] * part[4]
    p[..., 0] -= 3.2 * p[..., 1] ** 2 * smooth_step(-0.55, -0.9, x)  # the fork of the tail
    if bent:
        p[..., 2] += 0.05 * np.sin(4 * x + 0.6)
    return p


def koi_rings(count):
    """Places along the body, equally far from each other along its outline."""
    x = KOI_LENGTH * np.sin(np.linspace(-np.pi / 2, np.pi / 2, 20001))
    outline = np.stack([x, curve(x, KOI_HEIGHT) * koi_ends(x), curve(x, KOI_WIDTH) * koi_ends(x)])
    length = np.concatenate([[0], np.cumsum(np.sqrt((np.diff(outline) ** 2).sum(0)))])
    return np.interp(np.linspace(0, length[-1], count), length, x)


def koi_mesh(rings, around):
    """Points and faces; texture coordinates, and which of them the corners of faces have."""
    x, angle = koi_rings(rings + 2), np.linspace(-90, 270, around + 1)
    u, v = np.linspace(0, 1, rings + 2), np.linspace(0, 1, around + 1)
    inner = koi_place(x[1:-1, None], angle[None, :-1])
    ends = koi_place(x[[0, -1]], np.zeros(2))
    points = np.concatenate([inner.reshape(-1, 3), ends])
    # The seam has its places twice, the ends theirs once for each of their faces.
    uvs = np.stack(np.meshgrid(u[1:-1], v, indexing="ij"), -1).reshape(-1, 2)
    faces, corners = [], []
    for i in range(rings - 1):
        for j in range(around):
            quad = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)]
            faces.append([r * around + k % around for r, k in quad])
            corners.append([r * (around + 1) + k for r, k in quad])
    for ring, end, order in ((0, 0, 1), (rings - 1, 1, -1)):
        for j in range(0, around, 2):
            faces.append([rings * around + end] + [ring * around + (j + k) % around for k in (0, 1, 2)][::order])
            corners.append([len(uvs)] + [ring * (around + 1) + j + k for k in (0, 1, 2)][::order])
            uvs = np.concatenate([uvs, [[end, v[j + 1]]]])
    return points, np.array(faces), uvs, np.array(corners)


def normals(points, faces):
    """Of the points: the mean of the faces round each, by their area."""
    a, b, c, d = (points[faces[:, i]] for i in range(4))
    total = np.zeros_like(points)
    for i in range(4):
        np.add.at(total, faces[:, i], np.cross(c - a, d - b))
    return total / np.linalg.norm(total, axis=1, keepdims=True)


def hashed(cell, seed):
    """A number in [0, 1) for each cell of whole coordinates."""
    n = np.full(cell.shape[:-1], seed, np.uint32)
    for k in range(3):
        n = (n ^ cell[..., k].astype(np.int32).astype(np.uint32)) * np.uint32(0x9E3779B1)
        n ^= n >> np.uint32(15)
    n *= np.uint32(0x85EBCA77)
    return (n ^ n >> np.uint32(13)) / 2.0**32


def noise(p, size, seed):
    """Smooth numbers in space, most of them from 0.2 to 0.8, that change within size."""
    total = 0
    for octave in range(3):
        q = p / size * 2**octave
        low = np.floor(q)
        t = q - low
        t = t * t * (3 - 2 * t)
        for corner in np.ndindex(2, 2, 2):
            weight = np.where(np.array(corner, bool), t, 1 - t).prod(-1)
            total = total + weight * hashed(low + corner, seed + octave) * 4 / 7 / 2**octave
    return total


def speckles(p, size, share, seed):
    """1 within dots of which a share of the cells of a grid have one."""
    cell, found = np.floor(p / size), 0
    for step in np.ndindex(3, 3, 3):
        c = cell + step - 1
        middle = (c + 0.25 + 0.5 * np.stack([hashed(c, seed + k) for k in range(3)], -1)) * size
        radius = size * np.where(hashed(c, seed + 3) < share, 0.12 + 0.14 * hashed(c, seed + 4), 0)
        distance = np.sqrt(((p - middle) ** 2).sum(-1))
        found = np.maximum(found, 1 - smooth_step(0.6, 1.2, distance / np.maximum(radius, 1e-9)))
    return found


def scale_edges(u, v):
    """1 between scales, which lie in rows that are shifted against each other."""
    along, around = u * 58, v * 36
    nearest = 9
    for step in (-1, 0, 1):
        row = np.floor(along) + step
        shift = 0.5 * (row % 2)
        beside = (around - shift + 0.5) % 1 - 0.5
        nearest = np.minimum(nearest, np.hypot(along - row - 0.5, beside))
    return smooth_step(0.36, 0.6, nearest)


def koi_colours(width, height):
    """The texture, as bytes of red, green, blue; u goes along the body, v round it from the belly."""
    u, v = np.meshgrid((np.arange(width) + 0.5) / width, 1 - (np.arange(height) + 0.5) / height)
    x, angle = np.interp(u, np.linspace(0, 1, 20001), koi_rings(20001)), -90 + 360 * v
    p = koi_place(x, angle, bent=False)
    y = p[..., 1]
    colour = np.broadcast_to([0.95, 0.92, 0.87], p.shape)

    def paint(rgb, amount):
        nonlocal colour
        colour = colour + np.asarray(amount)[..., None] * (np.array(rgb) - colour)

    on_body = smooth_step(-0.62, -0.5, x) * (1 - smooth_step(0.5, 0.58, x)) * smooth_step(-0.23, -0.1, y)
    paint([0.93, 0.8, 0.66], 0.7 * smooth_step(0, -0.25, y))
    paint([0.87, 0.27, 0.07], smooth_step(0.5, 0.53, noise(p, 0.34, 7)) * smooth_step(-0.16, -0.04, y))
    paint([0.1, 0.1, 0.13], smooth_step(0.6, 0.625, noise(p, 0.2, 31)) * smooth_step(-0.08, 0.05, y))
    paint([0.35, 0.17, 0.1], 0.32 * scale_edges(u, v) * on_body)
    paint([0.12, 0.1, 0.12], 0.85 * speckles(p, 0.05, 0.3, 57) * smooth_step(-0.02, 0.1, y))
    # Fins: pale, with rays.
    tail = smooth_step(-0.56, -0.7, x)
    paint([0.95, 0.62, 0.36], 0.9 * tail)
    paint([0.62, 0.2, 0.08], 0.6 * tail * smooth_step(0.1, 0.8, np.sin(90 * np.arctan2(y, -0.3 - x))))
    for fin in KOI_FINS:
        amount = smooth_step(0.08, 0.45, koi_part(fin, x, angle))
        ray = np.sin(150 * (x + 0.5 * np.abs(y))) if fin is KOI_BACK_FIN else np.sin(turned(angle, fin[2]) * 0.9)
        paint([0.95, 0.62, 0.36], 0.75 * amount)
        paint([0.62, 0.2, 0.08], 0.6 * amount * smooth_step(0.1, 0.8, ray))
    # Head: gills, mouth, eyes.
    gill = np.hypot(x - 0.62, 0.75 * (y + 0.02))
    paint([0.35, 0.12, 0.08], 0.8 * bell(gill, 0.16, 0.008) * smooth_step(0.56, 0.5, x))
    paint([0.4, 0.12, 0.1], 0.9 * bell(y, -0.03, 0.008) * smooth_step(0.83, 0.845, x))
    for eye in KOI_EYES:
        distance = np.linalg.norm(p - koi_place(np.array(eye[0]), np.array(eye[2]), bent=False), axis=-1)
        for rgb, radius in (([0.2, 0.12, 0.08], 0.047), ([0.9, 0.68, 0.2], 0.04), ([0.03, 0.03, 0.04], 0.024)):
            paint(rgb, smooth_step(radius + 0.004, radius - 0.004, distance))
    return np.round(255 * np.clip(colour, 0, 1)).astype(np.uint8)


def write_png(name, pixels):
    """8-bit RGB. Each row is stored as its difference from the one above, which packs well."""
    height, width, _ = pixels.shape
    above = np.concatenate([np.zeros_like(pixels[:1]), pixels[:-1]])
    rows = np.concatenate([np.full((height, 1), 2, np.uint8), (pixels - above).reshape(height, -1)], 1)

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    path = os.path.join(HERE, name)
    with open(path, "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"sRGB", b"\0")
                   + chunk(b"IDAT", zlib.compress(rows.tobytes(), 9)) + chunk(b"IEND", b""))
    print("%s: %d x %d pixels, %d bytes" % (name, width, height, os.path.getsize(path)))


def write(name, comment, points, faces, uvs=None, corners=None, library=None, material=None):
    """With texture coordinates also normals: then each corner has its point, its texture coordinates and its normal."""
    volume, genus = check(points, faces)
    path = os.path.join(HERE, name)
    with open(path, "w", newline="\n") as file:
        file.write("# " + comment + "; made by make_meshes.py\n")
        if library:
            file.write("mtllib %s\n" % library)
        file.writelines("v %.4f %.4f %.4f\n" % tuple(p) for p in np.round(points, 4) + 0.0)  # no -0
        if uvs is None:
            file.writelines("f %d %d %d %d\n" % tuple(f) for f in faces + 1)
        else:
            file.writelines("vt %.4f %.4f\n" % tuple(t) for t in uvs)
            file.writelines("vn %.3f %.3f %.3f\n" % tuple(n) for n in np.round(normals(points, faces), 3) + 0.0)
            file.write("usemtl %s\n" % material)
            for f, t in zip(faces + 1, corners + 1):
                file.write("f " + " ".join("%d/%d/%d" % (p, q, p) for p, q in zip(f, t)) + "\n")
    print("%s: %d vertices, %d faces, genus %d, volume %.4f, %d bytes"
          % (name, len(points), len(faces), genus, volume, os.path.getsize(path)))


write("gingerbread_man.obj", "A gingerbread man",
      *surface_net(gingerbread_man, [-0.9, -1, -0.3], [0.9, 1, 0.3], 0.04))
write("koi.obj", "A koi", *koi_mesh(88, 56), "koi.mtl", "skin")
write_png("koi.png", koi_colours(512, 256))
with open(os.path.join(HERE, "koi.mtl"), "w", newline="\n") as mtl:
    mtl.write("# Made by make_meshes.py\nnewmtl skin\nKd 1 1 1\nKs 0.1 0.1 0.1\nNs 60\nmap_Kd koi.png\n")
