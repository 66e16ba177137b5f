#!/usr/bin/env python3
"""The two blocks of the benchmark as hexahedra in MSH 2.2, 200 mm wide, also with shuffled nodes and cells, or with a volume of
its own in each: inside the lower one, up to the contact in the upper one. Needs only Python.

    scripts/meshes/blocks.py [--shuffle SEED] [--cores] --out scenes/hard/blocks.msh
"""

import argparse
import itertools
import pathlib
import random

CELLS, WIDTH = (15, 5, 5), 200.0
ORIGINS = {"lower": (0.0, 0.0, 0.0), "upper": (600.0, 0.0, 1000.0)}
CORNERS = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
CORES = {"lower": ((3, 12), (1, 4), (1, 4)), "upper": ((3, 12), (1, 4), (0, 3))}
FACES = {"xmin": (0, 0), "xmax": (0, 1), "zmin": (2, 0), "zmax": (2, 1)}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--shuffle", type=int, metavar="SEED")
    parser.add_argument("--cores", action="store_true", help="name the inner cells of each block NAME-core")
    parser.add_argument("--out", type=pathlib.Path, required=True)
    arguments = parser.parse_args()
    nodes, cells, names = [], [], []
    for body, origin in ORIGINS.items():
        first = len(nodes)
        grid = list(itertools.product(*(range(n + 1) for n in CELLS)))
        number = {place: first + i for i, place in enumerate(grid)}
        nodes += [tuple(o + WIDTH * i for o, i in zip(origin, place)) for place in grid]
        volume = len(names) + 1
        names.append((3, volume, body))
        boxes = list(itertools.product(*(range(n) for n in CELLS)))
        corners = lambda box, shape: [number[tuple(a + b for a, b in zip(box, corner))] for corner in shape]
        core = lambda box: arguments.cores and all(a <= i < b for i, (a, b) in zip(box, CORES[body]))
        if arguments.cores:
            names.append((3, volume + 1, f"{body}-core"))
        cells += [(5, volume + core(box), corners(box, CORNERS)) for box in boxes]
        for name, (axis, side) in FACES.items():
            tag = len(names) + 1
            names.append((2, tag, f"{body}-{name}"))
            square = [c for c in CORNERS if c[axis] == side]
            square = [square[i] for i in cycle(square)]
            outer = (CELLS[axis] - 1) * side
            cells += [(3, tag, corners(box, square)) for box in boxes if box[axis] == outer]
    order = list(range(len(nodes)))
    if arguments.shuffle is not None:
        generator = random.Random(arguments.shuffle)
        generator.shuffle(order)
        generator.shuffle(cells)
    tags = {node: place + 1 for place, node in enumerate(order)}
    lines = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$PhysicalNames", str(len(names))]
    lines += [f'{dimension} {tag} "{name}"' for dimension, tag, name in names]
    lines += ["$EndPhysicalNames", "$Nodes", str(len(nodes))]
    lines += [f"{tags[node]} " + " ".join(f"{x:g}" for x in nodes[node]) for node in order]
    lines += ["$EndNodes", "$Elements", str(len(cells))]
    lines += [f"{i} {kind} 2 {tag} {tag} " + " ".join(str(tags[n]) for n in of) for i, (kind, tag, of) in enumerate(cells, 1)]
    arguments.out.write_text("\n".join([*lines, "$EndElements", ""]))


def cycle(square):
    """The order in which four corners of a square go around."""
    neighbours = lambda a, b: sum(x != y for x, y in zip(a, b)) == 1
    return next((0, *rest) for rest in itertools.permutations((1, 2, 3))
                if all(neighbours(square[a], square[b]) for a, b in zip((0, *rest), (*rest, 0))))


if __name__ == "__main__":
    main()
