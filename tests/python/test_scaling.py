"""The arithmetic of the studies `scaling` and `model`, on runs that are made up, so that the answers are known."""

import pytest

from studies import kernels, model, scaling

UNITS = {"factors": 1e-10, "operator": 2e-10, "preconditioner": 3e-10, "elements": 4e-6, "products": 5e-8}
UNITS |= {"projections": 6e-8, "coarse": 1.0, "output": 7e-7}
PROVENANCE = {"commit": "0" * 12, "dirty": False, "cpu": "cpu", "cores": 2, "memory_mb": 1, "rustc": "", "mpi": "", "quiet": True}
PROVENANCE |= {"date": "2026-01-01T00:00:00Z", "load_average": 0.0}
KINDS = [(1, 1, 1), (1, 1, 2), (1, 2, 2), (2, 1, 1), (2, 1, 2), (3, 1, 1), (3, 1, 2)]
"""Level, width and ranks."""
COARSE = model.Coarse(kernels.newest())


def record(level, width, ranks):
    """A run that costs what the model says."""
    subdomains = 6 * level**3 * width
    summary = {
        "subdomains": subdomains, "primal_dofs": 4000 * subdomains, "dual_dofs": 700 * subdomains, "ranks": ranks,
        "newton_iterations": 7, "hessian_multiplications": 60 + 10 * level, "preconditioner_applications": 40 + 10 * level,
        "active_set_iterations": 20, "peak_rss_mb": 100.0 * ranks, "cascade": [],
        "communication": {"collectives": {"calls": 500, "seconds": 0.0}}, "peak_rss_mb_max": 100.0,
        "work": {
            "factorisation": {"flops": 2e9 * subdomains}, "factorisation of the interior": {"flops": 1e9 * subdomains},
            "dual operator": {"bytes": 5e8 * subdomains}, "preconditioner": {"bytes": 3e8 * subdomains},
        },
    }
    parts = model.predict(UNITS, model.Amounts.of(summary), ranks, COARSE)
    names = {name: phases[0] for name, phases in model.PHASES.items()} | {"coarse": "coarse set-up"}
    summary["time"] = {names[part]: seconds for part, seconds in parts.items()}
    summary["time_total"] = sum(parts.values())
    of_run = {"exit_code": 0, "seconds": summary["time_total"], "summary": summary, "repetition": 1}
    label = {"scene": "two-blocks", "options": "", "level": level, "width": width, "cells": 10, "ranks": ranks}
    return label | of_run | {"provenance": PROVENANCE}


def close(value):
    return pytest.approx(value, rel=1e-9)


@pytest.fixture
def folder(records):
    return records([record(*kind) for kind in KINDS])


@pytest.fixture
def groups(folder):
    return scaling.read(folder)


@pytest.mark.parametrize("curve", [COARSE.setup, COARSE.solve], ids=["set-up", "solve"])
def test_curves_of_the_coarse_problem_go_through_what_was_measured(curve):
    for subdomains, value in curve.points:
        assert curve(subdomains) == close(value)


def test_the_set_up_of_the_coarse_problem_grows_with_the_square_beyond():
    last, value = COARSE.setup.points[-1]
    assert COARSE.setup(10 * last) == close(100 * value)


def test_unit_costs_come_back_and_the_largest_problem_is_predicted(folder, groups):
    assert len(groups) == len(KINDS)
    known, held = model.split(list(groups.values()))
    assert len(held) == 2 and all(group.first["subdomains"] == 162 for group in held)
    units = model.calibrate(known, COARSE)
    assert {part: units[part] for part in UNITS} == close(UNITS)
    assert "Largest error of a run held back: 0 %." in model.pages(folder, folder)[folder / "model.md"]


def test_speed_up_is_work_over_time_and_ideal_where_time_is(groups):
    strong, weak = (next(curve for curve in scaling.curves(groups) if curve.weak == wanted) for wanted in (False, True))
    one, two, wide = (groups[key].median() for key in ((strong.kind, 1), (strong.kind, 2), (strong.kind._replace(width=2), 2)))
    assert strong.speed_up(2) == close(one / two)
    assert strong.efficiency(1) == close(1.0)
    assert weak.efficiency(2) == close(one / wide)
    assert sum(scaling.phases(groups[strong.kind, 1]).values()) == close(one)


def test_times_of_runs_on_a_busy_machine_are_told_apart_and_predict_nothing(records):
    folder = records([record(*kind) | {"provenance": PROVENANCE | {"quiet": False}} for kind in KINDS])
    assert "Other work ran beside" in scaling.pages(folder, folder)[folder / "scaling.md"]
    assert model.pages(folder, folder) == {}


def test_a_fit_weighs_relative_errors():
    assert model.fit([2.0, 2.0]) == close(0.5)


def test_bodies_are_widened_with_their_cells():
    wide = scaling.widened("two-blocks", 3)
    for name in ("lower", "upper"):
        assert f"body.{name}.brick.size.1=3000.0" in wide and f"body.{name}.brick.cells.1=30" in wide
