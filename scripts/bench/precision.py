"""Work against precision on the benchmark: elements, meshes, tolerances and QP solvers against the limit of refined meshes."""

import itertools
import json

from . import plot
from .markdown import table
from .measure import ROOT, Run

RANKS = 2
RESULTS = ROOT / "bench-results"
RAW = RESULTS / "raw" / "precision"
ELEMENTS = {"tet4": [5, 10, 20], "hex8": [5, 10, 20], "tet10": [5, 10, 15]}
"""Cells along 1000 mm: the contact strip begins at 600 mm, so that multiples of 5 match."""
LIMIT = ["tet10", "hex8"]
"""Elements whose energies are extrapolated, the better one first."""
TOLERANCES = ["1e-2", "1e-4"]
SOLVERS = ["active-set", "smalse-m"]
STRICT = TOLERANCES[-1]
WANTED = [0.1, 0.05, 0.02, 0.01]


def boxes(element, cells):
    """Cells along an edge of a subdomain, the program's own choice where it divides the bodies."""
    return 10 if element != "tet10" and cells % 10 == 0 else 5


def options(element, cells, tolerance, solver):
    """Newton's criterion, and with it the residual in the proportion of the defaults; all from rest."""
    sets = [f"body.{body}.element={element}" for body in ("lower", "upper")]
    sets += [f"body.{body}.brick.cells=[{3 * cells}, {cells}, {cells}]" for body in ("lower", "upper")]
    sets += [f"decomposition.cells={[boxes(element, cells)] * 3}", f"solver.newton_tolerance={tolerance}"]
    sets += [f"solver.residual_tolerance={float(tolerance) / 100:g}", f"solver.qp={solver}"]
    return ["two-blocks", "--cascade", "off", *(word for key in sets for word in ("--set", key))]


def runs(elements, cells, tolerances, solvers):
    """The quick ones first."""
    kinds = itertools.product(cells or sorted({n for of in ELEMENTS.values() for n in of}), solvers, elements, tolerances)
    return [
        Run(
            {"element": element, "cells": n, "tolerance": tolerance, "qp": solver, "ranks": RANKS},
            options(element, n, tolerance, solver),
            RANKS,
        )
        for n, solver, element, tolerance in kinds
        if n in ELEMENTS[element]
    ]


def read(folder):
    """The last converged record of each kind."""
    lines = [json.loads(line) for file in sorted(folder.glob("*.jsonl")) for line in file.read_text().splitlines()]
    lines.sort(key=lambda record: record["provenance"]["date"])
    return {key_of(record): record for record in lines if record["exit_code"] == 0}


def key_of(record):
    return record["element"], record["cells"], record["tolerance"], record["qp"]


def extrapolate(energies):
    """`energies`: J by cells along an edge. With J(n) = J* + c n^-p through the three finest: J* and p, or None where the
    energies do not fall like that."""
    if len(energies) < 3:
        return None
    (a, ja), (b, jb), (c, jc) = sorted(energies.items())[-3:]
    wanted = (ja - jb) / (jb - jc) if jb != jc else 0.0

    def ratio(p):
        return (a**-p - b**-p) / (b**-p - c**-p)

    low, high = 1e-3, 20.0
    if not ratio(low) < wanted < ratio(high):
        return None
    for _ in range(200):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if ratio(middle) < wanted else (low, middle)
    return jc - (jb - jc) * c**-low / (b**-low - c**-low), low


def limits(records):
    """J* and the order that gave it, by element."""
    found = {}
    for element in LIMIT:
        of = {n: r["summary"]["energy"] for (e, n, t, q), r in records.items() if (e, t, q) == (element, STRICT, SOLVERS[0])}
        if (result := extrapolate(of)) is not None:
            found[element] = result
    return found


def error(record, exact):
    """Relative, of the energy J."""
    return abs(record["summary"]["energy"] / exact - 1)


def gigabytes(summary):
    """Of factors that the solves read: what most of the time goes into."""
    return (summary["work"]["dual operator"]["bytes"] + summary["work"]["preconditioner"]["bytes"]) / 1e9


def quiet(record):
    return record["provenance"].get("quiet", True)


COSTS = {
    "F": ("applications of F", lambda r: r["summary"]["hessian_multiplications"]),
    "gigabytes": ("GB of factors read", lambda r: gigabytes(r["summary"])),
    "memory": ("MiB, all ranks", lambda r: r["summary"]["peak_rss_mb"]),
    "time": ("seconds", lambda r: r["summary"]["time_total"]),
}


def known_costs(records):
    return [name for name in COSTS if name != "time" or all(quiet(record) for record in records.values())]


def picture(name, records, exact):
    """Error over one cost; a line for each element and QP solver, from mesh to mesh."""
    label, cost = COSTS[name]
    series = []
    for element, solver in itertools.product(ELEMENTS, SOLVERS):
        of = [r for (e, _, t, q), r in sorted(records.items()) if (e, t, q) == (element, STRICT, solver)]
        if of:
            series.append((f"{element}, {solver}", {cost(r): error(r, exact) for r in of}, False))
    return plot.curves(f"two-blocks: error against {label}", label, "relative error of the energy", series)


HEAD = """\
# Work against precision, measured

Written by `scripts/precision write` from the runs in [raw/precision](raw/precision), which `scripts/precision run` measured: the
benchmark on meshes of n cells along 1000 mm (level 1 has 10), from rest. Newton's tolerance goes with a tolerance of the
residual that is a hundredth of it; all else is default.

- *error*: |J - J*| / |J*|. As far as J is quadratic its root is the error of stresses in the energy norm; here the load is close
  to collapse. J* is extrapolated from the three finest meshes of one element, J(n) = J* + c n^-p.
- *F*: applications; *GB read*: of factors, in the dual operator and the preconditioner, which stands for time on any machine;
  *MiB*: the largest resident memory, summed over the ranks; *s*: blank where the machine was busy with other work.
"""


def cheapest(records, exact):
    """For each wanted error the choice that reaches it at the least cost."""
    names = known_costs(records)
    rows = []
    for wanted in WANTED:
        enough = [(key, record) for key, record in records.items() if error(record, exact) <= wanted]
        cells = []
        for name in names:
            if not enough:
                cells.append("none")
                continue
            (element, n, tolerance, solver), record = min(enough, key=lambda pair: COSTS[name][1](pair[1]))
            cells.append(f"{element}, n = {n}, {solver}, {tolerance}: {COSTS[name][1](record):.3g}")
        rows.append([f"{100 * wanted:g} %", *cells])
    return table(["error at most", *(COSTS[name][0] for name in names)], rows)


def rows(records, exact):
    order = {element: place for place, element in enumerate(ELEMENTS)}
    for (element, n, tolerance, solver), record in sorted(records.items(), key=lambda pair: (order[pair[0][0]], *pair[0][1:])):
        summary = record["summary"]
        yield [
            f"{element}, n = {n}", tolerance, solver, summary["primal_dofs"], f"{summary['energy']:.8g}",
            f"{100 * error(record, exact):.2f} %", summary["newton_iterations"], summary["hessian_multiplications"],
            f"{gigabytes(summary):.1f}", f"{summary['peak_rss_mb']:.0f}", f"{summary['time_total']:.2f}" if quiet(record) else "",
        ]


def told(found):
    """The limits, and how far they are apart."""
    text = "; ".join(f"{element}: J* = {exact:.8g}, order p = {order:.2f}" for element, (exact, order) in found.items())
    if len(found) < 2:
        return f"{text}.\n"
    (one, _), (other, _) = list(found.values())[:2]
    text += f". The first is used. They differ by {100 * abs(one / other - 1):.2g} %: errors that are not larger than some"
    return f"{text} times this mean nothing.\n"


def contents(folder):
    """Every file this writes, with its text."""
    records = read(folder)
    found = limits(records)
    if not found:
        return {}
    exact = next(iter(found.values()))[0]
    text = [HEAD, told(found), cheapest(records, exact)]
    files = {RESULTS / f"precision-{name.lower()}.svg": picture(name, records, exact) for name in known_costs(records)}
    text += [f"![{path.stem}]({path.name})\n" for path in files]
    head = ["mesh", "Newton tolerance", "QP", "primal unknowns", "J", "error", "Newton steps", "F", "GB read", "MiB", "s"]
    text += [table(head, rows(records, exact))]
    kinds = [key_of(run.label) for run in runs(ELEMENTS, None, TOLERANCES, SOLVERS)]
    missing = [f"{e}, n = {n}, {q}, {t}" for e, n, t, q in kinds if (e, n, t, q) not in records]
    text += [f"Not measured yet: {'; '.join(missing)}.\n"] if missing else []
    commits = sorted({record["provenance"]["commit"][:12] for record in records.values()})
    text += [f"Program: {', '.join(commits)}, {RANKS} ranks.\n"]
    return files | {RESULTS / "precision.md": "\n".join(text)}
