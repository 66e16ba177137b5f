#!/usr/bin/env python3
"""Mesh of the scene `ring`: an octant of two nested hollow spheres, radii 100, 200, 300, each of layers of prisms that are
split into tetrahedra.

    scripts/meshes/ring.py [--inner N] [--outer N] [--out FILE]

N is the number of triangles along each edge of an octant; where both are equal the meshes match at the interface. Volumes
`inner` and `outer`; surfaces `bore`, `interface`, `outside` and the planes of symmetry `x0`, `y0`, `z0`.
"""

import argparse

import numpy as np

from discrete import Model, prisms_to_tets

RADII = (100.0, 200.0, 300.0)


def octant(n):
    """Points on the unit sphere over a triangle cut into n x n, and the triangles."""
    at = {}
    points = []
    for i in range(n + 1):
        for j in range(n + 1 - i):
            at[i, j] = len(points)
            # Equal angles along the edges.
            weights = np.sin(0.5 * np.pi * np.array([i, j, n - i - j]) / n)
            points.append(weights / np.linalg.norm(weights))
    triangles = [(at[i, j], at[i + 1, j], at[i, j + 1]) for i in range(n) for j in range(n - i)]
    triangles += [(at[i + 1, j], at[i + 1, j + 1], at[i, j + 1]) for i in range(n) for j in range(n - 1 - i)]
    return np.array(points), np.array(triangles)


def shell(n, inside, outside):
    """Nodes and tetrahedra of an octant of a hollow sphere whose cells are about as thick as they are wide halfway."""
    directions, triangles = octant(n)
    thickness = outside - inside
    layers = max(1, round(n * thickness / (0.5 * np.pi * 0.5 * (inside + outside))))
    radii = inside + thickness * np.arange(layers + 1) / layers
    points = (radii[:, None, None] * directions).reshape(-1, 3)
    size = len(directions)
    prisms = [np.hstack([triangles + k * size, triangles + (k + 1) * size]) for k in range(layers)]
    return points, prisms_to_tets(np.concatenate(prisms))


def at_radius(radius):
    return lambda points: np.abs(np.linalg.norm(points, axis=1) - radius) < 1e-9 * radius


def planes():
    return {f"{axis}0": lambda points, a=a: points[:, a] == 0.0 for a, axis in enumerate("xyz")}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--inner", type=int, default=16)
    parser.add_argument("--outer", type=int, default=12)
    parser.add_argument("--out", default="scenes/ring.msh")
    arguments = parser.parse_args()
    a, b, d = RADII
    model = Model("ring")
    for name, n, inside, outside, skins in [
        ("inner", arguments.inner, a, b, {"bore": a, "interface": b}),
        ("outer", arguments.outer, b, d, {"interface": b, "outside": d}),
    ]:
        surfaces = {skin: at_radius(radius) for skin, radius in skins.items()} | planes()
        model.volume(name, *shell(n, inside, outside), surfaces)
    model.write(arguments.out)


if __name__ == "__main__":
    main()
