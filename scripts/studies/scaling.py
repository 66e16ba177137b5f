"""Scalability of a scene, strong, weak and numerical.

Strong: one level on all --ranks. Weak: one level on all --ranks, on p ranks with bodies p times as wide (along y), so that
every rank has the same work; this needs Python 3.11. Numerical: all --levels on the last of --ranks, with subdomains of all sizes
in --cells (cells along an edge) that divide every body. Runs start from rest, without a cascade, so that all times belong to one
size; with --options="--cascade auto" they are those of the program's default. The page is of the newest commit's runs of each
kind. On a cluster use jobs/strong and jobs/weak, which give --program, --launch and --out.
"""

import pathlib
import sys
import typing

from . import measure, plot
from .groups import Group, circumstances, thousands
from .measure import RESULTS, ROOT, Run
from .pages import table, write

RAW = measure.RAW / "scaling"
KINDS = ["strong", "weak", "numerical"]
READ = ("time", "work", "communication", "cascade")
"""Tables of the summary that this page and that of the model read."""

HEAD = """\
# Scalability

Written by `scripts/bench write scaling` from the newest commit's runs of each kind in [raw/scaling](raw/scaling), which
`scripts/bench run scaling` made.
Seconds are of the whole solve without starting and ending the processes, medians of the repetitions with smallest and
largest; so is memory. Speed-up and efficiency are those of the medians, against the smallest number of ranks. Runs start
from rest unless their options name a cascade. Counts do not depend on the number of ranks. `cells` are those along the edge
of a subdomain. Where subdomains form clusters (hybrid Total-FETI) the coarse problem has six unknowns a cluster; its part of the
time, set-up included, is that of the median run.
"""

BUSY = " (machine busy: only counts mean something)"
WHERE_BUSY = """
**Other work ran beside some of these runs: their times are left out of the tables, and plots only show what they will look
like.**
"""


def arguments(parser):
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=KINDS)
    parser.add_argument("--scene", default="two-blocks", help="built-in, or a file; its bodies are bricks")
    parser.add_argument("--options", default="", help="more options of `fetiplast solve`")
    parser.add_argument("--ranks", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--strong-level", type=int, default=2)
    parser.add_argument("--weak-level", type=int, default=1)
    parser.add_argument("--levels", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--cells", type=int, nargs="+", default=[10, 5], help="cells along the edge of a subdomain")
    parser.add_argument("--out", type=pathlib.Path, help="folder of runs, table and plots instead of bench-results")
    measure.add_repeat(parser, 1)
    measure.add_arguments(parser)


def run(arguments):
    failed = measure.run(list(runs(arguments)), arguments, arguments.out or RAW, READ)
    if arguments.out:
        write(pages(arguments.out, arguments.out))
    return 1 if failed else 0


def runs(arguments):
    """Everything to run, once; the quick runs first."""
    wanted = []
    if "weak" in arguments.kinds:
        wanted += [(arguments.weak_level, ranks, ranks, arguments.cells[0]) for ranks in arguments.ranks]
    if "strong" in arguments.kinds:
        wanted += [(arguments.strong_level, 1, ranks, arguments.cells[0]) for ranks in arguments.ranks]
    if "numerical" in arguments.kinds:
        wanted += [(n, 1, arguments.ranks[-1], cells) for n in arguments.levels for cells in arguments.cells]
    more = arguments.options.split()
    for level, width, ranks, cells in sorted(dict.fromkeys(wanted)):
        label = {"scene": arguments.scene, "options": arguments.options, "level": level, "width": width}
        options = [arguments.scene, "--level", str(level), *([] if "--cascade" in more else ["--cascade", "off"])]
        options += ["--set", f"decomposition.cells=[{cells}, {cells}, {cells}]"]
        if width > 1:
            options += widened(arguments.scene, width)
        yield Run({**label, "cells": cells, "ranks": ranks}, [*options, *more], ranks)


def widened(scene, factor):
    """Options of `fetiplast` that make every brick of a scene so many times as long, with as many times the cells, along y.
    Loads per area and supports go along; the bodies keep their places to each other."""
    import tomllib

    file, y = ROOT / "src" / "scene" / "library" / f"{scene}.toml", 1
    text = (file if file.exists() else pathlib.Path(scene)).read_text()
    found = []
    for name, body in tomllib.loads(text)["body"].items():
        if "brick" not in body:
            sys.exit(f"scripts/bench: body.{name} of {scene} is no brick: a weak study widens bricks")
        for key in ("origin", "size", "cells"):
            found += ["--set", f"body.{name}.brick.{key}.{y}={factor * body['brick'][key][y]}"]
    return found


class Kind(typing.NamedTuple):
    """What a run is about, but for its number of ranks."""

    scene: str
    options: str
    level: int
    width: int
    cells: int

    def name(self):
        more = f", {self.options}" if self.options else ""
        return f"{self.scene}, level {self.level}, {self.cells} cells{more}"


def read(folder):
    """Groups by kind and ranks, of the newest commit and machine that ran that kind."""
    records = [record for record in measure.read(folder) if record["exit_code"] == 0 and record["summary"]]

    def origin(record):
        return [record["provenance"][key] for key in ("commit", "dirty", "cpu", "cores")]

    def kind(record):
        return Kind(*(record[field] for field in Kind._fields))

    newest = {kind(r): origin(r) for r in records}
    kinds = {}
    for record in records:
        if origin(record) == newest[kind(record)]:
            kinds.setdefault((kind(record), record["ranks"]), []).append(record)
    return {key: Group(of_kind) for key, of_kind in sorted(kinds.items())}


class Curve:
    """Runs of one kind of study on more and more ranks."""

    def __init__(self, kind, groups, weak):
        self.kind, self.groups, self.weak = kind, groups, weak
        self.name = f"{'weak' if weak else 'strong'}: {kind.name()}"
        self.ranks = sorted(groups)
        self.timed = all(group.timed for group in groups.values())

    def short(self):
        return "weak" if self.weak else f"level {self.kind.level}"

    def speed_up(self, ranks):
        """Times the smallest number of ranks; where work grows with the ranks, of the work done in a second."""
        first = self.ranks[0]
        work = ranks / first if self.weak else 1
        return work * first * self.groups[first].median() / self.groups[ranks].median()

    def efficiency(self, ranks):
        return self.speed_up(ranks) / ranks

    def rows(self):
        for ranks in self.ranks:
            group = self.groups[ranks]
            timed = [f"{self.speed_up(ranks):.2f}", f"{100 * self.efficiency(ranks):.0f} %"] if self.timed else ["", ""]
            yield [
                self.name if ranks == self.ranks[0] else "", ranks, thousands(group.count("primal_dofs")),
                group.count("subdomains"), group.count("newton_iterations"), group.count("hessian_multiplications"),
                group.seconds(lambda s: s["time_total"]), *timed, group.seconds(lambda s: s["peak_rss_mb"] / s["ranks"]),
            ]


def curves(groups):
    """Strong and weak studies among the runs: those with more than one number of ranks."""
    strong, weak = {}, {}
    for (kind, ranks), group in groups.items():
        if kind.width == 1:
            strong.setdefault(kind, {})[ranks] = group
        if kind.width == ranks:
            weak.setdefault(kind._replace(width=1), {})[ranks] = group
    found = [Curve(kind, of, weak=False) for kind, of in strong.items() if len(of) > 1]
    return found + [Curve(kind, of, weak=True) for kind, of in weak.items() if len(of) > 1]


def numerical(groups):
    """Runs of one width on the most ranks, by scene, options and cells, then by level: where there are several levels."""
    found = {}
    for (kind, _), group in groups.items():
        if kind.width == 1:
            found.setdefault((kind.scene, kind.options, kind.cells), {})[kind.level] = group
    return {key: of_levels for key, of_levels in found.items() if len(of_levels) > 1}


def clusters(group):
    found = group.first.get("clusters", group.first["subdomains"])
    return "" if found == group.first["subdomains"] else thousands(found)


def coarse(group):
    found = phases(group)
    return f"{100 * found['coarse problem'] / sum(found.values()):.1f}" if group.timed else ""


def numerical_table(studies):
    head = ["", "level", "subdomains", "clusters", "primal unknowns", "dual unknowns", "Newton steps", "multiplications by F"]
    head += ["a Newton step", "seconds", "coarse problem, %", "ranks"]
    rows = []
    for (scene, options, cells), levels in studies.items():
        for place, (level, group) in enumerate(sorted(levels.items())):
            steps, products = group.count("newton_iterations"), group.count("hessian_multiplications")
            name = Kind(scene, options, level, 1, cells).name().replace(f", level {level}", "")
            rows.append(
                ["" if place else name, level, thousands(group.count("subdomains")), clusters(group)]
                + [thousands(group.count("primal_dofs")), thousands(group.count("dual_dofs")), steps, products]
                + [f"{products / steps:.1f}", group.seconds(lambda s: s["time_total"]), coarse(group), group.first["ranks"]]
            )
    return table(head, rows)


PARTS = ["factorisation", "dual operator", "preconditioner", "coarse problem", "inner products", "assembly", "internal forces", "messages"]
"""Phases that have a colour of their own, with what belongs to them."""
WITH = {"factorisation of the interior": "factorisation", "symbolic analysis": "factorisation", "clusters": "factorisation"}
WITH |= {"coarse set-up": "coarse problem"}


def phases(group):
    """Seconds of the run of median time by part; phases are on their slowest rank, what is left is other."""
    summary = group.summaries[(len(group.summaries) - 1) // 2]
    found = dict.fromkeys(PARTS, 0.0)
    found["messages"] = sum(row["seconds"] for row in summary["communication"].values())
    for phase, seconds in summary["time"].items():
        part = WITH.get(phase, phase)
        if part in found:
            found[part] += seconds
    return found | {"other": max(0.0, summary["time_total"] - sum(found.values()))}


def plots(folder, studies, of_levels):
    """Files and their text."""
    found = {}
    note = "" if all(study.timed for study in studies) else BUSY
    if studies:
        ranks = sorted({p for study in studies for p in study.ranks})
        ideal = ("ideal", {p: p for p in ranks}, True)
        series = [(study.short(), {p: study.speed_up(p) for p in study.ranks}, False) for study in studies]
        found["scaling-speedup.svg"] = plot.curves(f"Speed-up of the whole solve{note}", "ranks", "speed-up", [ideal, *series])
        ideal = ("ideal", dict.fromkeys(ranks, 1.0), True)
        series = [(study.short(), {p: study.efficiency(p) for p in study.ranks}, False) for study in studies]
        top = max(1.2, *(y for _, points, _ in series for y in points.values()))
        title = f"Parallel efficiency{note}"
        found["scaling-efficiency.svg"] = plot.curves(title, "ranks", "efficiency", [ideal, *series], y_top=top)
        columns = [(f"{study.short()} on {p}", phases(study.groups[p])) for study in studies for p in study.ranks]
        title = f"Time per phase, on its slowest rank{note}"
        found["scaling-phases.svg"] = plot.bars(title, "study on ranks", "seconds", columns)
    memory = [
        (study.short(), {p: study.groups[p].first["peak_rss_mb_max"] for p in study.ranks}, False) for study in studies
    ]
    if memory:
        found["scaling-memory.svg"] = plot.curves("Memory of a rank", "ranks", "MiB", memory)
    counts = [
        (f"{cells} cells", {g.count("subdomains"): g.count("hessian_multiplications") for g in levels.values()}, False)
        for (_, _, cells), levels in of_levels.items()
    ]
    if counts:
        title = "Multiplications by F, all Newton steps"
        found["scaling-counts.svg"] = plot.curves(title, "subdomains", "multiplications", counts)
    return {folder / name: text for name, text in found.items()}


def used():
    return [record for group in read(RAW).values() for record in group.records]


def pages(folder=RESULTS, raw=RAW):
    groups = read(raw)
    if not groups:
        return {}
    studies, of_levels = curves(groups), numerical(groups)
    found = plots(folder, studies, of_levels)
    text = [HEAD]
    if not all(group.timed for group in groups.values()):
        text.append(WHERE_BUSY)
    if studies:
        head = ["", "ranks", "primal unknowns", "subdomains", "Newton steps", "multiplications by F", "seconds", "speed-up"]
        rows = [row for study in studies for row in study.rows()]
        text += ["## Strong and weak\n", table([*head, "efficiency", "MiB a rank"], rows)]
    if of_levels:
        text += ["## Numerical\n", numerical_table(of_levels)]
    text += [f"![{path.stem}]({path.name})\n" for path in found]
    text += ["## Where the runs come from\n", circumstances(record for group in groups.values() for record in group.records)]
    return found | {folder / "scaling.md": "\n".join(text)}

