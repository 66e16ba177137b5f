#!/usr/bin/env python3
"""Errors of the program against closed forms, with each element, on meshes that get finer.

    scripts/verification.py run [CASE ...] [--np 2] [--quiet]    runs `fetiplast verify`, keeps bench-results/verification.json
    scripts/verification.py write [--check]                      makes bench-results/verification.md of it, or only says whether it is up to date

All cases take minutes. Needs a release build. With --quiet nothing else runs, and times mean something.
"""

import json
import math
import pathlib
import subprocess
import sys
import tempfile

from bench import cost, pages
from bench.markdown import table

ROOT = pathlib.Path(__file__).resolve().parent.parent
RECORDS = ROOT / "bench-results/verification.json"
TABLE = ROOT / "bench-results/verification.md"

INTRODUCTION = """# The program against closed forms

Written by `scripts/verification.py write` from [verification.json](verification.json), which `scripts/verification.py run`
measured on {ranks} ranks. Relative errors, with counts of Newton steps and applications of F; in brackets the observed order
between a mesh and the one before. *effectivity*: the error estimate of the run over the error, both of the stress in the norm of
its complementary energy. Below each table what is demanded; *missed* demands make `fetiplast verify` fail.
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


def run(cases, ranks, quiet):
    """Results of the cases replace those of earlier runs."""
    records = json.loads(RECORDS.read_text()) if RECORDS.exists() else {"cases": []}
    with tempfile.TemporaryDirectory() as directory:
        summary = pathlib.Path(directory) / "summary.json"
        command = ["mpirun", "-np", str(ranks), str(ROOT / "target/release/fetiplast"), "verify"]
        # A missed demand is a result too.
        subprocess.run([*command, "--summary", str(summary), *cases], check=False)
        new = json.loads(summary.read_text())
    for case in new["cases"]:
        case["quiet"] = quiet
    measured = {case["case"] for case in new["cases"]}
    order = list(dict.fromkeys(case["case"] for case in records["cases"] + new["cases"]))
    all_cases = [case for case in records["cases"] if case["case"] not in measured] + new["cases"]
    all_cases.sort(key=lambda case: order.index(case["case"]))
    RECORDS.write_text(json.dumps({"ranks": ranks, "cases": all_cases}, indent=1) + "\n")


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
    quiet = all(case["quiet"] for case in elements)
    return PRICES.format(names=", ".join(names)) + "\n" + cost.page(rows, names, quiet)


def contents():
    records = json.loads(RECORDS.read_text())
    text = INTRODUCTION.format(ranks=records["ranks"])
    for name in dict.fromkeys(case["case"] for case in records["cases"]):
        elements = [case for case in records["cases"] if case["case"] == name]
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
    return {TABLE: text}


SWITCHES = {"quiet": "nothing else runs: times are shown"}

if __name__ == "__main__":
    sys.exit(pages.run_or_write(__doc__.splitlines()[0], "scripts/verification.py", "CASE", run, contents, SWITCHES))
