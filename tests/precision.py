#!/usr/bin/env python3
"""What scripts/precision says, on runs that are made up, so that the answers are known."""

import json
import math
import pathlib
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "scripts"))

from bench import precision


def record(label, energy, applications):
    summary = {
        "energy": energy, "newton_iterations": 7, "hessian_multiplications": applications, "primal_dofs": 10,
        "work": {"dual operator": {"bytes": 2e9}, "preconditioner": {"bytes": 1e9}}, "peak_rss_mb": 50.0, "time_total": 1.0,
    }
    provenance = {"commit": "0" * 12, "date": "2026-01-01T00:00:00Z", "quiet": False}
    return label | {"exit_code": 0, "seconds": 1.0, "summary": summary, "provenance": provenance}


# Extrapolation gives back limit and order, and refuses what does not converge.
for sizes in ([5, 10, 20], [5, 10, 15], [3, 5, 10, 15]):
    exact, order = precision.extrapolate({n: -3.0 + 7.0 * n**-1.3 for n in sizes})
    assert math.isclose(exact, -3.0, rel_tol=1e-10) and math.isclose(order, 1.3, rel_tol=1e-9)
assert precision.extrapolate({5: 1.0, 10: 0.5}) is None and precision.extrapolate({5: 1.0, 10: 0.5, 20: 2.0}) is None
with tempfile.TemporaryDirectory() as name:
    folder = pathlib.Path(name)
    kinds = [(element, n) for element, sizes in precision.CASES["two-blocks"].meshes.items() for n in sizes]
    labels = [{"element": e, "cells": n, "tolerance": "1e-4", "qp": "active-set", "ranks": 2} for e, n in kinds]
    records = [record(label, -1.0 * (1 - 0.25 * label["cells"] ** -2.0), label["cells"]) for label in labels]
    (folder / "a.jsonl").write_text("".join(json.dumps(record) + "\n" for record in records))
    files = precision.contents(folder)
    page = files[precision.RESULTS / "precision.md"]
    # 0.25 n^-2 of 1.
    assert "| tet4, n = 5 | 1e-4 | active-set | 10 | -0.99 | 1 % | 7 | 5 | 3.0 |" in page, page
    assert "Not measured yet: tet4, n = 5, active-set, 1e-2; hex8, n = 5, active-set, 1e-2; tet10" in page, "of 1e-4 all are there"
    assert "J* = -1, order p = 2.00" in page
    assert precision.RESULTS / "precision-time.svg" not in files, "other work ran beside"
    assert "Not measured yet: nested-spheres, limit-sphere." in page

    # Half-way from 560 to 720 the history ended; the closed form is 623.8.
    label = {"case": "limit-sphere", "element": "hex8", "cells": 2, "tolerance": "1e-4", "qp": "active-set", "ranks": 2}
    history = record(label, -1.0, 30) | {"exit_code": 1}
    history["summary"]["steps"] = [{"time": 1.5, "converged": True}, {"time": 1.75, "converged": False}]
    (folder / "b.jsonl").write_text(json.dumps(history) + "\n")
    page = precision.contents(folder)[precision.RESULTS / "precision.md"]
    assert "Closed form: 623.83246." in page and "| hex8, n = 2 | 1e-4 | active-set | 10 | 640 | 2.59 % |" in page, page
print("Work against precision: passed.")
