#!/usr/bin/env python3
"""A part with a mesh of Gmsh solved with PETSc: what a user would write with petsc4py instead of installing fetiplast.

    mpirun -np 2 /usr/bin/python3 scripts/studies/peers/petsc_part.py SCENE --out DIR

The same discrete problem as fetiplast's, from the same two files: one body, supports, loads, and nodes that must not enter a
rigid plane. Newton's method and the linear systems are those of petsc.py; nodes that the plane holds are constrained. The nodes
are cut in halves along the longest axis and numbered by Cuthill and McKee. Writes DIR/summary.json.
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
import part  # noqa: E402
import scipy.sparse  # noqa: E402
from linear import Blocks, Linear, circumstances, rigid_modes  # noqa: E402
from newton import Step, newton, summary  # noqa: E402
from plasticity import Material  # noqa: E402
from ranks import COMM, dot, total  # noqa: E402
from scipy.sparse.csgraph import reverse_cuthill_mckee  # noqa: E402

TUNED = {"pc_gamg_use_sa_esteig": False}
"""Beside the options of the blocks. With a kept hierarchy, and contact that starts with the nodes that touch, the fastest of
those tried."""
LAG = 2.0
CHUNK = 50000
"""Elements whose matrices are in memory at a time."""


def order_of_nodes(points, tetrahedra, free):
    """The free nodes as they are numbered, and where each rank's begin."""
    axis = int(np.argmax(np.ptp(points, axis=0)))
    order = free[np.argsort(points[free, axis], kind="stable")]
    cuts = [len(order) * rank // COMM.size for rank in range(COMM.size + 1)]
    own = order[cuts[COMM.rank] : cuts[COMM.rank + 1]]
    place = np.full(len(points), -1)
    place[own] = np.arange(len(own))
    near = place[tetrahedra[(place[tetrahedra] >= 0).any(1)]]
    rows, columns = np.repeat(near, 4, 1).ravel(), np.tile(near, (1, 4)).ravel()
    inside = (rows >= 0) & (columns >= 0)
    ones = np.ones(int(inside.sum()), np.int8)
    graph = scipy.sparse.csr_matrix((ones, (rows[inside], columns[inside])), shape=(len(own), len(own)))
    return np.concatenate(COMM.allgather(own[reverse_cuthill_mckee(graph, True)])), cuts


class Discrete:
    """Elements that touch this rank's nodes, numbers of their nodes, shape functions, pattern of the matrix."""

    def __init__(self, given, tetrahedra):
        order, cuts = order_of_nodes(given.points, tetrahedra, np.flatnonzero(~given.fixed.all(1)))
        self.size, self.begin, self.end = len(order), cuts[COMM.rank], cuts[COMM.rank + 1]
        self.own, self.nodes = self.end - self.begin, order[self.begin : self.end]
        number = np.full(len(given.points), -1)
        number[order] = np.arange(self.size)
        of_elements = number[tetrahedra]
        mine = ((of_elements >= self.begin) & (of_elements < self.end)).any(1)
        held = (of_elements < 0).all(1)
        # Counted by the rank that owns the lowest of their numbers; those without any by the first rank.
        lowest = np.where(of_elements < 0, self.size, of_elements).min(1)
        mine |= held & (COMM.rank == 0)
        self.counted = ((lowest >= self.begin) & (lowest < self.end) | held)[mine]
        self.numbers = of_elements[mine]
        self.shape_functions(given.points[tetrahedra[mine]])
        self.ghosts()
        self.pattern()

    def shape_functions(self, corners):
        """Gradients and volumes."""
        edges = corners[:, 1:] - corners[:, :1]
        self.volume = np.abs(np.linalg.det(edges)) / 6
        self.gradients = np.empty((len(edges), 4, 3))
        self.gradients[:, 1:] = np.linalg.inv(edges).transpose(0, 2, 1)
        self.gradients[:, 0] = -self.gradients[:, 1:].sum(1)

    def ghosts(self):
        """Places of nodes in a local vector: own ones, those of others, and the supports' zero at the end."""
        others = np.unique(self.numbers)
        others = others[(others >= 0) & ((others < self.begin) | (others >= self.end))]
        own = (self.numbers >= self.begin) & (self.numbers < self.end)
        place = np.where(own, self.numbers - self.begin, self.own + np.searchsorted(others, self.numbers))
        self.local = np.where(self.numbers < 0, self.own + len(others), place)
        cuts = COMM.allgather(self.begin) + [self.size]
        owner = np.searchsorted(cuts, others, side="right") - 1
        wanted = [others[owner == rank] for rank in range(COMM.size)]
        self.sent = [numbers - self.begin for numbers in COMM.alltoall(wanted)]
        self.others = others

    def with_ghosts(self, values):
        """Values of own nodes, of the neighbours' nodes beside them, and zero."""
        received = COMM.alltoall([np.ascontiguousarray(values[places]) for places in self.sent])
        return np.concatenate([values, *received, np.zeros((1, values.shape[1]))])

    def pattern(self):
        """Blocks of the own rows, and to which of them each block of an element's matrix is added."""
        row, column = np.repeat(self.numbers, 4, 1).ravel(), np.tile(self.numbers, (1, 4)).ravel()
        there = np.flatnonzero((row >= self.begin) & (row < self.end) & (column >= 0))
        keys, entry = np.unique((row[there] - self.begin) * self.size + column[there], return_inverse=True)
        self.row = keys // self.size
        self.column = (keys % self.size).astype(np.int32)
        row_start = np.concatenate([[0], np.cumsum(np.bincount(self.row, minlength=self.own))]).astype(np.int32)
        self.blocks = Blocks(row_start, self.column, self.size)
        self.diagonal = np.searchsorted(keys, np.arange(self.own) * (self.size + 1) + self.begin)
        # Into one more block, which nobody reads.
        self.entry = np.full(len(row), len(keys), np.int32)
        self.entry[there] = entry
        self.entry = self.entry.reshape(-1, 16)
        # Columns of the blocks as places in a local vector.
        own = (self.column >= self.begin) & (self.column < self.end)
        self.place = np.where(own, self.column - self.begin, self.own + np.searchsorted(self.others, self.column))


class Equations:
    """Stresses, forces, tangents, and the linear systems."""

    def __init__(self, given):
        (tetrahedra,), (law,) = given.bodies.values(), given.materials.values()
        self.law = Material(law["young"], law["poisson"], law["yield_stress"], law.get("hardening", 0.0))
        self.d = d = Discrete(given, tetrahedra)
        self.fixed = given.fixed[d.nodes]
        self.load = np.where(self.fixed, 0.0, given.forces[d.nodes])
        centre = given.points.mean(0)
        self.modes = rigid_modes((given.points[d.nodes] - centre) / np.abs(given.points - centre).max())
        self.linear = Linear(d.blocks, "gamg", LAG, TUNED)
        self.floor(given)
        self.elastic = np.zeros((len(d.column) + 1, 9))
        for begin in range(0, len(d.volume), CHUNK):
            elements = np.arange(begin, min(begin + CHUNK, len(d.volume)))
            self.add(self.elastic, elements, np.broadcast_to(self.law.elastic, (len(elements), 6, 6)))

    def floor(self, given):
        """Own nodes that must not enter the plane, and how far above it they are."""
        self.contact, self.axis, self.sign, self.height = np.zeros(0, int), 0, 1.0, np.zeros(0)
        if given.contacts:
            (plane,) = given.contacts
            self.axis, self.sign = plane.axis, plane.sign
            slave = np.zeros(len(given.points), bool)
            slave[plane.slave] = True
            self.contact = np.flatnonzero(slave[self.d.nodes] & ~self.fixed[:, plane.axis])
            self.height = plane.sign * (given.points[self.d.nodes[self.contact], plane.axis] - plane.place)

    def add(self, values, elements, moduli):
        """Stiffnesses of some elements, B' C B by their volumes."""
        d, count = self.d, len(elements)
        gradients = d.gradients[elements]
        b = np.zeros((count, 6, 4, 3))
        for row, pairs in enumerate([[(0, 0)], [(1, 1)], [(2, 2)], [(0, 1), (1, 0)], [(1, 2), (2, 1)], [(0, 2), (2, 0)]]):
            for component, along in pairs:
                b[:, row, :, component] = gradients[:, :, along]
        b = b.reshape(count, 6, 12)
        stiffness = np.matmul(b.transpose(0, 2, 1), np.matmul(moduli * d.volume[elements][:, None, None], b))
        stiffness = stiffness.reshape(count, 4, 3, 4, 3).transpose(0, 1, 3, 2, 4).reshape(-1, 9)
        entry = d.entry[elements].ravel()
        gather = scipy.sparse.csr_matrix((np.ones(len(entry)), (entry, np.arange(len(entry)))), shape=(len(values), len(entry)))
        values += gather @ stiffness

    def state(self, u):
        return State(self, u)

    def norm(self, strain):
        inner = strain[self.d.counted]
        return np.sqrt(total(float(self.d.volume[self.d.counted] @ np.einsum("ij,ij->i", inner @ self.law.elastic, inner))))

    def gap(self, u):
        return self.height + self.sign * u[self.contact, self.axis]

    def held(self, active):
        held = self.fixed.copy()
        held[self.contact[active], self.axis] = True
        return held

    def free(self, force, active):
        return np.where(self.held(active), 0.0, force)

    def step(self, state, active, tolerance):
        d, held, values = self.d, self.held(active), state.tangent()
        closing = np.zeros_like(state.u)
        closing[self.contact[active], self.axis] = -self.sign * self.gap(state.u)[active]
        change = state.force - self.load
        right = np.where(held, 0.0, -change - self.multiply(values, closing))
        stiffness = total(float(np.trace(values[d.diagonal], axis1=1, axis2=2).sum())) / (3 * d.size)
        constrained = values * ~held[d.row][:, :, None]
        constrained *= (d.with_ghosts(held.astype(float)) == 0)[d.place][:, None, :]
        node, component = np.nonzero(held)
        constrained[d.diagonal[node], component, component] = stiffness
        modes = np.where(held[:, :, None], 0.0, self.modes)
        step, iterations = self.linear.solve(constrained, right, tolerance, held, modes)
        step[held] = 0
        change = change + self.multiply(values, step + closing)
        return Step(step, closing, self.sign * change[self.contact, self.axis], stiffness, iterations)

    def multiply(self, values, u):
        """By the matrix without constraints."""
        if not total(len(self.contact)):
            return np.zeros_like(u)
        products = np.einsum("kij,kj->ki", values, self.d.with_ghosts(u)[self.d.place])
        return np.add.reduceat(products, self.d.blocks.row_start[:-1])


class State:
    """What displacements entail."""

    def __init__(self, equations, u):
        d, self.equations, self.u = equations.d, equations, u
        gradient = np.matmul(d.with_ghosts(u)[d.local].transpose(0, 2, 1), d.gradients)
        self.strain = np.empty((len(d.volume), 6))
        for k in range(3):
            self.strain[:, k] = gradient[:, k, k]
        for k, (a, b) in enumerate([(0, 1), (1, 2), (0, 2)], start=3):
            self.strain[:, k] = gradient[:, a, b] + gradient[:, b, a]
        self.response = equations.law.respond(self.strain)
        stress = self.response.stress[:, [[0, 3, 5], [3, 1, 4], [5, 4, 2]]]
        force = np.matmul(d.gradients, stress) * d.volume[:, None, None]
        length, place = d.own + len(d.others) + 1, d.local.ravel()
        sums = [np.bincount(place, force[:, :, k].ravel(), length)[: d.own] for k in range(3)]
        self.force = np.stack(sums, 1)

    def tangent(self):
        values, plastic = self.equations.elastic.copy(), self.response.plastic
        for begin in range(0, len(plastic), CHUNK):
            some = slice(begin, begin + CHUNK)
            self.equations.add(values, plastic[some], self.equations.law.softening(self.response, some))
        return values[:-1].reshape(-1, 3, 3)

    def energy(self):
        counted = self.equations.d.counted
        return dot(self.equations.d.volume[counted], self.response.dense[counted])

    def plastic_elements(self):
        return total(int(self.equations.d.counted[self.response.plastic].sum()))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", type=pathlib.Path)
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("out"))
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    given = part.load(arguments.scene)
    equations = Equations(given)
    u, active = np.zeros((equations.d.own, 3)), equations.height <= 0
    state, active, rows, converged = newton(equations, u, active)
    force = [0.0, 0.0, 0.0]
    force[equations.axis] = total(float((state.force - equations.load)[equations.contact, equations.axis].sum()))
    told = {**summary(equations, state, rows, converged), "contact_forces": {c.name: force for c in given.contacts}, "newton": rows}
    told |= circumstances(STARTED, equations.linear.seconds)
    if COMM.rank == 0:
        (arguments.out / "summary.json").write_text(json.dumps(told) + "\n")
        print(json.dumps({key: value for key, value in told.items() if key != "newton"}))
    return 0 if converged else 1


if __name__ == "__main__":
    sys.exit(main())
