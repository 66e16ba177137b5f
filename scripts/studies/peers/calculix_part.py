#!/usr/bin/env python3
"""A scene with a mesh of Gmsh solved with CalculiX: what an engineer opens first.

    scripts/studies/peers/calculix_part.py SCENE --out DIR

Writes DIR/part.inp from fetiplast's scene and mesh: C3D4, isotropic hardening by *PLASTIC, forces at nodes, penalty contact from
surface to surface; a rigid plane is the top of a fixed brick. Runs `ccx` on it and reads its results. DIR/summary.json has
them; `time_total` is that of ccx alone, which reads the mesh as a part of its input.
"""

import argparse
import math
import pathlib
import sys

import ccx
import numpy as np
import part

PENALTY = 1e5
"""Pressure per overclosure, MPa/mm. Ten times as much takes more than twice the iterations on the flange."""
CYCLES = 25
"""Iterations after which an increment is cut back. CalculiX waits for 60, in which the flange goes round in cycles."""
SIDES = np.array([1, 2, 4, 3])
"""What CalculiX calls the faces of a C3D4 in the order of `part.FACES`."""


def write(file, given, options):
    elements = np.concatenate(list(given.bodies.values()))
    print("*NODE,NSET=NALL", file=file)
    file.writelines(f"{n},{x:.12g},{y:.12g},{z:.12g}\n" for n, (x, y, z) in enumerate(given.points.tolist(), 1))
    first = 1
    for number, (body, tetrahedra) in enumerate(given.bodies.items()):
        law = given.materials[body]
        print(f"*ELEMENT,TYPE=C3D4,ELSET=BODY{number}", file=file)
        ccx.lines(file, ([e, *nodes] for e, nodes in enumerate((tetrahedra + 1).tolist(), first)))
        first += len(tetrahedra)
        print(f"*MATERIAL,NAME=LAW{number}\n*ELASTIC\n{law['young']},{law['poisson']}", file=file)
        limits = law["yield_stress"], law["yield_stress"] + law.get("hardening", 0.0)
        print(f"*PLASTIC\n{limits[0]},0.\n{limits[1]},1.\n*SOLID SECTION,ELSET=BODY{number},MATERIAL=LAW{number}", file=file)
    print("*ELSET,ELSET=EALL", file=file)
    ccx.lines(file, ([f"BODY{number}"] for number in range(len(given.bodies))))
    print("*BOUNDARY", file=file)
    ccx.lines(file, ([n + 1, c + 1, c + 1] for n, c in np.argwhere(given.fixed).tolist()))
    for contact in given.contacts:
        write_contact(file, given, elements, contact)
    print(f"*STEP,INC=200\n*CONTROLS,PARAMETERS=CONTACT\n0.001,0.1,100,{CYCLES}", file=file)
    print(f"*STATIC,SOLVER={options.solver}\n{options.increment},1.,1e-5,{options.increment}\n*CLOAD", file=file)
    loaded = np.argwhere(given.forces)
    values = given.forces[tuple(loaded.T)].tolist()
    file.writelines(f"{n + 1},{c + 1},{value:.12g}\n" for (n, c), value in zip(loaded.tolist(), values))
    print("*NODE PRINT,NSET=NALL,FREQUENCY=1000\nU\n*EL PRINT,ELSET=EALL,FREQUENCY=1000\nPEEQ", file=file)
    for contact in given.contacts:
        print(f"*CONTACT PRINT,FREQUENCY=1000,SLAVE=S-{contact.name},MASTER=M-{contact.name}\nCF".upper(), file=file)
    print("*END STEP", file=file)


def write_contact(file, given, elements, contact):
    slave, master = f"S-{contact.name}".upper(), f"M-{contact.name}".upper()
    write_surface(file, slave, contact.slave, elements)
    if isinstance(contact, part.Floor):
        write_floor(file, master, given.points, len(elements) + 1, contact)
    else:
        write_surface(file, master, contact.master, elements)
    print(
        f"*SURFACE INTERACTION,NAME=I{slave}\n*SURFACE BEHAVIOR,PRESSURE-OVERCLOSURE=LINEAR\n{PENALTY:g},1.\n"
        f"*CONTACT PAIR,INTERACTION=I{slave},TYPE=SURFACE TO SURFACE\n{slave},{master}",
        file=file,
    )
    if getattr(contact, "clearance", None) is not None:
        print(f"*CLEARANCE,MASTER={master},SLAVE={slave},VALUE={contact.clearance}", file=file)


def write_surface(file, name, triangles, elements):
    _, place = part.faces_of(triangles, elements)
    print(f"*SURFACE,NAME={name},TYPE=ELEMENT", file=file)
    ccx.lines(file, ([e + 1, f"S{side}"] for e, side in zip((place // 4).tolist(), SIDES[place % 4].tolist())))


def write_floor(file, name, points, number, plane):
    """A fixed brick whose face is the plane, wide enough for all that could touch it."""
    low, high = points.min(0), points.max(0)
    reach = (high - low).max()
    ends = np.array([low - reach, high + reach])
    ends[0 if plane.sign > 0 else 1, plane.axis] = plane.place - plane.sign * reach
    ends[1 if plane.sign > 0 else 0, plane.axis] = plane.place
    corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    # The faces across x, y, z: at the lower end, at the upper one.
    side = [(6, 4), (3, 5), (1, 2)][plane.axis][1 if plane.sign > 0 else 0]
    first = len(points) + 1
    print("*NODE,NSET=FLOOR", file=file)
    ccx.lines(file, ([first + k, *(ends[c, axis] for axis, c in enumerate(corner))] for k, corner in enumerate(corners)))
    print(f"*ELEMENT,TYPE=C3D8,ELSET=FLOOR\n{number},{','.join(str(first + k) for k in range(8))}", file=file)
    print("*SOLID SECTION,ELSET=FLOOR,MATERIAL=LAW0\n*BOUNDARY\nFLOOR,1,3", file=file)
    print(f"*SURFACE,NAME={name},TYPE=ELEMENT\n{number},S{side}", file=file)


def found(blocks, contacts):
    return {
        "max_displacement": max(math.hypot(*row[1:]) for row in blocks["displacements"]),
        "plastic_elements": len({row[0] for row in blocks["equivalent"] if row[2] > 0}),
        "contact_forces": {c.name: blocks[f"S-{c.name.upper()} surface"][0][:3] for c in contacts},
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", type=pathlib.Path)
    parser.add_argument("--solver", choices=["ITERATIVE CHOLESKY", "SPOOLES"], default="ITERATIVE CHOLESKY")
    parser.add_argument("--increment", type=float, default=1.0, help="share of the load that is tried at once")
    ccx.add_arguments(parser)
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    given = part.load(arguments.scene)
    with open(arguments.out / "part.inp", "w") as file:
        write(file, given, arguments)
    return ccx.solve("part", lambda blocks: found(blocks, given.contacts), arguments)


if __name__ == "__main__":
    sys.exit(main())
