"""Blocks with friction: fetiplast beside CalculiX on the same mesh, and both against a fine one."""

import sys

from .. import measure
from ..pages import table
from .records import FOLDER, OURS, RANKS, ended, middle, memory_of, no_result, program_of, seconds_of, spread, timed

FRICTION = 0.3
MATERIAL = "{young=210000.0,poisson=0.29}"
ELEMENTS = {"tet4": "linear tetrahedra", "hex8": "trilinear hexahedra"}
FINE = "hex8", 5
"""Element and level of what the others are compared with."""
LEVELS = {OURS: [1, 2], "calculix": [1]}
"""CalculiX factorises the whole matrix, which is not symmetric, in each of some thirty iterations."""
NUMBERS = ["normal force", "friction force", "largest displacement"]

HEAD = """\
## Friction

The blocks of the benchmark, elastic, with a coefficient of friction of {friction}. The load acts at once, and all that touches
slips.

- **fetiplast**: 2 ranks, everything at its default.
- **calculix** ([calculix.py](../scripts/studies/peers/calculix.py)): 2 threads, penalty contact from surface to surface with a stick
  slope of a tenth of the penalty, one increment as for fetiplast, and the direct solver SPOOLES, for its iterative one takes
  symmetric matrices only. Elements are C3D4 and C3D8.

Errors are relative to fetiplast with {fine} at level {level}:
{reference}. They are mostly those of the mesh. *From fetiplast's* is the largest difference of the three numbers from those of
fetiplast on the same mesh: the penalty makes it, and for hexahedra that C3D8 is another element than hex8. Where other work ran
beside, times are left out.
"""


def case(element):
    return f"two-blocks-friction-{element}"


def runs(peers):
    wanted = [
        (program, element, level)
        for element in ELEMENTS
        for program, levels in LEVELS.items()
        for level in levels
        if program == OURS or program in peers
    ]
    return [run_of(*of) for of in [(OURS, *FINE), *wanted]]


def run_of(program, element, level):
    label = {"scene": case(element), "level": level, "variant": f"peers/{program}", "ranks": RANKS}
    options = ["--level", str(level)]
    if program == "calculix":
        start = [sys.executable, str(FOLDER / "calculix.py")]
        more = ["--friction", str(FRICTION), "--element", element, "--threads", str(RANKS)]
        return measure.Run(label, [*options, *more], RANKS, start)
    keys = [f"contact.joint.friction={FRICTION}"]
    for body in ("lower", "upper"):
        keys += [f"body.{body}.element={element}", f"material.{body}={MATERIAL}"]
    sets = [word for key in keys for word in ("--set", key)]
    return measure.Run(label, ["two-blocks", *options, *sets], RANKS, once=(element, level) == FINE)


def numbers(summary):
    """Those that are compared: of the force on the upper block its parts across and along the surface, and the largest displacement."""
    force = summary["contact_force"]
    return [force[2], force[0], summary["max_displacement"]]


def errors(found, reference):
    return [abs(value / exact - 1) for value, exact in zip(found, reference)]


def work(record):
    summary = record["summary"]
    if program_of(record) == "calculix":
        return f"{summary['iterations']} iterations"
    return f"{summary['newton_iterations']} Newton steps, {summary['hessian_multiplications']} applications of F"


def row(element, level, program, records, ours, reference):
    start = [program, element, level]
    if ended(records):
        return [*start, *no_result(program, records, ours, len(COLUMNS) - 2)[1:]]
    summary = records[0]["summary"]
    known = timed(records, ours)
    seconds = [spread(map(seconds_of, records)), f"{middle(records, seconds_of) / middle(ours, seconds_of):.2f}"] if known else ["", ""]
    of_mesh = [f"{error:.1e}" for error in errors(numbers(summary), reference)]
    beside = "" if program == OURS else f"{max(errors(numbers(summary), numbers(ours[0]['summary']))):.1e}"
    return [*start, *seconds, *of_mesh, beside, spread(map(memory_of, records)), work(records[0])]


COLUMNS = ["", "element", "level", "seconds", "times fetiplast", *(f"error of {name}" for name in NUMBERS), "from fetiplast's"]
COLUMNS += ["MiB", "finest level"]


def sections(found):
    fine = (case(FINE[0]), FINE[1]), OURS
    if fine not in found:
        return []
    reference = numbers(found[fine][0][0]["summary"])
    rows = [
        row(element, level, program, *found[(case(element), level), program], reference)
        for element in ELEMENTS
        for level in LEVELS[OURS]
        for program in LEVELS
        if ((case(element), level), program) in found
    ]
    told = ", ".join(f"{name} {value:.6g}" for name, value in zip(NUMBERS, reference))
    head = HEAD.format(friction=FRICTION, fine=ELEMENTS[FINE[0]], level=FINE[1], reference=told)
    return [head, table(COLUMNS, rows)]
