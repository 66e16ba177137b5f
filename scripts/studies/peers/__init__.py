"""fetiplast beside programs a user can install from Debian's packages, on the paper's benchmark.

Installs PETSc with petsc4py, and CalculiX, as root or with sudo. Solves the benchmark with fetiplast and each peer in turn, the
whole list --repeat times. A program that has no result after --limit seconds is ended, and the record says so.
"""

import json
import os
import pathlib
import shutil
import signal
import statistics
import subprocess
import sys
import tempfile
import time

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
    records, failed = ours.records(RAW), 0
    for repetition in range(1, arguments.repeat + 1):
        for level in arguments.levels:
            for program in ["fetiplast", *(p for p in arguments.peers if level <= FINEST.get(p, level))]:
                record = solve(program, ours, level, arguments.limit)
                record["repetition"] = repetition
                records.add(record)
                failed += record["exit_code"] not in (0, None)
                print(told(record), flush=True)
    return 1 if failed else 0


def petsc4py():
    """Where Debian has it: beside the PETSc it was built for."""
    found = sorted(pathlib.Path("/usr/lib/petscdir").glob("petsc3.*/*-real/lib/python3/dist-packages"))
    return str(found[-1]) if found else ""


def command_of(program, ours, level, out):
    if program == "fetiplast":
        options = ["solve", "two-blocks", "--level", str(level), "--progress", "off", "--out", out]
        return [*ours.on(RANKS), *options, "--summary", f"{out}/summary.json"]
    options = ["--level", str(level), "--out", out]
    if program == "calculix":
        return [sys.executable, str(FOLDER / "calculix.py"), *options, "--threads", str(RANKS)]
    return [*ours.on(RANKS, PYTHON), str(FOLDER / "petsc.py"), *PEERS[program], *options]


def ended(command, environment, limit):
    """The exit code of a command, None if it and all its processes had to be ended after `limit` seconds, and the seconds."""
    begin = time.perf_counter()
    process = subprocess.Popen(
        command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, start_new_session=True
    )
    try:
        output, _ = process.communicate(timeout=limit)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        process.communicate()
        return None, time.perf_counter() - begin
    if process.returncode:
        print(output, file=sys.stderr)
    return process.returncode, time.perf_counter() - begin


def solve(program, ours, level, limit):
    """`ours` is fetiplast."""
    started, load = measure.now(), os.getloadavg()[0]
    with tempfile.TemporaryDirectory() as out:
        command = command_of(program, ours, level, out)
        code, seconds = ended(command, ours.environment, limit)
        found = measure.read_summary(pathlib.Path(out) / "summary.json")
    if program == "calculix" and found:
        seconds = found["time_total"]
    return {
        "level": level,
        "variant": f"peers/{program}",
        "ranks": RANKS,
        "exit_code": code,
        "seconds": seconds,
        "summary": measure.shortened(found, READ),
        "provenance": {
            "command": " ".join(pathlib.Path(w).name if w.startswith("/") else w for w in command),
            "date": measure.date(started),
            "load_average": load,
            **ours.provenance(found),
        },
    }


def program_of(record):
    return record["variant"].removeprefix("peers/")


def work(record):
    """What it took on the finest level."""
    s, program = record["summary"], program_of(record)
    if program == "calculix":
        return f"{s['increments']} increments, {s['iterations']} iterations"
    if program == "fetiplast":
        return f"{s['newton_iterations']} Newton steps, {s['hessian_multiplications']} applications of F"
    return f"{s['newton_iterations']} Newton steps, {s['iterations']} linear iterations"


def told(record):
    what = f"level {record['level']}, {program_of(record)}: exit code {record['exit_code']}, {record['seconds']:.1f} s"
    if record["exit_code"] is None:
        return f"{what}: ended without a result"
    if record["exit_code"] or not record["summary"]:
        return what
    return f"{what}, {record['summary']['peak_rss_mb']:.0f} MiB, {work(record)}"


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
        seconds = [record["seconds"] for record in records]
        ratio = statistics.median(seconds) / statistics.median(record["seconds"] for record in ours)
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
