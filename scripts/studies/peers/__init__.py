"""fetiplast beside programs a user can install from Debian's packages: on the paper's benchmark, and on meshes of users.

Installs PETSc with petsc4py, and CalculiX, as root or with sudo. Solves each scene with fetiplast and each peer in turn, the
whole list --repeat times. A program that has no result after --limit seconds is ended, and the record says so. Meshes are made
before, by Gmsh: run it with .venv/bin/python, or with --scenes two-blocks friction.
"""

import os
import pathlib
import shutil
import subprocess
import sys

from .. import measure
from ..groups import circumstances
from ..measure import RESULTS
from . import blocks, records, rubbing, scenes
from .records import FOLDER, PYTHON, RAW  # noqa: F401

PACKAGES = {
    "petsc": ["python3-petsc4py-real", "python3-mpi4py", "python3-scipy", "python3-numpy", "libopenblas0-pthread"],
    "calculix": ["calculix-ccx", "python3-numpy"],
}
"""By how names of programs begin. OpenBLAS because PETSc's direct solvers are ten times slower with the reference BLAS."""

READ = ("contact_force", "contact_forces", "time", "communication", "linear_seconds")
"""Of the lists in a summary."""

NAMED = ["two-blocks", "friction", *scenes.SCENES]

NAMES = sorted({*blocks.PEERS, *(peer for scene in scenes.SCENES.values() for peer in scene.peers)})

HEAD = """\
# fetiplast and its peers

Written by `scripts/bench write peers` from the runs in [raw/peers](raw/peers), which `scripts/bench run peers` made.

Programs alternate within one run on one machine. Seconds are wall time from the start of the processes to results on disk,
start-up of MPI and Python included; those of CalculiX are of `ccx`, without the writing of its input, and of a single run but
where there is friction. Medians of the repetitions, with the smallest and largest. "Times fetiplast" divides by the median of
fetiplast in the same run. Memory is the sum over the ranks of their largest resident memory.
"""


def arguments(parser):
    parser.add_argument("--scenes", nargs="+", choices=NAMED, default=NAMED)
    parser.add_argument("--levels", type=int, nargs="+", default=[1, 2, 3], help="of two-blocks")
    parser.add_argument("--nodes", type=int, default=1000, help="thousands of nodes of the other scenes at most")
    parser.add_argument("--peers", nargs="+", choices=NAMES, default=NAMES)
    parser.add_argument("--limit", type=float, default=3600.0, help="seconds after which a program is ended")
    measure.add_repeat(parser, 3)
    measure.add_arguments(parser)


def install(packages):
    """Those of Debian that this machine lacks."""

    def installed(package):
        done = subprocess.run(["dpkg-query", "-W", "-f=${Status}", package], capture_output=True, text=True)
        return "ok installed" in done.stdout

    if not shutil.which("dpkg-query"):
        sys.exit(f"scripts/bench: not a Debian or Ubuntu; what they call {' '.join(packages)} must be there.")
    missing = [package for package in packages if not installed(package)]
    if missing:
        print(f"scripts/bench: installing {' '.join(missing)}", file=sys.stderr)
        as_root = [] if os.getuid() == 0 else ["sudo"]
        apt = [*as_root, "env", "DEBIAN_FRONTEND=noninteractive", "apt-get", "-qq"]
        subprocess.run([*apt, "update"], check=True)
        command = [*apt, "install", "-y", "--no-install-recommends", *missing]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)


def run(arguments):
    needed = {package for start, packages in PACKAGES.items() for package in packages if any(p.startswith(start) for p in arguments.peers)}
    install(sorted(needed))
    ours = measure.Program(arguments)
    ours.environment |= {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "PYTHONPATH": petsc4py()}
    of_blocks = blocks.runs(arguments.levels, arguments.peers, ours) if "two-blocks" in arguments.scenes else []
    of_friction = rubbing.runs(arguments.peers) if "friction" in arguments.scenes else []
    meshes = [name for name in arguments.scenes if name in scenes.SCENES]
    with scenes.meshed(meshes, arguments.nodes) as files:
        runs = of_blocks + of_friction + scenes.runs(files, arguments.peers, ours)
        return 1 if measure.run(runs, arguments, RAW, READ, ours, arguments.limit) else 0


def petsc4py():
    """Where Debian has it: beside the PETSc it was built for."""
    found = sorted(pathlib.Path("/usr/lib/petscdir").glob("petsc3.*/*-real/lib/python3/dist-packages"))
    return str(found[-1]) if found else ""


def used():
    return [record for beside in records.read().values() for of in beside for record in of]


def pages():
    found = records.read()
    text = [HEAD, *blocks.sections(found), *rubbing.sections(found), *scenes.sections(found), "## Where the runs come from\n"]
    text.append(circumstances((record for of, _ in found.values() for record in of), records.versions))
    return {RESULTS / "peers.md": "\n".join(text)}


def short():
    """For the README."""
    return scenes.short(records.read())
