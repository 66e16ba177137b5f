#!/usr/bin/env python3
"""The benchmark two-blocks solved with PETSc: what a user would write with petsc4py instead of installing fetiplast.

    mpirun -np 2 /usr/bin/python3 scripts/studies/peers/petsc.py --level 2 [--coarsest cholmod] [--solver gamg] --out DIR

The same discrete problem as fetiplast's: mesh, split into tetrahedra, material, load, tolerances. One semismooth Newton
method for plasticity and contact: in every step the pairs in contact (primal-dual active set) are eliminated, slave by
master, and the linear system is solved by conjugate gradients with PETSc's algebraic multigrid GAMG, or by a direct solver.
Levels are solved one after the other, each started from the solution before. Everything between the calls of PETSc is
vectorised over the cells. Writes DIR/summary.json and, one file a rank, DIR/fields-RANK.npz.
"""

import argparse
import json
import pathlib
import resource
import sys
import time

STARTED = time.perf_counter()

import petsc4py  # noqa: E402

petsc4py.init(sys.argv[:1])
import numpy as np  # noqa: E402
import scipy.sparse  # noqa: E402
from mpi4py import MPI  # noqa: E402
from petsc4py import PETSc  # noqa: E402

YOUNG, POISSON, YIELD, HARDENING, PRESSURE = 210000.0, 0.29, 450.0, 10000.0, 150.0
NEWTON_TOLERANCE, RESIDUAL_TOLERANCE, NEWTON_LIMIT = 1e-4, 1e-6, 40
LOOSEST = 1e-2
"""Relative tolerance of the first linear solves; later ones follow the residual (Eisenstat and Walker)."""

MU = YOUNG / (2 * (1 + POISSON))
BULK = YOUNG / (3 * (1 - 2 * POISSON))
RADIUS = np.sqrt(2 / 3) * YIELD
BETA = 2 * MU / (2 * MU + 2 * HARDENING / 3)
ONE = np.array([1.0, 1, 1, 0, 0, 0])
DEVIATOR = np.diag([1, 1, 1, 0.5, 0.5, 0.5]) - np.outer(ONE, ONE) / 3  # engineering strain (xx yy zz xy yz xz) to tensor
ELASTIC = BULK * np.outer(ONE, ONE) + 2 * MU * DEVIATOR

CORNER = np.array([[v & 1, v >> 1 & 1, v >> 2] for v in range(8)])
TETS = np.array([(0, 1, 2, 5), (0, 2, 4, 5), (2, 4, 5, 6), (1, 3, 2, 5), (3, 5, 7, 2), (2, 5, 7, 6)])
STEPS = CORNER[TETS][:, None, :, :] - CORNER[TETS][:, :, None, :]  # tetrahedron, from, to: step in the grid
OFFSETS, CODES = np.unique(STEPS.reshape(-1, 3), axis=0, return_inverse=True)
CODES = CODES.reshape(6, 4, 4)  # which of the 15 offsets a step is
COMM = MPI.COMM_WORLD

OPTIONS = {
    "gamg": {
        "ksp_type": "cg",
        "ksp_norm_type": "unpreconditioned",
        "ksp_max_it": 1000,
        "pc_type": "gamg",
        "pc_gamg_agg_nsmooths": 1,
        "pc_gamg_reuse_interpolation": True,
        "pc_gamg_threshold": 0.0,
        "pc_gamg_coarse_eq_limit": 300,
        "pc_gamg_esteig_ksp_max_it": 10,
        "mg_levels_ksp_type": "chebyshev",
        "mg_levels_ksp_max_it": 2,
        "mg_levels_pc_type": "jacobi",
    },
    # CHOLMOD knows one process only, so every rank factorises the whole matrix: no slower than on one rank.
    "cholmod": {
        "ksp_type": "preonly",
        "pc_type": "redundant",
        "redundant_ksp_type": "preonly",
        "redundant_pc_type": "cholesky",
        "redundant_pc_factor_mat_solver_type": "cholmod",
    },
    "mumps": {
        "ksp_type": "preonly",
        "pc_type": "cholesky",
        "pc_factor_mat_solver_type": "mumps",
        "mat_mumps_icntl_14": 40,
    },
}


def total(value, operation=MPI.SUM):
    return COMM.allreduce(value, operation)


def dot(a, b):
    return total(float(np.vdot(a, b)))


def strain_matrices(h):
    """Of the six tetrahedra of a cell, in the order of their nodes' unknowns."""
    matrices = np.zeros((6, 6, 12))
    for t, tet in enumerate(TETS):
        gradients = np.linalg.inv(np.column_stack([np.ones(4), CORNER[tet] * h]))[1:].T
        for a, (x, y, z) in enumerate(gradients):
            matrices[t][:, 3 * a : 3 * a + 3] = [[x, 0, 0], [0, y, 0], [0, 0, z], [y, x, 0], [0, z, y], [z, 0, x]]
    return matrices


class Problem:
    """The mesh of one level, numbered by layers of constant x, which are what a rank owns; without the supported nodes."""

    def __init__(self, n):
        self.n, self.h = n, 100.0 / n
        self.nx, self.ny, self.nz, self.shift = 30 * n, 10 * n, 10 * n, 6 * n
        self.layers = self.nx + self.shift + 1
        layer, plane = np.arange(self.layers), (self.ny + 1) * (self.nz + 1)
        self.has = np.array([(layer >= 1) & (layer <= self.nx), (layer >= self.shift) & (layer < self.layers - 1)])
        self.start = np.concatenate([[0], np.cumsum(self.has.sum(0) * plane)])
        self.size = int(self.start[-1])
        cuts = np.searchsorted(self.start, self.size * np.arange(COMM.size + 1) / COMM.size)
        cuts[-1] = self.layers
        self.first, self.end = (int(c) for c in cuts[COMM.rank : COMM.rank + 2])
        self.r0, self.r1 = int(self.start[self.first]), int(self.start[self.end])
        self.low, self.high = int(self.start[max(self.first - 1, 0)]), int(self.start[min(self.end + 1, self.layers)])
        self.own = self.r1 - self.r0
        self.nodes()
        self.cells()
        self.pattern()
        self.contact()

    def number(self, body, x, y, z):
        """Global numbers of nodes; -1 for supported ones and those outside."""
        inside = (x >= 0) & (x < self.layers) & (y >= 0) & (y <= self.ny) & (z >= 0) & (z <= self.nz)
        x = np.clip(x, 0, self.layers - 1)
        found = self.start[x] + body * self.has[0, x] * ((self.ny + 1) * (self.nz + 1)) + y * (self.nz + 1) + z
        return np.where(inside & self.has[body, x], found, -1)

    def local(self, number):
        """Places in a local vector, whose last one stands for the supports."""
        return np.where(number >= 0, number - self.low, self.high - self.low)

    def nodes(self):
        self.body, self.grid = np.empty(self.own, int), np.empty((self.own, 3), int)
        for body in (0, 1):
            x = np.arange(self.first, self.end)[self.has[body, self.first : self.end]]
            grid = np.meshgrid(x, np.arange(self.ny + 1), np.arange(self.nz + 1), indexing="ij")
            grid = np.stack(grid, -1).reshape(-1, 3)
            place = self.number(body, *grid.T) - self.r0
            self.body[place], self.grid[place] = body, grid

    def cells(self):
        """Those that touch a node of this rank."""
        nodes, body, mine = [], [], []
        for b in (0, 1):
            x = np.arange(max(self.first - 1, b * self.shift), min(self.end, b * self.shift + self.nx))
            grid = np.stack(np.meshgrid(x, np.arange(self.ny), np.arange(self.nz), indexing="ij")).reshape(3, -1)
            nodes.append(np.stack([self.local(self.number(b, *(grid + c[:, None]))) for c in CORNER], 1))
            body.append(np.full(grid.shape[1], b))
            mine.append(grid[0] >= self.first)
        self.cell, self.cell_body, self.mine = np.concatenate(nodes), np.concatenate(body), np.concatenate(mine)

    def pattern(self):
        """Blocks of the matrix, those of any elimination included: `entry[node, body, offset]`, the last one means none."""
        pairs = self.shift, self.nx
        z = self.grid[:, 2] + self.nz * self.body  # height in both bodies together

        def in_contact(x, z):
            return (x >= pairs[0]) & (x <= pairs[1]) & (z == self.nz)

        columns = np.empty((self.own, 2, len(OFFSETS)), np.int64)
        for o, offset in enumerate(OFFSETS):
            x, y, height = self.grid[:, 0] + offset[0], self.grid[:, 1] + offset[1], z + offset[2]
            for other in (0, 1):
                to = self.number(other, x, y, height - self.nz * other)
                coupled = (self.body == other) | np.where(
                    self.body == 0, in_contact(self.grid[:, 0], z), in_contact(x, height)
                )
                columns[:, other, o] = np.where(coupled, to, -1)
        columns = columns.reshape(self.own, -1)
        there = columns >= 0
        order = np.argsort(np.where(there, columns, self.size), axis=1)
        place = np.empty_like(order)
        np.put_along_axis(place, order, np.arange(order.shape[1])[None, :], 1)
        self.row_start = np.concatenate([[0], np.cumsum(there.sum(1))]).astype(np.int32)
        self.blocks = int(self.row_start[-1])
        ordered = np.take_along_axis(columns, order, 1)
        self.column = ordered[ordered >= 0].astype(np.int32)
        entry = np.where(there, self.row_start[:-1, None] + place, self.blocks).astype(np.int32)
        none = np.full((1, entry.shape[1]), self.blocks, np.int32)
        self.entry = np.concatenate([entry, none]).reshape(self.own + 1, 2, -1)
        self.neighbour = self.local(columns).astype(np.int32).reshape(self.own, 2, -1)

    def contact(self):
        """Pairs of this rank, and which blocks an elimination moves where."""
        x, y = np.meshgrid(np.arange(self.shift, self.nx + 1), np.arange(self.ny + 1), indexing="ij")
        mine = ((x >= self.first) & (x < self.end)).ravel()
        self.pair = np.stack([x.ravel()[mine] - self.shift, y.ravel()[mine]])
        self.master = (self.number(0, x, y, self.nz).ravel())[mine] - self.r0
        self.slave = (self.number(1, x, y, 0).ravel())[mine] - self.r0
        is_slave = np.zeros((self.own, 1))
        is_slave[self.slave] = 1
        row, o = np.nonzero(self.with_ghosts(is_slave)[self.neighbour[:, 1, :], 0])
        self.move_column = row, self.neighbour[row, 1, o], self.entry[row, 1, o], self.entry[row, 0, o]
        source, target = (self.entry[nodes].reshape(len(nodes), -1) for nodes in (self.slave, self.master))
        pair, k = np.nonzero(source < self.blocks)
        self.move_row = pair, source[pair, k], target[pair, k]
        here = int(np.flatnonzero((OFFSETS == 0).all(1))[0])
        self.diagonal = self.entry[np.arange(self.own), self.body, here]

    def with_ghosts(self, values):
        """Values of own nodes, those of the neighbours' nodes beside them, and the supports' zero."""
        full = np.zeros((self.high - self.low + 1, values.shape[1]))
        full[self.r0 - self.low : self.r1 - self.low] = values
        at = self.start - self.low
        for side, send, receive in ((-1, self.first, self.first - 1), (1, self.end - 1, self.end)):
            if 0 <= COMM.rank + side < COMM.size:
                incoming = full[at[receive] : at[receive + 1]]
                outgoing, other = full[at[send] : at[send + 1]].copy(), COMM.rank + side
                COMM.Sendrecv(outgoing, other, recvbuf=incoming, source=other)
        return full

    def load(self):
        """Pressure on the whole top of the upper body."""
        x, y = np.meshgrid(np.arange(self.shift, self.shift + self.nx), np.arange(self.ny), indexing="ij")
        force = np.zeros((self.size + 1, 3))
        for triangle in ((0, 1, 2), (1, 3, 2)):
            for v in triangle:
                np.add.at(force[:, 2], self.number(1, x + (v & 1), y + (v >> 1), self.nz), -PRESSURE * self.h**2 / 6)
        return force[self.r0 : self.r1]


class Equations:
    """Stresses, forces and tangents."""

    def __init__(self, problem):
        self.p, self.volume, self.strain_matrix = problem, problem.h**3 / 6, strain_matrices(problem.h)
        own_row = np.arange(problem.high - problem.low + 1) - (problem.r0 - problem.low)
        self.row = np.where((own_row >= 0) & (own_row < problem.own), own_row, problem.own)
        # From a tangent (36) to the 16 blocks (9) of an element's stiffness.
        self.expand = [
            self.volume * np.einsum("ia,jb->ijab", b, b).reshape(36, 4, 3, 4, 3).transpose(0, 1, 3, 2, 4).reshape(36, 144)
            for b in self.strain_matrix
        ]
        self.elastic = np.zeros((problem.blocks + 1, 9))
        for t in range(6):
            self.add(self.elastic, t, slice(None), (ELASTIC.reshape(1, 36) @ self.expand[t]).reshape(1, 16, 9))

    def add(self, values, t, cells, stiffness):
        """In one tetrahedron of different cells, node a is a different row each time, so += is enough."""
        rows, body = self.row[self.p.cell[cells][:, TETS[t]]], self.p.cell_body[cells]
        for a in range(4):
            for b in range(4):
                values[self.p.entry[rows[:, a], body, CODES[t, a, b]]] += stiffness[:, 4 * a + b]

    def state(self, u):
        return State(self, u)


class State:
    """What displacements entail."""

    def __init__(self, equations, u):
        p, self.equations, self.u = equations.p, equations, u
        full, count = p.with_ghosts(u), len(p.cell)
        self.strain = np.empty((6, count, 6))
        for t, tet in enumerate(TETS):
            np.matmul(full[p.cell[:, tet]].reshape(count, 12), equations.strain_matrix[t].T, out=self.strain[t])
        stress = self.strain.reshape(-1, 6) @ (2 * MU * DEVIATOR)
        square = stress * stress
        norm = np.sqrt(square[:, :3].sum(1) + 2 * square[:, 3:].sum(1))
        self.plastic = np.flatnonzero(norm > RADIUS)
        self.norm = norm[self.plastic]
        self.direction = stress[self.plastic] / self.norm[:, None]
        stress[self.plastic] -= BETA * (self.norm - RADIUS)[:, None] * self.direction
        trace = self.strain.reshape(-1, 6)[:, :3].sum(1)
        stress[:, :3] += BULK * trace[:, None]
        self.stress = stress.reshape(6, count, 6)
        self.dense = norm**2 / (4 * MU) + BULK / 2 * trace**2
        self.dense[self.plastic] -= BETA * (self.norm - RADIUS) ** 2 / (4 * MU)
        on_cell = np.zeros((8, count, 3))
        for t, tet in enumerate(TETS):
            force = (equations.volume * self.stress[t] @ equations.strain_matrix[t]).reshape(count, 4, 3)
            for a, v in enumerate(tet):
                on_cell[v] += force[:, a]
        force = np.zeros_like(full)
        for v in range(8):
            force[p.cell[:, v]] += on_cell[v]
        self.force = force[p.r0 - p.low : p.r1 - p.low]

    def tangent(self):
        """Blocks of the stiffness."""
        values, count = self.equations.elastic.copy(), len(self.equations.p.cell)
        bounds = np.searchsorted(self.plastic, np.arange(7) * count)
        for t in range(6):
            for begin in range(bounds[t], bounds[t + 1], 20000):
                part = slice(begin, min(begin + 20000, bounds[t + 1]))
                ratio = (RADIUS / self.norm[part])[:, None, None]
                normal = self.direction[part]
                change = -2 * MU * BETA * ((1 - ratio) * DEVIATOR + ratio * normal[:, :, None] * normal[:, None, :])
                stiffness = (change.reshape(-1, 36) @ self.equations.expand[t]).reshape(-1, 16, 9)
                self.equations.add(values, t, self.plastic[part] - t * count, stiffness)
        values[-1] = 0
        return values.reshape(-1, 3, 3)

    def energy(self):
        """Psi of the whole, every cell counted by one rank."""
        return total(self.equations.volume * float(self.dense.reshape(6, -1)[:, self.equations.p.mine].sum()))

    def plastic_elements(self):
        return total(int(self.equations.p.mine[self.plastic % len(self.equations.p.mine)].sum()))


def elastic_norm(equations, strain):
    inner = strain[:, equations.p.mine].reshape(-1, 6)
    return np.sqrt(total(equations.volume * float(np.vdot(inner @ ELASTIC, inner))))


class Linear:
    """The linear systems of one level, all of one pattern."""

    def __init__(self, problem, solver):
        self.p, self.solver = problem, solver
        self.matrix = self.ksp = self.active = None
        self.sizes = (3 * problem.own, 3 * problem.size)
        options = PETSc.Options()
        for key, value in OPTIONS[solver].items():
            options[f"{solver}_{key}"] = value

    def solve(self, values, right, tolerance, active):
        p = self.p
        csr = scipy.sparse.bsr_matrix((values[:-1], p.column, p.row_start), shape=(3 * p.own, 3 * p.size)).tocsr()
        if self.matrix is None:
            csr = (csr.indptr, csr.indices, csr.data)
            self.matrix = PETSc.Mat().createAIJ((self.sizes, self.sizes), bsize=3, csr=csr, comm=COMM)
            self.matrix.setOption(PETSc.Mat.Option.SPD, True)
        else:
            self.matrix.setValuesCSR(csr.indptr, csr.indices, csr.data)
            self.matrix.assemble()
        del csr
        if self.solver == "gamg":
            self.matrix.setNearNullSpace(self.rigid_modes(active))
            # GAMG keeps its interpolation, which does not fit other pairs in contact.
            if self.active is None or total(int((self.active != active).sum())):
                self.close()
            self.active = active
        if self.ksp is None:
            self.ksp = PETSc.KSP().create(COMM)
            self.ksp.setOptionsPrefix(f"{self.solver}_")
            self.ksp.setFromOptions()
            self.ksp.setOperators(self.matrix)
        self.ksp.setTolerances(rtol=tolerance)
        right = PETSc.Vec().createWithArray(right.ravel(), self.sizes, bsize=3, comm=COMM)
        solution = right.duplicate()
        self.ksp.solve(right, solution)
        if self.ksp.getConvergedReason() <= 0:
            raise RuntimeError(f"the linear solver failed: {self.ksp.getConvergedReason()}")
        return solution.array.reshape(-1, 3).copy(), self.ksp.getIterationNumber()

    def close(self):
        if self.ksp is not None:
            self.ksp.destroy()
            self.ksp = None

    def rigid_modes(self, active):
        modes = np.zeros((self.p.own, 3, 6))
        x, y, z = (self.p.grid * self.p.h + np.array([0, 0, 1000.0]) * self.p.body[:, None] - [1800, 500, 1000]).T / 1000
        modes[:, [0, 1, 2], [0, 1, 2]] = 1
        modes[:, 0, 3], modes[:, 1, 3] = -y, x
        modes[:, 1, 4], modes[:, 2, 4] = -z, y
        modes[:, 0, 5], modes[:, 2, 5] = z, -x
        modes[self.p.slave[active], 2] = 0
        modes = modes.reshape(-1, 6)
        root = np.linalg.cholesky(total(modes.T @ modes))
        modes = np.linalg.solve(root, modes.T)
        vectors = [PETSc.Vec().createWithArray(mode.copy(), self.sizes, bsize=3, comm=COMM) for mode in modes]
        return PETSc.NullSpace().create(vectors=vectors, comm=COMM)


def eliminate(p, values, right, active, gap):
    """Slave by master in place; also what the closing of the gaps adds to the right-hand side. The new diagonal."""
    flag = np.zeros((p.own, 2))
    flag[p.slave[active], 0] = 1
    flag[p.slave[active], 1] = -gap[active]
    flag = p.with_ghosts(flag)
    row, to, source, target = p.move_column
    chosen = flag[to, 0] > 0
    row, to, source, target = row[chosen], to[chosen], source[chosen], target[chosen]
    np.subtract.at(right, row, values[source, :, 2] * flag[to, 1][:, None])
    values[target, :, 2] += values[source, :, 2]
    values[source, :, 2] = 0
    pair, source, target = p.move_row
    source, target = source[active[pair]], target[active[pair]]
    values[target, 2, :] += values[source, 2, :]
    values[source, 2, :] = 0
    onto_master(p, right, active)
    diagonal = total(float(np.trace(values[p.diagonal], axis1=1, axis2=2).sum())) / (3 * p.size)
    values[p.diagonal[p.slave[active]], 2, 2] = diagonal
    return diagonal


def onto_master(p, force, active):
    force[p.master[active], 2] += force[p.slave[active], 2]
    force[p.slave[active], 2] = 0


def step_length(slope, before, after):
    """Zero of the energy's slope along the step, roughly; the full step unless that overshoots."""
    if before >= 0 or after <= 0.5 * abs(before):
        return 1.0
    low, high, at_low, at_high, tried = 0.0, 1.0, before, after, 1.0
    for _ in range(7):
        tried = low - (high - low) * at_low / (at_high - at_low)
        tried = min(max(tried, low + 0.1 * (high - low)), high - 0.1 * (high - low))
        found = slope(tried)
        if abs(found) < 0.2 * abs(before):
            break
        if found > 0:
            high, at_high = tried, found
        else:
            low, at_low = tried, found
    return tried


def newton(p, solver, u, active):
    equations, linear, load = Equations(p), Linear(p, solver), p.load()
    state, scale = equations.state(u), np.sqrt(dot(load, load))
    norm, before, tolerance, rows, converged = elastic_norm(equations, state.strain), None, LOOSEST, [], False
    while len(rows) < NEWTON_LIMIT and not converged:
        values = state.tangent()
        gap = u[p.slave, 2] - u[p.master, 2]
        of_slaves = values[p.entry[p.slave].reshape(len(p.slave), -1)][:, :, 2, :]
        right = load - state.force
        diagonal = eliminate(p, values, right, active, gap)
        step, iterations = linear.solve(values, right, tolerance, active)
        del values
        step[p.slave[active], 2] = step[p.master[active], 2]
        closing = np.zeros_like(u)
        closing[p.slave[active], 2] = -gap[active]
        around = p.with_ghosts(step + closing)[p.neighbour[p.slave].reshape(len(p.slave), -1)]
        pressure = (state.force - load)[p.slave, 2] + np.einsum("skc,skc->s", of_slaves, around)

        closed = total(int(np.count_nonzero(closing))) > 0
        at_start = equations.state(u + closing) if closed else state
        new = equations.state(u + closing + step)

        def slope(length, known=None):
            return dot((known or equations.state(u + closing + length * step)).force - load, step)

        length = step_length(slope, slope(0, at_start), slope(1, new))
        if length != 1:
            new = equations.state(u + closing + length * step)
        new_norm = elastic_norm(equations, new.strain)
        criterion = elastic_norm(equations, new.strain - state.strain) / (norm + new_norm)
        u, state, norm = new.u, new, new_norm
        wanted = pressure - diagonal * (u[p.slave, 2] - u[p.master, 2]) > 0
        changed = total(int((wanted != active).sum()))
        active = wanted
        left = load - state.force
        onto_master(p, left, active)
        residual = np.sqrt(dot(left, left)) / scale
        if before is not None:
            tolerance = min(LOOSEST, max(0.9 * (residual / before) ** 2, 1e-8, 0.1 * RESIDUAL_TOLERANCE / residual))
        before = residual
        row = {"criterion": criterion, "residual": residual, "damping": length, "iterations": iterations, "changed": changed}
        row |= {"plastic_elements": state.plastic_elements(), "active_contacts": total(int(active.sum()))}
        rows.append(row)
        converged = bool(changed == 0 and length == 1 and criterion < NEWTON_TOLERANCE and residual < RESIDUAL_TOLERANCE)
    linear.close()
    return state, load, active, rows, converged


def refine(values, m, n):
    """Linear interpolation of values on a grid of level m to one of level n, axis by axis; the last axis is left alone."""
    for axis in range(values.ndim - 1):
        at = np.arange((values.shape[axis] - 1) // m * n + 1) * m / n
        below = np.minimum(at.astype(int), values.shape[axis] - 2)
        weight = (at - below).reshape([-1 if a == axis else 1 for a in range(values.ndim)])
        values = (1 - weight) * values.take(below, axis) + weight * values.take(below + 1, axis)
    return values


def spread(p, u, active):
    """Both on the whole grid, on every rank."""
    whole, touching = np.zeros((2, p.nx + 1, p.ny + 1, p.nz + 1, 3)), np.zeros((p.nx - p.shift + 1, p.ny + 1, 1))
    whole[p.body, p.grid[:, 0] - p.shift * p.body, p.grid[:, 1], p.grid[:, 2]] = u
    touching[p.pair[0], p.pair[1], 0] = active
    COMM.Allreduce(MPI.IN_PLACE, whole)
    COMM.Allreduce(MPI.IN_PLACE, touching)
    return whole, touching


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--level", type=int, default=1)
    parser.add_argument("--coarsest", choices=OPTIONS, default="gamg", help="linear solver of the first level")
    parser.add_argument("--solver", choices=OPTIONS, default="gamg", help="linear solver of the others")
    parser.add_argument("--cascade", choices=["on", "off"], default="on")
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("out"))
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)

    levels, coarser = [], None
    for n in range(1, arguments.level + 1) if arguments.cascade == "on" else [arguments.level]:
        begin = time.perf_counter()
        p = Problem(n)
        u, active = np.zeros((p.own, 3)), np.ones(len(p.slave), bool)
        if coarser:
            whole, touching = np.stack([refine(of_body, n - 1, n) for of_body in coarser[0]]), refine(coarser[1], n - 1, n)
            u = whole[p.body, p.grid[:, 0] - p.shift * p.body, p.grid[:, 1], p.grid[:, 2]]
            active = touching[p.pair[0], p.pair[1], 0] > 0.5
        state, load, active, rows, converged = newton(p, arguments.solver if coarser else arguments.coarsest, u, active)
        coarser = spread(p, state.u, active)
        levels.append({"level": n, "seconds": time.perf_counter() - begin, "unknowns": 3 * p.size, "newton": rows})
        if COMM.rank == 0:
            print(f"level {n}: {len(rows)} Newton steps, {sum(r['iterations'] for r in rows)} linear iterations, "
                  f"residual {rows[-1]['residual']:.1e}, {levels[-1]['seconds']:.1f} s", flush=True)

    contact = (state.force - load)[p.slave, 2]
    np.savez(arguments.out / f"fields-{COMM.rank}.npz", body=p.body, grid=p.grid, displacement=state.u, load=load,
             stress=state.stress[:, p.mine], slave=p.slave, contact_force=contact)
    work = dot(load, state.u)
    summary = {
        "converged": converged,
        "level": arguments.level,
        "ranks": COMM.size,
        "newton_iterations": len(rows),
        "iterations": sum(row["iterations"] for row in rows),
        "contact_force": total(float(contact.sum())),
        "energy": state.energy() - work,
        "external_work": work,
        "max_displacement": total(float(np.sqrt((state.u**2).sum(1)).max()), MPI.MAX),
        "plastic_elements": rows[-1]["plastic_elements"],
        "active_contacts": rows[-1]["active_contacts"],
        "residual": rows[-1]["residual"],
        "peak_rss_mb": total(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024),
        "levels": levels,
        "time_total": time.perf_counter() - STARTED,
        "petsc": ".".join(str(number) for number in PETSc.Sys.getVersion()),
    }
    if COMM.rank == 0:
        (arguments.out / "summary.json").write_text(json.dumps(summary) + "\n")
        print(json.dumps({key: value for key, value in summary.items() if key != "levels"}))
    return 0 if converged else 1


if __name__ == "__main__":
    sys.exit(main())
