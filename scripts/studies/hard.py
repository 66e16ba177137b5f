"""Scenes that are hard for the method: which of them it solves, in how many steps, and how exactly.

Solves each case, and once more as exactly as rounding allows where its energy is not known otherwise. Fails if a case does not end
as expected.
"""

import math
import sys
import typing

from . import measure
from .measure import RESULTS, Run
from .pages import table

RANKS = 2
RAW = measure.RAW / "hard"
GROWTH = 3
"""How many times the benchmark's applications of F a case should take at most, and never more than twice that."""
TIGHT = ["precision=double", "newton_tolerance=1e-8", "residual_tolerance=1e-9", "qp_tolerance=1e-10"]
TIGHT = [f"solver.{key}" for key in TIGHT]
"""Of the reference: the same scene, solved as exactly as rounding allows."""
RESIDUALS = ("equilibrium", "gluing", "gap", "complementarity")
BENCHMARK = "benchmark"
SAME_CORES = "cores of the same material, hex8"


class Case(typing.NamedTuple):
    name: str
    sets: list
    """Keys of the scene, as of `--set`."""
    scene: str = "two-blocks"
    converges: bool = True
    """What is expected; the other outcome is an end with an error and results."""
    beside: str = BENCHMARK
    """The case whose counts this one's are compared with."""
    same: tuple | None = None
    """Another case that this one is a picture of, and the factor from that one's energy to this one's."""
    energy: float | None = None
    """A closed form."""
    residual: float = 1e-6
    """The largest residual allowed."""
    says: str = ""
    """What the error of a case that does not converge has to say."""


def both(key, value):
    return [f"{key.replace('*', body)}={value}" for body in ("lower", "upper")]


def axes(order):
    """The benchmark with its axes x, y, z renamed."""
    x, y, z = order

    def put(values, quote=str):
        by_axis = dict(zip(order, values))
        return "[" + ", ".join(quote(by_axis[axis]) for axis in "xyz") + "]"

    sets = both("body.*.brick.size", put([3000.0, 1000.0, 1000.0])) + both("body.*.brick.cells", put([30, 10, 10]))
    sets += [f"body.upper.brick.origin={put([600.0, 0.0, 1000.0])}", f"load.top.traction={put([0.0, 0.0, -150.0])}"]
    sets += [f"support.left.surface=lower.{x}min", f"support.right.surface=upper.{x}max"]
    return sets + [f"load.top.surface=upper.{z}max", f"contact.joint.slave=upper.{z}min", f"contact.joint.master=lower.{z}max"]


def layers(begin, thin):
    """Cells of 100 along z, one of them cut in two at the place given; see scenes/hard/slivers.toml."""
    return sorted([float(begin + 100 * k) for k in range(11)] + [thin])


def turned(vector, axis, degrees):
    """Rodrigues' formula."""
    length = math.sqrt(sum(a * a for a in axis))
    k = [a / length for a in axis]
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    cross = [k[1] * vector[2] - k[2] * vector[1], k[2] * vector[0] - k[0] * vector[2], k[0] * vector[1] - k[1] * vector[0]]
    along = sum(a * b for a, b in zip(k, vector))
    return [c * v + s * w + (1 - c) * along * a for v, w, a in zip(vector, cross, k)]


HEX8 = both("body.*.element", "hex8")
HALF = "load.top.traction.2=-100"
SOFT = "load.top.traction.2=-30"
ELASTIC = "two-blocks-elastic"
MESHED = "scenes/hard/blocks.toml"
SLIVERS = "scenes/hard/slivers.toml"
CORES = "scenes/hard/cores.toml"
SOFT_CORES = ["material.steel.young=2.1e11", SOFT]
SOFT_CORE = SOFT_CORES + ["body.upper.material.upper-core=steel"]
METRES = both("material.*.young", 2.1e11) + both("material.*.yield_stress", 4.5e8) + both("material.*.hardening", 1e10)
METRES += both("body.*.brick.size", "[3.0, 1.0, 1.0]") + ["body.upper.brick.origin=[0.6, 0.0, 1.0]"]
METRES += ["load.top.traction.2=-1.5e8"]
MIRRORED = ["body.upper.brick.origin.0=-600.0", "support.left.surface=lower.xmax", "support.right.surface=upper.xmin"]
AXIS, ANGLE = [1.0, 2.0, 3.0], 40.0
ROTATED = both("body.*.gmsh.rotate", f"{{axis={AXIS}, angle_deg={ANGLE}}}")
ROTATED += [f"load.top.traction={turned([0.0, 0.0, -150.0], AXIS, ANGLE)}"]
STRONG = ["material.lower.young=2.1e11", "material.lower.yield_stress=4.5e8", "material.lower.hardening=1e10"]
RENUMBERED = both("body.*.gmsh.file", "renumbered.msh")
PLATE = ["body.upper.brick.size.2=20.0", "body.upper.brick.cells=[30, 10, 1]", "load.top.traction.2=-0.05"]
PLATE += ["decomposition.subdomains=12"]
SLENDER = ["body.upper.brick={origin=[600.0, 485.0, 1000.0], size=[3000.0, 30.0, 30.0], cells=[100, 2, 2]}"]
SLENDER += ["load.top.traction.2=-0.5", "decomposition.subdomains=12"]
# A homogeneous state: the support of the top is given to a side that is held already.
PRESSED = ["support.top={surface='upper.xmin', fix=['x']}", "load.top={surface='upper.zmax', traction=[0.0, 0.0, -315.0]}"]
HOMOGENEOUS = -0.5 * 315.0**2 / 210000.0 * 2e9
BESIDE_CONTACT = [f"body.lower.grid.z={layers(0, 999.9)}", f"body.upper.grid.z={layers(1000, 1000.1)}"]

CASES = [
    Case(BENCHMARK, []),
    Case("benchmark, hex8", HEX8),
    *(Case(f"nu {nu}", both("material.*.poisson", nu)) for nu in (0.49, 0.499, 0.4999)),
    *(Case(f"nu {nu}, hex8", HEX8 + both("material.*.poisson", nu), beside="benchmark, hex8") for nu in (0.49, 0.499, 0.4999)),
    Case("H/E 1e-3", both("material.*.hardening", 210.0) + [HALF]),
    Case("H/E 1e-6", both("material.*.hardening", 0.21) + [HALF]),
    Case("H = 0, below the limit load", both("material.*.hardening", 0.0) + [HALF]),
    Case("H = 0, above the limit load", both("material.*.hardening", 0.0) + ["load.top.traction.2=-400"], converges=False, says="limit load"),
    Case("upper body 1e6 times as stiff", ["material.upper.young=2.1e11", SOFT]),
    Case("lower body 1e6 times as stiff", ["material.lower.young=2.1e11", SOFT]),
    Case("lower body 1e6 times as stiff and as strong", STRONG),
    Case("lower body 1e6 times as stiff, as strong as before", ["material.lower.young=2.1e11"]),
    Case("lower body 1e6 times as stiff, as strong as before, hex8", HEX8 + ["material.lower.young=2.1e11"], beside="benchmark, hex8"),
    Case(SAME_CORES, [], scene=CORES, beside="benchmark, hex8", same=("from a mesh, hex8", 1.0)),
    Case("cores 1e6 times as stiff, hex8", ["material.core.young=2.1e11", SOFT], scene=CORES, beside=SAME_CORES),
    Case("core 1e6 times as soft, hex8", SOFT_CORE, scene=CORES, beside=SAME_CORES),
    Case("both cores 1e6 times as soft, one at the contact, hex8", SOFT_CORES, scene=CORES, beside=SAME_CORES),
    Case("beam 1:100 on a block, hex8", HEX8 + SLENDER, scene=ELASTIC),
    Case("plate of one element, 1:150, hex8", HEX8 + PLATE, scene=ELASTIC),
    Case("flat elements 1:25", ["body.upper.brick.size.2=40.0", "load.top.traction.2=-0.1"], scene=ELASTIC),
    Case("slivers 1:1000", [], scene=SLIVERS),
    Case("slivers 1:1000 on both sides of the contact", BESIDE_CONTACT, scene=SLIVERS),
    Case("contact edge at corners of subdomains", ["decomposition.cells=[6, 5, 5]"], same=(BENCHMARK, 1.0)),
    Case("contact without force", ["load.top.surface=lower.zmax", SOFT]),
    Case("gap 1e-12", ["contact.joint.gap=1e-12"], same=(BENCHMARK, 1.0)),
    Case("overlap 1", ["contact.joint.gap=-1"]),
    Case("body held by contact alone", PRESSED, scene="patch", energy=HOMOGENEOUS),
    Case("load x 1e-6", ["load.top.traction.2=-1.5e-4"]),
    Case("load x 10", ["load.top.traction.2=-1500"]),
    Case("m, Pa in place of mm, MPa", METRES, same=(BENCHMARK, 1e-3)),
    Case("axes x, y, z renamed y, z, x, hex8", HEX8 + axes("yzx"), beside="benchmark, hex8", same=("benchmark, hex8", 1.0)),
    Case("mirrored, hex8", HEX8 + MIRRORED, beside="benchmark, hex8", same=("benchmark, hex8", 1.0)),
    Case("from a mesh, hex8", [], scene=MESHED, beside="benchmark, hex8"),
    Case("rotated by 40 degrees", ROTATED, scene=MESHED, beside="from a mesh, hex8", same=("from a mesh, hex8", 1.0)),
    Case("renumbered", RENUMBERED, scene=MESHED, beside="from a mesh, hex8", same=("from a mesh, hex8", 1.0)),
    Case("one subdomain per body", ["decomposition.cells=[30, 10, 10]"], same=(BENCHMARK, 1.0)),
    Case("500 subdomains of 12 cells", ["decomposition.cells=[3, 2, 2]"], same=(BENCHMARK, 1.0)),
]


def arguments(parser):
    names = [case.name for case in CASES]
    parser.add_argument("--cases", nargs="+", choices=names, default=names, metavar="NAME", help="; ".join(names))
    measure.add_repeat(parser, 1)
    measure.add_arguments(parser)


def run(arguments):
    measure.run(runs(arguments.cases), arguments, RAW)
    records = read(RAW)
    wrong = [c.name for c in CASES if c.name in arguments.cases and not as_expected(c, records[c.name, False])]
    if wrong:
        print(f"scripts/bench: not as expected: {', '.join(wrong)}", file=sys.stderr)
    return 1 if wrong else 0


def runs(names):
    """Each case as the program solves it by itself, and as exactly as it can."""
    found = []
    for case in CASES:
        if case.name in names:
            for tight in (False, True) if case.converges and case.energy is None else (False,):
                sets = case.sets + (TIGHT if tight else [])
                options = [case.scene, "--cascade", "off", *(word for key in sets for word in ("--set", key))]
                found.append(Run({"case": case.name, "tight": tight, "ranks": RANKS}, options, RANKS))
    return found


def read(folder):
    """The last record of each case, and that of its tight run."""
    return {(record["case"], record["tight"]): record for record in measure.read(folder)}


def largest_residual(summary):
    return max(summary[f"residual_{name}"] for name in RESIDUALS)


def reference(case, records):
    """Energy of the solution, as far as it is known."""
    if case.energy is not None:
        return case.energy
    name, factor = case.same or (case.name, 1.0)
    energy = exact_energy(name, records)
    return energy and factor * energy


def exact_energy(name, records):
    tight = records.get((name, True))
    return tight["summary"]["energy"] if tight and tight["exit_code"] == 0 else None


def growth(case, records):
    """Applications of F over those of the case beside."""
    other = records.get((case.beside, False))
    count = records[case.name, False]["summary"]["hessian_multiplications"]
    return count / other["summary"]["hessian_multiplications"] if other and other["summary"] else None


def as_expected(case, record):
    """Whether a run ended as it should, with results."""
    summary = record["summary"]
    if summary is None or record["exit_code"] != (0 if case.converges else 1):
        return False
    return largest_residual(summary) <= case.residual if case.converges else case.says in (summary["error"] or "")


def outcome(record):
    summary = record["summary"]
    if summary is None:
        return f"exit code {record['exit_code']}"
    return "converged" if summary["converged"] else "not converged"


def row(case, records):
    record = records[case.name, False]
    cells = [case.name, outcome(record) + ("" if as_expected(case, record) else " (unexpected)")]
    summary = record["summary"]
    if summary is None:
        return cells + [""] * 8
    outer = (summary["smalse_iterations"] or 0) + (summary["active_set_iterations"] or 0)
    ratio, exact = growth(case, records), reference(case, records)
    error = abs(summary["energy"] / exact - 1) if exact and summary["converged"] else None
    bound = summary["error_algebraic"]
    return cells + [
        summary["newton_iterations"], outer, summary["hessian_multiplications"],
        f"{ratio:.2f}" if ratio and summary["converged"] else "", f"{largest_residual(summary):.1e}",
        f"{bound:.1e}" if bound is not None else "", f"{error:.1e}" if error is not None else "",
        f"{record['seconds']:.1f}" if record["provenance"]["quiet"] else "",
    ]


HEAD = """\
# Hard cases, measured

Written by `scripts/bench write hard` from the runs in [raw/hard](raw/hard), which `scripts/bench run hard` measured. Every case is
the benchmark at level 1, its elastic form, the contact patch or a scene of [scenes/hard](../scenes/hard) with the keys of the last
table. Nothing is tuned: solver settings are the defaults, from rest.

- *beside*: applications of F over those of the benchmark (of the same element and mesh, where there is such a row).
- *residual*: the largest of equilibrium, gluing, gap and complementarity.
- *algebraic error*: the program's own bound.
- *energy error*: relative to the energy of the solution: a closed form, or the same scene (for scenes that are pictures of
  another one: that other one) in double precision with tolerances 1e-8 (Newton), 1e-9 (residual) and 1e-10 (QP).
- *s*: of the whole run; blank where the machine was busy with other work.
"""


def misses(records):
    """Of the factor 3, said in words."""
    grown = {case.name: growth(case, records) for case in CASES if case.converges and finished(records, case)}
    grown = {name: ratio for name, ratio in grown.items() if ratio is not None}
    above = sorted((name for name, ratio in grown.items() if ratio > GROWTH), key=lambda name: -grown[name])
    if not above:
        most = max(grown.values())
        return f"No case takes more than {GROWTH} times the applications of F; the largest factor is {most:.2f}.\n"
    told = ", ".join(f"{name} ({grown[name]:.1f})" for name in above)
    worse = [name for name in above if grown[name] > 2 * GROWTH]
    text = f"More than {GROWTH} times the applications of F: {told}."
    return f"{text} More than {2 * GROWTH} times: {', '.join(worse) or 'none'}.\n"


def pictures(records):
    """How well tight runs of pictures of one scene agree."""
    rows = []
    for case in CASES:
        found, exact = exact_energy(case.name, records), reference(case, records)
        if case.same and found and exact:
            rows.append([case.name, case.same[0], f"{abs(found / exact - 1):.1e}"])
    return rows


def finished(records, case):
    record = records.get((case.name, False))
    return record and record["summary"] and record["summary"]["converged"]


def used():
    return read(RAW).values()


def pages(folder=RAW):
    records = read(folder)
    known = [case for case in CASES if (case.name, False) in records]
    if not known:
        return {}
    head = ["case", "outcome", "Newton", "QP", "F", "beside", "residual", "algebraic error", "energy error", "s"]
    text = [HEAD, table(head, [row(case, records) for case in known]), misses(records)]
    text += ["Scenes that are pictures of another one, both solved as exactly as the references:\n"]
    text += [table(["case", "of", "difference of the energies"], pictures(records))]
    wrong = [case.name for case in known if not as_expected(case, records[case.name, False])]
    text += [f"Not as expected: {', '.join(wrong)}.\n" if wrong else "Every case that was measured ended as expected.\n"]
    errors = [(case.name, (records[case.name, False]["summary"] or {}).get("error")) for case in known]
    told = [f"- {name}: {error}" for name, error in errors if error]
    text += ["What the program says where it does not converge:\n\n" + "\n".join(told) + "\n"] if told else []
    missing = [case.name for case in CASES if case not in known]
    text += [f"Not measured yet: {', '.join(missing)}.\n"] if missing else []
    keys = [[case.name, f"`{case.scene}`", " ".join(f"`{key}`" for key in case.sets)] for case in CASES]
    text += ["## The scenes\n", table(["case", "scene", "keys"], keys)]
    commits = sorted({records[case.name, False]["provenance"]["commit"][:12] for case in known})
    text += [f"Program: {', '.join(commits)}, {RANKS} ranks.\n"]
    return {RESULTS / "hard.md": "\n".join(text)}
