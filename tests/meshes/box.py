"""Writes a large mesh as Gmsh would, in binary MSH 4.1: the unit cube of N x N x N cells, six tetrahedra each, with the
physical volume `box` and the physical surfaces `bottom` and `top`.

    python tests/meshes/box.py N FILE

N = 70 gives 2 million tetrahedra, N = 150 gives 20 million. Nodes and cells are written layer by layer."""

import itertools
import pathlib
import sys

import numpy as np


def tetrahedra(n, k):
    """Nodes, from 1, of the tetrahedra of layer k: for each order of the axes the way along them through the cell."""
    j, i = np.divmod(np.arange(n * n), n)
    strides = (1, n + 1, (n + 1) ** 2)
    first = 1 + i + (n + 1) * j + (n + 1) ** 2 * k
    ways = []
    for order in itertools.permutations(range(3)):
        corners = [first]
        for axis in order:
            corners.append(corners[-1] + strides[axis])
        odd = order in [(0, 2, 1), (1, 0, 2), (2, 1, 0)]
        ways.append(np.stack([corners[c] for c in ((0, 2, 1, 3) if odd else (0, 1, 2, 3))], axis=1))
    return np.stack(ways, axis=1).reshape(-1, 4)


def triangles(n, k):
    """Nodes of the triangles of a plane of nodes."""
    j, i = np.divmod(np.arange(n * n), n)
    a = 1 + i + (n + 1) * j + (n + 1) ** 2 * k
    b, c, d = a + 1, a + n + 2, a + n + 1
    return np.stack([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)], axis=1).reshape(-1, 3)


def write(n, file):
    nodes, cells, faces = (n + 1) ** 3, 6 * n**3, 2 * n**2

    def ints(*values):
        file.write(np.array(values, np.int32).tobytes())

    def sizes(*values):
        file.write(np.array(values, np.uint64).tobytes())

    def elements(first, of_nodes):
        numbers = np.arange(first, first + len(of_nodes))[:, None]
        file.write(np.hstack([numbers, of_nodes]).astype(np.uint64).tobytes())

    file.write(b"$MeshFormat\n4.1 1 8\n")
    ints(1)
    file.write(b'\n$EndMeshFormat\n$PhysicalNames\n3\n2 1 "bottom"\n2 2 "top"\n3 1 "box"\n$EndPhysicalNames\n$Entities\n')
    sizes(0, 0, 2, 1)
    for tag, group in [(1, 1), (2, 2), (1, 1)]:
        ints(tag)
        file.write(bytes(48))
        sizes(1)
        ints(group)
        sizes(0)
    file.write(b"\n$EndEntities\n$Nodes\n")
    sizes(1, nodes, 1, nodes)
    ints(3, 1, 0)
    sizes(nodes)
    file.write(np.arange(1, nodes + 1, dtype=np.uint64).tobytes())
    y, x = np.divmod(np.arange((n + 1) ** 2), n + 1)
    for k in range(n + 1):
        file.write((np.stack([x, y, np.full_like(x, k)], axis=1) / n).tobytes())
    file.write(b"\n$EndNodes\n$Elements\n")
    sizes(3, 2 * faces + cells, 1, 2 * faces + cells)
    for tag, k in [(1, 0), (2, n)]:
        ints(2, tag, 2)
        sizes(faces)
        elements(1 + (tag - 1) * faces, triangles(n, k))
    ints(3, 1, 4)
    sizes(cells)
    for k in range(n):
        elements(1 + 2 * faces + k * 6 * n**2, tetrahedra(n, k))
    file.write(b"\n$EndElements\n")


if __name__ == "__main__":
    with pathlib.Path(sys.argv[2]).open("wb") as out:
        write(int(sys.argv[1]), out)
