"""Runs the program and keeps what it says, with the circumstances, as one JSON line per run."""

import datetime
import json
import os
import pathlib
import platform
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
RAW = ROOT / "bench-results" / "raw"


def run(runs, repeat, quiet):
    """All runs (level, Variant, ranks), the whole list `repeat` times, so that a slow spell does not hit one kind only. `quiet`
    says that nothing else runs on the machine."""
    if not runs:
        sys.exit("scripts/tables: nothing to measure with these --levels and --variants")
    subprocess.run(["scripts/setup"], cwd=ROOT, check=True)
    environment = in_environment("env", "-0")
    environment = dict(entry.split("=", 1) for entry in environment.split("\0") if "=" in entry)
    subprocess.run(["cargo", "build", "--release", "--quiet"], cwd=ROOT, env=environment, check=True)
    machine = circumstances(environment)
    RAW.mkdir(parents=True, exist_ok=True)
    file = RAW / f"{now():%Y%m%dT%H%M%SZ}-{machine['commit'][:12]}.jsonl"
    failed = 0
    for repetition in range(1, repeat + 1):
        for level, variant, ranks in runs:
            record = solve(level, variant, ranks, environment)
            record["repetition"] = repetition
            record["provenance"].update(machine, quiet=quiet)
            with open(file, "a") as lines:
                lines.write(json.dumps(record) + "\n")
            failed += record["exit_code"] != 0
            print(told(record), flush=True)
    print(f"Written to {file.relative_to(ROOT)}; scripts/tables write makes the tables.")
    return 1 if failed else 0


def in_environment(*command):
    """Output of a command in the environment that scripts/run has."""
    shell = ["bash", "-c", '. scripts/environment; "$@"', "bash", *command]
    return subprocess.run(shell, cwd=ROOT, check=True, capture_output=True, text=True).stdout


def now():
    return datetime.datetime.now(datetime.timezone.utc)


def solve(level, variant, ranks, environment):
    """One run of the benchmark with the paper's tolerances, which are the scene's own."""
    options = ["--level", str(level), *variant.options, "--progress", "off"]
    target = pathlib.Path(environment.get("CARGO_TARGET_DIR", ROOT / "target"))
    started, load = now(), os.getloadavg()[0]
    with tempfile.TemporaryDirectory() as out:
        summary = pathlib.Path(out) / "summary.json"
        command = ["mpirun", "-np", str(ranks), str(target / "release" / "fetiplast"), "solve", "two-blocks", *options]
        command += ["--out", out, "--summary", str(summary)]
        watch = time.monotonic()
        done = subprocess.run(command, env=environment, capture_output=True, text=True)
        seconds = time.monotonic() - watch
        found = json.loads(summary.read_text()) if summary.exists() else None
    if done.returncode:
        print(done.stdout + done.stderr, file=sys.stderr)
    return {
        "level": level,
        "variant": variant.name,
        "ranks": ranks,
        "exit_code": done.returncode,
        "seconds": seconds,
        "summary": found,
        "provenance": {
            "command": " ".join(["mpirun", "-np", str(ranks), "fetiplast", "solve", "two-blocks", *options]),
            "date": f"{started:%Y-%m-%dT%H:%M:%SZ}",
            "load_average": load,
        },
    }


def told(record):
    summary = record["summary"] or {}
    return (
        f"level {record['level']}, {record['variant']}, {record['ranks']} ranks: exit code {record['exit_code']}, "
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


def cpu():
    try:
        lines = pathlib.Path("/proc/cpuinfo").read_text().splitlines()
        return next(line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or "unknown"
