"""Runs the program and keeps what it says, with the circumstances, as one JSON line per run."""

import datetime
import json
import os
import pathlib
import platform
import shlex
import signal
import subprocess
import sys
import tempfile
import time
import typing

ROOT = pathlib.Path(__file__).resolve().parents[2]
RESULTS = ROOT / "bench-results"
RAW = RESULTS / "raw"


def add_arguments(parser):
    """Which program is measured and how it is started: on a cluster inside a job, where nothing can be built."""
    parser.add_argument("--busy", action="store_true", help="other work runs beside: counts are kept, times are not shown")
    parser.add_argument("--program", type=pathlib.Path, help="built before; without it the one of this repository is built")
    parser.add_argument("--launch", default="mpirun", help="what starts the ranks, options included; understands -n NUMBER")


def add_repeat(parser, runs):
    parser.add_argument("--repeat", type=int, default=runs, help="runs of each kind")


class Run(typing.NamedTuple):
    """What is run. `label` says in the records what kind of run it is."""

    label: dict
    options: list
    """Of `fetiplast solve`, the scene first."""
    ranks: int
    start: list | None = None
    """How the command begins where it is another program's, which takes --out DIR and leaves DIR/summary.json."""
    once: bool = False
    """Not repeated: what others are compared with."""


class Program:
    """The program that is measured, how it is started, and what all its runs have in common."""

    def __init__(self, arguments):
        self.launch = shlex.split(arguments.launch)
        # Other nodes see the folder of the results, if anything.
        self.shared = arguments.program is not None
        self.path, self.environment = (arguments.program, dict(os.environ)) if self.shared else built()
        self.circumstances = circumstances(self.environment) | {"quiet": not arguments.busy}

    def on(self, ranks, other=None):
        """How a command line of this program begins, or of another one."""
        return [*self.launch, "-n", str(ranks), str(other or self.path)]

    def records(self, folder):
        return Records(folder, self.circumstances["commit"])

    def provenance(self, summary):
        """Circumstances of a run; a program that was built elsewhere says itself of which commit it is."""
        return self.circumstances | (origin(summary or {}) if self.shared else {})


def built():
    """The program of this repository as it is now, and the environment that scripts/run has."""
    subprocess.run(["scripts/setup"], cwd=ROOT, check=True)
    entries = in_environment("env", "-0").split("\0")
    environment = dict(entry.split("=", 1) for entry in entries if "=" in entry)
    subprocess.run(["cargo", "build", "--release", "--quiet"], cwd=ROOT, env=environment, check=True)
    return pathlib.Path(environment.get("CARGO_TARGET_DIR", ROOT / "target")) / "release" / "fetiplast", environment


class Records:
    """A new file in a folder, named after the time and the commit, which takes one JSON line per run."""

    def __init__(self, folder, commit):
        folder.mkdir(parents=True, exist_ok=True)
        self.file = folder / f"{now():%Y%m%dT%H%M%SZ}-{commit[:12]}.jsonl"
        print(f"Records go to {self.file}", flush=True)

    def add(self, record):
        with open(self.file, "a") as lines:
            lines.write(json.dumps(record) + "\n")


def read(folder):
    """All records of a folder, the oldest first."""
    lines = [json.loads(line) for file in sorted(folder.glob("*.jsonl")) for line in file.read_text().splitlines()]
    return sorted(lines, key=lambda record: record["provenance"]["date"])


def kept(folder, used):
    """The files of a folder with nothing but the records that are used, None for those that have none."""
    lines = {json.dumps(record) for record in used}

    def text(file):
        return "".join(f"{line}\n" for line in file.read_text().splitlines() if json.dumps(json.loads(line)) in lines)

    return {file: text(file) or None for file in folder.glob("*.jsonl")}


def run(runs, arguments, folder, tables=(), program=None, limit=None):
    """All runs, the whole list as often as is asked for, so that a slow spell does not hit one kind only. Their records go to
    a new file in the folder; the number of runs that failed is returned. `tables`: see `shortened`; `limit`: see `ended`."""
    if not runs:
        sys.exit("scripts/bench: nothing to measure with these options")
    program = program or Program(arguments)
    records, failed = program.records(folder), 0
    for repetition in range(1, arguments.repeat + 1):
        for run in (run for run in runs if repetition == 1 or not run.once):
            record = {**run.label, **solve(program, run, folder, limit)}
            record["repetition"] = repetition
            record["provenance"] |= program.provenance(record["summary"])
            record["summary"] = shortened(record["summary"], tables)
            records.add(record)
            failed += record["exit_code"] not in (0, None)
            print(told(run.label, record), flush=True)
    return failed


def in_environment(*command):
    """Output of a command in the environment that scripts/run has."""
    shell = ["bash", "-c", '. scripts/environment; "$@"', "bash", *command]
    return subprocess.run(shell, cwd=ROOT, check=True, capture_output=True, text=True).stdout


def now():
    return datetime.datetime.now(datetime.timezone.utc)


def date(time):
    return f"{time:%Y-%m-%dT%H:%M:%SZ}"


def solve(program, run, folder, limit):
    """One run, without its label."""
    command = [*(run.start or [*program.on(run.ranks), "solve"]), *run.options]
    started, load = now(), os.getloadavg()[0]
    with tempfile.TemporaryDirectory(dir=folder if program.shared else None) as out:
        summary = pathlib.Path(out) / "summary.json"
        more = [] if run.start else ["--progress", "off", "--summary", str(summary)]
        watch, before = time.monotonic(), processor_time()
        code, said = ended([*command, *more, "--out", out], program.environment, limit)
        seconds = time.monotonic() - watch
        taken, passed = (after - earlier for after, earlier in zip(processor_time(), before))
        found = json.loads(summary.read_text()) if summary.exists() else None
    if code:
        print(said, file=sys.stderr)
    return {
        "exit_code": code,
        "seconds": seconds,
        "summary": found,
        "provenance": {
            # Paths are those of one machine.
            "command": shlex.join(pathlib.Path(word).name if word.startswith("/") else word for word in command),
            "date": date(started),
            "load_average": load,
            "stolen": taken / passed if passed else 0.0,
        },
    }


def ended(command, environment, limit):
    """The exit code of a command and what it said. The code is None where it and all its processes had to be ended after `limit`
    seconds."""
    apart = limit is not None
    process = subprocess.Popen(
        command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, start_new_session=apart
    )
    try:
        said, _ = process.communicate(timeout=limit)
        return process.returncode, said
    except subprocess.TimeoutExpired:
        return None, ""
    finally:
        if apart and process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
            process.communicate()


def shortened(summary, tables):
    """What is recorded of a summary: all its numbers and words, but of its tables and lists, which are most of it, only those that
    the page of the study reads; of increments only when they were, and whether they converged. The circumstances of a run stand
    beside its summary."""
    if summary is None:
        return None
    found = {key: value for key, value in summary.items() if key in tables or not isinstance(value, (dict, list))}
    # A scene's path is that of one machine.
    if "scene" in found:
        found["scene"] = pathlib.PurePath(found["scene"]).name
    if "steps" in found:
        found["steps"] = [{key: step[key] for key in ("time", "converged")} for step in found["steps"]]
    return found


def origin(summary):
    """The commit of a program, as it says itself."""
    commit = summary.get("provenance", {}).get("commit", "unknown")
    return {"commit": commit.removesuffix("-dirty"), "dirty": commit.endswith("-dirty")}


def told(label, record):
    summary = record["summary"] or {}
    return (
        f"{', '.join(f'{key} {value}' for key, value in label.items())}: exit code {record['exit_code']}, "
        f"{summary.get('newton_iterations')} Newton steps, {summary.get('hessian_multiplications')} applications of F, "
        f"{record['seconds']:.1f} s, {summary.get('peak_rss_mb') or 0:.0f} MiB"
    )


def circumstances(environment):
    """What the runs of one call have in common."""

    def output(*command):
        try:
            done = subprocess.run(command, cwd=ROOT, env=environment, check=True, capture_output=True, text=True)
        except (OSError, subprocess.CalledProcessError):
            return "unknown"
        return done.stdout.strip()

    return {
        "commit": output("git", "rev-parse", "HEAD"),
        "dirty": output("git", "status", "--porcelain", "--untracked-files=no") != "",
        "rustc": output("rustc", "--version"),
        "mpi": output("mpirun", "--version").split("\n")[0],
        "cpu": cpu(),
        "cores": os.cpu_count(),
        "memory_mb": os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") >> 20,
        "system": f"{platform.system()} {platform.machine()}",
    }


def processor_time():
    """What a hypervisor gave to others while there was work here, and all of the cores' time; in ticks, 0 where nobody counts."""
    try:
        ticks = [int(word) for word in pathlib.Path("/proc/stat").read_text().split("\n")[0].split()[1:9]]
        return ticks[7], sum(ticks)
    except (OSError, IndexError, ValueError):
        return 0, 0


def cpu():
    try:
        lines = pathlib.Path("/proc/cpuinfo").read_text().splitlines()
        return next(line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or "unknown"
