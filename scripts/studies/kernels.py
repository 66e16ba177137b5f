"""What the kernels cost on one core, beside the machine's limits and CHOLMOD.

Runs `cargo bench --bench kernels`, and CHOLMOD, which it installs from Debian's packages, on the same matrices. Takes minutes.
"""

import json
import subprocess

from . import measure, peers
from .measure import RESULTS
from .pages import table

RAW = measure.RAW / "kernels"
PACKAGES = ["libsuitesparse-dev", "libopenblas0-pthread", "python3-numpy", "python3-scipy"]

HEAD = """\
# Kernels, measured

Written by `scripts/bench write kernels` from [raw/kernels](raw/kernels), which `scripts/bench run kernels` measured on one core
of a machine with {cores} ({cpu}): the best of several runs each. Cubes of n x n x n cells, elastic, three unknowns a node.

- *whole factor*: of `K + rho Q`, ordered by nested dissection; *interior*: the second factor that the Dirichlet
  preconditioner needs; *interior first*: the one factor that would replace both, with the dense Schur complement of the
  boundary at its end.
- *solve*: `K^+` for one vector; *Schur*: one application of `S`. *of twins*: the same where {count} congruent subdomains share
  their factors, per subdomain.
- *CHOLMOD*: Debian's, supernodal, with OpenBLAS and the better of its own orderings, double precision, the same matrix up to
  the shift ([cholmod.py](../scripts/studies/peers/cholmod.py)). Its solve finds the factor in the cache, ours does not.
"""

READING = """
Two factors always win: one factor that eliminates the interior first is {length:.1f} to {length_most:.1f} times as long and takes
{time:.1f} to {time_most:.1f} times as long as both together, so the program does not offer it. Twins are worth a factor of
{twins:.1f} to {twins_most:.1f} in a solve.
faer's factor (which is ours) takes {cholmod:.2f} to {cholmod_most:.2f} of CHOLMOD's time.
"""


def ms(seconds):
    return f"{1e3 * seconds:.3g}"


def arguments(parser):
    """There is nothing to choose."""


def run(_):
    peers.install(PACKAGES)
    _, environment = measure.built()
    circumstances = measure.circumstances(environment)
    cholmod = [peers.PYTHON, str(peers.FOLDER / "cholmod.py")]
    lines = []
    for command in (["cargo", "bench", "--quiet", "--bench", "kernels"], cholmod):
        done = subprocess.run(command, cwd=measure.ROOT, env=environment, check=True, stdout=subprocess.PIPE, text=True)
        lines += [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]
    limits(lines).update(circumstances)
    records = measure.Records(RAW, circumstances["commit"])
    for line in lines:
        records.add(line)
    return 0


def newest():
    """The lines of the last file."""
    return [json.loads(line) for line in max(RAW.glob("*.jsonl")).read_text().splitlines()]


used = newest


def limits(lines):
    """Of one core: rates of multiplying matrices and of reading memory."""
    return next(line for line in lines if line["kind"] == "machine")


def pages():
    lines = newest()
    machine = limits(lines)
    cubes = [line for line in lines if line["kind"] == "subdomain"]
    coarse = [line for line in lines if line["kind"] == "coarse"]
    cholmod = {line["cells"]: line for line in lines if line["kind"] == "cholmod"}
    peak = {"single": machine["gemm_single_gflops"], "double": machine["gemm_double_gflops"]}
    width = {"single": 4, "double": 8}
    rows = []
    for cube in cubes:
        factor, precision = cube["factor"], cube["precision"]
        rate = factor["flops"] / factor["seconds"] / 1e9
        peer = cholmod[cube["cells"]] if precision == "double" else None
        read = 2 * width[precision] * factor["length"] / cube["solve"] / 1e9
        rows.append([
            f"{cube['cells']}, {precision}", str(cube["dofs"]), ms(cube["assembly"]), ms(factor["seconds"]),
            f"{rate:.0f} ({100 * rate / peak[precision]:.0f} %)", ms(cube["interior_factor"]),
            ms(cube["interior_first"]["seconds"]), ms(cube["solve"]), f"{read:.0f}", ms(cube["solve_twins"]),
            ms(cube["schur"]), ms(cube["schur_twins"]), *((ms(peer["factor"]), ms(peer["solve"])) if peer else ("", "")),
        ])
    head = ["n, precision", "unknowns", "assembly ms", "whole factor ms", "GF/s (of matrix product)", "interior ms",
            "interior first ms", "solve ms", "GB/s", "of twins ms", "Schur ms", "of twins ms", "CHOLMOD factor ms", "solve ms"]
    lengths = [cube["interior_first"]["length"] / cube["factor"]["length"] for cube in cubes]
    times = [cube["interior_first"]["seconds"] / (cube["factor"]["seconds"] + cube["interior_factor"]) for cube in cubes]
    ours = [c["factor"]["seconds"] / cholmod[c["cells"]]["factor"] for c in cubes if c["precision"] == "double"]
    twins = [cube["solve"] / cube["solve_twins"] for cube in cubes]
    text = [HEAD.format(count=8, cores=machine["cores"], cpu=machine["cpu"]), "Limits of one core: product of two matrices of 512 x 512 "
            f"{peak['single']:.0f} GF/s in single and {peak['double']:.0f} GF/s in double precision; reading memory in order "
            f"{machine['read_gb_per_s']:.0f} GB/s (one stream, not prefetched by hand).\n"]
    text += [table(head, rows)]
    text += [READING.format(length=min(lengths), length_most=max(lengths), time=min(times), time_most=max(times),
                            twins=min(twins), twins_most=max(twins), cholmod=min(ours), cholmod_most=max(ours))]
    text += ["## The coarse problem\n", "`G G'` of tiny subdomains (one cell each), sparse Cholesky factor on one core, in seconds.\n"]
    text += [table(
        ["subdomains", "numbers in the factor", "set-up", "again for another set of rows", "one solve", "one projection"],
        [[str(line["subdomains"]), f"{line['length'] / 1e6:.1f} million", *(f"{line[key]:.3g}" for key in
          ("setup", "restricted", "solve", "projection"))] for line in coarse],
    )]
    text += ["Every rank holds the whole factor, and makes it anew for every set of contacts: the last lines show where that ends.\n"]
    return {RESULTS / "kernels.md": "\n".join(text)}
