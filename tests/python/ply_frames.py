"""Frames of runs as .ply, as docs/output.md has them."""
import re

import numpy as np


def read_ply(path):
    """Names of the values of points, a table of them with a row for each point, the number of faces, and their bytes."""
    head, body = path.read_bytes().split(b"end_header\n", 1)
    names = re.findall(r"property float (\w+)", head.decode())
    points, faces = (int(n) for n in re.findall(r"element \w+ (\d+)", head.decode()))
    end = points * len(names) * 4
    return names, np.frombuffer(body[:end], "<f4").reshape(points, -1), faces, body[end:]
