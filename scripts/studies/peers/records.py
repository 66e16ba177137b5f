"""What was recorded of the programs that are compared, and columns that tables of them have in common."""

import json
import pathlib
import statistics

from .. import measure

FOLDER = pathlib.Path(__file__).parent
RAW = measure.RAW / "peers"
RANKS = 2
OURS = "fetiplast"

EXACT = "fetiplast-tight"
"""A reference: the same scene, solved as exactly as rounding allows."""
ONCE = {EXACT, "calculix"}
"""Programs that are not repeated: what takes ten times as long needs no median."""

PYTHON = "/usr/bin/python3"
"""Debian's, which has Debian's petsc4py."""


def program_of(record):
    return record["variant"].removeprefix("peers/")


def case_of(record):
    """Scene, and its level or thousands of nodes."""
    return record.get("scene", "two-blocks"), record["level"] if "level" in record else record["nodes"]


def seconds_of(record):
    """Those of CalculiX are of `ccx` alone, without the writing of the input."""
    alone = program_of(record) == "calculix" and record["summary"]
    return alone["time_total"] if alone else record["seconds"]


def read(folder=RAW):
    """Records that succeeded or were ended for their time, by case and program: those of the last run with fetiplast's."""
    found = {}
    for file in sorted(folder.glob("*.jsonl")):
        of_file = {}
        for line in file.read_text().splitlines():
            record = json.loads(line)
            if record["exit_code"] is None or (record["exit_code"] == 0 and record["summary"]):
                of_file.setdefault((case_of(record), program_of(record)), []).append(record)
        for (case, program), records in of_file.items():
            if (case, OURS) in of_file:
                found[case, program] = records, of_file[case, OURS]
    return found


def ended(records):
    """Whether a program had no result in the time it was given."""
    return any(record["exit_code"] is None for record in records)


def no_result(program, records, ours, columns):
    least = min(map(seconds_of, records))
    return [program, f"no result after {least:.3g}", f"> {least / middle(ours, seconds_of):.0f}", *[""] * (columns - 3)]


def timed(records, ours):
    """Not where other work ran beside."""
    return all(record["provenance"]["quiet"] for record in [*records, *ours])


def middle(records, value):
    return statistics.median(map(value, records))


def memory_of(record):
    return record["summary"]["peak_rss_mb"]


def spread(values):
    values = list(values)
    text = f"{statistics.median(values):.3g}"
    return text if len(values) == 1 else f"{text} ({min(values):.3g} to {max(values):.3g})"


def versions(records):
    """Of the peers, as they say themselves."""
    summaries = [record["summary"] for record in records if record["summary"]]
    found = {f"{name} {s[key]}" for name, key in (("PETSc", "petsc"), ("CalculiX", "calculix")) for s in summaries if key in s}
    return f"; {', '.join(sorted(found)) or 'no peers'}"
