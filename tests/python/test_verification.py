"""What the study `verification` says of the price of one percent, on rows that are made up, so that the answers are known."""

import pytest

from studies import cost

NAMES = ["moved", "pressure"]


def rows(errors, levels=(4, 8, 16)):
    """`errors`: values of both by level."""
    costs = {"primal_dofs": lambda n: n**3, "hessian_multiplications": lambda n: n, "gigabytes": lambda n: n**4, "seconds": lambda n: n**5}
    return [{"level": n, "errors": dict(zip(NAMES, errors(n)))} | {name: of(n) for name, of in costs.items()} for n in levels]


GOOD = rows(lambda n: (0.01 * (8 / n) ** 2, -0.02 * (8 / n)))
POOR = rows(lambda n: (0.02 * (16 / n) ** 2, 0.04 * (16 / n)))
STUCK = rows(lambda n: (0.02, 0.001))


def test_the_first_mesh_that_is_fine_enough_in_both_counts_whatever_the_signs():
    price = cost.cheapest(GOOD, NAMES)
    assert (price.level, price.measured, price.costs["F"], price.costs["GB read"]) == (16, True, 16, 16**4)
    assert price.error == pytest.approx(0.01)
    assert cost.cheapest(GOOD, NAMES[:1]).level == 8


def test_beyond_the_meshes_the_slower_error_decides():
    """0.04 at 16 with order 1 is 0.01 at 64; powers are those of the costs."""
    price = cost.cheapest(POOR, NAMES)
    assert price.level == pytest.approx(64) and not price.measured
    for name, power in {"primal unknowns": 3, "F": 1, "GB read": 4, "s": 5}.items():
        assert price.costs[name] == pytest.approx(64**power, rel=1e-9), name


def test_what_does_not_fall_is_not_extrapolated():
    assert cost.cheapest(STUCK, NAMES) is None


def test_the_table_has_what_was_measured_before_what_is_extrapolated():
    lines = cost.page({"tet10": GOOD, "tet4": POOR, "hex8": STUCK}, NAMES, quiet=False).splitlines()
    assert lines[2:] == [
        "| tet10 | 16 | 1 % | 4096 | 16 | 6.55e+04 | 1 |",
        "| tet4 | 16 | 4 % | 4096 | 16 | 6.55e+04 | 1 |",
        "| tet4 | ~ 64 | 1 % | ~ 262144 | ~ 64 | ~ 1.68e+07 | ~ 256 |",
        "| hex8 | 16 | 2 % | 4096 | 16 | 6.55e+04 | 1 |",
    ]


def test_seconds_are_shown_where_they_were_measured_on_a_quiet_machine():
    assert "| s |" in cost.page({"tet10": GOOD}, NAMES, quiet=True)
    assert "| s |" not in cost.page({"tet10": GOOD}, NAMES, quiet=False)
