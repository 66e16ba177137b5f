#!/usr/bin/env python3
"""The arithmetic of scripts/study and scripts/model on runs that are made up, so that the answers are known."""

import json
import math
import pathlib
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "scripts"))

from bench import model, scaling, widen

UNITS = {"factors": 1e-10, "operator": 2e-10, "preconditioner": 3e-10, "elements": 4e-6, "products": 5e-8}
UNITS |= {"projections": 6e-8, "coarse": 1.0, "output": 7e-7}
PROVENANCE = {"commit": "0" * 12, "dirty": False, "cpu": "cpu", "cores": 2, "memory_mb": 1, "rustc": "", "mpi": "", "quiet": True}


def record(level, width, ranks, coarse):
    """A run that costs what the model says."""
    subdomains = 6 * level**3 * width
    summary = {
        "subdomains": subdomains, "primal_dofs": 4000 * subdomains, "dual_dofs": 700 * subdomains, "ranks": ranks,
        "newton_iterations": 7, "hessian_multiplications": 60 + 10 * level, "preconditioner_applications": 40 + 10 * level,
        "active_set_iterations": 20, "peak_rss_mb": 100.0 * ranks, "cascade": [],
        "communication": {"collectives": {"calls": 500}},
        "work": {
            "factorisation": {"flops": 2e9 * subdomains}, "factorisation of the interior": {"flops": 1e9 * subdomains},
            "dual operator": {"bytes": 5e8 * subdomains}, "preconditioner": {"bytes": 3e8 * subdomains},
        },
    }
    parts = model.predict(UNITS, model.Amounts.of(summary), ranks, coarse)
    names = {name: phases[0] for name, phases in model.PHASES.items()} | {"coarse": "coarse set-up"}
    summary["time"] = {names[part]: seconds for part, seconds in parts.items()}
    summary["time_total"] = sum(parts.values())
    of_run = {"exit_code": 0, "seconds": summary["time_total"], "summary": summary, "repetition": 1}
    where = PROVENANCE | {"date": "2026-01-01T00:00:00Z", "load_average": 0.0}
    label = {"scene": "two-blocks", "options": "", "level": level, "width": width, "cells": 10, "ranks": ranks}
    return label | of_run | {"provenance": where}


def close(found, expected):
    assert math.isclose(found, expected, rel_tol=1e-9), f"{found} is not {expected}"


coarse = model.Coarse(model.RESULTS / "kernels.jsonl")
for points in (coarse.setup.points, coarse.solve.points):
    curve = coarse.setup if points is coarse.setup.points else coarse.solve
    for subdomains, value in points:
        close(curve(subdomains), value)
last, value = coarse.setup.points[-1]
close(coarse.setup(10 * last), 100 * value)

with tempfile.TemporaryDirectory() as name:
    folder = pathlib.Path(name)
    kinds = [(1, 1, 1), (1, 1, 2), (1, 2, 2), (2, 1, 1), (2, 1, 2), (3, 1, 1), (3, 1, 2)]
    lines = [json.dumps(record(*kind, coarse)) for kind in kinds]
    (folder / "a.jsonl").write_text("\n".join(lines) + "\n")
    groups = scaling.read(folder)
    assert len(groups) == len(kinds)

    # The unit costs come back, and the largest problem, which is held back, is predicted.
    known, held = model.split(list(groups.values()))
    assert len(held) == 2 and all(group.first["subdomains"] == 162 for group in held)
    units = model.calibrate(known, coarse)
    for part, unit in UNITS.items():
        close(units[part], unit)
    assert "Largest error of a run held back: 0 %." in model.contents(folder, folder)[folder / "model.md"]

    # Speed-up: work over time, and ideal where time is.
    strong, weak = (next(curve for curve in scaling.curves(groups) if curve.weak == wanted) for wanted in (False, True))
    one, two, wide = (groups[key].median() for key in ((strong.kind, 1), (strong.kind, 2), (strong.kind._replace(width=2), 2)))
    close(strong.speed_up(2), one / two)
    close(strong.efficiency(1), 1.0)
    close(weak.efficiency(2), one / wide)
    close(sum(scaling.phases(groups[strong.kind, 1]).values()), one)

    # Times of runs on a busy machine are told apart, and nothing is predicted from them.
    busy = [json.loads(line) for line in lines]
    for run in busy:
        run["provenance"]["quiet"] = False
    (folder / "a.jsonl").write_text("".join(json.dumps(run) + "\n" for run in busy))
    assert "Other work ran beside" in scaling.contents(folder, folder)[folder / "scaling.md"]
    assert model.contents(folder, folder) == {}

close(model.fit([2.0, 2.0]), 0.5)

wide = widen.options("two-blocks", 3)
for name in ("lower", "upper"):
    assert f"body.{name}.brick.size.1=3000.0" in wide and f"body.{name}.brick.cells.1=30" in wide
print("Studies and model: passed.")
