#!/usr/bin/python3
"""Reference values of 'vdbfrac verify --newtons' that have no closed form: finite elements that share nothing with the program.

    tests/python/references.py --write tools/lab/verify/src/reference_values.h
    tests/python/references.py --check tools/lab/verify/src/reference_values.h    # on coarser meshes; exit 1: they differ

Small strain, nine-node squares on graded rectangles, energy release rates by the difference of two crack lengths. NumPy only.
"""
import argparse
import re
import sys

import numpy as np

GAUSS = np.array([-np.sqrt(0.6), 0, np.sqrt(0.6)]), np.array([5, 8, 5]) / 9
COARSE = 0.004  # of a value: what a mesh of --check may differ by
CHECKS = ((0.2, 0.0), (0.2, 0.3), (0.2, 0.45), (0.1, 0.3), (0.1, 0.45))  # B / H and nu of the clamped strips


def shape_1d(s):
    """Values and derivatives of the three shape functions at s in [-1, 1]."""
    return np.array([s * (s - 1) / 2, 1 - s * s, s * (s + 1) / 2]), np.array([s - 0.5, -2 * s, s + 0.5])


def plane_law(nu, strain):
    """Stress of (e_x, e_y, 2 e_xy) for E = 1."""
    if strain:  # plane strain is plane stress of other constants
        return plane_law(nu / (1 - nu), False) / (1 - nu * nu)
    return np.array([[1, nu, 0], [nu, 1, 0], [0, 0, (1 - nu) / 2]]) / (1 - nu * nu)


def element(a, b, law):
    """Stiffness of an a x b element; unknowns u, v of the nodes, y fastest."""
    k = np.zeros((18, 18))
    for s, ws in zip(*GAUSS):
        for t, wt in zip(*GAUSS):
            (n, dn), (m, dm) = shape_1d(s), shape_1d(t)
            dx, dy = np.outer(dn, m).ravel() * 2 / a, np.outer(n, dm).ravel() * 2 / b
            strain = np.zeros((3, 18))
            strain[0, 0::2], strain[1, 1::2], strain[2, 0::2], strain[2, 1::2] = dx, dy, dy, dx
            k += ws * wt * a * b / 4 * strain.T @ law @ strain
    return k


def column(a, ys, law, thickness):
    """Stiffness of a column of elements of width a: three lines of nodes, y fastest."""
    m = 2 * (2 * len(ys) - 1)
    k = np.zeros((3 * m, 3 * m))
    for j in range(len(ys) - 1):
        index = np.concatenate([line * m + np.arange(4 * j, 4 * j + 6) for line in range(3)])
        k[np.ix_(index, index)] += thickness(ys[j]) * element(a, ys[j + 1] - ys[j], law)
    return k


def energy(xs, ys, law, fixed, thickness=lambda y: 1):
    """Least energy of a plate under E = 1, of this thickness above y. fixed(i, j, component): the displacement of the node (i, j) of the grid with
    the nodes between, or None where it is free."""
    m = 2 * (2 * len(ys) - 1)
    below = np.zeros((m, m)), np.zeros(m), 0.0  # what is left of the columns before: K, f, twice the energy
    for c in range(len(xs) - 1):
        k, f = column(xs[c + 1] - xs[c], ys, law, thickness), np.zeros(3 * m)
        k[:m, :m] += below[0]
        f[:m] += below[1]
        below = condensed(k, f, below[2], c, 2 * (c == len(xs) - 2), fixed, m)
    return below[2] / 2


def condensed(k, f, twice, c, last, fixed, m):
    """Takes the first two lines of a column out, or all three of the last; held nodes with them."""
    out = (2 + last // 2) * m
    value = np.array([np.nan if (v := fixed(2 * c + d // m, d % m // 2, d % 2)) is None else v for d in range(out)])
    held = np.flatnonzero(~np.isnan(value))
    free = np.flatnonzero(np.isnan(value))
    rest = np.arange(out, len(f))
    g = value[held]
    twice += g @ k[np.ix_(held, held)] @ g - 2 * f[held] @ g
    f = f - k[:, held] @ g
    solved = np.linalg.solve(k[np.ix_(free, free)], np.column_stack([f[free], k[np.ix_(free, rest)]]))
    twice -= f[free] @ solved[:, 0]
    if last:
        return None, None, twice
    left = np.zeros((m, m)), np.zeros(m)
    left[0][:] = k[np.ix_(rest, rest)] - k[np.ix_(rest, free)] @ solved[:, 1:]
    left[1][:] = f[rest] - k[np.ix_(rest, free)] @ solved[:, 0]
    return left[0], left[1], twice


def graded(points, size, least, at):
    """Rising coordinates through `points`, elements `least` long near those `at`, growing by a fifth of the way from them."""
    result = [points[0]]
    for a, b in zip(points, points[1:]):
        x, inner = a, []
        while x < b:
            step = min(size, least + 0.2 * min(abs(x - p) for p in at))
            step = min(step, least + 0.2 * min(abs(x + step - p) for p in at))
            x += step
            inner.append(x)
        result += [a + (v - a) * (b - a) / (inner[-1] - a) for v in inner[:-1]] + [b]
    return np.array(result)


def strip(width, nu, least):
    """w / (E e^2) of a long strip of height 1 and this width, clamped at top and bottom: its cross-section is in plane strain.
    A quarter of it."""
    xs = graded([0, width / 2], width / 8, least, [width / 2])
    ys = graded([0, 0.5], 0.05, least, [0.5])
    top = 2 * len(ys) - 2

    def fixed(i, j, component):
        if j == top:
            return 0.5 * component
        return 0.0 if (component == 0 and i == 0) or (component == 1 and j == 0) else None

    return 2 * energy(xs, ys, plane_law(nu, True), fixed) / (width / 2)


def half_plate(width, height, crack, least, tip):
    """Energy of the half of a plate above its slit from x = 0 to `crack`, whose top is moved by 1 and held."""
    xs = graded(sorted({0, *tip, width}), width / 20, least, tip)
    ys = graded([0, height / 2], height / 20, least, [0])
    top, ahead = 2 * len(ys) - 2, 2 * int(np.argmin(abs(xs - crack)))

    def fixed(i, j, component):
        if j == top:
            return float(component)
        return 0.0 if component == 1 and j == 0 and i >= ahead else None

    return energy(xs, ys, plane_law(0, False), fixed)


def plate_load(width, height, crack, least):
    """(Stiffness P / (E d), G / (E d^2)) of the whole plate, d the opening of its grips, for a thickness of 1."""
    da = 0.02 * width
    tip = (crack - da, crack, crack + da)
    # Moved by 1 at either side, so d = 2 and both halves together have P d / 2.
    energies = [2 * half_plate(width, height, a, least, tip) for a in tip]
    return energies[1] / 2, (energies[0] - energies[2]) / (2 * da) / 4


def arms_release(crack, least):
    """G / (E d^2) per area of the web of a double cantilever 2.2 long, its arms .4 high and moved apart by d where x = 0, without
    turning; a third as thick within .11 of its plane."""
    da, web = 0.02, 0.11
    tip = (crack - da, crack, crack + da)
    xs = graded([0, *tip, 2.2], 0.06, least, tip)
    ys = graded([0, web, 0.4], 0.04, least, [0])

    def moved(a):
        ahead = 2 * int(np.argmin(abs(xs - a)))
        return lambda i, j, component: float(component) if i == 0 else 0.0 if component == 1 and j == 0 and i >= ahead else None

    energies = [2 * energy(xs, ys, plane_law(0, False), moved(a), lambda y: 1 if y > web - 1e-9 else 1 / 3) for a in tip]
    return (energies[0] - energies[2]) / (2 * da) / 4 * 3


def entries(scale):
    """Name, value, what it is. `scale`: 1 as written, more is coarser."""
    for width, nu in CHECKS:
        yield f"kStrip{int(100 * width):02d}Nu{int(100 * nu):02d}", strip(width, nu, 2e-4 * scale), \
            f"w / (E e^2) of a clamped strip, B / H = {width}, nu = {nu}"
    stiffness, release = plate_load(1, 1.2, 0.4, 2e-3 * scale)
    yield "kPlateStiffness", stiffness, "P / (E B d) of a plate 1 wide, 1.2 high between grips, with an edge crack of .4 in its middle, nu = 0"
    yield "kPlateRelease", release, "G W / (E d^2) of the same plate"
    for crack in (1, 1.4):
        yield f"kArms{int(10 * crack)}Release", arms_release(crack, 2e-3 * scale), \
            f"G / (E d^2) of a double cantilever with a groove, of a crack of {crack} m (/m)"


HEADER = """// Written by tests/python/references.py, which computes them by finite elements of its own. Do not edit: run it again.
#pragma once

namespace vdbfrac::lab::verify {

"""


def text():
    lines = [f"/// {about}.\ninline constexpr double {name} = {value:.5g};\n" for name, value, about in entries(1)]
    return HEADER + "".join(lines) + "\n}  // namespace vdbfrac::lab::verify\n"


def differences(written):
    known = dict(re.findall(r"double (\w+) = ([\d.]+);", written))
    for name, value, _ in entries(4):
        if name not in known or abs(float(known.pop(name)) / value - 1) > COARSE:
            yield f"{name}: a coarse mesh gives {value:.5g}"
    for name in known:
        yield f"{name} is not computed"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    action = parser.add_mutually_exclusive_group(required=True)
    action.add_argument("--write", metavar="FILE")
    action.add_argument("--check", metavar="FILE")
    arguments = parser.parse_args()
    if arguments.write:
        with open(arguments.write, "w", encoding="utf-8") as file:
            file.write(text())
        return 0
    with open(arguments.check, encoding="utf-8") as file:
        complaints = list(differences(file.read()))
    print("\n".join(complaints))
    return bool(complaints)


if __name__ == "__main__":
    sys.exit(main())
