#!/usr/bin/env python3
"""What scripts/hard says, on runs that are made up, so that the answers are known."""

import json
import math
import pathlib
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "scripts"))

from bench import hard, pages


def case(name, energy, tight=False, applications=100, code=0, residual=1e-9, date="2026-01-01T00:00:00Z", error="no descent"):
    summary = {
        "converged": code == 0, "error": None if code == 0 else error, "energy": energy, "newton_iterations": 7,
        "smalse_iterations": 0, "active_set_iterations": 9, "hessian_multiplications": applications,
    }
    summary |= {f"residual_{name}": residual for name in hard.RESIDUALS}
    provenance = {"commit": "0" * 12, "date": date, "quiet": False}
    label = {"case": name, "tight": tight, "ranks": 2}
    return label | {"exit_code": code, "seconds": 1.0, "summary": summary, "provenance": provenance}


def hard_page(folder, *more):
    base = [case("benchmark", -1.0001, applications=50), case("benchmark", -1.0, tight=True)]
    (folder / "a.jsonl").write_text("".join(json.dumps(record) + "\n" for record in [*base, *more]))
    return hard.contents(folder)[hard.RESULTS / "hard.md"]


with tempfile.TemporaryDirectory() as name:
    folder = pathlib.Path(name)
    # Growth is told from three times on, by how much, and again from six times on.
    assert "No case takes more than 3 times" in hard_page(folder, case("nu 0.49", -2.0, applications=150))
    page = hard_page(folder, case("nu 0.49", -2.0, applications=155), case("nu 0.499", -2.0, applications=305))
    assert "More than 3 times the applications of F: nu 0.499 (6.1), nu 0.49 (3.1). More than 6 times: nu 0.499.\n" in page
    assert "| 1.0e-04 |" in page and "Every case that was measured ended as expected." in page
    # Of two records the later one counts.
    later = case("nu 0.49", -2.0, applications=60, date="2026-01-02T00:00:00Z")
    assert "No case takes more" in hard_page(folder, later, case("nu 0.49", -2.0, applications=400))
    # What should converge must, with small residuals; what should not must not, and say why.
    above, why = "H = 0, above the limit load", "the limit load is in between"
    failed = case("nu 0.49", -2.0, code=1)
    for wrong in (failed, case("nu 0.49", -2.0, residual=1e-5), case(above, -2.0), case(above, -2.0, code=1)):
        assert f"Not as expected: {wrong['case']}.\n" in hard_page(folder, wrong)
    page = hard_page(folder, case(above, -2.0, code=1, error=why))
    assert "Every case that was measured ended as expected." in page and f"- {above}: {why}" in page
    # In metres the energy is a thousandth.
    units = "m, Pa in place of mm, MPa"
    assert f"| {units} | benchmark | 2.0e-06 |" in hard_page(folder, case(units, -1.000002e-3, tight=True))

turned = hard.turned([0.0, 0.0, 1.0], [1.0, 1.0, 1.0], 120.0)
assert all(math.isclose(found, exact, abs_tol=1e-14) for found, exact in zip(turned, [1.0, 0.0, 0.0])), "z becomes x"
assert len({case.name for case in hard.CASES}) == len(hard.CASES)
for case_ in hard.CASES:
    assert {case_.beside, *(case_.same or [case_.beside])[:1]} <= {other.name for other in hard.CASES}, case_.name

with tempfile.TemporaryDirectory(dir=hard.ROOT) as name:
    file = pathlib.Path(name) / "page.md"
    assert [pages.write({file: "x"}, "it", only_check) for only_check in (True, False, True)] == [1, 0, 0]
    assert pages.write({file: "y"}, "it", only_check=True) == 1 and file.read_text() == "x"
print("Hard cases: passed.")
