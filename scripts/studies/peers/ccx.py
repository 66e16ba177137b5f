"""Runs CalculiX on a deck and reads what it prints."""

import json
import os
import pathlib
import re
import resource
import subprocess
import sys
import time


def add_arguments(parser):
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("out"))
    parser.add_argument("--threads", type=int, default=2)


def solve(job, found, arguments):
    """Runs JOB.inp in the folder of results; `found(blocks)` tells what the scene is asked for. Writes summary.json; the exit
    code."""
    out = arguments.out
    environment = os.environ | {"OMP_NUM_THREADS": str(arguments.threads), "OPENBLAS_NUM_THREADS": "1"}
    begin = time.perf_counter()
    done = subprocess.run(["ccx", job], cwd=out, env=environment, capture_output=True, text=True)
    seconds = time.perf_counter() - begin
    (out / "ccx.log").write_text(done.stdout + done.stderr)
    version = re.search(r"Version (\S+)", done.stdout)
    summary = {"time_total": seconds, "converged": False, "calculix": version.group(1).rstrip(",") if version else "unknown"}
    summary["peak_rss_mb"] = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
    if done.returncode == 0 and "Job finished" in done.stdout:
        summary |= found(printed(out / f"{job}.dat")) | work(out, job)
        summary["converged"] = abs(summary["load"] - 1) < 1e-6
    else:
        print((done.stdout + done.stderr)[-2000:], file=sys.stderr)
    (out / "summary.json").write_text(json.dumps(summary) + "\n")
    print(json.dumps(summary))
    return 0 if summary["converged"] else 1


def printed(file):
    """Tables of numbers of the last increment by the first word above them; of totals also by the second one and, of contacts, by
    the slave surface."""
    blocks, rows, slave = {}, [], ""
    for line in file.read_text().splitlines():
        words = line.split()
        if words[:4] == ["statistics", "for", "slave", "set"]:
            slave = words[4].rstrip(",") + " "
        elif words and not re.match(r"[-+0-9.]", words[0]):
            name = f"{slave}{words[1]}" if words[:2] == ["total", "surface"] else " ".join(words[: 1 + (words[0] == "total")])
            rows = blocks[name] = []
        elif words:
            rows.append([float(word) for word in words])
    return blocks


def work(out, job):
    """Iterations and increments of all, and the last one's share of the load."""
    iterations = len((out / f"{job}.cvg").read_text().splitlines()) - 4
    increments = [line.split() for line in (out / f"{job}.sta").read_text().splitlines()[2:]]
    return {"iterations": iterations, "increments": len(increments), "load": float(increments[-1][4])}


def lines(file, rows):
    file.writelines(",".join(map(str, row)) + "\n" for row in rows)
