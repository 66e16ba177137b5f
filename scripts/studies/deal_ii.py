"""What deal.II's step-42 recorded: the ball pressed into a block, on adaptive meshes."""

import json

from .measure import RESULTS

RECORD = RESULTS / "deal.II-step-42.json"


def forces_of_deal_ii():
    """On the whole ball in deal.II's adaptive cycles: of linear and of quadratic elements."""
    cycles = json.loads(RECORD.read_text())["cycles"]
    return [cycle["contact_force"] for cycle in cycles]


def limit_of_deal_ii():
    """Where those of linear elements go, by Aitken's rule from the last three."""
    a, b, c = forces_of_deal_ii()[0][-3:]
    return c - (c - b) ** 2 / ((c - b) - (b - a))
