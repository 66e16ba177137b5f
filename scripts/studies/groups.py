"""The repetitions of one kind of run, and where they come from."""

import statistics
import sys


class Group:
    """The repetitions of one kind of run, made by one commit: the one that was measured last."""

    def __init__(self, records):
        newest = max(records, key=lambda record: record["provenance"]["date"])
        same = [r for r in records if r["provenance"]["commit"] == newest["provenance"]["commit"]]
        self.records = [r for r in same if r["provenance"]["dirty"] == newest["provenance"]["dirty"]]
        # In the order of their times.
        self.records.sort(key=lambda record: record["summary"]["time_total"])
        self.summaries = [record["summary"] for record in self.records]
        self.first = self.summaries[0]
        # Whether times mean something: not where the machine was busy with other work.
        self.timed = all(record["provenance"]["quiet"] for record in self.records)

    def count(self, key):
        """A number that must not differ between repetitions."""
        values = [summary[key] for summary in self.summaries]
        if any(value != values[0] for value in values):
            sys.exit(f"scripts/bench: {key} differs between repetitions: {values}")
        return values[0]

    def of_all_levels(self, key):
        """The number with that of the coarser levels, if there are any."""
        coarser = self.first["cascade"]
        return self.count(key) + sum(row[key] for row in coarser) if coarser else None

    def seconds(self, value):
        if not self.timed:
            return ""
        return spread([value(summary) for summary in self.summaries])

    def wall(self):
        """From the start of the processes to their end."""
        return spread([record["seconds"] for record in self.records]) if self.timed else ""

    def median(self):
        """The median of the times."""
        return statistics.median(summary["time_total"] for summary in self.summaries)


def spread(values):
    middle = measured(statistics.median(values))
    least, most = measured(min(values)), measured(max(values))
    return middle if least == most else f"{middle} ({least} to {most})"


def measured(value):
    """Three digits, or all of an integer part with more."""
    return f"{value:.3g}" if value < 999.5 else thousands(round(value))


def thousands(value):
    """A count with groups of three digits."""
    return "" if value is None else f"{value:,}".replace(",", " ")


def circumstances(records, more=lambda records: ""):
    """One line for each commit and machine that the tables draw from, with `more` of them behind the machine."""
    found = {}
    for record in records:
        p = record["provenance"]
        commit = p["commit"][:12] + (" (with uncommitted changes)" if p["dirty"] else "")
        where = f"{p['cores']} cores of {p['cpu']}, {p['memory_mb'] / 1024:.0f} GiB, {p['rustc']}, {p['mpi']}"
        found.setdefault((commit, where), []).append(record)
    lines = []
    for (commit, where), runs in found.items():
        dates, loads, shares = ([run["provenance"].get(key) for run in runs] for key in ("date", "load_average", "stolen"))
        line = f"- commit {commit}, {min(dates)[:10]}, {len(runs)} runs on {where}{more(runs)}; "
        line += f"load average before a run at most {max(loads):.1f}"
        if stolen := [share for share in shares if share is not None]:
            line += f"; a hypervisor kept {100 * min(stolen):.1f} to {100 * max(stolen):.1f} % of the cores' time from a run"
        lines.append((max(dates), f"{line}.\n"))
    return "".join(line for _, line in sorted(lines))
