"""What a run costs: units fitted to measured runs, checked on others, and asked about machines that are not here.

`fetiplast check --ranks N` counts the amounts of work of a run, as src/sizing/forecast.rs has them, and multiplies them by the
seconds of a unit in bench-results/model.json. This writes that file. `run` measures: it solves the benchmark at several levels, with
small and large subdomains, and asks `check` for the amounts of each of these runs, and of runs on up to 100,000 cores. `write` fits
the units to all but the runs that are held back. Networks are not measured here: see `NETWORKS`.

`run --kinds weak --ranks ...` is for a cluster (jobs/nodes): for each number of ranks it takes the subdomains and clusters that the
forecast finds fastest, solves, and writes what was forecast beside what was measured.
"""

import json
import math
import pathlib
import statistics
import subprocess
import tempfile

from . import kernels, measure, plot, scaling, study
from .groups import Group, circumstances, thousands
from .measure import RESULTS
from .pages import table

RAW = measure.RAW / "model"

NETWORKS = {
    "good": {"latency": 2e-6, "overhead": 3e-7, "bandwidth": 1e10, "noise": 1e-6},
    "slow": {"latency": 2e-5, "overhead": 2e-6, "bandwidth": 1e9, "noise": 1e-5},
    "noisy": {"latency": 2e-6, "overhead": 3e-7, "bandwidth": 1e10, "noise": 5e-5},
}
"""Assumed: seconds from rank to rank, seconds in which a rank sends or takes a message, bytes a second into a rank, and seconds by which
the slowest of all ranks is late in each step of a collective call (LogP: Culler et al. 1993). The first is in the program."""

TIMED = [(1, 10, 1), (1, 10, 2), (2, 10, 1), (2, 10, 2), (3, 10, 2), (2, 5, 2), (3, 5, 2), (2, 2, 2), (3, 2, 2), (4, 2, 2)]
"""Level, cells along an edge of a subdomain, ranks."""
HELD = [(4, 10, 2), (5, 10, 2), (4, 5, 2), (5, 2, 2)]
"""Held back: larger than all others. The last has 93,750 subdomains."""

WEAK = {1: (4, 1, 1), 10: (5, 2, 4), 100: (10, 5, 8), 1000: (25, 10, 16), 10_000: (50, 25, 32), 100_000: (100, 50, 80)}
"""Boxes of 10^3 cells along the axes of each of the two bodies, by cores: eight a core."""
STRONG = {cores: (50, 25, 40) for cores in (1000, 2000, 5000, 10_000, 20_000, 50_000)}
"""100,000 subdomains, 4e8 unknowns."""
MACHINES = {16: 64, 256: 64, 4096: 64}
"""Cores of a node, by nodes: what a machine may have."""
UNKNOWNS_A_CORE = 30_000
"""Of the proposals."""
CELLS, CLUSTERS = (5, 8, 10, 16), ("1", "8", "[8, 8]", "[8, 8, 8]")
"""What proposals choose from."""

FITS = [
    (["discretisation", "interfaces", "symbolic analysis", "clusters", "interpolation", "output", "records", "error estimate"],
     [("meshes", "run"), ("rows", "run")]),
    (["assembly", "internal forces", "residuals", "certificate", "scaling"], [("meshes", "step")]),
    (["factorisation", "factorisation of the interior"], [("factors", "step")]),
    (["dual operator", "preconditioner", "refinement", "inner products", "coarse problem", "outside phases", "coarse set-up"],
     [("factors", "application"), ("rows", "application")]),
]
"""Phases, and the amounts that they are fitted by. The coarse problem's own are known from the kernels and taken off before."""
BY_BYTES = ["dual operator", "preconditioner", "coarse problem", "inner products", "outside phases", "refinement", "residuals"]
BY_BYTES += ["certificate", "scaling", "internal forces", "records", "error estimate"]
BY_FLOPS = ["assembly", "factorisation", "factorisation of the interior", "coarse set-up"]
BY_UNKNOWNS = ["discretisation", "interfaces", "symbolic analysis", "clusters", "interpolation", "output"]
"""Phases by what the program counts of them."""
MESSAGES = ("exchanges", "messages", "collectives", "bytes")


def arguments(parser):
    parser.add_argument("--kinds", nargs="+", choices=["time", "forecast", "weak"], default=["time", "forecast"])
    parser.add_argument("--ranks", type=int, nargs="+", default=[1, 2], help="of weak runs")
    parser.add_argument("--unknowns", type=int, default=UNKNOWNS_A_CORE, help="of weak runs, about, for each rank")
    parser.add_argument("--out", type=pathlib.Path, help="folder of weak runs and their table instead of bench-results")
    measure.add_repeat(parser, 1)
    measure.add_arguments(parser)


def run(arguments):
    """Solves, then asks for the amounts of these runs and of those that are only predicted."""
    program, failed = measure.Program(arguments), 0
    if "weak" in arguments.kinds:
        return weak(program, arguments)
    if "time" in arguments.kinds:
        runs = []
        for level, cells, ranks in TIMED + HELD:
            label = {"kind": "time", "level": level, "cells": cells, "ranks": ranks}
            runs.append(measure.Run(label, ["two-blocks", "--level", str(level), *cut(cells)], ranks))
        failed = measure.run(runs, arguments, RAW, ("time", "counts", "cascade"), program)
    if "forecast" not in arguments.kinds:
        return 1 if failed else 0
    records = program.records(RAW)
    for label, options in asked():
        summary = check(program, [*options, "--ranks", str(label["ranks"])])
        keys = ("subdomains", "clusters", "coarse_blocks", "primal_dofs", "dual_dofs", "memory_estimate_mb", "forecast")
        record = {"kind": "forecast", **label, "summary": {key: summary[key] for key in keys}}
        record["summary"]["rank_mb"] = sum(row["owned_mb"] + row["everywhere_mb"] for row in summary["memory_of_rank"])
        record["provenance"] = program.provenance(summary) | {"date": measure.date(measure.now())}
        records.add(record)
    return 1 if failed else 0


def weak(program, arguments):
    """Runs of the size and with the subdomains that are forecast to be fastest, on each number of ranks."""
    folder, failed, rows = arguments.out or RAW, 0, []
    for ranks in arguments.ranks:
        found = []
        for label, options in choices({"kind": "weak", "ranks": ranks}, arguments.unknowns):
            forecast = check(program, [*options, "--ranks", str(ranks)])["forecast"]
            found.append((forecast["seconds"], label, options))
        seconds, label, options = min(found, key=lambda choice: choice[0])
        label = {**label, "forecast": seconds}
        failed += measure.run([measure.Run(label, options, ranks)], arguments, folder, ("time", "counts", "cascade"), program)
    for record in measure.read(folder):
        if record["kind"] == "weak" and (summary := record["summary"]):
            rows.append([
                record["ranks"], thousands(summary["primal_dofs"]), f"{record['cells']}^3", record["cluster"],
                summary["hessian_multiplications"], f"{record['forecast']:.3g}", f"{summary['time_total']:.3g}",
            ])
    head = ["ranks", "unknowns", "cells", "cluster", "applications of F", "seconds forecast", "seconds"]
    (folder / "weak.md").write_text(table(head, rows))
    return 1 if failed else 0


def choices(label, unknowns):
    """Scenes with about so many unknowns a rank that differ in their subdomains and clusters."""
    edge = (label["ranks"] * unknowns / 3 / 6) ** (1 / 3)
    for cells in CELLS:
        n = max(round(edge / cells), 1)
        for cluster in CLUSTERS:
            yield {**label, "cells": cells, "cluster": cluster}, scene((3 * n, n, n), cells, cluster)


def cut(cells, cluster=None):
    options = ["--set", f"decomposition.cells=[{cells}, {cells}, {cells}]"]
    return options + (["--set", f"decomposition.cluster={cluster}"] if cluster else [])


def scene(boxes, cells, cluster):
    """The benchmark with about so many boxes of so many cells along the axes of each body, at the highest level that divides
    them, so that there are coarser ones. Cells of a scene are those of its level 1."""
    fits = (level for level in (10, 5, 2) if min(boxes[1:]) >= level and all(cells * n % level == 0 for n in boxes))
    level = next(fits, 1)
    counts = [cells * n // level for n in boxes]
    sets = [part for body in ("lower", "upper") for part in ("--set", f"body.{body}.brick.cells={counts}")]
    return ["two-blocks", "--level", str(level), *sets, *cut(cells, cluster)]


def asked():
    """Labels and options of all that is only counted."""
    for level, cells, ranks in TIMED + HELD:
        yield {"of": "time", "level": level, "cells": cells, "ranks": ranks}, ["two-blocks", "--level", str(level), *cut(cells)]
    for of, points in (("weak", WEAK), ("strong", STRONG)):
        for cores, boxes in points.items():
            for cluster in CLUSTERS:
                label = {"of": of, "ranks": cores, "cells": 10, "cluster": cluster}
                yield label, scene(boxes, 10, cluster)
    for nodes, cores in MACHINES.items():
        yield from choices({"of": "machine", "nodes": nodes, "ranks": nodes * cores}, UNKNOWNS_A_CORE)


def check(program, options):
    with tempfile.TemporaryDirectory() as folder:
        summary = pathlib.Path(folder) / "summary.json"
        command = [*program.on(1), "check", *options, "--summary", str(summary)]
        subprocess.run(command, check=True, env=program.environment, stdout=subprocess.DEVNULL)
        return json.loads(summary.read_text())


def newest(records, keys):
    """The last record of each kind."""
    found = {}
    for record in records:
        found[tuple(str(record.get(key)) for key in keys)] = record
    return list(found.values())


def used(raw=RAW):
    records = measure.read(raw)
    times = [r for r in records if r["kind"] == "time" and r["exit_code"] == 0 and r["provenance"]["quiet"]]
    groups = {}
    for record in times:
        groups.setdefault((record["level"], record["cells"], record["ranks"]), []).append(record)
    timed = [record for records in groups.values() for record in Group(records).records]
    # Amounts of a run are those of as many levels as it had.
    had = {(r["level"], r["cells"], r["ranks"]): len(r["summary"]["cascade"]) + 1 for r in timed}

    def fits(record):
        levels = len(record["summary"]["forecast"]["levels"])
        return record["of"] != "time" or levels == had.get((record["level"], record["cells"], record["ranks"]))

    asked = [r for r in records if r["kind"] == "forecast" and fits(r)]
    return timed + newest(asked, ("of", "level", "cells", "ranks", "cluster", "nodes"))


class Timed:
    """Repetitions of a run, and its amounts."""

    def __init__(self, records, forecast):
        self.group, self.label = Group(records), records[0]
        self.levels = forecast["summary"]["forecast"]["levels"]
        summary = self.group.first
        own = [*summary["cascade"], summary]
        # The program's counts in place of the forecast's.
        self.counts = [(level["newton_iterations"], level["hessian_multiplications"]) for level in own]

    def amount(self, of, per):
        """Of all levels, with the program's own counts."""
        total = 0.0
        for level, (steps, applications) in zip(self.levels, self.counts, strict=True):
            times = {"run": 1, "step": steps, "application": applications}[per]
            total += times * sum(a["amount"] for a in level["amounts"] if (a["of"], a["per"]) == (of, per))
        return total

    def seconds(self, phases):
        return statistics.median(sum(s["time"].get(phase, 0.0) for phase in phases) for s in self.group.summaries)

    def total(self):
        return self.seconds([phase for phases, _ in FITS for phase in phases])

    def counted(self):
        """What the rank with most did in each phase, as the program counts it."""
        counts, found = self.group.first["counts"], {}
        for key, phases in (("bytes", BY_BYTES), ("flops", BY_FLOPS)):
            found |= {phase: counts[phase][key]["busiest"] for phase in phases if phase in counts}
        return found | {phase: self.amount("meshes", "run") for phase in BY_UNKNOWNS}

    def predicted_by_counts(self, units):
        return sum(units[phase] * amount for phase, amount in self.counted().items())

    def predicted(self, units):
        # Ranks of one machine: messages are not among these phases.
        return sum(unit * self.amount(*key) for key, unit in units.items() if key[0] not in MESSAGES)


def fit(rows, targets):
    """Numbers, none below zero, for which the sums of `rows` times them are nearest to `targets`, relative to these."""
    rows = [[x / t for x in row] for row, t in zip(rows, targets)]
    found = [0.0] * len(rows[0])
    for _ in range(2000):
        for k in range(len(found)):
            rest = [1 - sum(x * u for j, (x, u) in enumerate(zip(row, found)) if j != k) for row in rows]
            square = sum(row[k] ** 2 for row in rows)
            found[k] = max(0.0, sum(row[k] * r for row, r in zip(rows, rest)) / square) if square else 0.0
    return found


def coarse_units():
    """Seconds of the coarse problem's units: one solve for a number in the factor, and the set-up for what it grows with."""
    lines = [line for line in kernels.newest() if line["kind"] == "coarse" and line["subdomains"] <= 2000]
    last = max(lines, key=lambda line: line["subdomains"])
    return {
        ("coarse", "run"): last["setup"] / (last["length"] * last["subdomains"] ** 0.6),
        ("coarse", "application"): last["solve"] / last["length"],
    }


def calibrated(runs):
    """Units by the unknowns of a subdomain: small ones stay in caches, and have short loops."""
    found = {}
    for cells in sorted({run.label["cells"] for run in runs}):
        found[3 * (cells + 1) ** 3] = units_of([run for run in runs if run.label["cells"] == cells])
    return found


def units_at(found, unknowns):
    """Between the measured sizes of subdomains straight in logarithms, beyond them as at the nearest."""
    sizes = sorted(found)
    upper = next((k for k, size in enumerate(sizes) if size >= unknowns), len(sizes) - 1)
    lower = max(upper - 1, 0)
    if upper == lower or unknowns >= sizes[upper]:
        return found[sizes[upper]]
    share = max(0.0, math.log(unknowns / sizes[lower]) / math.log(sizes[upper] / sizes[lower]))
    low, high = found[sizes[lower]], found[sizes[upper]]
    return {key: (1 - share) * low[key] + share * high[key] for key in low}


def units_of(runs):
    units = coarse_units()
    known = dict(units)
    for phases, keys in FITS:
        rows = [[run.amount(*key) for key in keys] for run in runs]
        is_coarse = "coarse problem" in phases
        targets = [
            run.seconds(phases) - (sum(u * run.amount(*key) for key, u in known.items()) if is_coarse else 0.0) for run in runs
        ]
        for key, unit in zip(keys, fit(rows, targets)):
            units[key] = unit
    return units


def by_counts(runs):
    """Seconds of what is counted of each phase. Large runs say more of it than small ones, which stay in caches."""
    units = {}
    for phase in [*BY_BYTES, *BY_FLOPS, *BY_UNKNOWNS]:
        pairs = [(run.counted().get(phase, 0.0), run.seconds([phase])) for run in runs]
        amount = sum(amount for amount, _ in pairs)
        units[phase] = sum(seconds for _, seconds in pairs) / amount if amount else 0.0
    return units


def growth(points):
    """`a` and `b` of applications a step, `a / (1 + b S^(-1/3))`, by least squares of their inverses; `b` is not below zero.

    FETI's condition number is bounded for any number S of subdomains (Farhat, Mandel and Roux 1994). Fewer of them have fewer
    iterations, as more are at the outside of the bodies, with fewer neighbours: a share of about S^(-1/3).
    """
    xs, ys = zip(*[(s ** (-1 / 3), 1 / y) for s, y in points])
    slope, value = statistics.linear_regression(xs, ys)
    return [1 / value, slope / value] if slope > 0 < value else [1 / statistics.mean(ys), 0.0]


def applications_of(steps, law, subdomains):
    """In so many steps, by the law that `growth` found."""
    return steps * law[0] / (1 + law[1] * max(subdomains, 1) ** (-1 / 3))


def counts_of(runs):
    """Newton steps, and growth of applications a step, of the first level of a cascade, of those between, and of the last."""
    points = points_of(runs)
    steps = [statistics.median(steps for _, steps, _ in of_place) for of_place in points]
    return steps, [growth(a_step(of_place)) for of_place in points]


def a_step(points):
    return [(subdomains, applications / steps) for subdomains, steps, applications in points]


def points_of(runs):
    """Subdomains, Newton steps and applications by the place of a level in its cascade. They are the same on any ranks."""
    points = [set(), set(), set()]
    for run in runs:
        summary = run.group.first
        coarser = summary["cascade"]
        for number, level in enumerate([*coarser, summary] if coarser else []):
            place = place_of(number, len(coarser) + 1)
            points[place].add((level["subdomains"], level["newton_iterations"], level["hessian_multiplications"]))
    return points


def place_of(number, levels):
    """0 for the first level of a cascade, 2 for the last or only one, 1 for those between."""
    return 2 if number + 1 == levels else min(number, 1)


def network_units(network):
    step = network["latency"] + network["noise"]
    return {
        ("exchanges", "application"): network["latency"], ("messages", "application"): network["overhead"],
        ("collectives", "application"): step,
        ("bytes", "application"): 1 / network["bandwidth"],
    }


def in_network(units, network):
    return {size: of_size | network_units(network) for size, of_size in units.items()}


def forecast(record, units, steps, applications):
    """Seconds of a run that was asked about: all, and of messages; and the applications on the finest level."""
    summary, (total, messages, count) = record["summary"], (0.0, 0.0, 0.0)
    units = units_at(units, summary["primal_dofs"] / summary["subdomains"])
    levels = record["summary"]["forecast"]["levels"]
    for number, level in enumerate(levels):
        place = place_of(number, len(levels))
        count = applications_of(steps[place], applications[place], level["subdomains"])
        times = {"run": 1, "step": steps[place], "application": count}
        for amount in level["amounts"]:
            seconds = times[amount["per"]] * amount["amount"] * units.get((amount["of"], amount["per"]), 0.0)
            total += seconds
            messages += seconds if amount["of"] in MESSAGES else 0.0
    return total, messages, count


HEAD = """\
# A model of the costs

Written by `scripts/bench write model` from the runs in [raw/model](raw/model), the coarse problems in [raw/kernels](raw/kernels) and
the counts in [raw/study](raw/study). `fetiplast check --ranks N` counts the [amounts of work](../src/sizing/forecast.rs) of a run;
here the seconds of their units are fitted to measured runs, and written to [model.json](model.json), by which it forecasts. It tells
what cannot be measured here, with the caution that asks for: units are those of this machine, networks are assumed, and applications
of F grow with the subdomains to a bound, as measured ones do. Input and output of files, and imbalance of plastic elements, are
not in it.
"""


def pages(folder=RESULTS, raw=RAW, counted=study.RAW):
    records = used(raw)
    asked = [r for r in records if r["kind"] == "forecast"]
    runs, held = [], []
    for places, into in ((TIMED, runs), (HELD, held)):
        for level, cells, ranks in places:
            key = {"level": level, "cells": cells, "ranks": ranks}
            mine = [r for r in records if r["kind"] == "time" and all(r[k] == v for k, v in key.items())]
            counts = [r for r in asked if r["of"] == "time" and all(r[k] == v for k, v in key.items())]
            if mine and counts:
                into.append(Timed(mine, counts[0]))
    if len(runs) < 3:
        return {}
    units, (steps, applications) = calibrated(runs), counts_of(runs + held)
    good = in_network(units, NETWORKS["good"])
    text = [HEAD, *of_units(good, steps, applications), *of_runs(runs, held, units), *of_growth(runs, held), *of_counts(counted)]
    text += [*of_weak(asked, units, steps, applications), *of_strong(asked, units, steps, applications)]
    text += [*of_machines(asked, good, steps, applications), "## Where the runs come from\n"]
    text.append(circumstances([r for r in records if r["kind"] == "time"]))
    values = {
        "sizes": [
            {
                "unknowns": size,
                "units": [{"of": of, "per": per, "seconds": float(f"{unit:.4g}")} for (of, per), unit in sorted(units.items())],
            }
            for size, units in good.items()
        ],
        "steps": steps,
        "applications": [[float(f"{x:.4g}") for x in line] for line in applications],
    }
    charts = {"model-weak.svg": chart(asked, "weak", good, steps, applications), "model-strong.svg": chart(asked, "strong", good, steps, applications)}
    files = {folder / "model.md": "\n".join(text), folder / "model.json": json.dumps(values, indent=1) + "\n"}
    return files | {folder / name: chart for name, chart in charts.items()}


def of_units(units, steps, applications):
    yield "## Units\n"
    sizes = sorted(units)
    rows = [[of, per, *(f"{units[size][of, per]:.3g}" for size in sizes)] for of, per in sorted(units[sizes[0]])]
    yield "Seconds, by the unknowns of a subdomain.\n"
    yield table(["amount", "of each", *map(thousands, sizes)], rows)
    network = ", ".join(f"{key} {value:g}" for key, value in NETWORKS["good"].items())
    yield f"Messages are those of an assumed network ({network}; in seconds and bytes a second).\n"
    lines = []
    for name, n, (a, b) in zip(("first of a cascade", "between", "last"), steps, applications):
        lines.append([name, f"{n:g}", f"{a:.1f} / (1 + {b:.2f} S^(-1/3))"])
    yield "Applications of F a Newton step, of S subdomains:\n"
    yield table(["level", "Newton steps", "applications a step"], lines)


def of_runs(runs, held, units):
    yield "## Measured runs, and runs held back\n"
    yield (
        "With the cascade; seconds without messages. *By counts*: bytes, flops and unknowns of each phase, as the program counts them, "
        "times seconds of each. *By the scene*: amounts that `check` tells beforehand, with the run's own steps and applications; it "
        "cannot know how much yields, and takes it that congruent subdomains share factors as those of the benchmark do.\n"
    )
    rows, errors = [], []
    for run in [*runs, *held]:
        measured, cells = run.total(), run.label["cells"]
        known = by_counts([other for other in runs if other.label["cells"] == cells])
        found = [run.predicted_by_counts(known), run.predicted(units[3 * (cells + 1) ** 3])]
        ratios = [predicted / measured - 1 for predicted in found]
        if run in held:
            errors.append([abs(ratio) for ratio in ratios])
        label = run.label
        rows.append([
            f"level {label['level']}, {label['cells']}^3 cells", thousands(run.group.first["subdomains"]), label["ranks"],
            f"{measured:.3g}", *(f"{predicted:.3g} ({100 * ratio:+.0f} %)" for predicted, ratio in zip(found, ratios)),
            "held back" if run in held else "",
        ])
    yield table(["run", "subdomains", "ranks", "seconds", "by counts", "by the scene", ""], rows)
    if errors:
        most = [100 * max(of) for of in zip(*errors)]
        yield f"Largest error of a run held back: {most[0]:.0f} % by counts, {most[1]:.0f} % by the scene.\n"


def of_growth(runs, held):
    """The last level's applications by the runs that are not held back, with the bound and without."""
    known = set(a_step(points_of(runs)[2]))
    beyond = set(a_step(points_of(held)[2])) - known
    bound, line = growth(known), statistics.linear_regression([math.log(s) for s, _ in known], [y for _, y in known])

    def errors(subdomains, counted):
        predicted = (applications_of(1, bound, subdomains), line.intercept + line.slope * math.log(subdomains))
        return [(p, p / counted - 1) for p in predicted]

    yield "## Applications of F, held back\n"
    yield (
        "Of a Newton step on the last level of a cascade, by the runs that are not held back: a / (1 + b S^(-1/3)), which has a bound "
        "as FETI's condition number has, and a + b ln S.\n"
    )
    rows = []
    for point in sorted(known | beyond):
        found = [f"{predicted:.1f} ({100 * error:+.0f} %)" for predicted, error in errors(*point)]
        rows.append([thousands(point[0]), f"{point[1]:.1f}", *found, "held back" if point in beyond else ""])
    yield table(["subdomains", "applications a step", "with a bound", "without", ""], rows)
    if beyond:
        of_laws = zip(*([error for _, error in errors(*point)] for point in beyond))
        means = [100 * math.sqrt(statistics.mean(e**2 for e in of_law)) for of_law in of_laws]
        yield f"Of those held back {means[0]:.0f} % off with a bound, and {means[1]:.0f} % without (root of the mean square).\n"


def of_counts(raw):
    """Work of a rank on the most ranks, from that on fewer: a share and what every rank does."""
    strong = [curve.groups for curve in scaling.curves(scaling.read(raw)) if not curve.weak]
    groups = strong[0] if strong else {}
    fewer = sorted(p for p in groups if 2 <= p < 64)
    if 64 not in groups or len(fewer) < 2:
        return
    yield "## Counts held back: 64 ranks\n"
    yield "Of the mean rank of the strong study; from 2 to 16 ranks: a share, its surface, and what every rank does, a / p + b / p^(2/3) + c.\n"
    rows = []
    for key in ("flops", "bytes"):
        amount = {p: groups[p].first["counts_total"][key]["mean"] for p in (*fewer, 64)}

        def parts(p):
            return [1 / p, p ** (-2 / 3), 1]

        found = fit([parts(p) for p in fewer], [amount[p] for p in fewer])
        predicted = sum(x * part for x, part in zip(found, parts(64)))
        rows.append([key, f"{amount[64]:.3g}", f"{predicted:.3g}", f"{100 * (predicted / amount[64] - 1):+.0f} %"])
    yield table(["of a rank", "counted", "predicted", "error"], rows)


def best(records, units, steps, applications):
    """The fastest of some that differ in their clusters."""
    return min(records, key=lambda r: forecast(r, units, steps, applications)[0])


def points(asked, of, units, steps, applications):
    cores = sorted({r["ranks"] for r in asked if r["of"] == of})
    return {p: best([r for r in asked if r["of"] == of and r["ranks"] == p], units, steps, applications) for p in cores}


def lines_of(asked, of, networks, units, steps, applications, first):
    """A row for each number of cores, with the efficiency in each network relative to `first` cores."""
    rows = []
    found = {name: points(asked, of, in_network(units, n), steps, applications) for name, n in networks.items()}
    for p in found["good"]:
        record = found["good"][p]
        row = [thousands(p), thousands(record["summary"]["subdomains"]), record["cluster"], thousands(record["summary"]["coarse_blocks"])]
        for name, network in networks.items():
            all_units = in_network(units, network)
            time, messages, count = forecast(found[name][p], all_units, steps, applications)
            start = forecast(found[name][first], all_units, steps, applications)[0]
            efficiency = start / time * (first / p if of == "strong" else 1)
            if name == "good":
                row += [f"{count:.0f}", f"{time:.3g}", f"{messages:.3g}"]
            row.append(f"{100 * efficiency:.0f} %")
        rows.append(row)
    head = ["cores", "subdomains", "clusters", "coarse blocks", "applications of F", "seconds", "of these messages"]
    return table(head + [f"efficiency, {name} network" for name in networks], rows)


def of_weak(asked, units, steps, applications):
    yield "## Weak: 8 subdomains of 10^3 cells on every core\n"
    yield "With the clusters that the model finds fastest; efficiency relative to 10 cores, with the growth of F in it.\n"
    yield lines_of(asked, "weak", NETWORKS, units, steps, applications, 10)
    yield "![Weak](model-weak.svg)\n"


def of_strong(asked, units, steps, applications):
    yield "## Strong: 4e8 unknowns in 100 000 subdomains\n"
    yield "Efficiency relative to 1000 cores.\n"
    yield lines_of(asked, "strong", NETWORKS, units, steps, applications, 1000)
    yield "![Strong](model-strong.svg)\n"


def of_machines(asked, units, steps, applications):
    yield "## What to choose\n"
    cores = next(iter(MACHINES.values()))
    yield f"The fastest of {', '.join(map(str, CELLS))} cells along an edge and of some clusters, with about {thousands(UNKNOWNS_A_CORE)} unknowns a core.\n"
    rows = []
    for nodes in MACHINES:
        record = best([r for r in asked if r["of"] == "machine" and r["nodes"] == nodes], units, steps, applications)
        time, messages, count = forecast(record, units, steps, applications)
        summary = record["summary"]
        rows.append([
            f"{thousands(nodes)} nodes of {cores}", f"{summary['primal_dofs']:.2g}", f"{record['cells']}^3", thousands(summary["subdomains"]),
            record["cluster"], f"{count:.0f}", f"{time:.3g}", f"{100 * messages / time:.0f} %", thousands(round(summary["rank_mb"])),
        ])
    head = ["machine", "unknowns", "cells", "subdomains", "cluster", "applications of F", "seconds", "messages", "MiB a rank"]
    yield table(head, rows)


def chart(asked, of, units, steps, applications):
    found = {p: forecast(r, units, steps, applications) for p, r in points(asked, of, units, steps, applications).items()}
    series = [
        ("total", {p: total for p, (total, _, _) in found.items()}, False),
        ("messages", {p: messages for p, (_, messages, _) in found.items() if messages > 0}, False),
    ]
    title = "Predicted: 8 subdomains on every core" if of == "weak" else "Predicted: 100 000 subdomains"
    return plot.curves(title, "cores", "seconds", series)
