"""What each element pays for an error of one percent in several quantities at once, from the rows of `fetiplast verify`."""

import math
import typing

from .pages import table

WANTED = 0.01
COSTS = {
    "primal unknowns": lambda row: row["primal_dofs"],
    "F": lambda row: row["hessian_multiplications"],
    "GB read": lambda row: row["gigabytes"],
    "s": lambda row: row["seconds"],
}

FORMATS = {"GB read": ".3g", "s": ".3g"}


class Price(typing.NamedTuple):
    level: float
    error: float
    """The largest of the quantities."""
    costs: dict
    measured: bool


def worst(row, names):
    return max(abs(row["errors"][name]) for name in names)


def power(rows, value):
    """Of the level, between the last two meshes."""
    (a, b), (x, y) = [row["level"] for row in rows[-2:]], [value(row) for row in rows[-2:]]
    return math.log(y / x) / math.log(b / a)


def measured(row, names):
    return Price(row["level"], worst(row, names), {name: cost(row) for name, cost in COSTS.items()}, True)


def cheapest(rows, names):
    """The first mesh on which all quantities are within one percent; beyond the meshes there are, by the orders between the last
    two. None where one of them does not fall: the mesh that would do is not in sight."""
    for row in rows:
        if worst(row, names) <= WANTED:
            return measured(row, names)
    last = rows[-1]
    level = last["level"]
    for name in names:
        error = abs(last["errors"][name])
        if error > WANTED:
            order = -power(rows, lambda row: abs(row["errors"][name]))
            if order < 0.5:
                return None
            level = max(level, last["level"] * (error / WANTED) ** (1.0 / order))
    refined = level / last["level"]
    costs = {name: cost(last) * refined ** power(rows, cost) for name, cost in COSTS.items()}
    return Price(level, WANTED, costs, False)


def lines(element, rows, names):
    """What is measured first where the rest is extrapolated."""
    price = cheapest(rows, names)
    found = [] if price and price.measured else [measured(rows[-1], names)]
    return [(element, price) for price in [*found, *([price] if price else [])]]


def page(elements, names, quiet):
    """`elements`: rows by element. Seconds are shown where they were measured on a quiet machine."""
    shown = [name for name in COSTS if quiet or name != "s"]
    found = [line for element, rows in elements.items() for line in lines(element, rows, names)]
    enough = [price for _, price in found if price.measured and price.error <= WANTED]
    least = min((price.costs["GB read"] for price in enough), default=None)

    def cells(element, price):
        sign = "" if price.measured else "~ "
        costs = [f"{sign}{price.costs[name]:{FORMATS.get(name, '.0f')}}" for name in shown]
        ratio = f"{sign}{price.costs['GB read'] / least:.3g}" if least else "-"
        return [element, f"{sign}{price.level:.3g}", f"{100 * price.error:.2g} %", *costs, ratio]

    head = ["element", "level", "largest error", *shown, "GB over the least within 1 %"]
    return table(head, [cells(element, price) for element, price in found])
