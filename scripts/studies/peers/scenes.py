"""Scenes with meshes as users bring them: fetiplast beside PETSc where there is one body, CalculiX where there is contact."""

import contextlib
import pathlib
import subprocess
import sys
import tempfile
import typing

from .. import measure
from ..groups import thousands
from ..hard import TIGHT
from ..measure import ROOT
from ..pages import table
from .records import EXACT, FOLDER, ONCE, OURS, PYTHON, RANKS, ended, memory_of, middle, no_result, seconds_of, spread, timed

FILES = ROOT / "scenes/peers"


class Scene(typing.NamedTuple):
    mesh: str
    """What makes it, in scripts/meshes."""
    scales: dict
    """Of the widths of elements, by thousands of nodes."""
    peers: list
    increment: float = 1.0
    """Share of the load that CalculiX takes at once: the largest that it manages."""


HOUSING = {30: 0.97, 90: 0.64, 260: 0.437}
SCENES = {
    "housing": Scene("housing", HOUSING, ["petsc-gamg"]),
    "housing-floor": Scene("housing", HOUSING, ["petsc-gamg", "calculix"]),
    "flange": Scene("flange", {20: 1.2, 60: 0.74, 150: 0.52}, ["calculix"], 0.2),
}
FINEST = {("flange", "calculix"): 20}
"""The last mesh of a scene a peer is run on, in thousands of nodes: the next would take hours."""

BESIDE = {"assembly", "internal forces", "discretisation", "residuals", "output", "certificate", "error estimate"}
"""Phases of fetiplast that are no part of its linear systems; all others are."""
MESSAGES = ("collectives", "neighbour exchange")
"""Which belong to them as well: PETSc's seconds have those of its own."""

HEAD = """\
## Users' meshes

Parts with unstructured, graded meshes of linear tetrahedra ([scenes/peers](../scenes/peers)). Meshes are made
before the runs. All programs read the same scene and the same mesh, and that is a part of their time.

- `housing`: a bearing housing that is bolted down and yields; `housing-floor`: the same on a rigid floor.
- `flange`: two pipes with flanges and eight bolts, tightened and then pulled. No two meshes match: contact is by mortar.

The programs:

- **fetiplast**: 2 ranks, everything at its default.
- **petsc-gamg** ([petsc_part.py](../scripts/studies/peers/petsc_part.py)): as for the benchmark, without cascade. GAMG's
  hierarchy is kept as long as it takes at most twice the iterations it took when it was new, also while contacts change;
  smoothers estimate eigenvalues of their own; contact starts with the nodes that touch. These are the fastest settings of
  those tried. Not run on the flange: its contact is not node to node.
- **calculix** ([calculix_part.py](../scripts/studies/peers/calculix_part.py)): as for the benchmark, with as much of the load in
  an increment as it manages: all on the floor, a fifth with the flange. The floor is a fixed brick. Contact integrals, penalty
  and increments differ from fetiplast's, and so do results.

*Linear seconds* are what linear systems take, messages included. Of fetiplast: F, preconditioner, factors, coarse problem, and
all that is no assembly, residual, input or output; each on its slowest rank. Of PETSc: set-up and solve of KSP, without Python.
"Times" divides by fetiplast's in the same run. *A step* is applications of F, or iterations of CG, a Newton step. Errors are
relative to fetiplast in double precision with tolerances of 1e-8 (Newton), 1e-9 (residual), 1e-10 (QP).
"""


@contextlib.contextmanager
def meshed(names, largest):
    """A folder for each number of nodes of each mesh, with the scenes in it."""
    with tempfile.TemporaryDirectory() as folder:
        files = {}
        for name in names:
            scene = SCENES[name]
            for nodes, scale in scene.scales.items():
                if nodes > largest:
                    continue
                place = pathlib.Path(folder) / f"{scene.mesh}-{nodes}"
                if not place.exists():
                    place.mkdir()
                    print(f"scripts/bench: meshing {scene.mesh}, {nodes} thousand nodes", flush=True)
                    command = [sys.executable, str(ROOT / f"scripts/meshes/{scene.mesh}.py"), "--scale", str(scale)]
                    subprocess.run([*command, "--out", str(place / f"{scene.mesh}.msh")], check=True)
                files[name, nodes] = place / f"{name}.toml"
                files[name, nodes].write_text((FILES / f"{name}.toml").read_text())
        yield files


def runs(files, peers, ours):
    """`files`: scene files by name and thousands of nodes."""
    found = []
    for (name, nodes), file in files.items():
        wanted = [peer for peer in SCENES[name].peers if peer in peers and nodes <= FINEST.get((name, peer), nodes)]
        for program in [EXACT, OURS, *wanted]:
            label = {"scene": name, "nodes": nodes, "variant": f"peers/{program}", "ranks": RANKS}
            found.append(measure.Run(label, *command(program, file, ours), once=program in ONCE))
    return found


def command(program, file, ours):
    """Options, ranks, and how the command begins."""
    if program == "petsc-gamg":
        return [str(file)], RANKS, [*ours.on(RANKS, PYTHON), str(FOLDER / "petsc_part.py")]
    if program == "calculix":
        options = [str(file), "--threads", str(RANKS), "--increment", str(SCENES[file.stem].increment)]
        return options, RANKS, [PYTHON, str(FOLDER / "calculix_part.py")]
    tight = [word for key in TIGHT for word in ("--set", key)]
    return [str(file), *(tight if program == EXACT else [])], RANKS


def linear_seconds(record):
    """Of linear systems alone; None where they are not told."""
    summary = record["summary"]
    if "time" in summary:
        messages = sum(summary["communication"][kind]["seconds"] for kind in MESSAGES)
        return messages + sum(seconds for phase, seconds in summary["time"].items() if phase not in BESIDE)
    return sum(summary["linear_seconds"].values()) if "linear_seconds" in summary else None


def counts(summary):
    """Newton steps; applications of F or iterations of CG, and those a Newton step. CalculiX tells all of its iterations."""
    if "newton_iterations" not in summary:
        return [summary["iterations"], "", ""]
    count = summary["hessian_multiplications" if "hessian_multiplications" in summary else "iterations"]
    return [summary["newton_iterations"], count, f"{count / summary['newton_iterations']:.1f}"]


def contact_error(summary, reference):
    """Of the contact forces, relative to the largest one."""
    exact, found = (norms(s.get("contact_forces") or {}) for s in (reference, summary))
    if not exact or exact.keys() != found.keys():
        return ""
    return f"{max(abs(found[name] - exact[name]) for name in exact) / max(exact.values()):.1e}"


def norms(forces):
    return {name: sum(x * x for x in force) ** 0.5 for name, force in forces.items()}


def beside(records, ours, value):
    """The median over fetiplast's."""
    known = value(records[0]) is not None and (value is memory_of or timed(records, ours))
    return f"{middle(records, value) / middle(ours, value):.2f}" if known else ""


def measured(records, ours, value):
    """A value of all repetitions, and their median over fetiplast's."""
    ratio = beside(records, ours, value)
    return [spread(map(value, records)) if ratio else "", ratio]


def row(program, records, ours, reference):
    if ended(records):
        return no_result(program, records, ours, len(COLUMNS))
    summary = records[0]["summary"]
    displacement = abs(summary["max_displacement"] / reference["max_displacement"] - 1) if reference else None
    cells = [cell for value in (seconds_of, linear_seconds, memory_of) for cell in measured(records, ours, value)]
    cells += ["" if displacement is None else f"{displacement:.1e}", contact_error(summary, reference or {})]
    return [program, *cells, summary["plastic_elements"], *counts(summary)]


COLUMNS = ["", "seconds", "times", "linear seconds", "times", "MiB", "times", "error of largest displacement"]
COLUMNS += ["... of contact forces", "plastic elements", "Newton steps", "F or CG", "a step"]


def case_table(case, found):
    records, _ = found.get((case, EXACT), ([], None))
    reference = records[0]["summary"] if records else None
    programs = [OURS, *SCENES[case[0]].peers]
    return table(COLUMNS, [row(p, *found[case, p], reference) for p in programs if (case, p) in found])


def cases(found):
    """Those that were measured, in the order of the scenes."""
    return [(name, n) for name, scene in SCENES.items() for n in scene.scales if ((name, n), OURS) in found]


def sections(found):
    tables = []
    for name, nodes in cases(found):
        count = thousands(found[(name, nodes), OURS][0][0]["summary"]["nodes"])
        tables += [f"### {name}, {count} nodes\n", case_table((name, nodes), found)]
    return [HEAD, *tables] if tables else []


SHORT = """\
On parts as users mesh them, beside tuned algebraic multigrid (PETSc's GAMG) and CalculiX. *Times* is how many times
fetiplast's time or memory the other program takes; *linear* compares linear systems alone, without the other's Python.

"""


def short(found):
    """For the README."""
    rows = []
    for name, nodes in cases(found):
        records, _ = found[(name, nodes), OURS]
        summary = records[0]["summary"]
        start = [name, thousands(summary["nodes"]), counts(summary)[-1], measured(records, records, seconds_of)[0]]
        there = [peer for peer in SCENES[name].peers if ((name, nodes), peer) in found]
        rows += [[*start, *times_of(peer, *found[(name, nodes), peer])] for peer in there] or [[*start, *[""] * 4]]
    head = ["", "nodes", "F a Newton step", "seconds", "beside", "times seconds", "times linear seconds", "times memory"]
    return SHORT + table(head, rows) if rows else ""


def times_of(peer, records, ours):
    if ended(records):
        return [peer, no_result(peer, records, ours, 3)[2], "", ""]
    return [peer, *(beside(records, ours, value) for value in (seconds_of, linear_seconds, memory_of))]
