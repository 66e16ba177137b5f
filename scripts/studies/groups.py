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
        self.timed = all(record["provenance"].get("quiet", True) for record in self.records)

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


def circumstances(groups):
    """One line for each commit and machine that the tables draw from."""
    found = {}
    for group in groups:
        for record in group.records:
            p = record["provenance"]
            commit = p["commit"][:12] + (" (with uncommitted changes)" if p["dirty"] else "")
            where = f"{p['cores']} cores of {p['cpu']}, {p['memory_mb'] / 1024:.0f} GiB, {p['rustc']}, {p['mpi']}"
            found.setdefault((commit, where), []).append((p["date"], p["load_average"], p.get("stolen")))
    lines = []
    for (commit, where), runs in sorted(found.items(), key=lambda item: max(run[0] for run in item[1])):
        busiest = max(load for _, load, _ in runs)
        first = min(date for date, _, _ in runs)[:10]
        line = f"- commit {commit}, {first}, {len(runs)} runs on {where}; load average before a run at most {busiest:.1f}"
        stolen = [share for _, _, share in runs if share is not None]
        if stolen:
            line += f"; a hypervisor kept {100 * min(stolen):.1f} to {100 * max(stolen):.1f} % of the cores' time from a run"
        lines.append(line + ".")
    return "\n".join(lines) + "\n"
