"""What the study `hard` says, on runs that are made up, so that the answers are known."""

import pytest

from studies import hard


def case(name, energy, tight=False, applications=100, code=0, residual=1e-9, date="2026-01-01T00:00:00Z", error="no descent"):
    summary = {
        "converged": code == 0, "error": None if code == 0 else error, "energy": energy, "newton_iterations": 7,
        "smalse_iterations": 0, "active_set_iterations": 9, "hessian_multiplications": applications,
        "error_algebraic": 1e-5,
    }
    summary |= {f"residual_{name}": residual for name in hard.RESIDUALS}
    provenance = {"commit": "0" * 12, "date": date, "quiet": False}
    label = {"case": name, "tight": tight, "ranks": 2}
    return label | {"exit_code": code, "seconds": 1.0, "summary": summary, "provenance": provenance}


@pytest.fixture
def page(records):
    base = [case("benchmark", -1.0001, applications=50), case("benchmark", -1.0, tight=True)]
    return lambda *more: hard.pages(records([*base, *more]))[hard.RESULTS / "hard.md"]


def test_growth_is_told_from_three_times_on_and_again_from_six(page):
    assert "No case takes more than 3 times" in page(case("nu 0.49", -2.0, applications=150))
    text = page(case("nu 0.49", -2.0, applications=155), case("nu 0.499", -2.0, applications=305))
    assert "More than 3 times the applications of F: nu 0.499 (6.1), nu 0.49 (3.1). More than 6 times: nu 0.499.\n" in text
    assert "| 1.0e-04 |" in text and "Every case that was measured ended as expected." in text


def test_of_two_records_the_later_one_counts(page):
    later = case("nu 0.49", -2.0, applications=60, date="2026-01-02T00:00:00Z")
    assert "No case takes more" in page(later, case("nu 0.49", -2.0, applications=400))


ABOVE = "H = 0, above the limit load"


@pytest.mark.parametrize(
    "wrong",
    [
        case("nu 0.49", -2.0, code=1),
        case("nu 0.49", -2.0, residual=1e-5),
        case(ABOVE, -2.0),
        case(ABOVE, -2.0, code=1),
    ],
    ids=["not converged", "large residual", "converged", "says nothing of the limit load"],
)
def test_what_ends_otherwise_is_told(page, wrong):
    assert f"Not as expected: {wrong['case']}.\n" in page(wrong)


def test_what_should_not_converge_must_say_why(page):
    why = "the limit load is in between"
    text = page(case(ABOVE, -2.0, code=1, error=why))
    assert "Every case that was measured ended as expected." in text and f"- {ABOVE}: {why}" in text


def test_in_metres_the_energy_is_a_thousandth(page):
    units = "m, Pa in place of mm, MPa"
    assert f"| {units} | benchmark | 2.0e-06 |" in page(case(units, -1.000002e-3, tight=True))


def test_a_third_of_a_turn_around_the_diagonal_takes_z_to_x():
    assert hard.turned([0.0, 0.0, 1.0], [1.0, 1.0, 1.0], 120.0) == pytest.approx([1.0, 0.0, 0.0], abs=1e-14)


def test_cases_refer_to_each_other_by_names_that_are_unique():
    names = [case.name for case in hard.CASES]
    assert len(set(names)) == len(names)
    for case in hard.CASES:
        assert {case.beside, *(case.same or [case.beside])[:1]} <= set(names), case.name
