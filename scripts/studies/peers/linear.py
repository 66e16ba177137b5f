"""Linear systems of 3 x 3 blocks, all of one pattern, solved by PETSc; options, seconds, versions."""

import contextlib
import resource
import time

import numpy as np
import scipy.sparse
from petsc4py import PETSc
from ranks import COMM, MPI, total

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


class Blocks:
    """A pattern of blocks by rows of this rank, and how many rows there are in all."""

    def __init__(self, row_start, column, size):
        self.row_start, self.column, self.own, self.size = row_start, column, len(row_start) - 1, size
        self.sizes = (3 * self.own, 3 * size)

    def csr(self, values):
        blocks = (values, self.column, self.row_start)
        return scipy.sparse.bsr_matrix(blocks, shape=(3 * self.own, 3 * self.size)).tocsr()

    def vector(self, values):
        return PETSc.Vec().createWithArray(np.ascontiguousarray(values).ravel(), self.sizes, bsize=3, comm=COMM)


class Linear:
    """Solves one system after the other. Aggregates of GAMG fit one set of constrained unknowns and are kept with it. With a
    `lag` above 0 the whole hierarchy is kept, for other sets as well, until it takes more than so many times the iterations it
    took when it was new."""

    def __init__(self, blocks, solver, lag=0.0, more=None):
        self.blocks, self.solver, self.lag = blocks, solver, lag
        self.matrix = self.kept = self.ksp = self.constrained = None
        self.fresh = self.last = 0
        self.seconds = {"set-up": 0.0, "solve": 0.0}
        options = PETSc.Options()
        for key, value in (OPTIONS[solver] | (more or {})).items():
            options[f"{solver}_{key}"] = value

    def solve(self, values, right, tolerance, constrained, modes):
        """`modes`: rigid motions of the nodes, zero where they are constrained."""
        self.assemble(values)
        if self.solver == "gamg":
            self.matrix.setNearNullSpace(self.orthonormal(modes))
        solution, reason, renewed = self.attempt(right, tolerance, constrained)
        if reason <= 0 and not renewed:
            self.close()
            solution, reason, renewed = self.attempt(right, tolerance, constrained)
        if reason <= 0:
            raise RuntimeError(f"the linear solver failed: {reason}")
        if renewed:
            self.fresh = self.last
        return solution.array.reshape(-1, 3).copy(), self.last

    def attempt(self, right, tolerance, constrained):
        """Solution, PETSc's reason to stop, and whether the preconditioner was made for it."""
        renewed = self.ksp is None or self.lag == 0 or self.last > self.lag * self.fresh + 2
        if renewed:
            other = self.constrained is not None and total(int((self.constrained != constrained).sum())) > 0
            if other and self.solver == "gamg":
                self.close()
            self.constrained = constrained
        with self.clock("set-up"):
            self.set_up(tolerance, renewed)
        right_side = self.blocks.vector(right)
        solution = right_side.duplicate()
        with self.clock("solve"):
            self.ksp.solve(right_side, solution)
        self.last = self.ksp.getIterationNumber()
        return solution, self.ksp.getConvergedReason(), renewed

    def assemble(self, values):
        csr = self.blocks.csr(values)
        if self.matrix is None:
            csr = (csr.indptr, csr.indices, csr.data)
            self.matrix = PETSc.Mat().createAIJ((self.blocks.sizes, self.blocks.sizes), bsize=3, csr=csr, comm=COMM)
            self.matrix.setOption(PETSc.Mat.Option.SPD, True)
        else:
            self.matrix.setValuesCSR(csr.indptr, csr.indices, csr.data)
            self.matrix.assemble()

    def set_up(self, tolerance, renewed):
        if self.ksp is None:
            self.ksp = PETSc.KSP().create(COMM)
            self.ksp.setOptionsPrefix(f"{self.solver}_")
            self.ksp.setFromOptions()
        if renewed and self.lag > 0:
            self.keep()
        self.ksp.setOperators(self.matrix, self.kept or self.matrix)
        self.ksp.setTolerances(rtol=tolerance)
        self.ksp.setUp()

    def keep(self):
        """A copy of the matrix for the preconditioner, which does not change with it."""
        if self.kept is None:
            self.kept = self.matrix.duplicate(True)
            self.kept.setOption(PETSc.Mat.Option.SPD, True)
        else:
            self.matrix.copy(self.kept, PETSc.Mat.Structure.SAME_NONZERO_PATTERN)
        self.kept.setNearNullSpace(self.matrix.getNearNullSpace())

    def close(self):
        for name in ("ksp", "kept"):
            if getattr(self, name) is not None:
                getattr(self, name).destroy()
                setattr(self, name, None)

    def orthonormal(self, modes):
        modes = modes.reshape(-1, 6)
        root = np.linalg.cholesky(total(modes.T @ modes))
        return PETSc.NullSpace().create(vectors=[self.blocks.vector(mode) for mode in np.linalg.solve(root, modes.T)], comm=COMM)

    @contextlib.contextmanager
    def clock(self, name):
        begin = time.perf_counter()
        yield
        self.seconds[name] += time.perf_counter() - begin


def rigid_modes(points):
    """Three translations and three rotations about the origin: node, component, mode."""
    modes = np.zeros((len(points), 3, 6))
    x, y, z = points.T
    modes[:, [0, 1, 2], [0, 1, 2]] = 1
    modes[:, 0, 3], modes[:, 1, 3] = -y, x
    modes[:, 1, 4], modes[:, 2, 4] = -z, y
    modes[:, 0, 5], modes[:, 2, 5] = z, -x
    return modes


def circumstances(started, linear_seconds):
    """Time, memory of all ranks, version. `linear_seconds` are those within PETSc's solvers, of the slowest rank."""
    return {
        "ranks": COMM.size,
        "peak_rss_mb": total(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024),
        "linear_seconds": {name: total(seconds, MPI.MAX) for name, seconds in linear_seconds.items()},
        "time_total": time.perf_counter() - started,
        "petsc": ".".join(str(number) for number in PETSc.Sys.getVersion()),
    }
