"""Work against precision: what each element, mesh, tolerance and QP solver costs for an error that is wanted.

Errors are against the limits of refined meshes, or a closed form. Cells are along 1000 mm, or through a wall.
"""

import itertools
import math
import typing

from . import measure, plot
from .measure import RESULTS, Run
from .pages import of_cases, table

RANKS = 2
RAW = measure.RAW / "precision"
ELEMENTS = ["tet4", "hex8", "tet10"]
LIMIT = ["tet10", "hex8"]
"""Elements whose energies are extrapolated, the better one first."""
TOLERANCES = ["1e-2", "1e-4"]
SOLVERS = ["active-set", "smalse-m"]
STRICT = TOLERANCES[-1]
WANTED = [0.1, 0.05, 0.02, 0.01, 0.001, 0.0001]


class Case(typing.NamedTuple):
    scene: str
    meshes: dict
    """Of each element: cells along some length."""
    mesh: typing.Callable
    """Keys of the scene, by element and cells."""
    about: str
    measure: typing.Callable = lambda summary: summary["energy"]
    """What the error is of, from a summary."""
    exact: float | None = None
    """Its closed form; else it is extrapolated."""
    solvers: list = SOLVERS
    exit_codes: tuple = (0,)


def blocks(element, cells):
    """Cells along 1000 mm, in subdomains of the program's own choice where that divides the bodies."""
    box = 10 if element != "tet10" and cells % 10 == 0 else 5
    sets = [f"body.{body}.brick.cells=[{3 * cells}, {cells}, {cells}]" for body in ("lower", "upper")]
    return sets + [f"body.{body}.element={element}" for body in ("lower", "upper")] + [f"decomposition.cells={[box] * 3}"]


def spheres(*bodies):
    """Cells through each wall and along half an edge."""

    def sets(element, cells):
        of = [(f"body.{body}.element={element}", f"body.{body}.sphere.cells=[{cells}, {cells}]") for body in bodies]
        return [key for keys in of for key in keys]

    return sets


def last_pressure(summary):
    """Of the history in scenes/precision/limit-sphere.toml."""
    amplitudes = [0.0, 560.0, 720.0]
    time = max((step["time"] for step in summary["steps"] if step["converged"]), default=0.0)
    before = min(int(time), len(amplitudes) - 2)
    return amplitudes[before] + (time - before) * (amplitudes[before + 1] - amplitudes[before])


CASES = {
    "two-blocks": Case(
        "two-blocks", {"tet4": [5, 10, 20], "hex8": [5, 10, 20], "tet10": [5, 10, 15]}, blocks,
        "the benchmark, n cells along 1000 mm (level 1 has 10; the contact strip begins at 600 mm, so that multiples of 5 match). "
        "The error is that of the energy J, relative. As far as J is quadratic its root is the error of stresses in the energy "
        "norm; here the load is close to collapse",
    ),
    "nested-spheres": Case(
        "scenes/precision/nested-spheres.toml", {"tet4": [4, 8, 12], "hex8": [4, 8, 12], "tet10": [2, 4, 6]}, spheres("inner", "outer"),
        "a yielding sphere that closes the gap to another one, n cells through each wall. The error is that of the energy J, "
        "relative; facets that cut off the sphere have their share in it",
    ),
    "limit-sphere": Case(
        "scenes/precision/limit-sphere.toml", {"tet4": [4, 6, 8], "hex8": [2, 4, 6], "tet10": [1, 2, 3]}, spheres("wall"),
        "the limit pressure of a perfectly plastic hollow sphere, 2 sigma_y ln(b/a), n cells through the wall: the last "
        "equilibrium of a history whose increments are halved ten times. No contact, so the QP solver is conjugate gradients",
        last_pressure, 2 * 450.0 * math.log(2.0), ["active-set"], (0, 1),
    ),
}


def options(case, element, cells, tolerance, solver):
    """Newton's criterion, and with it the residual in the proportion of the defaults; all from rest."""
    sets = CASES[case].mesh(element, cells) + [f"solver.newton_tolerance={tolerance}"]
    sets += [f"solver.residual_tolerance={float(tolerance) / 100:g}", f"solver.qp={solver}"]
    return [CASES[case].scene, "--cascade", "off", *(word for key in sets for word in ("--set", key))]


def kinds(case):
    """All choices; the quick ones first."""
    meshes = CASES[case].meshes
    sizes = sorted({n for of in meshes.values() for n in of})
    found = itertools.product(sizes, CASES[case].solvers, ELEMENTS, TOLERANCES)
    return [(element, n, tolerance, solver) for n, solver, element, tolerance in found if n in meshes[element]]


def arguments(parser):
    choices = {"cases": list(CASES), "elements": ELEMENTS, "tolerances": TOLERANCES, "solvers": SOLVERS}
    for name, known in choices.items():
        parser.add_argument(f"--{name}", nargs="+", choices=known, default=known)
    parser.add_argument("--cells", type=int, nargs="+", help="these only; without it all")
    measure.add_repeat(parser, 1)
    measure.add_arguments(parser)


def run(arguments):
    wanted = runs(arguments.cases, arguments.elements, arguments.cells, arguments.tolerances, arguments.solvers)
    measure.run(wanted, arguments, RAW, tables=("steps", "work"))
    known = read(RAW)
    return 1 if any(key_of(run.label) not in known[run.label["case"]] for run in wanted) else 0


def runs(cases, elements, cells, tolerances, solvers):
    """What is asked for; `cells` of None means all."""
    return [
        Run(
            {"case": case, "element": element, "cells": n, "tolerance": tolerance, "qp": solver, "ranks": RANKS},
            options(case, element, n, tolerance, solver),
            RANKS,
        )
        for case in cases
        for element, n, tolerance, solver in kinds(case)
        if element in elements and (not cells or n in cells) and tolerance in tolerances and solver in solvers
    ]


def read(folder):
    """The last usable record of each kind, by case."""
    found = {case: {} for case in CASES}
    for record in measure.read(folder):
        case = record["case"]
        if record["summary"] and record["exit_code"] in CASES[case].exit_codes:
            found[case][key_of(record)] = record
    return found


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


def errors(case, records, exact):
    """Relative, of what the case is about."""
    return {key: abs(CASES[case].measure(record["summary"]) / exact - 1) for key, record in records.items()}


def gigabytes(summary):
    """Of factors that the solves read: what most of the time goes into."""
    return (summary["work"]["dual operator"]["bytes"] + summary["work"]["preconditioner"]["bytes"]) / 1e9


def quiet(record):
    return record["provenance"]["quiet"]


COSTS = {
    "F": ("applications of F", lambda r: r["summary"]["hessian_multiplications"]),
    "gigabytes": ("GB of factors read", lambda r: gigabytes(r["summary"])),
    "memory": ("MiB, all ranks", lambda r: r["summary"]["peak_rss_mb"]),
    "time": ("seconds", lambda r: r["summary"]["time_total"]),
}


def known_costs(records):
    return [name for name in COSTS if name != "time" or all(quiet(record) for record in records.values())]


def picture(case, name, records, error):
    """Error over one cost; a line for each element and QP solver, from mesh to mesh."""
    label, cost = COSTS[name]
    series = []
    for element, solver in itertools.product(ELEMENTS, CASES[case].solvers):
        of = [key for key in sorted(records) if (key[0], key[2], key[3]) == (element, STRICT, solver)]
        if of:
            series.append((f"{element}, {solver}", {cost(records[key]): error[key] for key in of}, False))
    return plot.curves(f"{case}: error against {label}", label, "relative error", series)


HEAD = """\
# Work against precision, measured

Written by `scripts/bench write precision` from the runs in [raw/precision](raw/precision), which `scripts/bench run precision`
measured, all from rest. Newton's tolerance goes with a tolerance of the residual that is a hundredth of it; all else is default.

- *J**: where there is no closed form of what the error is of, it is extrapolated from the three finest meshes of one element,
  J(n) = J* + c n^-p.
- *F*: applications; *GB read*: of factors, in the dual operator and the preconditioner, which stands for time on any machine;
  *MiB*: the largest resident memory, summed over the ranks; *s*: blank where the machine was busy with other work.
"""


def cheapest(records, error):
    """For each wanted error the choice that reaches it at the least cost."""
    names = known_costs(records)
    rows = []
    for wanted in WANTED:
        enough = [(key, record) for key, record in records.items() if error[key] <= wanted]
        cells = []
        for name in names:
            if not enough:
                cells.append("none")
                continue
            (element, n, tolerance, solver), record = min(enough, key=lambda pair: COSTS[name][1](pair[1]))
            cells.append(f"{element}, n = {n}, {solver}, {tolerance}: {COSTS[name][1](record):.3g}")
        rows.append([f"{100 * wanted:g} %", *cells])
    return table(["error at most", *(COSTS[name][0] for name in names)], rows)


def rows(case, records, error):
    order = {element: place for place, element in enumerate(ELEMENTS)}
    for (element, n, tolerance, solver), record in sorted(records.items(), key=lambda pair: (order[pair[0][0]], *pair[0][1:])):
        summary = record["summary"]
        yield [
            f"{element}, n = {n}", tolerance, solver, summary["primal_dofs"], f"{CASES[case].measure(summary):.8g}",
            f"{100 * error[element, n, tolerance, solver]:.3g} %", summary["newton_iterations"],
            summary["hessian_multiplications"], f"{gigabytes(summary):.1f}", f"{summary['peak_rss_mb']:.0f}",
            f"{summary['time_total']:.2f}" if quiet(record) else "",
        ]


def told(found):
    """The limits, and how far they are apart."""
    text = "; ".join(f"{element}: J* = {exact:.8g}, order p = {order:.2f}" for element, (exact, order) in found.items())
    if len(found) < 2:
        return f"{text}.\n"
    (one, _), (other, _) = list(found.values())[:2]
    text += f". The first is used. They differ by {100 * abs(one / other - 1):.2g} %: errors that are not larger than some"
    return f"{text} times this mean nothing.\n"


def section(case, records):
    """Text and pictures of a case; none where there is nothing to compare with."""
    about, exact = CASES[case].about, CASES[case].exact
    text = [f"## {case}\n", f"{about[0].upper()}{about[1:]}.\n"]
    if exact is None:
        found = limits(records)
        if not found:
            return text + ["Not enough meshes were measured to extrapolate.\n"], {}
        exact = next(iter(found.values()))[0]
        text.append(told(found))
    else:
        text.append(f"Closed form: {exact:.8g}.\n")
    error = errors(case, records, exact)
    text.append(cheapest(records, error))
    prefix = "precision" if case == "two-blocks" else f"precision-{case}"
    # Lines need runs of the strict tolerance.
    drawn = known_costs(records) if any(key[2] == STRICT for key in records) else []
    files = {RESULTS / f"{prefix}-{name.lower()}.svg": picture(case, name, records, error) for name in drawn}
    text += [f"![{path.stem}]({path.name})\n" for path in files]
    head = ["mesh", "Newton tolerance", "QP", "primal unknowns", "value", "error", "Newton steps", "F", "GB read", "MiB", "s"]
    text.append(table(head, rows(case, records, error)))
    missing = [f"{e}, n = {n}, {q}, {t}" for e, n, t, q in kinds(case) if (e, n, t, q) not in records]
    return text + ([f"Not measured yet: {'; '.join(missing)}.\n"] if missing else []), files


def used():
    return [record for records in read(RAW).values() for record in records.values()]


def missing(found):
    names = [case for case in CASES if case not in found]
    return [f"Not measured yet: {', '.join(names)}.\n"] if names else []


def pages(folder=RAW):
    return of_cases(RESULTS / "precision.md", HEAD, read(folder), section, RANKS, missing)
