"""The arithmetic of the studies `scaling` and `model`, on runs that are made up, so that the answers are known."""

import pytest

from studies import model, scaling

PARTS = {"factorisation": 3e-3, "dual operator": 5e-3, "preconditioner": 4e-3, "coarse problem": 1e-3, "output": 2e-4}
"""Seconds of a subdomain, on one rank."""
PROVENANCE = {"commit": "0" * 12, "dirty": False, "cpu": "cpu", "cores": 2, "memory_mb": 1, "rustc": "", "mpi": "", "quiet": True}
PROVENANCE |= {"date": "2026-01-01T00:00:00Z", "load_average": 0.0}
KINDS = [(1, 1, 1), (1, 1, 2), (1, 2, 2), (2, 1, 1), (2, 1, 2), (3, 1, 1), (3, 1, 2)]
"""Level, width and ranks."""


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
    summary["time"] = {name: seconds * subdomains / ranks for name, seconds in PARTS.items()}
    summary["time_total"] = sum(summary["time"].values())
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


def test_speed_up_is_work_over_time_and_ideal_where_time_is(groups):
    strong, weak = (next(curve for curve in scaling.curves(groups) if curve.weak == wanted) for wanted in (False, True))
    one, two, wide = (groups[key].median() for key in ((strong.kind, 1), (strong.kind, 2), (strong.kind._replace(width=2), 2)))
    assert strong.speed_up(2) == close(one / two)
    assert strong.efficiency(1) == close(1.0)
    assert weak.efficiency(2) == close(one / wide)
    assert sum(scaling.phases(groups[strong.kind, 1]).values()) == close(one)


def test_times_of_runs_on_a_busy_machine_are_told_apart(records):
    folder = records([record(*kind) | {"provenance": PROVENANCE | {"quiet": False}} for kind in KINDS])
    assert "Other work ran beside" in scaling.pages(folder, folder)[folder / "scaling.md"]


def test_a_fit_finds_the_units_that_runs_were_made_of_and_none_below_zero():
    rows = [[1.0, 2.0, 5.0], [2.0, 1.0, 7.0], [4.0, 9.0, 1.0], [3.0, 3.0, 3.0]]
    assert model.fit(rows, [sum(x * u for x, u in zip(row, (0.5, 0.0, 2.0))) for row in rows]) == pytest.approx([0.5, 0.0, 2.0], abs=1e-6)
    # Relative errors count: 1 of 1 as much as 4 of 4.
    assert model.fit([[1.0], [1.0]], [1.0, 2.0])[0] == close((1 + 0.5) / (1 + 0.25))


def test_units_are_straight_in_logarithms_between_sizes_and_constant_beyond():
    found = {100: {"a": 1.0}, 10_000: {"a": 3.0}}
    values = [model.units_at(found, size)["a"] for size in (10, 100, 1000, 10_000, 10**6)]
    assert values == pytest.approx([1.0, 1.0, 2.0, 3.0, 3.0])


def test_counts_grow_to_a_bound_or_not_at_all():
    points = [(s, 16.0 / (1 + 2 * s ** (-1 / 3))) for s in (8, 1000, 64)]
    assert model.growth(points) == pytest.approx([16.0, 2.0])
    assert model.applications_of(5, [16.0, 2.0], 8) == close(5 * 8.0)
    assert model.growth([(1, 60.0), (8, 40.0)]) == [close(48.0), 0.0]


def test_levels_of_a_cascade_are_the_first_those_between_and_the_last():
    assert [model.place_of(k, 4) for k in range(4)] == [0, 1, 1, 2]
    assert model.place_of(0, 1) == 2


def test_a_record_is_forecast_from_its_amounts():
    amounts = [{"of": "rows", "per": per, "amount": 2.0} for per in ("run", "step", "application")]
    levels = [{"subdomains": 1, "amounts": amounts}, {"subdomains": 8, "amounts": [*amounts, {"of": "bytes", "per": "run", "amount": 3.0}]}]
    record = {"summary": {"primal_dofs": 80, "subdomains": 8, "forecast": {"levels": levels}}}
    units = {10: {("rows", "run"): 1.0, ("rows", "step"): 0.1, ("rows", "application"): 0.01, ("bytes", "run"): 5.0}}
    steps, applications = [2, 3, 4], [[5, 0], [1, 0], [10, 2]]
    last = 4 * 10 / (1 + 2 / 2)
    total, messages, count = model.forecast(record, units, steps, applications)
    assert (messages, count) == (15.0, close(last))
    assert total == close(2 * (1 + 0.2 + 0.1) + 2 * (1 + 0.4 + 0.01 * last) + 15)


def test_scenes_are_cut_into_whole_boxes_on_every_level():
    for boxes, cells in (((25, 10, 16), 10), ((10, 5, 8), 10), ((4, 1, 1), 10), ((42, 14, 14), 5)):
        options = model.scene(boxes, cells, "8")
        level = int(options[options.index("--level") + 1])
        counts = [int(n) for n in options[4].partition("[")[2].strip("]").split(",")]
        assert [n * level for n in counts] == [cells * n for n in boxes]
