"""The paper's benchmark: fetiplast beside PETSc and CalculiX, level by level."""

import json
import sys

from .. import measure
from ..measure import RESULTS
from ..pages import table
from .records import FOLDER, ONCE, OURS, PYTHON, RANKS, ended, memory_of, middle, no_result, program_of, seconds_of, spread

PEERS = {
    "petsc-gamg": ["--coarsest", "gamg"],
    "petsc-cholmod": ["--coarsest", "cholmod"],
    "calculix": [],
}
FINEST = {"calculix": 2}
"""The last level a peer is run on: the next would take hours."""

HEAD = """\
## The benchmark

The benchmark `two-blocks` with the same mesh of linear tetrahedra, the same material and the same load. All coarser levels are
included in times.

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
  its own; the penalty and the increments alone make its result differ from the exact one of the discrete problem.

Errors are relative to the independent references in [reference.json](reference.json); where those have no value, in italics,
to fetiplast's.
"""


def runs(levels, peers, ours):
    return [
        run_of(program, level, ours)
        for level in levels
        for program in [OURS, *(peer for peer in peers if peer in PEERS and level <= FINEST.get(peer, level))]
    ]


def run_of(program, level, ours):
    """`ours` is fetiplast."""
    label, options = {"level": level, "variant": f"peers/{program}", "ranks": RANKS}, ["--level", str(level)]
    if program == OURS:
        return measure.Run(label, ["two-blocks", *options], RANKS)
    if program == "calculix":
        start = [sys.executable, str(FOLDER / "calculix.py")]
        return measure.Run(label, [*options, "--threads", str(RANKS)], RANKS, start, once=program in ONCE)
    start = [*ours.on(RANKS, PYTHON), str(FOLDER / "petsc.py")]
    return measure.Run(label, [*PEERS[program], *options], RANKS, start)


def work(record):
    """What it took on the finest level."""
    s, program = record["summary"], program_of(record)
    if program == "calculix":
        return f"{s['increments']} increments, {s['iterations']} iterations"
    if program == OURS:
        return f"{s['newton_iterations']} Newton steps, {s['hessian_multiplications']} applications of F"
    return f"{s['newton_iterations']} Newton steps, {s['iterations']} linear iterations"


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
    for program in [OURS, *PEERS]:
        if (("two-blocks", level), program) not in found:
            continue
        records, ours = found[("two-blocks", level), program]
        if ended(records):
            rows.append(no_result(program, records, ours, 9))
            continue
        summary, beside = records[0]["summary"], ours[0]["summary"]
        ratio = middle(records, seconds_of) / middle(ours, seconds_of)
        errors = [error(summary, key, reference, beside) for key in ("contact_force", "max_displacement", "energy")]
        memory = spread(map(memory_of, records))
        row = [program, spread(map(seconds_of, records)), f"{ratio:.2f}", *errors, summary["plastic_elements"], memory, work(records[0])]
        rows.append(row)
    head = ["", "seconds", "times fetiplast", "error of contact force", "... largest displacement", "... energy J"]
    head += [f"plastic elements (reference {reference.get('plastic_elements', 'none')})", "MiB", "finest level"]
    return table(head, rows)


def sections(found):
    levels = sorted({level for (scene, level), _ in found if scene == "two-blocks"})
    references = json.loads((RESULTS / "reference.json").read_text())["levels"]
    tables = [text for n in levels for text in (f"### Level {n}\n", level_table(n, found, references.get(str(n), {})))]
    return [HEAD, *tables] if levels else []
