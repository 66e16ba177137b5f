#!/usr/bin/env python3
"""Errors of the program against closed forms, with each element, on meshes that get finer.

    scripts/verification.py run [CASE ...] [--np 2]    runs `fetiplast verify`, keeps bench-results/verification.json
    scripts/verification.py write [--check]            makes bench-results/verification.md of it, or only says whether it is up to date

All cases take minutes. Needs a release build.
"""

import json
import math
import pathlib
import subprocess
import sys
import tempfile

from bench import pages
from bench.markdown import table

ROOT = pathlib.Path(__file__).resolve().parent.parent
RECORDS = ROOT / "bench-results/verification.json"
TABLE = ROOT / "bench-results/verification.md"

INTRODUCTION = """# The program against closed forms

Written by `scripts/verification.py write` from [verification.json](verification.json), which `scripts/verification.py run`
measured on {ranks} ranks. Relative errors, with counts of Newton steps and applications of F; in brackets the observed order
between a mesh and the one before. Below each table what is demanded; *missed* demands make `fetiplast verify` fail.
"""


def run(cases, ranks):
    """Results of the cases replace those of earlier runs."""
    records = json.loads(RECORDS.read_text()) if RECORDS.exists() else {"cases": []}
    with tempfile.TemporaryDirectory() as directory:
        summary = pathlib.Path(directory) / "summary.json"
        command = ["mpirun", "-np", str(ranks), str(ROOT / "target/release/fetiplast"), "verify"]
        # A missed demand is a result too.
        subprocess.run([*command, "--summary", str(summary), *cases], check=False)
        new = json.loads(summary.read_text())
    measured = {case["case"] for case in new["cases"]}
    order = list(dict.fromkeys(case["case"] for case in records["cases"] + new["cases"]))
    all_cases = [case for case in records["cases"] if case["case"] not in measured] + new["cases"]
    all_cases.sort(key=lambda case: order.index(case["case"]))
    RECORDS.write_text(json.dumps({"ranks": ranks, "cases": all_cases}, indent=1) + "\n")


def cell(row, before, name):
    error = row["errors"][name]
    if error is None:
        return "-"
    text = f"{error:.1e}"
    earlier = before and before["errors"][name]
    if earlier and abs(error) > 1e-8:
        order = math.log(abs(earlier / error)) / math.log(row["level"] / before["level"])
        text += f" ({order:.2f})"
    return text


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
    return {TABLE: text}


if __name__ == "__main__":
    sys.exit(pages.run_or_write(__doc__.splitlines()[0], "scripts/verification.py", "CASE", run, contents))
