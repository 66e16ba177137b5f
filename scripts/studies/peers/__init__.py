"""fetiplast beside programs a user can install from Debian's packages, on the paper's benchmark.

Installs PETSc with petsc4py, and CalculiX, as root or with sudo. Solves the benchmark with fetiplast and each peer in turn, the
whole list --repeat times. A program that has no result after --limit seconds is ended, and the record says so.
"""

import json
import os
import pathlib
import shutil
import statistics
import subprocess
import sys

from .. import measure
from ..groups import circumstances
from ..measure import RESULTS
from ..pages import table

FOLDER = pathlib.Path(__file__).parent
RAW = measure.RAW / "peers"
RANKS = 2

PYTHON = "/usr/bin/python3"
"""Debian's, which has Debian's petsc4py."""

PACKAGES = ["python3-petsc4py-real", "python3-mpi4py", "python3-scipy", "python3-numpy", "calculix-ccx"]
PACKAGES += ["libopenblas0-pthread"]
"""The last one because PETSc's direct solvers are ten times slower with the reference BLAS."""

PEERS = {
    "petsc-gamg": ["--coarsest", "gamg"],
    "petsc-cholmod": ["--coarsest", "cholmod"],
    "calculix": [],
}
FINEST = {"calculix": 2}
"""The last level a peer is run on: the next would take hours."""

READ = ("contact_force",)
"""Of the lists in a summary."""

HEAD = """\
# fetiplast and its peers

Written by `scripts/bench write peers` from the runs in [raw/peers](raw/peers), which `scripts/bench run peers` made.

What is compared: the benchmark `two-blocks` with the same mesh of linear tetrahedra, the same material and the same load, on
the same machine, programs alternating within one run. Seconds are wall time from the start of the processes to results on
disk, start-up of MPI and Python and all coarser levels included; medians of the repetitions, with the smallest and largest.
"Times fetiplast" divides by the median of fetiplast in the same run. Memory is the sum over the ranks of their largest
resident memory.

- **fetiplast**: `mpirun -np 2 fetiplast solve two-blocks --level N`, everything at its default.
- **petsc-gamg** ([petsc.py](../scripts/studies/peers/petsc.py)): PETSc through petsc4py, 2 ranks. One semismooth Newton method
  for plasticity and contact with an energy line search, pairs in contact eliminated; conjugate gradients with the multigrid
  GAMG, which is given the rigid-body modes; linear tolerances after Eisenstat and Walker; levels 1 to N in sequence, each
  started from the one before. It has fetiplast's tolerances: 1e-4 for the step in the energy norm and 1e-6 for the residual.
  It solves the same discrete problem, so results must agree to these tolerances.
- **petsc-cholmod**: the same, with the direct solver CHOLMOD in place of multigrid at level 1; every rank factorises the whole
  matrix there, for CHOLMOD knows one process only.
- **calculix** ([calculix.py](../scripts/studies/peers/calculix.py)): CalculiX as an engineer would use it, with 2 threads, penalty
  contact from surface to surface, its iterative Cholesky solver and 5 load increments. It has no cascade, and tolerances of
  its own; the penalty and the increments alone make its result differ from the exact one of the discrete problem. Its time
  is that of `ccx`, without the writing of the input.

Errors are relative to the independent references in [reference.json](reference.json); where those have no value, in italics,
to fetiplast's.
"""


def arguments(parser):
    parser.add_argument("--levels", type=int, nargs="+", default=[1, 2, 3])
    parser.add_argument("--peers", nargs="+", choices=PEERS, default=list(PEERS))
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
    install(PACKAGES)
    ours = measure.Program(arguments)
    ours.environment |= {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "PYTHONPATH": petsc4py()}
    runs = [
        run_of(program, level, ours)
        for level in arguments.levels
        for program in ["fetiplast", *(peer for peer in arguments.peers if level <= FINEST.get(peer, level))]
    ]
    return 1 if measure.run(runs, arguments, RAW, READ, ours, arguments.limit) else 0


def run_of(program, level, ours):
    """`ours` is fetiplast."""
    label, options = {"level": level, "variant": f"peers/{program}", "ranks": RANKS}, ["--level", str(level)]
    if program == "fetiplast":
        return measure.Run(label, ["two-blocks", *options], RANKS)
    if program == "calculix":
        return measure.Run(label, [*options, "--threads", str(RANKS)], RANKS, [sys.executable, str(FOLDER / "calculix.py")])
    start = [*ours.on(RANKS, PYTHON), str(FOLDER / "petsc.py")]
    return measure.Run(label, [*PEERS[program], *options], RANKS, start)


def petsc4py():
    """Where Debian has it: beside the PETSc it was built for."""
    found = sorted(pathlib.Path("/usr/lib/petscdir").glob("petsc3.*/*-real/lib/python3/dist-packages"))
    return str(found[-1]) if found else ""


def program_of(record):
    return record["variant"].removeprefix("peers/")


def seconds_of(record):
    """Those of CalculiX are of `ccx` alone, without the writing of the input."""
    alone = program_of(record) == "calculix" and record["summary"]
    return alone["time_total"] if alone else record["seconds"]


def work(record):
    """What it took on the finest level."""
    s, program = record["summary"], program_of(record)
    if program == "calculix":
        return f"{s['increments']} increments, {s['iterations']} iterations"
    if program == "fetiplast":
        return f"{s['newton_iterations']} Newton steps, {s['hessian_multiplications']} applications of F"
    return f"{s['newton_iterations']} Newton steps, {s['iterations']} linear iterations"


def read():
    """Records that succeeded or were ended for their time, by level and program: those of the last run with fetiplast's."""
    found = {}
    for file in sorted(RAW.glob("*.jsonl")):
        of_file = {}
        for line in file.read_text().splitlines():
            record = json.loads(line)
            if record["exit_code"] is None or (record["exit_code"] == 0 and record["summary"]):
                of_file.setdefault((record["level"], program_of(record)), []).append(record)
        for (level, program), records in of_file.items():
            if (level, "fetiplast") in of_file:
                found[level, program] = records, of_file[level, "fetiplast"]
    return found


def spread(values):
    middle = f"{statistics.median(values):.3g}"
    return middle if len(values) == 1 else f"{middle} ({min(values):.3g} to {max(values):.3g})"


def value(summary, key):
    found = summary.get(key)
    return found[2] if isinstance(found, list) else found


def error(summary, key, reference, ours):
    """Relative difference, in italics if it is not from an independent reference."""
    found = value(summary, key)
    if found is None:
        return ""
    if key in reference:
        return f"{abs(found / reference[key] - 1):.1e}"
    return f"*{abs(found / value(ours, key) - 1):.1e}*" if found != value(ours, key) else ""


def level_table(level, found, reference):
    rows = []
    for program in ["fetiplast", *PEERS]:
        if (level, program) not in found:
            continue
        records, ours = found[level, program]
        summary, beside = records[0]["summary"], ours[0]["summary"]
        seconds = [seconds_of(record) for record in records]
        ratio = statistics.median(seconds) / statistics.median(seconds_of(record) for record in ours)
        if any(record["exit_code"] is None for record in records):
            rows.append([program, f"no result after {min(seconds):.3g}", f"> {ratio:.0f}", *[""] * 6])
            continue
        errors = [error(summary, key, reference, beside) for key in ("contact_force", "max_displacement", "energy")]
        memory = spread([record["summary"]["peak_rss_mb"] for record in records])
        row = [program, spread(seconds), f"{ratio:.2f}", *errors, summary["plastic_elements"], memory, work(records[0])]
        rows.append(row)
    head = ["", "seconds", "times fetiplast", "error of contact force", "... largest displacement", "... energy J"]
    head += [f"plastic elements (reference {reference.get('plastic_elements', 'none')})", "MiB", "finest level"]
    return table(head, rows)


def versions(records):
    """Of the peers, as they say themselves."""
    summaries = [record["summary"] for record in records if record["summary"]]
    found = {f"{name} {s[key]}" for name, key in (("PETSc", "petsc"), ("CalculiX", "calculix")) for s in summaries if key in s}
    return f"; {', '.join(sorted(found)) or 'no peers'}"


def used():
    return [record for beside in read().values() for records in beside for record in records]


def pages():
    found = read()
    references = json.loads((RESULTS / "reference.json").read_text())["levels"]
    text = [HEAD]
    for level in sorted({level for level, _ in found}):
        text += [f"## Level {level}\n", level_table(level, found, references.get(str(level), {}))]
    text += ["## Where the runs come from\n", circumstances((record for records, _ in found.values() for record in records), versions)]
    return {RESULTS / "peers.md": "\n".join(text)}
