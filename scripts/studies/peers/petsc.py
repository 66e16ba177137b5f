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
import sys
import time

STARTED = time.perf_counter()

import petsc4py  # noqa: E402

petsc4py.init(sys.argv[:1])
import numpy as np  # noqa: E402
from linear import OPTIONS, Blocks, Linear, circumstances, rigid_modes  # noqa: E402
from newton import Step, newton, summary  # noqa: E402
from plasticity import Material  # noqa: E402
from ranks import COMM, MPI, total  # noqa: E402

STEEL = Material(young=210000.0, poisson=0.29, yield_stress=450.0, hardening=10000.0)
PRESSURE = 150.0

CORNER = np.array([[v & 1, v >> 1 & 1, v >> 2] for v in range(8)])
TETS = np.array([(0, 1, 2, 5), (0, 2, 4, 5), (2, 4, 5, 6), (1, 3, 2, 5), (3, 5, 7, 2), (2, 5, 7, 6)])
STEPS = CORNER[TETS][:, None, :, :] - CORNER[TETS][:, :, None, :]  # tetrahedron, from, to: step in the grid
OFFSETS, CODES = np.unique(STEPS.reshape(-1, 3), axis=0, return_inverse=True)
CODES = CODES.reshape(6, 4, 4)  # which of the 15 offsets a step is


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

    def points(self):
        """About the middle, in metres."""
        return (self.grid * self.h + np.array([0, 0, 1000.0]) * self.body[:, None] - [1800, 500, 1000]) / 1000

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

    def __init__(self, problem, solver):
        self.load, self.linear = problem.load(), Linear(Blocks(problem.row_start, problem.column, problem.size), solver)
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
            self.add(self.elastic, t, slice(None), (STEEL.elastic.reshape(1, 36) @ self.expand[t]).reshape(1, 16, 9))

    def add(self, values, t, cells, stiffness):
        """In one tetrahedron of different cells, node a is a different row each time, so += is enough."""
        rows, body = self.row[self.p.cell[cells][:, TETS[t]]], self.p.cell_body[cells]
        for a in range(4):
            for b in range(4):
                values[self.p.entry[rows[:, a], body, CODES[t, a, b]]] += stiffness[:, 4 * a + b]

    def state(self, u):
        return State(self, u)

    def norm(self, strain):
        inner = strain[:, self.p.mine].reshape(-1, 6)
        return np.sqrt(total(self.volume * float(np.vdot(inner @ STEEL.elastic, inner))))

    def gap(self, u):
        return u[self.p.slave, 2] - u[self.p.master, 2]

    def free(self, force, active):
        """Of the unknowns that are left after the elimination."""
        left = force.copy()
        onto_master(self.p, left, active)
        return left

    def step(self, state, active, tolerance):
        p, gap, values = self.p, self.gap(state.u), state.tangent()
        of_slaves = values[p.entry[p.slave].reshape(len(p.slave), -1)][:, :, 2, :]
        right = self.load - state.force
        diagonal = eliminate(p, values, right, active, gap)
        modes = rigid_modes(p.points())
        modes[p.slave[active], 2] = 0
        step, iterations = self.linear.solve(values[:-1], right, tolerance, active, modes)
        del values
        step[p.slave[active], 2] = step[p.master[active], 2]
        closing = np.zeros_like(state.u)
        closing[p.slave[active], 2] = -gap[active]
        around = p.with_ghosts(step + closing)[p.neighbour[p.slave].reshape(len(p.slave), -1)]
        pressure = (state.force - self.load)[p.slave, 2] + np.einsum("skc,skc->s", of_slaves, around)
        return Step(step, closing, pressure, diagonal, iterations)


class State:
    """What displacements entail."""

    def __init__(self, equations, u):
        p, self.equations, self.u = equations.p, equations, u
        full, count = p.with_ghosts(u), len(p.cell)
        self.strain = np.empty((6, count, 6))
        for t, tet in enumerate(TETS):
            np.matmul(full[p.cell[:, tet]].reshape(count, 12), equations.strain_matrix[t].T, out=self.strain[t])
        self.response = STEEL.respond(self.strain.reshape(-1, 6))
        self.stress = self.response.stress.reshape(6, count, 6)
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
        plastic = self.response.plastic
        bounds = np.searchsorted(plastic, np.arange(7) * count)
        for t in range(6):
            for begin in range(bounds[t], bounds[t + 1], 20000):
                part = slice(begin, min(begin + 20000, bounds[t + 1]))
                change = STEEL.softening(self.response, part)
                stiffness = (change.reshape(-1, 36) @ self.equations.expand[t]).reshape(-1, 16, 9)
                self.equations.add(values, t, plastic[part] - t * count, stiffness)
        values[-1] = 0
        return values.reshape(-1, 3, 3)

    def energy(self):
        """Psi of the whole, every cell counted by one rank."""
        return total(self.equations.volume * float(self.response.dense.reshape(6, -1)[:, self.equations.p.mine].sum()))

    def plastic_elements(self):
        return total(int(self.equations.p.mine[self.response.plastic % len(self.equations.p.mine)].sum()))


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

    levels, coarser, linear = [], None, {}
    for n in range(1, arguments.level + 1) if arguments.cascade == "on" else [arguments.level]:
        begin = time.perf_counter()
        p = Problem(n)
        u, active = np.zeros((p.own, 3)), np.ones(len(p.slave), bool)
        if coarser:
            whole, touching = np.stack([refine(of_body, n - 1, n) for of_body in coarser[0]]), refine(coarser[1], n - 1, n)
            u = whole[p.body, p.grid[:, 0] - p.shift * p.body, p.grid[:, 1], p.grid[:, 2]]
            active = touching[p.pair[0], p.pair[1], 0] > 0.5
        equations = Equations(p, arguments.solver if coarser else arguments.coarsest)
        state, active, rows, converged = newton(equations, u, active)
        equations.linear.close()
        for name, taken in equations.linear.seconds.items():
            linear[name] = linear.get(name, 0.0) + taken
        coarser = spread(p, state.u, active)
        levels.append({"level": n, "seconds": time.perf_counter() - begin, "unknowns": 3 * p.size, "newton": rows})
        if COMM.rank == 0:
            print(f"level {n}: {len(rows)} Newton steps, {sum(r['iterations'] for r in rows)} linear iterations, "
                  f"residual {rows[-1]['residual']:.1e}, {levels[-1]['seconds']:.1f} s", flush=True)

    contact = (state.force - equations.load)[p.slave, 2]
    np.savez(arguments.out / f"fields-{COMM.rank}.npz", body=p.body, grid=p.grid, displacement=state.u, load=equations.load,
             stress=state.stress[:, p.mine], slave=p.slave, contact_force=contact)
    told = {"level": arguments.level, **summary(equations, state, rows, converged)}
    told |= {"contact_force": total(float(contact.sum())), "levels": levels, **circumstances(STARTED, linear)}
    if COMM.rank == 0:
        (arguments.out / "summary.json").write_text(json.dumps(told) + "\n")
        print(json.dumps({key: value for key, value in told.items() if key != "levels"}))
    return 0 if converged else 1


if __name__ == "__main__":
    sys.exit(main())
