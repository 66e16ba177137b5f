"""Contact of curved surfaces: errors against closed forms and another program, on refined meshes.

Makes the meshes, solves, and compares fields; all cases take ten minutes. Needs the packages of scripts/requirements.txt.
"""

import json
import math

from . import measure
from .measure import RESULTS
from .deal_ii import forces_of_deal_ii, limit_of_deal_ii
from .pages import table

RAW = measure.RAW / "accuracy"
CASES = ["ring", "spheres", "patch", "hertz", "step-42"]


def arguments(parser):
    parser.add_argument("cases", nargs="*", metavar="CASE", help=f"of {', '.join(CASES)}; without one all")
    parser.add_argument("--np", type=int, default=2, help="ranks")
    measure.add_arguments(parser)


def run(arguments):
    from . import curved

    program = measure.Program(arguments)
    records = program.records(RAW)
    for case in arguments.cases or CASES:
        for place, summary, errors in curved.CASES[case](curved.Solver(program, arguments.np)):
            record = {"study": case, **place, "nodes": summary["nodes"], "elements": summary["elements"]}
            record |= {"slave": summary["contacts"][0]["slave"], "rule": summary["contacts"][0]["rule"]}
            record |= {"seconds": summary["time_total"], "ranks": summary["ranks"]}
            record["errors"] = {name: float(error) for name, error in errors.items()}
            record["provenance"] = {"date": measure.date(measure.now()), **program.provenance(summary)}
            records.add(record)
            print(json.dumps({key: record[key] for key in ("study", "family", "mesh", "errors")}), flush=True)
    return 0


HEAD = """\
# Contact of curved surfaces, measured

Written by `scripts/bench write accuracy` from the runs in [raw/accuracy](raw/accuracy), which `scripts/bench run accuracy`
measured. Relative errors; in brackets the order between a row and the one above. The nested spheres stand on two more pages, with
other questions: [verification.md](verification.md) holds each element against the closed form on matching meshes,
[precision.md](precision.md) says what an error costs. Here their interfaces are curved and do not match.
"""

NOTES = {
    "ring": """Nested spheres (scene `ring`, pressure 600, clearance 0.05), one octant; N/M are the triangles along an edge of the
inner and the outer sphere. *Contact force*: mean over the surface; *contact pressure*: root mean square over the slave nodes;
*plastic front*: radius of a sphere that holds as much yielded volume; *plastic strain*: in the L2 norm; *displacement* of the
outer sphere at the interface: root mean square. The last family takes the distance of the meshes instead of a clearance: the
facets' own gaps and overlaps are as large as the displacements, and vanish with the square of the width only.""",
    "spheres": """The same of quadratic tetrahedra (scene `scenes/precision/nested-spheres.toml`), whose nodes lie on the spheres; N/M
are the cells along half an edge of the inner and the outer sphere.""",
    "patch": """Patch test on a curved surface: the same spheres, elastic, without a gap, a pressure in and around them. Each is under
that pressure alone, with linear displacements, which linear elements hold exactly; all errors are those of the contact.
Relative to the pressure.""",
    "hertz": """Hertz (scene `hertz`), against the closed form for the force that was found. *Contact radius*: of a circle as large as the
closed nodes' share of the surface; *radius of inertia*: from the second moment of the pressure; *pressure*: in the L2 norm;
*approach*: what was prescribed. A ball of 100 contact radii leaves about -0.7 % of the approach, whatever the mesh.""",
    "step-42": f"""The rigid ball of deal.II's tutorial step-42 (scene `step-42`), on meshes graded towards the contact; h is the width
of the cells there. *Force*: on the whole ball. Adaptive hexahedra of deal.II end with {forces_of_deal_ii()[0][-1]} (trilinear, going to
{limit_of_deal_ii():.2f} by Aitken's rule) and {forces_of_deal_ii()[1][-1]} (quadratic): [all cycles](deal.II-step-42.json). There nodes are held along z; here
along the ball's normals, which tilt by up to ten degrees. *Along z* is the ball as a height field of level treads around the
nodes, which holds them as deal.II does.""",
}


def read():
    """The last record of each case, family and mesh, the cases in their order."""
    found = {(record["study"], record["family"], record["mesh"]): record for record in measure.read(RAW)}
    return sorted(found.values(), key=lambda record: CASES.index(record["study"]))


used = read


def order(row, above, name):
    """Between a row and the one above, in brackets, where both errors are ones that fall."""
    if above is None or row["study"] == "step-42":
        return ""
    coarse, fine = abs(above["errors"][name]), abs(row["errors"][name])
    if not (max(coarse, fine) < 20 and min(coarse, fine) > 1e-8):
        return ""
    return f" ({math.log(coarse / fine) / math.log(above['h'] / row['h']):.1f})"


def cells(row, above):
    yield "" if above else row["family"]
    yield from (row["mesh"], f"{row['h']:.3g}", row["elements"], f"{row['seconds']:.1f}")
    for name, error in row["errors"].items():
        yield (f"{error:.2e}" if abs(error) < 20 else f"{error:.4g}") + order(row, above, name)


def pages():
    """With orders between the rows of a family."""
    text = [HEAD]
    records = read()
    for case, note in NOTES.items():
        rows, above = [], None
        for row in (record for record in records if record["study"] == case):
            rows.append(list(cells(row, above if above and above["family"] == row["family"] else None)))
            above = row
        head = ["", "mesh", "h", "elements", "s", *above["errors"]]
        text += [f"## {case}\n", f"{note}\n", table(head, rows)]
    return {RESULTS / "accuracy.md": "\n".join(text)}
