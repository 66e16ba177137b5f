"""Strong and weak scaling by counts: what each rank does and says, on far more ranks than there are cores.

Counts do not depend on the machine, so ranks may share cores. Seconds are shown where each rank has one. Strong: two-blocks at
--strong-level, cut into subdomains of --cells cells an edge. Weak: p ranks with p slices of 24 subdomains (slice.toml). Newton's
method ends at 30 %, after a few steps: these have all phases, and more of them only repeat the same. On a cluster use jobs/study.
"""

import argparse
import os
import pathlib

from . import measure, plot, scaling
from .groups import circumstances, thousands
from .measure import RESULTS
from .pages import table, write

RAW = measure.RAW / "study"
SLICE = pathlib.Path(__file__).with_name("slice.toml")
LOOSE = "--set solver.newton_tolerance=0.3 --set solver.residual_tolerance=0.3"
READ = ("time", "counts", "counts_total", "partners")

SHARING = {
    "OMPI_MCA_mpi_yield_when_idle": "1", "OMPI_MCA_coll_tuned_use_dynamic_rules": "1",
    "OMPI_MCA_coll_tuned_alltoallv_algorithm": "1", "OMPI_MCA_coll_tuned_allgatherv_algorithm": "1",
}
"""Open MPI where ranks share cores: who waits lets others work, and collective calls take one round instead of one a rank."""

HEAD = """\
# Scaling by counts

Written by `scripts/bench write study` from the newest commit's runs in [raw/study](raw/study), which `scripts/study` made.
Each number is a [count](../docs/results.md#counts) of the program itself, free of noise; ranks share cores where there are more.
*Strong* is one problem on more and more ranks, *weak* one with 24 subdomains for each rank. Runs end after a few Newton steps.
Seconds are shown where each rank has a core.

- *all ranks together*: sum over the ranks, over that on the fewest ranks (per rank in weak scaling). More than 1 is work that
  ranks repeat.
- *busiest / mean*: of the ranks.
- *MiB of their own*: largest memory of all ranks without pages that processes of a host share (libraries, messages between
  them); *MiB resident* counts these for each.
- *messages of an F*: to single ranks, in one application of F, on the busiest rank.
"""


def ranks_of(text):
    return [int(word) for word in text.split(",")]


def arguments(parser):
    parser.add_argument("--kinds", nargs="+", choices=["strong", "weak"], default=["strong", "weak"])
    parser.add_argument("--ranks", type=ranks_of, nargs="+", default=[[1, 2, 4, 8, 16, 32, 64]], help="1,2,4 or 1 2 4")
    parser.add_argument("--strong-level", type=int, default=2)
    parser.add_argument("--cells", type=int, default=2, help="cells along the edge of a subdomain, strong")
    parser.add_argument("--limit", type=float, default=900, help="seconds after which a run is ended")
    parser.add_argument("--out", type=pathlib.Path, help="folder of runs, tables and plots instead of bench-results")
    measure.add_repeat(parser, 1)
    measure.add_arguments(parser)


def run(arguments):
    program = measure.Program(arguments)
    wanted, cores = list(runs(arguments)), os.cpu_count()
    failed = 0
    own, shared = [r for r in wanted if r.ranks <= cores], [r for r in wanted if r.ranks > cores]
    for some, settings in ((own, {}), (shared, {} if program.shared else SHARING)):
        program.environment = program.environment | settings
        if some:
            failed += measure.run(some, arguments, arguments.out or RAW, READ, program, arguments.limit)
    if arguments.out:
        write(pages(arguments.out, arguments.out))
    return 1 if failed else 0


def runs(arguments):
    """Everything to run, once, as `scaling` does it."""
    ranks = [number for some in arguments.ranks for number in some]
    common = {"ranks": ranks, "options": LOOSE, "levels": []}
    strong = argparse.Namespace(
        kinds=["strong"], scene="two-blocks", strong_level=arguments.strong_level, cells=[arguments.cells], **common
    )
    weak = argparse.Namespace(kinds=["weak"], scene=str(SLICE), weak_level=1, cells=[2], **common)
    for of_kind in (strong, weak):
        if of_kind.kinds[0] in arguments.kinds:
            for one in scaling.runs(of_kind):
                yield one._replace(label={**one.label, "scene": pathlib.Path(of_kind.scene).stem})


def ratio(load):
    return load["busiest"] / load["mean"] if load["mean"] else 1.0


def total(group):
    return group.first["counts_total"]


class Curve(scaling.Curve):
    """Runs of one kind on more and more ranks, by counts."""

    def short(self):
        return "weak" if self.weak else "strong"

    def together(self, ranks, key):
        """What all ranks count, as in `over_fewest`."""
        return self.over_fewest(ranks, lambda group, ranks: total(group)[key]["mean"] * ranks)

    def over_fewest(self, ranks, amount):
        """An amount of all ranks over that of the fewest; of the work for one rank where work grows with the ranks."""

        def share(ranks):
            return amount(self.groups[ranks], ranks) / (ranks if self.weak else 1)

        return share(ranks) / share(self.ranks[0])

    def work_rows(self):
        for ranks in self.ranks:
            group = self.groups[ranks]
            of = total(group)
            timed = group.timed and ranks <= group.records[0]["provenance"]["cores"]
            yield [
                self.short() if ranks == self.ranks[0] else "", ranks, thousands(group.count("subdomains")),
                group.count("newton_iterations"), group.count("hessian_multiplications"),
                f"{self.together(ranks, 'flops'):.2f}", f"{self.together(ranks, 'bytes'):.2f}",
                f"{ratio(of['flops']):.2f}", f"{ratio(of['bytes']):.2f}",
                thousands(round(group.first["peak_private_mb"])),
                f"{self.over_fewest(ranks, lambda group, _: group.first['peak_private_mb']):.2f}",
                thousands(round(group.first["peak_rss_mb"])), thousands(round(group.first["peak_rss_mb_max"])),
                group.seconds(lambda s: s["time_total"]) if timed else "",
            ]

    def message_rows(self):
        for ranks in (p for p in self.ranks if p > 1):
            group = self.groups[ranks]
            of, partners = total(group), group.first["partners"]
            yield [
                self.short() if ranks == self.ranks[1] else "", ranks, f"{partners['busiest']:.0f}", f"{partners['mean']:.1f}",
                f"{of_operator(group):.1f}", f"{ratio(of['messages']):.2f}", f"{size(group) / 1024:.1f}",
                f"{ratio(of['bytes_sent']):.2f}", f"{mib(of['bytes_sent']['busiest'])}", f"{mib(of['bytes_received']['busiest'])}",
                mib(of["largest_message"]["busiest"]),
            ]


def of_operator(group):
    """Messages of the busiest rank in one application of F."""
    return group.first["counts"]["dual operator"]["messages"]["busiest"] / group.count("hessian_multiplications")


def size(group):
    """Mean length of a message between neighbours in an application of F, in bytes."""
    of = group.first["counts"]["dual operator"]
    return of["bytes_sent"]["mean"] / of["messages"]["mean"]


def mib(bytes):
    return f"{bytes / 2**20:.2f}"


def phase_table(curve):
    """What the phases do on the most ranks, beside the fewest; the phase with the most work of a rank first."""
    first, last = curve.groups[curve.ranks[0]], curve.groups[curve.ranks[-1]]
    most = curve.ranks[-1]
    head = [f"{curve.short()}, {most} ranks", "% of a rank's flops", "flops together", "flops, busiest / mean"]
    head += ["bytes, busiest / mean", "messages", "busiest / mean", "MiB sent", "MiB received", "longest, KiB"]
    rows = []
    counts, before = last.first["counts"], first.first["counts"]
    for name in sorted(counts, key=lambda name: -counts[name]["flops"]["mean"]):
        of = counts[name]
        at_first = before.get(name, of)["flops"]["mean"] * (1 if curve.weak else curve.ranks[0] / most)
        busiest = [of[key]["busiest"] for key in ("messages", "bytes_sent", "bytes_received", "largest_message")]
        rows.append([
            name, f"{100 * of['flops']['mean'] / total(last)['flops']['mean']:.1f}",
            f"{of['flops']['mean'] / at_first:.2f}" if at_first else "", f"{ratio(of['flops']):.2f}", f"{ratio(of['bytes']):.2f}",
            f"{busiest[0]:.0f}", f"{ratio(of['messages']):.2f}", mib(busiest[1]), mib(busiest[2]), f"{busiest[3] / 1024:.1f}",
        ])
    return table(head, rows)


def growth_table(curve):
    """In weak scaling: what the busiest rank gets in a phase, and the longest message there, which should not grow at all."""
    several = [p for p in curve.ranks if p > 1]
    shown = several[-3:]
    head = ["weak", *(f"longest, KiB, {p} ranks" for p in shown), *(f"MiB received, {p} ranks" for p in shown), "grows"]
    rows = []
    for name, of in curve.groups[shown[-1]].first["counts"].items():
        each = [curve.groups[p].first["counts"].get(name, of) for p in shown]
        longest = [e["largest_message"]["busiest"] for e in each]
        received = [e["bytes_received"]["busiest"] for e in each]
        if longest[-1]:
            grows = max(((values[-1] / values[0]) for values in (longest, received) if values[0]), default=1.0)
            told = "with the ranks" if grows > 0.7 * shown[-1] / shown[0] else "" if grows < 1.3 else "slowly"
            rows.append([name, *(f"{x / 1024:.1f}" for x in longest), *map(mib, received), told])
    return table(head, sorted(rows, key=lambda row: row[-1] != "with the ranks"))


def plots(folder, curves):
    """Files and their text."""
    found = {}

    def add(name, title, y_label, series):
        series = [(of, points, False) for of, points in series if points]
        if series:
            found[folder / f"study-{name}.svg"] = plot.curves(title, "ranks", y_label, series)

    def over(curve, value, least=1):
        return {p: value(curve.groups[p]) for p in curve.ranks if p >= least}

    keys = {"flops": "flops", "bytes": "bytes read", "messages": "messages", "bytes_sent": "bytes sent"}
    for curve in curves:
        name = curve.short()
        series = [(word, over(curve, lambda g, key=key: ratio(total(g)[key]))) for key, word in keys.items()]
        add(f"balance-{name}", f"Busiest rank over the mean, {name}", "busiest / mean", series)
    add("work", "Flops of all ranks together, over those on the fewest", "times", [
        (curve.short(), {p: curve.together(p, "flops") for p in curve.ranks}) for curve in curves
    ])
    add("partners", "Partners of a rank", "other ranks", [
        (f"{curve.short()}, {word}", over(curve, lambda g, key=key: g.first["partners"][key], 2))
        for curve in curves for key, word in (("busiest", "largest"), ("mean", "mean"))
    ])
    add("sizes", "Length of messages", "bytes", [
        (f"{curve.short()}, {word}", over(curve, value, 2)) for curve in curves
        for word, value in (("F, mean", size), ("longest of all", lambda g: total(g)["largest_message"]["busiest"]))
    ])
    add("memory", "Memory of all ranks together", "MiB", [
        (curve.short(), over(curve, lambda g: g.first["peak_private_mb"])) for curve in curves
    ])
    return found


def used():
    return [record for group in scaling.read(RAW).values() for record in group.records]


def pages(folder=RESULTS, raw=RAW):
    groups = scaling.read(raw)
    curves = [Curve(curve.kind, curve.groups, curve.weak) for curve in scaling.curves(groups)]
    if not curves:
        return {}
    head = ["", "ranks", "subdomains", "Newton steps", "multiplications by F", "flops, all ranks together", "bytes, all together"]
    head += ["flops, busiest / mean", "bytes, busiest / mean", "MiB of their own", "all together",
             "MiB resident", "MiB, largest rank", "seconds"]
    text = [HEAD, "## Work and memory\n", table(head, [row for curve in curves for row in curve.work_rows()])]
    head = ["", "ranks", "partners, most", "mean", "messages of an F", "messages, busiest / mean", "KiB a message of F"]
    head += ["sent, busiest / mean", "MiB sent, busiest", "MiB received, busiest", "longest, MiB"]
    text += ["## Messages\n", table(head, [row for curve in curves for row in curve.message_rows()])]
    text += ["## Phases\n", *map(phase_table, curves)]
    if growing := [growth_table(curve) for curve in curves if curve.weak and len([p for p in curve.ranks if p > 1]) > 1]:
        text += ["## What grows with the ranks\n", "Of the busiest rank. Work for a rank is the same: nothing should grow.\n", *growing]
    found = plots(folder, curves)
    text += [f"![{path.stem}]({path.name})\n" for path in found]
    text += ["## Where the runs come from\n", circumstances(record for group in groups.values() for record in group.records)]
    return found | {folder / "study.md": "\n".join(text)}
