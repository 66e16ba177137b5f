"""Errors that were asked for: what they cost, beside uniform meshes, and what they were in truth.

Energies are compared with that of a much finer run, or for two-blocks with the limit of two families of meshes of another program.
"""

import typing

from . import measure, plot
from .measure import RESULTS, Run
from .pages import of_cases, table

RANKS = 2
RAW = measure.RAW / "adaptive"


class Case(typing.NamedTuple):
    scene: str
    about: str
    wanted: list
    """Errors that are asked for."""
    exact: float | None = None
    """The least energy, or the number, where it is known; else that of a run with ..."""
    fine: str | None = None
    """... this error."""
    sets: tuple = ()
    uniform: tuple = ()
    """Options of runs on uniform meshes."""
    goal: str | None = None
    """The number whose error is asked for, in place of the energy."""
    limit: bool = False
    """Whether it is the energy of a limit load, whose factor is compared with 1, that of the closed form."""

    def value(self, summary):
        last = summary["refinements"][-1] if summary["refinements"] else {}
        if self.limit:
            return last["limit_load"]["factor"]
        return last["goal"]["value"] if self.goal else summary["energy"]

    def known(self, records):
        """The least energy, or the number, that errors refer to, and what is said of it; None without the run that it takes."""
        if self.limit:
            return 1.0, "The limit load factor of the closed form is 1."
        fine = records.get(("fine", self.fine))
        value = self.value(fine["summary"]) if fine and self.exact is None else self.exact
        source = f"of a run with an error of {self.fine}" if self.exact is None else "of another program's meshes, or a limit of uniform ones"
        what = f"`{self.goal}` is" if self.goal else "The least energy is"
        return value and (value, f"{what} {value:.8g}, {source}.")


def blocks(element, cells):
    sets = [f"body.{body}.brick.cells=[{3 * cells}, {cells}, {cells}]" for body in ("lower", "upper")]
    sets += [f"body.{body}.element={element}" for body in ("lower", "upper")] + ["decomposition.cells=[5, 5, 5]"]
    return f"{element}, n = {cells}", sets


def spheres(bodies, cells):
    return f"tet10, n = {cells}", [f"body.{b}.{key}" for b in bodies for key in ("element=tet10", f"sphere.cells=[{cells}, {cells}]")]


CASES = {
    "two-blocks": Case(
        "two-blocks", "the benchmark; uniform meshes have n cells along 1000 mm", ["5%", "2%", "1%", "0.5%", "0.25%", "0.1%"],
        exact=-1.4876e9, uniform=tuple(blocks(*of) for of in [("hex8", 10), ("hex8", 20), ("tet10", 5), ("tet10", 10), ("tet10", 15)]),
    ),
    "hollow-sphere": Case(
        "scenes/precision/hollow-sphere.toml", "a sphere that yields in part; uniform meshes have n cells through the wall",
        ["1%", "0.5%", "0.2%", "0.1%", "0.05%"], fine="0.002%", uniform=tuple(spheres(["wall"], n) for n in (2, 4, 6)),
    ),
    "nested-spheres": Case(
        "scenes/precision/nested-spheres.toml", "contact of two spheres, one of which yields; begins with 2 cells through each wall",
        ["1%", "0.5%", "0.2%", "0.1%"], exact=-1301975.0,
        sets=("body.inner.sphere.cells=[2, 2]", "body.outer.sphere.cells=[2, 2]"),
        uniform=tuple(spheres(["inner", "outer"], n) for n in (2, 3, 4, 6)),
    ),
    "bolt": Case("scenes/bolt.toml", "four bodies from a mesh file of flat faces", ["2%", "1%", "0.5%"], fine="0.15%"),
    "hertz": Case("scenes/hertz.toml", "elastic contact, from a graded mesh file", ["0.2%", "0.1%", "0.05%"], fine="0.005%"),
    "punch": Case(
        "scenes/punch.toml", "a punch that is pressed into a block that yields, at once, from a mesh file", ["0.15%", "0.1%", "0.05%", "0.02%"],
        fine="0.008%", sets=("step=[{}]",),
    ),
    "notch": Case(
        "scenes/notch.toml", "a notched bar that yields, from a mesh file of quadratic elements", ["0.2%", "0.1%", "0.05%", "0.02%"],
        fine="0.003%",
    ),
    "ring": Case(
        "scenes/ring.toml", "the nested spheres, from a mesh file of flat faces", ["0.1%", "0.05%", "0.02%"], exact=-1301975.0,
    ),
    "two-blocks force": Case(
        "two-blocks", "the contact force of the benchmark", ["1%", "0.5%", "0.2%", "0.1%"], fine="0.02%", goal="contact_force",
    ),
    "two-blocks deflection": Case(
        "two-blocks", "how far the end of the lower block of the benchmark sinks", ["5%", "2%", "1%"], fine="0.2%",
        goal="displacement:3000,500,0:z",
    ),
    "hollow-sphere bore": Case(
        "scenes/precision/hollow-sphere.toml", "how far the bore of the sphere widens", ["1%", "0.5%", "0.2%", "0.1%"], fine="0.01%",
        goal="displacement:100,0,0:x",
    ),
    "hertz force": Case("scenes/hertz.toml", "the force between ball and block", ["0.2%", "0.1%", "0.05%"], fine="0.01%", goal="contact_force"),
    "limit of a sphere": Case(
        "scenes/limit/sphere.toml", "a hollow sphere without hardening; begins with 18 elements", ["2%", "1%", "0.5%", "0.2%"],
        sets=("body.wall.sphere.cells=[1, 1]",), limit=True,
    ),
    "limit of a cylinder": Case(
        "scenes/limit/cylinder.toml", "a tube without hardening; begins with 18 elements", ["2%", "1%", "0.5%", "0.2%"],
        sets=("body.wall.cylinder.cells=[2, 1, 1]",), limit=True,
    ),
    "limit of a strip": Case(
        "scenes/limit/strip.toml", "a stamp on ground without hardening; begins with large cells", ["3%", "2%", "1%"],
        sets=(
            "body.ground.grid.x=[0, 24, 42, 50, 58, 78, 118, 190, 330, 500]", "body.ground.grid.z=[-500, -310, -190, -115, -68, -41, -23, -10, 0]",
            "body.stamp.grid.x=[0, 24, 42, 50]",
        ),
        limit=True,
    ),
}


def options(case, error):
    of = CASES[case]
    goal = ["--error-of", of.goal] if of.goal else []
    return [of.scene, "--error", error, *goal, *(word for key in of.sets for word in ("--set", key))]


def runs(cases):
    found = []
    for case in cases:
        of = CASES[case]
        label = {"case": case, "ranks": RANKS}
        found += [Run({**label, "error": error, "mesh": "refined"}, options(case, error), RANKS) for error in of.wanted]
        if of.fine:
            found.append(Run({**label, "error": of.fine, "mesh": "fine"}, options(case, of.fine), RANKS, once=True))
        for mesh, sets in of.uniform:
            words = [of.scene, *(word for key in sets for word in ("--set", key))]
            found.append(Run({**label, "error": None, "mesh": mesh}, words, RANKS))
    return found


def arguments(parser):
    parser.add_argument("--cases", nargs="+", choices=list(CASES), default=list(CASES))
    measure.add_repeat(parser, 1)
    measure.add_arguments(parser)


def run(arguments):
    return 1 if measure.run(runs(arguments.cases), arguments, RAW, tables=("refinements",)) else 0


def key_of(record):
    return record["mesh"], record["error"]


def read(folder=RAW):
    """The last record of each kind that is asked for, by case."""
    known = {(run.label["case"], *key_of(run.label)) for run in runs(CASES)}
    found = {case: {} for case in CASES}
    for record in measure.read(folder):
        if record["summary"] and (record["case"], *key_of(record)) in known:
            found[record["case"]][key_of(record)] = record
    return found


def used():
    return [record for records in read().values() for record in records.values()]


def unknowns(summary):
    return 3 * summary["nodes"]


def share(text):
    return float(text.rstrip("%")) / 100


def percent(value):
    return f"{100 * value:.3g} %"


HEAD = """\
# Errors that were asked for

Written by `scripts/bench write adaptive` from the runs in [raw/adaptive](raw/adaptive), which `scripts/bench run adaptive` measured.

- *true error*: of the energy J, over the least one; in later sections of a number ([`--error-of`](../docs/running.md#asking-for-an-error)),
  in the last ones of the factor of a limit load. *over the wanted one* it should be between 0.4 and 1, for numbers between 0.3 and 1; less
  means that a mesh before was not enough, or that already the first mesh was better.
- *F*: applications of F, and *s*: seconds, of all meshes together.
"""


def section(case, records):
    of = CASES[case]
    if (found := of.known(records)) is None:
        return [f"## {case}\n", "Not measured yet.\n"], {}
    known, said = found
    text = [f"## {case}\n", f"{of.about[0].upper()}{of.about[1:]}. {said}\n"]

    def error(summary):
        return abs(of.value(summary) / known - 1)

    rows, refined, uniform = [], {}, {}
    for wanted in of.wanted:
        record = records.get(("refined", wanted))
        if record is None:
            continue
        summary = record["summary"]
        meshes = summary["refinements"]
        refined[summary["time_total"]] = error(summary)
        rows.append([
            wanted, unknowns(summary), len(meshes), percent(meshes[-1]["error"]), percent(error(summary)),
            f"{error(summary) / share(wanted):.2f}", sum(row["hessian_multiplications"] for row in meshes), f"{summary['time_total']:.2f}",
        ])
    text.append(table(["wanted", "unknowns", "meshes", "estimated", "true error", "over the wanted one", "F", "s"], rows))
    rows = []
    for mesh, _ in of.uniform:
        record = records.get((mesh, None))
        if record is not None:
            summary = record["summary"]
            uniform.setdefault(mesh.partition(",")[0], {})[summary["time_total"]] = error(summary)
            rows.append([mesh, unknowns(summary), percent(error(summary)), summary["hessian_multiplications"], f"{summary['time_total']:.2f}"])
    if not rows:
        return text, {}
    text.append(table(["uniform mesh", "unknowns", "true error", "F", "s"], rows))
    path = RESULTS / f"adaptive-{case}.svg"
    series = [("refined", refined, False), *((f"uniform {element}", points, True) for element, points in uniform.items())]
    text.append(f"![{path.stem}]({path.name})\n")
    return text, {path: plot.curves(f"{case}: error of the energy against time", "seconds", "relative error", series)}


def pages():
    return of_cases(RESULTS / "adaptive.md", HEAD, read(), section, RANKS)
