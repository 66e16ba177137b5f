"""Files that are made from others: written, or only compared."""

import sys

from .measure import ROOT


def write(contents, command, only_check):
    """`contents`: text by path. Writes what has changed; with `only_check` fails if something would."""
    stale = [path for path, text in contents.items() if not path.exists() or path.read_text() != text]
    names = ", ".join(str(path.relative_to(ROOT)) for path in stale)
    if only_check and stale:
        print(f"out of date: {names}. Run {command}.", file=sys.stderr)
        return 1
    for path in stale:
        path.write_text(contents[path])
    print(f"{'written' if stale else 'up to date'}: {names or 'all files'}")
    return 0
