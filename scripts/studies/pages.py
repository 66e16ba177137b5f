"""Files that are made from others: written, or only compared. Tables in Markdown."""

import re
import sys

from .measure import ROOT

MARKED = re.compile(r"(<!-- measured: written by scripts/bench write (\w+) -->\n).*?(<!-- /measured -->)", re.DOTALL)


def table(head, rows):
    """First column to the left, the others to the right."""
    lines = [head, ["---"] + ["---:"] * (len(head) - 1), *rows]
    return "\n".join("| " + " | ".join(str(cell) for cell in line) + " |" for line in lines) + "\n"


def of_cases(path, head, found, section, ranks, tail=lambda found: []):
    """A page with a section for each case that has records, and the files that these draw; `section` gives both. `found` has the
    records of each case by their keys; what `tail` makes of it stands before the commits that they come from."""
    found = {case: records for case, records in found.items() if records}
    if not found:
        return {}
    text, files = [head], {}
    for case, records in found.items():
        more, pictures = section(case, records)
        text += more
        files |= pictures
    commits = sorted({record["provenance"]["commit"][:12] for records in found.values() for record in records.values()})
    text += [*tail(found), f"Program: {', '.join(commits)}, {ranks} ranks.\n"]
    return files | {path: "\n".join(text)}


def filled(parts):
    """The README and the pages of docs with their marked parts replaced: texts by the name of the study."""

    def text(part):
        return f"{part[1]}{parts[part[2]]}{part[3]}" if part[2] in parts else part[0]

    documents = (ROOT / "README.md", *(ROOT / "docs").glob("*.md"))
    return {file: MARKED.sub(text, file.read_text()) for file in documents}


def write(files, only_check=False):
    """`files`: text by path, None for a file that goes. Writes what has changed; with `only_check` fails if something would."""
    stale = [path for path, text in files.items() if (path.read_text() if path.exists() else None) != text]
    names = ", ".join(str(path.relative_to(ROOT) if path.is_relative_to(ROOT) else path) for path in stale)
    if only_check and stale:
        print(f"out of date: {names}. Run scripts/bench write.", file=sys.stderr)
        return 1
    for path in stale:
        if files[path] is None:
            path.unlink()
        else:
            path.write_text(files[path])
    print(f"written: {names}" if stale else f"up to date: all {len(files)} files")
    return 0
