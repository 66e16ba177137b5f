#!/usr/bin/env python3
"""What scripts/verification.py says of the price of one percent, on rows that are made up, so that the answers are known."""

import math
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "scripts"))

from bench import cost

NAMES = ["moved", "pressure"]


def rows(errors, levels=(4, 8, 16)):
    """`errors`: values of both by level."""
    costs = {"primal_dofs": lambda n: n**3, "hessian_multiplications": lambda n: n, "gigabytes": lambda n: n**4, "seconds": lambda n: n**5}
    return [{"level": n, "errors": dict(zip(NAMES, errors(n)))} | {name: of(n) for name, of in costs.items()} for n in levels]


# The first mesh that is fine enough in both, whatever the signs.
good = rows(lambda n: (0.01 * (8 / n) ** 2, -0.02 * (8 / n)))
price = cost.cheapest(good, NAMES)
assert (price.level, price.measured, price.costs["F"], price.costs["GB read"]) == (16, True, 16, 16**4)
assert math.isclose(price.error, 0.01)
assert cost.cheapest(good, NAMES[:1]).level == 8
# Beyond the meshes the slower one decides: 0.04 at 16 with order 1 is 0.01 at 64; powers are those of the costs.
poor = rows(lambda n: (0.02 * (16 / n) ** 2, 0.04 * (16 / n)))
price = cost.cheapest(poor, NAMES)
assert math.isclose(price.level, 64) and not price.measured
for name, power in {"primal unknowns": 3, "F": 1, "GB read": 4, "s": 5}.items():
    assert math.isclose(price.costs[name], 64**power, rel_tol=1e-9), name
# What does not fall is not extrapolated.
stuck = rows(lambda n: (0.02, 0.001))
assert cost.cheapest(stuck, NAMES) is None

page = cost.page({"tet10": good, "tet4": poor, "hex8": stuck}, NAMES, quiet=False)
lines = page.splitlines()
assert lines[2] == "| tet10 | 16 | 1 % | 4096 | 16 | 6.55e+04 | 1 |", page
assert lines[3] == "| tet4 | 16 | 4 % | 4096 | 16 | 6.55e+04 | 1 |", page
assert lines[4] == "| tet4 | ~ 64 | 1 % | ~ 262144 | ~ 64 | ~ 1.68e+07 | ~ 256 |", page
assert lines[5:] == ["| hex8 | 16 | 2 % | 4096 | 16 | 6.55e+04 | 1 |"], page
assert "| s |" in cost.page({"tet10": good}, NAMES, quiet=True)
print("the price of one percent is as it must be")
