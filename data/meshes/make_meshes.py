#!/usr/bin/python3
"""Makes the meshes of this folder. Needs numpy only; the same files come out each time.

A shape is a function that is negative inside. Surface nets make a closed mesh of it: a vertex in each cube of a grid that
the surface passes through, a quadrilateral across each edge that crosses it. The vertices are then moved onto the surface.
"""

import os

import numpy as np


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


def write(name, comment, shape, low, high, step):
    points, faces = surface_net(shape, low, high, step)
    volume, genus = check(points, faces)
    path = os.path.join(os.path.dirname(os.path.abspath(__file__)), name)
    with open(path, "w", newline="\n") as file:
        file.write("# " + comment + "; made by make_meshes.py\n")
        file.writelines("v %.4f %.4f %.4f\n" % tuple(p) for p in np.round(points, 4) + 0.0)  # no -0
        file.writelines("f %d %d %d %d\n" % tuple(f) for f in faces + 1)
    print("%s: %d vertices, %d faces, genus %d, volume %.4f, %d bytes"
          % (name, len(points), len(faces), genus, volume, os.path.getsize(path)))


write("gingerbread_man.obj", "A gingerbread man", gingerbread_man, [-0.9, -1, -0.3], [0.9, 1, 0.3], 0.04)
