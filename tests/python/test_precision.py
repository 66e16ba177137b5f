"""What the study `precision` says, on runs that are made up, so that the answers are known."""

import pytest

from studies import precision


def record(label, energy, applications):
    summary = {
        "energy": energy, "newton_iterations": 7, "hessian_multiplications": applications, "primal_dofs": 10,
        "work": {"dual operator": {"bytes": 2e9}, "preconditioner": {"bytes": 1e9}}, "peak_rss_mb": 50.0, "time_total": 1.0,
    }
    provenance = {"commit": "0" * 12, "date": "2026-01-01T00:00:00Z", "quiet": False}
    return label | {"exit_code": 0, "seconds": 1.0, "summary": summary, "provenance": provenance}


def label(case, element, cells):
    return {"case": case, "element": element, "cells": cells, "tolerance": "1e-4", "qp": "active-set", "ranks": 2}


@pytest.mark.parametrize("sizes", [[5, 10, 20], [5, 10, 15], [3, 5, 10, 15]])
def test_extrapolation_gives_back_limit_and_order(sizes):
    exact, order = precision.extrapolate({n: -3.0 + 7.0 * n**-1.3 for n in sizes})
    assert exact == pytest.approx(-3.0, rel=1e-10) and order == pytest.approx(1.3, rel=1e-9)


@pytest.mark.parametrize("energies", [{5: 1.0, 10: 0.5}, {5: 1.0, 10: 0.5, 20: 2.0}])
def test_extrapolation_refuses_what_does_not_converge(energies):
    assert precision.extrapolate(energies) is None


def test_errors_are_against_the_extrapolated_limit(records):
    meshes = precision.CASES["two-blocks"].meshes
    made = [
        record(label("two-blocks", element, n), -1.0 * (1 - 0.25 * n**-2.0), n) for element, sizes in meshes.items() for n in sizes
    ]
    files = precision.pages(records(made))
    page = files[precision.RESULTS / "precision.md"]
    # 0.25 n^-2 of 1.
    assert "| tet4, n = 5 | 1e-4 | active-set | 10 | -0.99 | 1 % | 7 | 5 | 3.0 |" in page
    assert "Not measured yet: tet4, n = 5, active-set, 1e-2; hex8, n = 5, active-set, 1e-2; tet10" in page, "of 1e-4 all are there"
    assert "J* = -1, order p = 2.00" in page
    assert precision.RESULTS / "precision-time.svg" not in files, "other work ran beside"
    assert "Not measured yet: nested-spheres, limit-sphere." in page


def test_the_limit_pressure_is_where_the_history_ended(records):
    """Half-way from 560 to 720; the closed form is 623.8."""
    history = record(label("limit-sphere", "hex8", 2), -1.0, 30) | {"exit_code": 1}
    history["summary"]["steps"] = [{"time": 1.5, "converged": True}, {"time": 1.75, "converged": False}]
    page = precision.pages(records([history]))[precision.RESULTS / "precision.md"]
    assert "Closed form: 623.83246." in page and "| hex8, n = 2 | 1e-4 | active-set | 10 | 640 | 2.59 % |" in page
