"""Files that are drawn, read by themselves: .obj frames and point caches."""
import struct
from collections import Counter
from pathlib import Path

import numpy as np


class Obj:
    """An .obj with all that a renderer takes of it."""

    def __init__(self, path):
        self.points, self.uvs, self.faces = [], [], []  # faces: points, uvs, object, group, material
        obj = group = material = None
        for line in Path(path).read_text().splitlines():
            key, _, rest = line.partition(" ")
            if key == "v":
                self.points.append([float(x) for x in rest.split()])
            elif key == "vt":
                self.uvs.append([float(x) for x in rest.split()])
            elif key == "o":
                obj = rest
            elif key == "g":
                group = rest
            elif key == "usemtl":
                material = rest
            elif key == "f":
                corners = [c.split("/") for c in rest.split()]
                self.faces.append(([int(c[0]) - 1 for c in corners], [int(c[1]) - 1 for c in corners if len(c) > 1 and c[1]], obj, group, material))
        self.points = np.array(self.points)

    def open_edges(self):
        """Directed edges without the one that goes back, by object."""
        edges = Counter()
        for points, _, obj, _, _ in self.faces:
            for a, b in zip(points, points[1:] + points[:1]):
                edges[obj, a, b] += 1
        return sum(1 for (obj, a, b), n in edges.items() if n != 1 or edges[obj, b, a] != 1)

    def volume(self):
        return sum(np.dot(self.points[f[0][0]], np.cross(self.points[f[0][k - 1]], self.points[f[0][k]]))
                   for f in self.faces for k in range(2, len(f[0]))) / 6


def read_mdd(path):
    data = path.read_bytes()
    frames, points = struct.unpack(">ii", data[:8])
    times = np.frombuffer(data, ">f4", frames, 8)
    return times, np.frombuffer(data, ">f4", frames * points * 3, 8 + 4 * frames).reshape(frames, points, 3)


def edge_counts(faces):
    edges = Counter()
    for f in faces:
        for a, b in zip(f[0], f[0][1:] + f[0][:1]):
            edges[min(a, b), max(a, b)] += 1
    return edges
