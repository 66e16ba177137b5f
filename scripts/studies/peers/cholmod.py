#!/usr/bin/env python3
"""CHOLMOD beside fetiplast's factors: the stiffness of cubes of n x n x n cells, each of six linear tetrahedra.

    scripts/studies/peers/cholmod.py [CELLS ...]

Prints one JSON line a cube. Needs Debian's libsuitesparse-dev, libopenblas0-pthread and python3-scipy; one thread.
`scripts/bench run kernels` calls this beside `cargo bench --bench kernels`.
"""

import itertools
import os
import pathlib
import subprocess
import sys
import tempfile

import numpy as np
import scipy.sparse

SOURCE = pathlib.Path(__file__).with_name("cholmod.c")
YOUNG, POISSON = 210e3, 0.29


def tetrahedra(n):
    """Nodes of the six tetrahedra of every cell: one for each order of walking along the three edges."""
    m = n + 1
    corner = (np.arange(n)[:, None, None] * m + np.arange(n)[None, :, None]) * m + np.arange(n)[None, None, :]
    strides = [m * m, m, 1]
    cells = []
    for walk in itertools.permutations(range(3)):
        nodes = [corner.ravel()]
        for axis in walk:
            nodes.append(nodes[-1] + strides[axis])
        cells.append(np.stack(nodes, axis=1))
    return np.concatenate(cells)


def stiffness(n):
    """Of a cube with unit cells, made definite by a small multiple of its diagonal."""
    m = n + 1
    grid = np.stack(np.meshgrid(*[np.arange(m, dtype=float)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    elements = tetrahedra(n)
    edges = grid[elements[:, 1:]] - grid[elements[:, :1]]
    inverse = np.linalg.inv(edges)
    gradients = np.concatenate([-inverse.sum(axis=2, keepdims=True), inverse], axis=2)
    volume = np.abs(np.linalg.det(edges)) / 6
    lame, shear = YOUNG * POISSON / (1 + POISSON) / (1 - 2 * POISSON), YOUNG / 2 / (1 + POISSON)
    g = gradients
    blocks = lame * np.einsum("eia,ejb->eaibj", g, g) + shear * np.einsum("eja,eib->eaibj", g, g)
    blocks += shear * np.einsum("eka,ekb,ij->eaibj", g, g, np.eye(3))
    blocks *= volume[:, None, None, None, None]
    dofs = (3 * elements[:, :, None] + np.arange(3)).reshape(len(elements), 12)
    rows, columns = np.repeat(dofs, 12, axis=1).ravel(), np.tile(dofs, (1, 12)).ravel()
    matrix = scipy.sparse.csc_matrix((blocks.reshape(-1), (rows, columns)), shape=(3 * m**3, 3 * m**3))
    return matrix + scipy.sparse.diags(1e-6 * matrix.diagonal())


def main():
    with tempfile.TemporaryDirectory() as folder:
        program = pathlib.Path(folder) / "cholmod"
        subprocess.run(["gcc", "-O2", str(SOURCE), "-o", str(program), "-lcholmod"], check=True)
        for n in map(int, sys.argv[1:] or ["4", "6", "8", "10", "12"]):
            upper = scipy.sparse.triu(stiffness(n), format="csc")
            upper.sort_indices()
            parts = [np.int64([upper.shape[0]]), upper.indptr.astype(np.int64), upper.indices.astype(np.int64), upper.data]
            data = b"".join(part.tobytes() for part in parts)
            environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
            done = subprocess.run([program], input=data, env=environment, check=True, capture_output=True)
            line = done.stdout.decode().strip()
            print(line.replace('"dofs"', f'"cells": {n}, "dofs"', 1), flush=True)


if __name__ == "__main__":
    main()
