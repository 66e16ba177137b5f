"""A model of what a run costs, calibrated on measured runs, checked on others, and asked about machines that are not here.

A run has S subdomains on p ranks and needs N Newton steps, F and P applications of the dual operator and of the preconditioner,
and A active sets. Each part of its time is a unit cost times an amount of work:

    factors     unit * flops / p
    operator    unit * bytes of the factors read / p          preconditioner   likewise
    elements    unit * N * primal unknowns / p
    products    unit * (F + P) * dual unknowns / p
    projections unit * (F + P) * dual unknowns / p, the sides of the coarse problem that are spread over the ranks
    coarse      set-up + A * set-up for other rows + (F + P) * solve, whole on every rank, by the curves of the kernels
    output      unit * primal unknowns

Networks are not measured here. What messages cost between nodes is put in from outside, see `Network`.
"""

import math
import statistics
import typing

from . import kernels, plot, scaling
from .measure import RESULTS
from .pages import table


class Network(typing.NamedTuple):
    """Assumed, not measured: what a good cluster's interconnect takes."""

    latency: float = 2e-6
    """Seconds from rank to rank."""
    seconds_per_byte: float = 1e-10
    """10 GB/s into every rank."""


NEIGHBOURS = 26
"""Of a box among boxes."""
MEMORY = 4 * 2**30
"""Bytes a core may have, on usual nodes."""
A_CORE = 8
"""Subdomains of a rank in the weak prediction."""


class Curve:
    """A quantity of the coarse problem over the number of subdomains: straight between measured points in logarithms; beyond
    the last as nested dissection of a body in three dimensions promises."""

    def __init__(self, lines, key, exponent):
        self.points = sorted((line["subdomains"], line[key]) for line in lines)
        self.exponent = exponent

    def __call__(self, subdomains):
        last, at_last = self.points[-1]
        if subdomains >= last:
            return at_last * (subdomains / last) ** self.exponent
        pairs = list(zip(self.points, self.points[1:]))
        (x0, y0), (x1, y1) = next((pair for pair in pairs if subdomains <= pair[1][0]), pairs[-1])
        return y0 * (y1 / y0) ** (math.log(subdomains / x0) / math.log(x1 / x0))


class Coarse:
    def __init__(self, lines):
        lines = [line for line in lines if line["kind"] == "coarse"]
        self.setup, self.restricted = Curve(lines, "setup", 2), Curve(lines, "restricted", 2)
        self.solve, self.length = Curve(lines, "solve", 4 / 3), Curve(lines, "length", 4 / 3)
        self.measured = max(line["subdomains"] for line in lines)

    def seconds(self, subdomains, sets, applications):
        again = sets * self.restricted(subdomains) + applications * self.solve(subdomains)
        return self.setup(subdomains) + again


class Amounts(typing.NamedTuple):
    """What a run does, all ranks together."""

    subdomains: int
    primal: float
    dual: float
    newton: float
    operator: float
    preconditioner: float
    sets: float
    flops: float
    operator_bytes: float
    preconditioner_bytes: float

    @classmethod
    def of(cls, summary):
        work = summary["work"]
        return cls(
            summary["subdomains"], summary["primal_dofs"], summary["dual_dofs"], summary["newton_iterations"],
            summary["hessian_multiplications"], summary["preconditioner_applications"], summary["active_set_iterations"],
            work["factorisation"]["flops"] + work["factorisation of the interior"]["flops"],
            work["dual operator"]["bytes"], work["preconditioner"]["bytes"],
        )

    def parts(self, ranks, coarse):
        """Work on the critical path of each part."""
        applications = self.operator + self.preconditioner
        return {
            "factors": self.flops / ranks,
            "operator": self.operator_bytes / ranks,
            "preconditioner": self.preconditioner_bytes / ranks,
            "elements": self.newton * self.primal / ranks,
            "products": applications * self.dual / ranks,
            "projections": applications * self.dual / ranks,
            "coarse": coarse.seconds(self.subdomains, self.sets, applications),
            "output": self.primal,
        }


PHASES = {
    "factors": ["factorisation", "factorisation of the interior", "symbolic analysis"],
    "operator": ["dual operator"],
    "preconditioner": ["preconditioner"],
    "elements": ["assembly", "internal forces", "residuals", "scaling", "discretisation"],
    "products": ["inner products"],
    "projections": ["coarse problem", "coarse set-up"],
    "output": ["output"],
}
"""Phases of the summary's `time` that make up a part, or two parts together."""


def seconds(group, part):
    return statistics.median(sum(s["time"].get(phase, 0.0) for phase in PHASES[part]) for s in group.summaries)


def calibrate(groups, coarse):
    """Unit cost of each part: least squares of the relative error, so that small runs count as much as large ones. The coarse
    problem is known from its curves: the runs that fit here are too small to tell its cost from that of the projections."""
    units = {"coarse": 1.0}
    for part in PHASES:
        shares = []
        for group in groups:
            works = Amounts.of(group.first).parts(group.first["ranks"], coarse)
            known = works["coarse"] if part == "projections" else 0.0
            if (rest := seconds(group, part) - known) > 0.0:
                shares.append(works[part] / rest)
        units[part] = fit(shares)
    return units


def fit(shares):
    """The number x for which the products `x share` are as near to 1 as can be."""
    return sum(shares) / sum(share * share for share in shares)


def predict(units, amounts, ranks, coarse):
    return {part: units[part] * work for part, work in amounts.parts(ranks, coarse).items()}


def total(group):
    """What the model speaks of: the sum of the phases that it has."""
    return sum(seconds(group, part) for part in PHASES)


def split(groups):
    """Runs to calibrate on, and those held back: all of the largest problem."""
    largest = max(group.first["subdomains"] for group in groups)
    return [g for g in groups if g.first["subdomains"] < largest], [g for g in groups if g.first["subdomains"] == largest]


class Growth:
    """A count as a + b ln S, by least squares over the runs of `cells` along an edge."""

    def __init__(self, groups, key):
        points = sorted({(math.log(g.first["subdomains"]), g.count(key)) for g in groups})
        x, y = zip(*points)
        self.slope, self.value = statistics.linear_regression(x, y) if len(points) > 1 else (0.0, y[0])

    def __call__(self, subdomains):
        return self.value + self.slope * math.log(subdomains)


class Extrapolation:
    """Amounts for any number of subdomains of the size of the largest measured problem."""

    def __init__(self, groups):
        summary = max(groups, key=lambda g: g.first["subdomains"]).first
        self.base = Amounts.of(summary)
        cubes = [g for g in groups if g.first["subdomains"] > 1]
        self.newton = statistics.median(g.count("newton_iterations") for g in cubes)
        keys = ("hessian_multiplications", "preconditioner_applications", "active_set_iterations")
        self.operator, self.preconditioner, self.sets = (Growth(cubes, key) for key in keys)

    def __call__(self, subdomains):
        base, times = self.base, subdomains / self.base.subdomains
        operator, preconditioner = self.operator(subdomains), self.preconditioner(subdomains)
        return Amounts(
            subdomains, base.primal * times, base.dual * times, self.newton, operator, preconditioner, self.sets(subdomains),
            base.flops * times * self.newton / base.newton, base.operator_bytes * times * operator / base.operator,
            base.preconditioner_bytes * times * preconditioner / base.preconditioner,
        )


def messages(amounts, ranks, calls, network):
    """Seconds for exchanges with neighbours, and for collectives: `calls` for each application, each as deep as a tree of the
    ranks, and six numbers of every subdomain to every rank."""
    if ranks == 1:
        return {"neighbours": 0.0, "collectives": 0.0}
    applications = amounts.operator + amounts.preconditioner
    surface = 8 * 2 * amounts.dual / ranks
    gathered = 8 * 6 * amounts.subdomains
    return {
        "neighbours": applications * (NEIGHBOURS * network.latency + surface * network.seconds_per_byte),
        "collectives": applications * (calls * network.latency * math.log2(ranks) + gathered * network.seconds_per_byte),
    }


HEAD = """\
# A model of the costs

Written by `scripts/bench write model` from the runs in [raw/scaling](raw/scaling) and the coarse problems in
[raw/kernels](raw/kernels). Each part of the time is a unit cost times an amount of work that the program counts; the
formulas are at the top of [model.py](../scripts/studies/model.py). It tells what cannot be measured here, with all the caution
that asks for: unit costs are those of this machine, networks are assumed ({latency:.0f} us from rank to rank, {rate:.0f} GB/s into
every rank), counts grow as a + b ln S through the measured ones, and the coarse problem beyond {measured} subdomains grows as
nested dissection promises (set-up with S^2, solve with S^4/3).
"""


def pages(folder=RESULTS, raw=scaling.RAW):
    """Nothing from runs that other work ran beside: without two sizes of others there is no page."""
    groups = [group for group in scaling.read(raw).values() if group.timed and group.first["work"].get("preconditioner")]
    # Those of one size alone.
    groups = [group for group in groups if not group.first["cascade"]]
    cells = max((group.records[0]["cells"] for group in groups), default=None)
    groups = [group for group in groups if group.records[0]["cells"] == cells]
    if len({group.first["subdomains"] for group in groups}) < 2:
        return {}
    coarse, network = Coarse(kernels.newest()), Network()
    known, held = split(groups)
    units = calibrate(known, coarse)
    text = [HEAD.format(latency=1e6 * network.latency, rate=1e-9 / network.seconds_per_byte, measured=coarse.measured)]
    text += ["## Unit costs, and runs held back\n", *validation(units, known, held, coarse)]
    weak, strong, plots, words = predictions(groups, units, coarse, network)
    text += [f"## Weak: {A_CORE} subdomains of {cells}^3 cells on every core\n", weak, "![Weak](model-weak.svg)\n"]
    text += ["## Strong\n", strong, "![Strong](model-strong.svg)\n", "## Where it ends\n", words]
    return {folder / "model.md": "\n".join(text)} | {folder / name: chart for name, chart in plots.items()}


def validation(units, known, held, coarse):
    names = {"factors": "flop", "operator": "byte", "preconditioner": "byte", "elements": "unknown and Newton step"}
    names |= {"products": "dual unknown and application", "output": "unknown"}
    names["projections"] = names["products"]
    cost = [[part, f"{unit:.3g}", f"s per {names[part]}"] for part, unit in units.items() if part in names]
    yield table(["part", "unit cost", ""], cost)
    yield f"From {len(known)} kinds of runs; all of the largest problem are held back. Predicted with their own counts:\n"
    rows, errors = [], []
    for group in [*known, *held]:
        summary = group.first
        predicted = sum(predict(units, Amounts.of(summary), summary["ranks"], coarse).values())
        error = predicted / total(group) - 1
        if group in held:
            errors.append(abs(error))
        label = group.records[0]
        rows.append(
            [f"level {label['level']}, width {label['width']}", summary["subdomains"], summary["ranks"], f"{total(group):.3g}"]
            + [f"{predicted:.3g}", f"{100 * error:+.0f} %", "held back" if group in held else ""]
        )
    yield table(["run", "subdomains", "ranks", "seconds in these parts", "predicted", "error", ""], rows)
    yield f"Largest error of a run held back: {100 * max(errors):.0f} %.\n"


def predictions(groups, units, coarse, network):
    """Weak and strong tables, plots, and what they say."""
    extrapolation = Extrapolation(groups)
    calls = statistics.median(
        g.first["communication"]["collectives"]["calls"]
        / (g.first["hessian_multiplications"] + g.first["preconditioner_applications"])
        for g in groups
    )

    def at(subdomains, ranks):
        amounts = extrapolation(subdomains)
        return predict(units, amounts, ranks, coarse) | messages(amounts, ranks, calls, network), amounts

    head = ["cores", "subdomains", "unknowns", "applications of F", "local s", "coarse s", "messages s", "total s", "efficiency"]
    cores = [10**k for k in range(6)]

    def rows(points, strong):
        found, first = [], None
        for ranks, subdomains in points:
            parts, amounts = at(subdomains, ranks)
            local = sum(parts[part] for part in units if part not in ("coarse", "output"))
            sent = parts["neighbours"] + parts["collectives"]
            # Results go to a file system, which is not part of the model.
            whole = local + parts["coarse"] + sent
            first = first or (ranks, whole)
            efficiency = first[1] / whole * (first[0] / ranks if strong else 1)
            found.append((ranks, subdomains, amounts, local, parts["coarse"], sent, whole, efficiency))
        return found

    def shown(found):
        return table(
            head,
            [
                [f"{p:,}".replace(",", " "), f"{s:,}".replace(",", " "), f"{a.primal:.2g}", f"{a.operator:.0f}"]
                + [f"{x:.3g}" for x in (local, c, sent, whole)] + [f"{100 * e:.1f} %"]
                for p, s, a, local, c, sent, whole, e in found
            ],
        )

    weak = rows([(p, A_CORE * p) for p in cores], strong=False)
    large = 10**5
    strong = rows([(p, large) for p in cores if p >= 100], strong=True)

    def series(found):
        names = ["local work", "coarse problem", "messages", "total"]
        return [(name, {r[0]: r[3 + k] for r in found if r[3 + k] > 0}, False) for k, name in enumerate(names)]

    plots = {
        "model-weak.svg": plot.curves(f"Predicted: {A_CORE} subdomains on every core", "cores", "seconds", series(weak)),
        "model-strong.svg": plot.curves(f"Predicted: {large:,} subdomains".replace(",", " "), "cores", "seconds", series(strong)),
    }
    return shown(weak), shown(strong), plots, where(at, coarse, cores)


def where(at, coarse, cores):
    """From which size on the coarse problem takes as long as all else, and no longer fits."""

    def first(holds):
        fine = (round(10 ** (k / 20)) for k in range(20, 20 * 6))
        return next((p for p in fine if holds(p)), None)

    def share(p):
        parts, _ = at(A_CORE * p, p)
        return parts["coarse"] / sum(seconds for part, seconds in parts.items() if part != "output")

    tenth, half = first(lambda p: share(p) > 0.1), first(lambda p: share(p) > 0.5)
    full = first(lambda p: 8 * coarse.length(A_CORE * p) > MEMORY)
    return (
        f"With {A_CORE} subdomains a core the coarse problem takes a tenth of the time from {tenth} cores "
        f"({A_CORE * tenth} subdomains) on and half of it from {half} cores ({A_CORE * half} subdomains) on. Its factor, which "
        f"every rank holds whole, outgrows {MEMORY >> 30} GiB a core at {full} cores ({A_CORE * full} subdomains). That is the "
        f"wall of the one-level method: beyond it the coarse problem must be smaller or spread over the ranks.\n"
    )
