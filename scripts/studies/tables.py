"""The paper's Tables 1 and 2, beside the paper's numbers and independent references.

All levels of SMALSE-M without a preconditioner take hours. What has not been measured stays blank on the page; its short form also
goes between `<!-- measured: -->` and `<!-- /measured -->` in the README and in docs. With --out, runs and one table go to a folder
of their own: for a cluster, see jobs/table1 and jobs/table2.
"""

import itertools
import json
import pathlib
import sys

from . import kernels, measure, plot
from .groups import Group, circumstances, measured, thousands
from .measure import RESULTS, Run
from .pages import table

RAW = measure.RAW / "tables"


class Variant:
    """A way to solve the benchmark. `name` is QP solver/preconditioner, with /cascade behind if coarser levels give the start."""

    def __init__(self, name, levels, cascade, more=()):
        qp, preconditioner = name.split("/")[:2]
        self.name = name
        self.levels = levels
        self.options = ["--qp", qp, "--preconditioner", preconditioner, "--cascade", cascade, *more]

    def choose(self, levels):
        """Its own levels, or the wanted ones from its first on."""
        return self.levels if levels is None else [level for level in levels if level >= self.levels[0]]


VARIANTS = [
    Variant("smalse-m/none", [1, 2, 3, 4], cascade="off", more=["--set", "solver.precision=double"]),
    Variant("smalse-m/dirichlet", [1, 2, 3, 4], cascade="off"),
    Variant("active-set/dirichlet", [1, 2, 3, 4], cascade="off"),
    Variant("active-set/lumped/cascade", [2, 3, 4], cascade="auto"),
    # The default of the program. Level 1 has no coarser one.
    Variant("active-set/dirichlet/cascade", [2, 3, 4], cascade="auto"),
]
"""What is measured, the paper's method first, and at which levels of Table 2."""

NAMES = [variant.name for variant in VARIANTS]

PAPER = json.loads((RESULTS / "paper.json").read_text())
REFERENCES = json.loads((RESULTS / "reference.json").read_text())["levels"]

RANKS = 2
"""Ranks of Table 2, the numerical scalability."""

TABLE_1 = [("smalse-m/none", 2, [1, 2]), ("active-set/dirichlet", 3, [1, 2])]
"""Variant, level and ranks of Table 1, the parallel scalability."""

READ = ("time", "work", "communication", "newton", "cascade")
READ += ("contacts", "contact_force", "contact_forces", "reactions")
"""Tables of the summary that the page reads, or compares between numbers of ranks."""

PAPERS_CRITERION = 1e-4
"""Newton's criterion in the paper. fetiplast also asks for a small residual and may take a step more."""

RESIDUALS = ("equilibrium", "gluing", "gap", "complementarity")

HEAD = """\
# Tables 1 and 2, measured

Written by `scripts/bench write tables` from the runs in [raw/tables](raw/tables), which `scripts/bench run tables` measured; the
paper's numbers are in [paper.json](paper.json), those of independent programs in [reference.json](reference.json). Variants are
named QP solver/preconditioner. `smalse-m/none` is the paper's method, with factors in double precision; the others keep factors
in single precision where a probe allows it. All start from rest but `active-set/dirichlet/cascade`, the default of the program,
which starts from the solution of the coarser levels. All runs use the paper's tolerances: 1e-4 for Newton's method in the energy
norm, 1e-7 for the QP; early Newton steps solve theirs less exactly, as far as their own progress allows.

How to read them:

- Counts are the point. They are the same in every repetition and on every number of ranks. Times are medians of the
  repetitions with smallest and largest value; the paper's come from other processors, Matlab and other numbers of cores, so
  they stand there for completeness only.
- "Multiplications by F" are all applications of the dual operator, those for norm estimates and residuals included. With a
  cascade, counts are those of the level itself; rows that say "all levels" add the coarser ones. Times and memory always
  belong to the whole run.
- fetiplast ends Newton's method when the paper's criterion *and* a relative residual of 1e-6 are met. The rows "until the
  paper's criterion" count up to the step that meets the paper's criterion alone.
- The paper gives no coordinates of its bodies. The scene used here reproduces every size of the mesh and of the dual problem
  in Table 2, but not the numbers of plastic elements: ours are larger from level 1 on, and their share grows with refinement
  where the paper's shrinks. No variant of load, supports or element split that was tried removes the difference, so some
  property of the paper's model remains unknown. Independent programs on our scene give our numbers (second table of each
  level); those are the ones to be right against.
- One multiplication by F takes as long as reading its factors. Elastic subdomains of one shape share one, and their part grows
  with the level: the time per unknown falls as the bytes do.
- Memory is the sum over the ranks of their largest resident memory.
"""


DEFAULT = "active-set/dirichlet/cascade"
"""What the program does by itself."""

PROFILE = """\
`{variant}` at level {level} on {ranks} ranks, the run of median time{coarser}. Each phase is on its slowest rank, without
messages; those stand at the end, waiting for other ranks included. Outside messages the busiest rank spends {imbalance:.2f}
times as long as the least busy one. Rates are of the work that must be done: additions and multiplications of the factors,
and bytes of the factors that each application reads, shared ones once for all that are solved together. They stand against the limits of as many cores as there are ranks, taken one at a time
([kernels.md](kernels.md)): the product of matrices in single precision, and reading memory in order. A solve for eight at
once does eight times the work on what it reads, so `dual operator` and `preconditioner` lie between both limits.

"""

NEXT_HALF = """What the next factor of two would take: {half} s of {total} s must go. F and the preconditioner take {apply} s, {least_apply} s with
all they read at the limit; factors take {factorise} s, {least_factorise} s at the limit; everything else takes {rest} s. At both limits
the run would still take {least} s, so faster kernels alone do not halve it. It takes less work as well: fewer bytes (factors in half
precision), fewer applications (directions that outlive a Newton step), fewer factors (those that differ from the last in a few
elements only, corrected), and half of everything else.
"""


def arguments(parser):
    parser.add_argument("--levels", type=int, nargs="+", help="these only; without it 1 to 3 or 4, as the variant allows")
    parser.add_argument("--variants", nargs="+", choices=NAMES, default=NAMES, metavar="NAME", help=", ".join(NAMES))
    parser.add_argument("--table", type=int, choices=[1, 2], help="this one only")
    parser.add_argument("--out", type=pathlib.Path, help="folder of runs and table, seen by all nodes; needs --table and --levels")
    parser.add_argument("--ranks", type=int, nargs="+", help="numbers of ranks, with --out; Table 2 is of the last")
    measure.add_repeat(parser, 1)
    measure.add_arguments(parser)


def run(arguments):
    wanted = [variant for variant in VARIANTS if variant.name in arguments.variants]
    if arguments.out:
        return run_apart(arguments, wanted)
    runs = []
    if arguments.table != 1:
        # Level by level: the quick runs come first.
        highest = max(arguments.levels or [4])
        runs += [(n, v, RANKS) for n in range(1, highest + 1) for v in wanted if n in v.choose(arguments.levels)]
    if arguments.table != 2:
        by_name = {variant.name: variant for variant in wanted}
        rows = [row for row in TABLE_1 if row[0] in by_name and row[1] in (arguments.levels or [row[1]])]
        runs += [(level, by_name[name], ranks) for name, level, of_row in rows for ranks in of_row]
    failed = measure.run(kinds(runs), arguments, RAW, READ)
    return 1 if failed else 0


def run_apart(arguments, wanted):
    """One table from the runs of one file."""
    if not (arguments.table and arguments.levels and arguments.ranks):
        sys.exit("scripts/bench: run tables --out needs --table, --levels and --ranks")
    ranks = arguments.ranks if arguments.table == 1 else arguments.ranks[-1:]
    runs = kinds(itertools.product(arguments.levels, wanted, ranks))
    failed = measure.run(runs, arguments, arguments.out, READ)
    text = table_of(arguments.table, arguments.out, arguments.variants, arguments.levels, ranks)
    (arguments.out / f"table{arguments.table}.md").write_text(text)
    return 1 if failed else 0


def kinds(runs):
    """Each (level, variant, ranks) once, with the paper's tolerances, which are the scene's own."""
    return [
        Run(
            {"level": level, "variant": variant.name, "ranks": ranks},
            ["two-blocks", "--level", str(level), *variant.options],
            ranks,
        )
        for level, variant, ranks in dict.fromkeys(runs)
    ]


def read(folder, variants=NAMES):
    """Groups by (level, variant, ranks); runs that failed, and variants that are measured no more, are left out."""
    found = {}
    for record in measure.read(folder):
        if record["exit_code"] == 0 and record["summary"] and record["variant"] in variants:
            found.setdefault((record["level"], record["variant"], record["ranks"]), []).append(record)
    return {kind: Group(records) for kind, records in found.items()}


def share(numbers):
    """Plastic elements in per cent; a cell has six tetrahedra."""
    return f"{100 * numbers['plastic_elements'] / (6 * numbers['cells']):.1f} %" if numbers else ""


def outer_iterations(summary):
    """Of either QP solver; both have some where SMALSE-M stepped in."""
    return (summary["smalse_iterations"] or 0) + (summary["active_set_iterations"] or 0)


def largest_residual(summary):
    values = [summary[f"residual_{name}"] for name in RESIDUALS]
    return max(value for value in values if value is not None)


def until_papers_criterion(summary):
    rows = summary["newton"]
    met = next((i for i, row in enumerate(rows) if row["criterion"] <= PAPERS_CRITERION), len(rows) - 1)
    return rows[: met + 1]


def cost_table(groups, paper):
    """What a level costs: the paper's column, then ours."""

    def row(name, key, of_group):
        of_paper = thousands(paper.get(key)) if paper else ""
        return [name, of_paper, *(of_group(group) for group in groups.values())]

    def count(name, key):
        return row(name, key, lambda group: thousands(group.count(key)))

    def one_product(summary):
        """Of F, in nanoseconds for each unknown on each rank. Times with a cascade belong to several sizes."""
        products = summary["hessian_multiplications"] * summary["primal_dofs"]
        return 1e9 * summary["time"]["dual operator"] * summary["ranks"] / products

    def read_by_product(summary):
        """Of the factors, in bytes for each unknown: elastic subdomains of one shape share theirs."""
        if summary["cascade"]:
            return ""
        products = summary["hessian_multiplications"] * summary["primal_dofs"]
        return measured(summary["work"]["dual operator"]["bytes"] / products)

    rows = [
        count("mesh nodes", "nodes"),
        count("mesh elements (cells of 6 tetrahedra)", "cells"),
        count("subdomains", "subdomains"),
        row("cores", "ranks", lambda group: group.first["ranks"]),
        count("primal variables", "primal_dofs"),
        count("dual variables", "dual_dofs"),
        count("plastic elements", "plastic_elements"),
        ["share of all tetrahedra", share(paper), *(share(group.first) for group in groups.values())],
        count("Newton steps", "newton_iterations"),
        row("... until the paper's criterion", "", lambda group: len(until_papers_criterion(group.first))),
        row("... on all levels", "", lambda group: thousands(group.of_all_levels("newton_iterations"))),
        row("outer QP iterations", "smalse_iterations", lambda group: thousands(outer_iterations(group.first))),
        count("multiplications by F", "hessian_multiplications"),
        row(
            "... until the paper's criterion",
            "",
            lambda group: sum(step["hessian_multiplications"] for step in until_papers_criterion(group.first)),
        ),
        row("... on all levels", "", lambda group: thousands(group.of_all_levels("hessian_multiplications"))),
        count("preconditioner applications", "preconditioner_applications"),
        count("factorisations of subdomains", "factorisations"),
        row("last Newton step [s]", "time_last_newton", lambda g: g.seconds(lambda s: s["newton"][-1]["seconds"])),
        row(
            "one multiplication by F per primal unknown and core [ns]",
            "",
            lambda group: "" if group.first["cascade"] else group.seconds(one_product),
        ),
        row(
            "... bytes of factors that it reads per primal unknown",
            "",
            lambda group: read_by_product(group.first),
        ),
        row("total time [s]", "time_total", lambda group: group.seconds(lambda summary: summary["time_total"])),
        row(
            "... of it on coarser levels",
            "",
            lambda g: g.seconds(lambda s: sum(r["seconds"] for r in s["cascade"])) if g.first["cascade"] else "",
        ),
        row("... with start and end of the processes", "", lambda group: group.wall()),
        row("memory [MiB]", "", lambda group: group.seconds(lambda summary: summary["peak_rss_mb"])),
        row("repetitions", "", lambda group: len(group.records)),
    ]
    return table(["", "paper", *groups], [r for r in rows if any(r[1:])])


def result_table(groups, reference):
    """What came out: the reference's column, then ours."""

    def row(name, key, value, form):
        of_reference = form(reference[key]) if key in reference else ""
        return [name, of_reference, *(form(value(group.first)) for group in groups.values())]

    def error(name, key, value):
        if key not in reference:
            return None
        errors = (abs(value(group.first) / reference[key] - 1) for group in groups.values())
        return [f"... relative difference of {name}", "", *(f"{e:.1e}" for e in errors)]

    def residual(name):
        values = (group.first[f"residual_{name}"] for group in groups.values())
        return [f"residual: {name}", "", *("" if value is None else f"{value:.1e}" for value in values)]

    quantities = [
        ("energy J", "energy", lambda s: s["energy"]),
        ("contact force", "contact_force", lambda s: s["contact_force"][2]),
        ("largest displacement", "max_displacement", lambda s: s["max_displacement"]),
        ("largest von Mises stress", "max_von_mises", lambda s: s["max_von_mises"]),
    ]
    rows = []
    for name, key, value in quantities:
        rows += [row(name, key, value, lambda v: f"{v:.10g}"), error(name, key, value)]
    rows += [
        row("plastic elements", "plastic_elements", lambda s: s["plastic_elements"], thousands),
        row("active contact pairs", "active_contacts", lambda s: s["active_contacts"], thousands),
        *(residual(name) for name in RESIDUALS),
    ]
    return table(["", "reference", *groups], [r for r in rows if r])


class Levels:
    """Makes rows of what all levels gave."""

    def __init__(self, levels, paper):
        self.levels, self.paper = levels, paper
        self.numbers = sorted({*levels, *(int(level) for level in paper)})
        self.variants = list(dict.fromkeys(variant for groups in levels.values() for variant in groups))

    def group(self, level, variant):
        return self.levels.get(level, {}).get(variant)

    def of_paper(self, name, value):
        return [name, *(value(self.paper[str(n)]) if str(n) in self.paper else "" for n in self.numbers)]

    def of_variants(self, title, value):
        """A row for each variant that has something to say."""
        groups = {variant: [self.group(n, variant) for n in self.numbers] for variant in self.variants}
        rows = [[f"{title}, {v}", *(value(g) if g else "" for g in of_variant)] for v, of_variant in groups.items()]
        return [row for row in rows if any(row[1:])]

    def growth(self, title, key):
        """Counts relative to those of one level."""

        def relative(name, counts):
            base = counts.get(GROWTH_FROM)
            return [name, *(f"{counts[n] / base:.2f}" if base and n in counts else "" for n in self.numbers)]

        rows = [relative(f"{title}, paper", {int(n): row[key] for n, row in self.paper.items()})]
        for variant in self.variants:
            groups = {n: self.group(n, variant) for n in self.numbers}
            counts = {n: group.count(key) for n, group in groups.items() if group}
            if GROWTH_FROM in counts:
                rows.append(relative(f"{title}, {variant}", counts))
        return rows


GROWTH_FROM = 2
"""Level that growth is measured from; the 6 subdomains of the first say little."""


def scalability(levels, ranks):
    """Counts, times and memory at all levels: the short form of Table 2."""
    rows = [
        levels.of_paper("subdomains", lambda p: p["subdomains"]),
        levels.of_paper("dual unknowns", lambda p: thousands(p["dual_dofs"])),
    ]
    for title, key in (("Newton steps", "newton_iterations"), ("multiplications by F", "hessian_multiplications")):
        rows.append(levels.of_paper(f"{title}, paper", lambda p: thousands(p[key])))
        rows += levels.of_variants(title, lambda g: thousands(g.count(key)))
        rows += levels.of_variants(f"{title} on all levels", lambda g: thousands(g.of_all_levels(key)))
    rows += levels.of_variants(f"seconds on {ranks} ranks", lambda g: g.seconds(lambda s: s["time_total"]))
    rows += levels.of_variants(f"MiB on {ranks} ranks", lambda g: g.seconds(lambda s: s["peak_rss_mb"]))
    return table(["level", *levels.numbers], rows)


def growth(levels):
    """How counts grow with the number of subdomains."""
    rows = levels.growth("Newton steps", "newton_iterations")
    rows += levels.growth("multiplications by F", "hessian_multiplications")
    return table(["level", *levels.numbers], rows)


def accuracy(levels):
    """How right the solutions are, at all levels."""

    def difference(key, value):
        def of_group(group):
            expected = REFERENCES.get(str(group.first["level"]), {}).get(key)
            return "" if expected is None else f"{abs(value(group.first) / expected - 1):.1e}"

        return of_group

    rows = levels.of_variants("largest residual", lambda g: f"{largest_residual(g.first):.1e}")
    rows += levels.of_variants("difference of J", difference("energy", lambda s: s["energy"]))
    force = difference("contact_force", lambda summary: summary["contact_force"][2])
    rows += levels.of_variants("difference of contact force", force)
    return table(["level", *levels.numbers], rows)


def profile(levels):
    """Where the time goes: phases of the default at the highest level, each against the machine's limits."""
    timed = {n: {v: g for v, g in groups.items() if g.timed} for n, groups in levels.levels.items()}
    level = max(n for n, groups in timed.items() if groups)
    candidates = timed[level]
    variant, group = DEFAULT, candidates.get(DEFAULT)
    if group is None:
        variant, group = min(candidates.items(), key=lambda item: item[1].median())
    summary = group.summaries[(len(group.summaries) - 1) // 2]
    total, ranks = summary["time_total"], summary["ranks"]
    limits = kernels.limits(kernels.newest())
    flops, read = ranks * limits["gemm_single_gflops"], ranks * limits["read_gb_per_s"]

    def against(name, seconds):
        work = summary["work"].get(name, {})
        done = [(work.get("flops", 0), flops, "GF/s"), (work.get("bytes", 0), read, "GB/s")]
        rates = [(amount / seconds / 1e9, limit, unit) for amount, limit, unit in done if amount]
        return ", ".join(f"{rate:.3g} of {limit:.3g} {unit} ({100 * rate / limit:.0f} %)" for rate, limit, unit in rates)

    phases = sorted(summary["time"].items(), key=lambda phase: -phase[1])
    rows = [[name, f"{s:.3g}", f"{100 * s / total:.1f} %", against(name, s)] for name, s in phases]
    messages = summary["communication"]
    for kind, row in messages.items():
        volume = f"{row['megabytes']:.3g} MiB in {thousands(row['calls'])} calls"
        rows.append([kind, f"{row['seconds']:.3g}", f"{100 * row['seconds'] / total:.1f} %", volume])
    # Ranks are slow in different phases, so that all together may exceed the total.
    other = max(0.0, total - sum(seconds for _, seconds in phases) - sum(row["seconds"] for row in messages.values()))
    rows += [["other", f"{other:.3g}", f"{100 * other / total:.1f} %", ""], ["total", f"{total:.3g}", "", ""]]
    coarser = ", coarser levels included" if summary["cascade"] else ""
    imbalance = summary["imbalance"] or 1.0
    text = PROFILE.format(variant=variant, level=level, ranks=ranks, coarser=coarser, imbalance=imbalance)
    return text + table(["phase", "seconds", "share", "rate, all ranks"], rows) + "\n" + next_half(summary, flops, read)


def next_half(summary, flops, read):
    """What would halve the time of a run, against limits of work in GF/s and GB/s."""
    applying, factorising = ("dual operator", "preconditioner"), ("factorisation", "factorisation of the interior")

    def taken(names):
        return sum(summary["time"].get(name, 0) for name in names)

    def least(names):
        work = [summary["work"].get(name, {}) for name in names]
        return sum(max(w.get("flops", 0) / flops, w.get("bytes", 0) / read) / 1e9 for w in work)

    total, apply, factorise = summary["time_total"], taken(applying), taken(factorising)
    rest = total - apply - factorise
    numbers = {"total": total, "half": total / 2, "apply": apply, "factorise": factorise, "rest": rest}
    numbers |= {"least_apply": least(applying), "least_factorise": least(factorising)}
    numbers["least"] = rest + numbers["least_apply"] + numbers["least_factorise"]
    return NEXT_HALF.format(**{name: f"{value:.3g}" for name, value in numbers.items()})


def table_1(groups, study):
    """Parallel scalability: the same problem on more and more ranks."""
    paper = PAPER["table1"]
    head = ["", "ranks", "Newton steps", "outer QP iterations", "multiplications by F", "last Newton step [s]"]
    head += ["total time [s]", "speed-up", "memory [MiB]"]
    rows = [
        [f"paper, level {paper['level']}", p["ranks"], p["newton_iterations"], p["smalse_iterations"]]
        + [thousands(p["hessian_multiplications"]), thousands(p["time_last_newton"]), thousands(p["time_total"])]
        + [f"{paper['rows'][0]['time_total'] / p['time_total']:.2f}", ""]
        for p in paper["rows"]
    ]
    equal = []
    for variant, level, ranks in study:
        found = [(r, groups[level, variant, r]) for r in ranks if (level, variant, r) in groups]
        for r, group in found:
            rows.append(
                [f"{variant}, level {level}", r, group.count("newton_iterations"), outer_iterations(group.first)]
                + [thousands(group.count("hessian_multiplications"))]
                + [group.seconds(lambda s: s["newton"][-1]["seconds"]), group.seconds(lambda s: s["time_total"])]
                + [f"{found[0][1].median() / group.median():.2f}" if found[0][0] == ranks[0] else ""]
                + [group.seconds(lambda s: s["peak_rss_mb"])]
            )
        if len(found) > 1 and len({g.records[0]["provenance"]["commit"] for _, g in found}) == 1:
            equal.append(equality(variant, level, [group.first for _, group in found]))
    return table(head, rows) + "\n" + " ".join(equal) + "\n"


DEPENDS_ON_RANKS = {"ranks", "time", "work", "communication", "time_total", "peak_rss_mb", "memory_estimate_mb"}
DEPENDS_ON_RANKS |= {"counts", "counts_total", "partners", "newton", "cascade", "imbalance", "peak_private_mb", "peak_rss_mb_max"}


def equality(variant, level, summaries):
    """Whether everything but times and memory is the same, to the last bit."""

    def essence(summary):
        rows = [{k: v for k, v in row.items() if k != "seconds"} for row in summary["newton"] + summary["cascade"]]
        return {k: v for k, v in summary.items() if k not in DEPENDS_ON_RANKS} | {"steps": rows}

    differing = [k for k, v in essence(summaries[0]).items() if any(essence(s)[k] != v for s in summaries)]
    if differing:
        return f"**`{variant}`, level {level}: runs on other numbers of ranks differ in {', '.join(differing)}.**"
    return f"`{variant}`, level {level}: every number of the summary but times and memory is equal to the last bit on all of these."


def used():
    return [record for group in read(RAW).values() for record in group.records]


def by_level(groups, ranks):
    """Groups by level, then by variant."""
    found = {}
    for level, variant, on in sorted(groups, key=lambda kind: (kind[0], NAMES.index(kind[1]))):
        if on == ranks:
            found.setdefault(level, {})[variant] = groups[level, variant, on]
    return found


def table_2(levels, heading):
    """Numerical scalability: what each level costs, and what comes out."""
    for level, groups in levels.items():
        yield f"## {heading} {level}\n"
        yield cost_table(groups, PAPER["table2"].get(str(level), {}))
        yield result_table(groups, REFERENCES.get(str(level), {}))


def short():
    """For the README."""
    return scalability(Levels(by_level(read(RAW), RANKS), PAPER["table2"]), RANKS)


def pages():
    groups = read(RAW)
    levels = by_level(groups, RANKS)
    all_levels = Levels(levels, PAPER["table2"])
    text = [HEAD, "## Table 2 in short\n", scalability(all_levels, RANKS), "![Multiplications by F against subdomains](scalability.svg)\n"]
    text += [f"## Growth, level {GROWTH_FROM} = 1\n", growth(all_levels)]
    if levels:
        text += ["## Accuracy: residuals, and relative difference from independent programs\n"]
        text += [accuracy(all_levels), "## Where the time goes\n", profile(all_levels)]
    text += table_2(levels, "Table 2, level")
    text += ["## Table 1: one problem on more ranks\n", table_1(groups, TABLE_1)]
    text += ["## Where the runs come from\n", circumstances(used())]

    by_variant = {}
    for of_level in levels.values():
        for variant, group in of_level.items():
            by_variant.setdefault(variant, {})[group.first["subdomains"]] = group.count("hessian_multiplications")
    of_paper = {row["subdomains"]: row["hessian_multiplications"] for row in PAPER["table2"].values()}
    series = [("paper", of_paper), *by_variant.items()]
    x_values = sorted({x for _, points in series for x in points})
    chart = plot.chart("Multiplications by F, all Newton steps", "subdomains", "multiplications", x_values, series)

    return {RESULTS / "tables.md": "\n".join(text), RESULTS / "scalability.svg": chart}


def table_of(number, folder, variants, levels, ranks):
    """Table 1 or 2 beside the paper's, from the runs of a folder."""
    groups = read(folder, variants)
    if not groups:
        sys.exit(f"scripts/bench: no run of {folder} succeeded")
    if number == 1:
        tables = [table_1(groups, [(variant, level, ranks) for variant in variants for level in levels])]
    else:
        tables = table_2(by_level(groups, ranks[-1]), "Level")
    records = (record for group in groups.values() for record in group.records)
    return "\n".join([f"# Table {number}\n", *tables, "## Where the runs come from\n", circumstances(records)])
