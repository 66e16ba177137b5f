"""Tables in Markdown from the raw runs, the paper's numbers and the independent references."""

import json
import pathlib
import statistics
import sys

from . import plot

ROOT = pathlib.Path(__file__).resolve().parents[2]
RESULTS = ROOT / "bench-results"
BEGIN, END = "<!-- measured: written by scripts/tables write -->", "<!-- /measured -->"

PAPERS_CRITERION = 1e-4
"""Newton's criterion in the paper. fetiplast also asks for a small residual and may take a step more."""

HEAD = """\
# Tables 1 and 2, measured

Written by `scripts/tables write` from the runs in [raw](raw); the paper's numbers are in [paper.json](paper.json), those of
independent programs in [reference.json](reference.json). Variants are named QP solver/preconditioner; `smalse-m/none` is the
paper's method. All runs use the paper's tolerances: 1e-4 for Newton's method in the energy norm, 1e-7 for the QP.

How to read them:

- Counts are the point. They are the same in every repetition and on every number of ranks. Times are medians of the
  repetitions with smallest and largest value; the paper's come from other processors, Matlab and other numbers of cores, so
  they stand there for completeness only.
- "Multiplications by F" are all applications of the dual operator, those for norm estimates and residuals included.
- fetiplast ends Newton's method when the paper's criterion *and* a relative residual of 1e-6 are met. The rows "until the
  paper's criterion" count up to the step that meets the paper's criterion alone.
- The paper gives no coordinates of its bodies. The scene used here reproduces every size of the mesh and of the dual problem
  in Table 2, but not the numbers of plastic elements: ours are larger from level 1 on, and their share grows with refinement
  where the paper's shrinks. No variant of load, supports or element split that was tried removes the difference, so some
  property of the paper's model remains unknown. Independent programs on our scene give our numbers (second table of each
  level); those are the ones to be right against.
- Memory is the sum over the ranks of their largest resident memory.
"""


class Group:
    """The repetitions of one kind of run, made by one commit: the one that was measured last."""

    def __init__(self, records):
        newest = max(records, key=lambda record: record["provenance"]["date"])
        same = [r for r in records if r["provenance"]["commit"] == newest["provenance"]["commit"]]
        self.records = [r for r in same if r["provenance"]["dirty"] == newest["provenance"]["dirty"]]
        self.summaries = [record["summary"] for record in self.records]
        self.first = self.summaries[0]

    def count(self, key):
        """A number that must not differ between repetitions."""
        values = [summary[key] for summary in self.summaries]
        if any(value != values[0] for value in values):
            sys.exit(f"scripts/tables: {key} differs between repetitions: {values}")
        return values[0]

    def seconds(self, value):
        return spread([value(summary) for summary in self.summaries])


def spread(values):
    middle = f"{statistics.median(values):.3g}"
    return middle if len(values) == 1 else f"{middle} ({min(values):.3g} to {max(values):.3g})"


def read(variants):
    """Groups by (level, variant, ranks); runs that failed, and variants that are measured no more, are left out."""
    kinds = {}
    for file in sorted((RESULTS / "raw").glob("*.jsonl")):
        for line in file.read_text().splitlines():
            record = json.loads(line)
            if record["exit_code"] == 0 and record["summary"] and record["variant"] in variants:
                kinds.setdefault((record["level"], record["variant"], record["ranks"]), []).append(record)
    return {kind: Group(records) for kind, records in kinds.items()}


def thousands(value):
    """A count with groups of three digits."""
    return "" if value is None else f"{value:,}".replace(",", " ")


def share(numbers):
    """Plastic elements in per cent; a cell has six tetrahedra."""
    return f"{100 * numbers['plastic_elements'] / (6 * numbers['cells']):.1f} %" if numbers else ""


def until_papers_criterion(summary):
    rows = summary["newton"]
    met = next((i for i, row in enumerate(rows) if row["criterion"] <= PAPERS_CRITERION), len(rows) - 1)
    return rows[: met + 1]


def table(head, rows):
    lines = [head, ["---"] + ["---:"] * (len(head) - 1), *rows]
    return "\n".join("| " + " | ".join(str(cell) for cell in line) + " |" for line in lines) + "\n"


def cost_table(groups, paper):
    """What a level costs: the paper's column, then ours."""

    def row(name, key, of_group):
        of_paper = thousands(paper.get(key)) if paper else ""
        return [name, of_paper, *(of_group(group) for group in groups.values())]

    def count(name, key):
        return row(name, key, lambda group: thousands(group.count(key)))

    def outer(group):
        return group.first["smalse_iterations"] or group.first["active_set_iterations"]

    return table(
        ["", "paper", *groups],
        [
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
            row("outer QP iterations", "smalse_iterations", lambda group: thousands(outer(group))),
            count("multiplications by F", "hessian_multiplications"),
            row(
                "... until the paper's criterion",
                "",
                lambda group: sum(step["hessian_multiplications"] for step in until_papers_criterion(group.first)),
            ),
            count("preconditioner applications", "preconditioner_applications"),
            count("factorisations of subdomains", "factorisations"),
            row("last Newton step [s]", "time_last_newton", lambda g: g.seconds(lambda s: s["newton"][-1]["seconds"])),
            row("total time [s]", "time_total", lambda group: group.seconds(lambda summary: summary["time_total"])),
            row("memory [MiB]", "", lambda group: group.seconds(lambda summary: summary["peak_rss_mb"])),
            row("repetitions", "", lambda group: len(group.records)),
        ],
    )


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
        *(residual(name) for name in ("equilibrium", "gluing", "gap", "complementarity")),
    ]
    return table(["", "reference", *groups], [r for r in rows if r])


def scalability(levels, paper):
    """Multiplications by F and Newton steps at all levels: the short form of Table 2."""
    numbers = sorted({level for level in levels} | {int(level) for level in paper})
    variants = list(dict.fromkeys(variant for groups in levels.values() for variant in groups))

    def row(name, of_paper, of_group, variant=None):
        cells = []
        for level in numbers:
            group = levels.get(level, {}).get(variant)
            cells.append(of_paper(paper[str(level)]) if variant is None else of_group(group) if group else "")
        return [name, *cells]

    rows = [
        row("subdomains", lambda p: p["subdomains"], None),
        row("dual unknowns", lambda p: thousands(p["dual_dofs"]), None),
    ]
    for title, key in (("Newton steps", "newton_iterations"), ("multiplications by F", "hessian_multiplications")):
        rows.append(row(f"{title}, paper", lambda p: thousands(p[key]), None))
        rows += [row(f"{title}, {v}", None, lambda g: thousands(g.count(key)), v) for v in variants]
    rows += [row(f"seconds on 2 ranks, {v}", None, lambda g: g.seconds(lambda s: s["time_total"]), v) for v in variants]
    rows += [row(f"MiB on 2 ranks, {v}", None, lambda g: g.seconds(lambda s: s["peak_rss_mb"]), v) for v in variants]
    return table(["level", *numbers], rows)


def table_1(groups, study, paper):
    """Parallel scalability: the same problem on more and more ranks."""
    head = ["", "ranks", "Newton steps", "outer QP iterations", "multiplications by F", "last Newton step [s]"]
    head += ["total time [s]", "speed-up", "memory [MiB]"]
    rows = [
        [f"paper, level {paper['level']}", p["ranks"], p["newton_iterations"], p["smalse_iterations"]]
        + [thousands(p["hessian_multiplications"]), thousands(p["time_last_newton"]), thousands(p["time_total"])]
        + [f"{paper['rows'][0]['time_total'] / p['time_total']:.2f}", ""]
        for p in paper["rows"]
    ]
    equal = []
    for variant in study["variants"]:
        found = [(r, groups[study["level"], variant, r]) for r in study["ranks"] if (study["level"], variant, r) in groups]
        if not found:
            continue
        median = [statistics.median(s["time_total"] for s in group.summaries) for _, group in found]
        for (ranks, group), seconds in zip(found, median):
            outer = group.first["smalse_iterations"] or group.first["active_set_iterations"]
            rows.append(
                [f"{variant}, level {study['level']}", ranks, group.count("newton_iterations"), outer]
                + [thousands(group.count("hessian_multiplications"))]
                + [group.seconds(lambda s: s["newton"][-1]["seconds"]), group.seconds(lambda s: s["time_total"])]
                + [f"{median[0] / seconds:.2f}", group.seconds(lambda s: s["peak_rss_mb"])]
            )
        if len(found) > 1 and len({g.records[0]["provenance"]["commit"] for _, g in found}) == 1:
            equal.append(equality(variant, [group.first for _, group in found]))
    return table(head, rows) + "\n" + " ".join(equal) + "\n"


DEPENDS_ON_RANKS = {"ranks", "warnings", "time", "time_total", "peak_rss_mb", "memory_estimate_mb", "newton"}


def equality(variant, summaries):
    """Whether everything but times and memory is the same, to the last bit."""

    def essence(summary):
        steps = [{k: v for k, v in row.items() if k != "seconds"} for row in summary["newton"]]
        return {k: v for k, v in summary.items() if k not in DEPENDS_ON_RANKS} | {"steps": steps}

    differing = [k for k, v in essence(summaries[0]).items() if any(essence(s)[k] != v for s in summaries)]
    if differing:
        return f"**`{variant}`: the numbers of ranks differ in {', '.join(differing)}.**"
    return f"`{variant}`: every number of the summary but times and memory is equal to the last bit on all of these."


def circumstances(groups):
    """One line for each commit and machine that the tables draw from."""
    found = {}
    for group in groups:
        for record in group.records:
            p = record["provenance"]
            commit = p["commit"][:12] + (" (with uncommitted changes)" if p["dirty"] else "")
            where = f"{p['cores']} cores of {p['cpu']}, {p['memory_mb'] / 1024:.0f} GiB, {p['rustc']}, {p['mpi']}"
            found.setdefault((commit, where), []).append((p["date"], p["load_average"]))
    lines = []
    for (commit, where), runs in sorted(found.items(), key=lambda item: max(item[1])):
        busiest = max(load for _, load in runs)
        lines.append(
            f"- commit {commit}, {min(runs)[0][:10]}, {len(runs)} runs on {where}; load average before a run at most "
            f"{busiest:.1f}."
        )
    return "\n".join(lines) + "\n"


def contents(variants, study):
    """Every file this writes, with its text."""
    paper = json.loads((RESULTS / "paper.json").read_text())
    references = json.loads((RESULTS / "reference.json").read_text())["levels"]
    groups = read(variants)
    levels = {}
    for level, variant, ranks in sorted(groups, key=lambda kind: (kind[0], variants.index(kind[1]), kind[2])):
        if ranks == 2:
            levels.setdefault(level, {})[variant] = groups[level, variant, ranks]

    short = scalability(levels, paper["table2"])
    text = [HEAD, "## Table 2 in short\n", short, "![Multiplications by F against subdomains](scalability.svg)\n"]
    for level, of_level in levels.items():
        text += [f"## Table 2, level {level}\n", cost_table(of_level, paper["table2"].get(str(level), {}))]
        text += [result_table(of_level, references.get(str(level), {}))]
    text += ["## Table 1: one problem on more ranks\n", table_1(groups, study, paper["table1"])]
    text += ["## Where the runs come from\n", circumstances(groups.values())]

    by_variant = {}
    for of_level in levels.values():
        for variant, group in of_level.items():
            by_variant.setdefault(variant, {})[group.first["subdomains"]] = group.count("hessian_multiplications")
    of_paper = {row["subdomains"]: row["hessian_multiplications"] for row in paper["table2"].values()}
    series = [("paper", of_paper), *by_variant.items()]
    x_values = sorted({x for _, points in series for x in points})
    chart = plot.chart("Multiplications by F, all Newton steps", "subdomains", "multiplications", x_values, series)

    readme = (ROOT / "README.md").read_text()
    before, rest = readme.split(BEGIN)
    after = rest.split(END)[1]
    return {
        RESULTS / "tables.md": "\n".join(text),
        RESULTS / "scalability.svg": chart,
        ROOT / "README.md": f"{before}{BEGIN}\n{short}{END}{after}",
    }


def write(variants, study, only_check):
    stale = []
    for path, text in contents(variants, study).items():
        if not path.exists() or path.read_text() != text:
            stale.append(str(path.relative_to(ROOT)))
            if not only_check:
                path.write_text(text)
    if only_check and stale:
        print(f"out of date: {', '.join(stale)}. Run scripts/tables write.", file=sys.stderr)
        return 1
    print(f"{'written' if stale else 'up to date'}: {', '.join(stale) or 'all tables'}")
    return 0
