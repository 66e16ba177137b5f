"""Sums over the ranks."""

import numpy as np
from mpi4py import MPI

COMM = MPI.COMM_WORLD


def total(value, operation=MPI.SUM):
    return COMM.allreduce(value, operation)


def dot(a, b):
    return total(float(np.vdot(a, b)))
