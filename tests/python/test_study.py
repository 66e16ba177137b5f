"""The arithmetic of the study by counts, on runs that are made up, so that the answers are known."""

import argparse

import pytest

from studies import scaling, study

PROVENANCE = {"commit": "0" * 12, "dirty": False, "cpu": "cpu", "cores": 2, "memory_mb": 1, "rustc": "", "mpi": "", "quiet": True}
PROVENANCE |= {"date": "2026-01-01T00:00:00Z", "load_average": 0.0}
RANKS = [1, 2, 4, 8]


def load(busiest, mean):
    return {"busiest": float(busiest), "mean": float(mean)}


def counts(flops, messages, gathered):
    """Of a phase that has so many flops on the mean rank, a half more on the busiest, and gathers so many bytes."""
    of = {"flops": load(1.5 * flops, flops), "bytes": load(8 * flops, 8 * flops), "messages": load(messages, messages / 2)}
    of |= {"collectives": load(1, 1), "bytes_sent": load(100 * messages, 50 * messages), "bytes_received": load(gathered, gathered)}
    return of | {"largest_message": load(max(100 if messages else 0, gathered), 0)}


def record(scene, width, ranks):
    """Work of 1000 a rank, or in all; and 10 that every rank repeats, with a gather whose length is the number of ranks."""
    local = counts(1000 * width / ranks, 40 if ranks > 1 else 0, 0)
    coarse = counts(10, 0, 800 * ranks if ranks > 1 else 0)
    total = {key: load(*(local[key][k] + coarse[key][k] for k in ("busiest", "mean"))) for key in local}
    summary = {
        "ranks": ranks, "subdomains": 24 * width, "newton_iterations": 3, "hessian_multiplications": 10, "time_total": 1.0,
        "peak_rss_mb": 100.0 * ranks, "peak_private_mb": 60.0 * ranks, "peak_rss_mb_max": 100.0, "time": {}, "counts_total": total,
        "counts": {"dual operator": local, "coarse problem": coarse},
        "partners": load(4, 2) if ranks > 1 else load(0, 0),
    }
    label = {"scene": scene, "options": study.LOOSE, "level": 1, "width": width, "cells": 2, "ranks": ranks}
    return label | {"exit_code": 0, "seconds": 1.0, "summary": summary, "repetition": 1, "provenance": PROVENANCE}


@pytest.fixture
def folder(records):
    strong = [record("two-blocks", 1, ranks) for ranks in RANKS]
    return records(strong + [record("slice", ranks, ranks) for ranks in RANKS])


def test_repeated_work_is_what_all_ranks_do_more_than_the_fewest(folder):
    strong, weak = (study.Curve(curve.kind, curve.groups, curve.weak) for curve in scaling.curves(scaling.read(folder)))
    assert (strong.weak, weak.weak) == (False, True)
    assert strong.together(8, "flops") == pytest.approx((1000 + 8 * 10) / 1010)
    assert weak.together(8, "flops") == pytest.approx(1.0)
    assert study.of_operator(strong.groups[8]) == 4.0
    assert study.size(strong.groups[8]) == 100.0


def test_what_grows_with_the_ranks_is_named_and_what_does_not_is_not(folder):
    pages = study.pages(folder, folder)
    page = pages[folder / "study.md"]
    grown = page.partition("## What grows")[2].partition("![")[0].splitlines()
    assert [line for line in grown if line.startswith("| coarse problem")][0].endswith("| with the ranks |")
    assert [line for line in grown if line.startswith("| dual operator")][0].endswith("|  |")
    assert {path.name for path in pages if path.suffix == ".svg"} == {
        f"study-{name}.svg" for name in ("balance-strong", "balance-weak", "work", "partners", "sizes", "memory")
    }
    assert all("nan" not in text and "<polyline" in text for path, text in pages.items() if path.suffix == ".svg")


def test_seconds_are_shown_where_each_rank_has_a_core(folder):
    rows = [line.split(" | ") for line in study.pages(folder, folder)[folder / "study.md"].splitlines() if "| 24 | 3 | 10 |" in line]
    assert [row[-1].strip(" |") for row in rows[:4]] == ["1", "1", "", ""]


def test_runs_are_those_of_both_kinds_with_wider_slices():
    asked = argparse.Namespace(kinds=["strong", "weak"], ranks=[[1, 2], [8]], strong_level=2, cells=2)
    found = [(run.label["scene"], run.label["width"], run.ranks) for run in study.runs(asked)]
    assert found == [("two-blocks", 1, 1), ("two-blocks", 1, 2), ("two-blocks", 1, 8), ("slice", 1, 1), ("slice", 2, 2), ("slice", 8, 8)]
    widest = list(study.runs(asked))[-1].options
    assert "body.upper.brick.cells.1=16" in widest and "body.lower.brick.size.1=4000.0" in widest
