"""Errors of the program against closed forms, with each element, on meshes that get finer.

Runs `fetiplast verify`; all cases take minutes.
"""

import json
import math
import pathlib
import subprocess
import tempfile

from . import cost, measure
from .measure import RESULTS
from .pages import table

RAW = measure.RAW / "verification"
CASES = [
    "uniaxial", "biaxial", "shear", "plane-strain", "patch-elastic", "patch-plastic", "manufactured-elastic",
    "manufactured-plastic", "manufactured-front", "sphere-elastic", "sphere-plastic", "sphere-unloaded",
    "nested-spheres", "cylinder-elastic", "cylinder-plastic", "limit-sphere", "limit-cylinder", "limit-footing", "hertz",
]
"""In the order of the page; any more of `fetiplast verify` stand behind."""

INTRODUCTION = """# The program against closed forms

Written by `scripts/bench write verification` from the runs in [raw/verification](raw/verification), which
`scripts/bench run verification` measured on {ranks} ranks. Relative errors, with counts of Newton steps and applications of F; in
brackets the observed order between a mesh and the one before. *effectivity*: the error estimate of the run over the error, both
of the stress in the norm of its complementary energy. Below each table what is demanded; *missed* demands make `fetiplast verify`
fail.
"""

RATIOS = ["effectivity"]
"""They have no order."""

TOGETHER = {"nested-spheres": ["interface moved", "contact pressure", "plastic front"]}
"""Quantities that one mesh should know to a percent."""

PRICES = """### One percent

The first mesh on which these are all within 1 %: {names}. Where none is fine enough, the finest one, and below it (*~*) what errors
and costs come to with their orders between the last two meshes; an error that does not fall is not extrapolated. Linear elements
yield as a whole, so they know a front to half a cell. *GB read*: of factors, by the dual operator and the preconditioner.
"""


def arguments(parser):
    parser.add_argument("cases", nargs="*", metavar="CASE", help=f"of {', '.join(CASES)}; without one all")
    parser.add_argument("--np", type=int, default=2, help="ranks")
    measure.add_arguments(parser)


def run(arguments):
    program, started = measure.Program(arguments), measure.now()
    with tempfile.TemporaryDirectory() as directory:
        summary = pathlib.Path(directory) / "summary.json"
        command = [*program.on(arguments.np), "verify", "--summary", str(summary), *arguments.cases]
        # A missed demand is a result too.
        code = subprocess.run(command, env=program.environment, check=False).returncode
        found = json.loads(summary.read_text())
    provenance = {"date": measure.date(started), **program.provenance(found)}
    records = program.records(RAW)
    for case in found["cases"]:
        records.add({**case, "ranks": arguments.np, "provenance": provenance})
    return code


def read():
    """The last record of each case and element."""
    found = {(record["case"], record["element"]): record for record in measure.read(RAW)}
    order = [*CASES, *(case for case, _ in found)]
    return sorted(found.values(), key=lambda record: order.index(record["case"]))


used = read


def cell(row, before, name):
    error = row["errors"][name]
    if error is None:
        return "-"
    if name in RATIOS:
        return f"{error:.2f}"
    text = f"{error:.1e}"
    earlier = before and before["errors"][name]
    if earlier and abs(error) > 1e-8:
        order = math.log(abs(earlier / error)) / math.log(row["level"] / before["level"])
        text += f" ({order:.2f})"
    return text


def prices(elements, names):
    rows = {case["element"]: case["rows"] for case in elements}
    quiet = all(case["provenance"]["quiet"] for case in elements)
    return PRICES.format(names=", ".join(names)) + "\n" + cost.page(rows, names, quiet)


def pages():
    records = read()
    text = INTRODUCTION.format(ranks=" or ".join(str(n) for n in sorted({record["ranks"] for record in records})))
    for name in dict.fromkeys(record["case"] for record in records):
        elements = [record for record in records if record["case"] == name]
        errors = list(elements[0]["rows"][0]["errors"])
        rows, demands = [], []
        for case in elements:
            before = None
            for row in case["rows"]:
                numbers = [row["level"], row["nodes"], row["newton_iterations"], row["hessian_multiplications"]]
                rows.append([case["element"], *numbers, *(cell(row, before, error) for error in errors)])
                before = row
            met = [f"{'' if verdict['met'] else '**missed** '}{verdict['text']}" for verdict in case["verdicts"]]
            demands.append(f"- {case['element']}: " + ("; ".join(met) or "nothing demanded"))
        text += f"\n## {name}\n\n" + elements[0]["about"] + "\n\n"
        text += table(["element", "level", "nodes", "Newton", "F", *errors], rows) + "\n" + "\n".join(demands) + "\n"
        if name in TOGETHER:
            text += "\n" + prices(elements, TOGETHER[name])
    return {RESULTS / "verification.md": text}
