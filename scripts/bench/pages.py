"""Files that are made from others: written, or only compared."""

import argparse
import sys

from .measure import ROOT


def write(contents, command, only_check):
    """`contents`: text by path. Writes what has changed; with `only_check` fails if something would."""
    stale = [path for path, text in contents.items() if not path.exists() or path.read_text() != text]
    names = ", ".join(str(path.relative_to(ROOT) if path.is_relative_to(ROOT) else path) for path in stale)
    if only_check and stale:
        print(f"out of date: {names}. Run {command}.", file=sys.stderr)
        return 1
    for path in stale:
        path.write_text(contents[path])
    nothing = "all files" if contents else "nothing, for there are no such runs"
    print(f"{'written' if stale else 'up to date'}: {names or nothing}")
    return 0


def run_or_write(description, command, kind, run, contents, switches=()):
    """A script's commands: `run(names, ranks)` measures some or all of a kind, what `contents()` gives is written. `switches`: more
    that `run` wants to know, with help."""
    parser = argparse.ArgumentParser(description=description)
    commands = parser.add_subparsers(dest="command", required=True)
    running = commands.add_parser("run", help="measure")
    running.add_argument("names", nargs="*", metavar=kind)
    running.add_argument("--np", type=int, default=2)
    for name, text in dict(switches).items():
        running.add_argument(f"--{name}", action="store_true", help=text)
    writing = commands.add_parser("write", help="make the page from the runs there are")
    writing.add_argument("--check", action="store_true", help="write nothing; fail if something would change")
    arguments = parser.parse_args()
    if arguments.command == "write":
        return write(contents(), f"{command} write", arguments.check)
    return run(arguments.names, arguments.np, **{name: getattr(arguments, name) for name in dict(switches)})
