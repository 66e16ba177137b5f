#!/usr/bin/env python3
"""The benchmark two-blocks solved with CalculiX: what an engineer opens first.

    scripts/studies/peers/calculix.py --level 1 --out DIR [--friction MU [--element hex8]]

Writes DIR/two_blocks.inp with fetiplast's mesh as C3D4 or C3D8, isotropic hardening by *PLASTIC and penalty contact from surface
to surface, runs `ccx` on it and reads its results. With friction the blocks are elastic. DIR/summary.json has the results;
`time_total` is that of ccx alone, for an engineer has the mesh already. Needs nothing but Python and ccx.
"""

import argparse
import itertools
import math
import sys
import typing

import ccx

INCREMENTS = 5
PENALTY = 1e5
"""Pressure per overclosure, MPa/mm. A hundred times as much changes the contact force at level 1 by 1e-6 and the largest
displacement by 1e-3, and takes 1.6 times the iterations."""
STICK = 1e4
"""Shear stress per slip before surfaces slide, MPa/mm."""


class Element(typing.NamedTuple):
    name: str
    of_cell: list
    """Corners of the elements of a cell; bits of their numbers are steps along x, y, z."""
    faces: list
    """In CalculiX's order, from S1 on."""


ELEMENTS = {
    "tet4": Element(
        "C3D4",
        [(0, 1, 2, 5), (0, 2, 4, 5), (2, 4, 5, 6), (1, 3, 2, 5), (3, 5, 7, 2), (2, 5, 7, 6)],
        [(0, 1, 2), (0, 1, 3), (1, 2, 3), (0, 2, 3)],
    ),
    "hex8": Element(
        "C3D8",
        [(0, 1, 3, 2, 4, 5, 7, 6)],
        [(0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)],
    ),
}


def write(file, n, kind, friction):
    h, cells, shift = 100 / n, (30 * n, 10 * n, 10 * n), 6 * n
    nx, ny, nz = cells
    per_body = (nx + 1) * (ny + 1) * (nz + 1)

    def node(body, x, y, z):
        return 1 + body * per_body + (x * (ny + 1) + y) * (nz + 1) + z

    def lines(rows):
        ccx.lines(file, rows)

    def numbers(values):
        lines([value] for value in values)

    print("*NODE,NSET=NALL", file=file)
    for body in (0, 1):
        grid = itertools.product(*(range(c + 1) for c in cells))
        lines((node(body, x, y, z), (x + shift * body) * h, y * h, z * h + 1000 * body) for x, y, z in grid)
    element, faces = 0, {"MASTER": [], "SLAVE": [], "LOADED": []}
    for body in (0, 1):
        print(f"*ELEMENT,TYPE={kind.name},ELSET=BODY{body}", file=file)
        for x, y, z in itertools.product(*map(range, cells)):
            surfaces = []
            if body == 0 and z == nz - 1 and x >= shift:
                surfaces.append(("MASTER", 1))
            if body == 1 and z == 0 and x < nx - shift:
                surfaces.append(("SLAVE", 0))
            if body == 1 and z == nz - 1:
                surfaces.append(("LOADED", 1))
            for corners in kind.of_cell:
                element += 1
                lines([[element, *(node(body, x + (v & 1), y + (v >> 1 & 1), z + (v >> 2)) for v in corners)]])
                for name, top in surfaces:
                    for number, face in enumerate(kind.faces, 1):
                        if all(corners[corner] >> 2 == top for corner in face):
                            faces[name].append((element, number))
    print("*ELSET,ELSET=EALL\nBODY0,BODY1", file=file)
    for body, x in ((0, 0), (1, nx)):
        print(f"*NSET,NSET=FIX{body}", file=file)
        numbers(node(body, x, y, z) for y in range(ny + 1) for z in range(nz + 1))
    for name in ("MASTER", "SLAVE"):
        print(f"*SURFACE,NAME={name},TYPE=ELEMENT", file=file)
        lines((e, f"S{face}") for e, face in faces[name])
    # The matrix of friction is not symmetric, and a straight path needs one increment.
    plastic, rubbing = ("", f"*FRICTION\n{friction},{STICK:g}\n") if friction else ("*PLASTIC\n450.,0.\n10450.,1.\n", "")
    solver, increment = ("SPOOLES", 1.0) if friction else ("ITERATIVE CHOLESKY", 1 / INCREMENTS)
    print(
        f"*MATERIAL,NAME=STEEL\n*ELASTIC\n210000.,0.29\n{plastic}*SOLID SECTION,ELSET=EALL,MATERIAL=STEEL\n"
        f"*SURFACE INTERACTION,NAME=CONTACT\n*SURFACE BEHAVIOR,PRESSURE-OVERCLOSURE=LINEAR\n{PENALTY:g},1.\n{rubbing}"
        "*CONTACT PAIR,INTERACTION=CONTACT,TYPE=SURFACE TO SURFACE\nSLAVE,MASTER\n"
        "*BOUNDARY\nFIX0,1,3\nFIX1,1,3\n"
        f"*STEP,INC=200\n*STATIC,SOLVER={solver}\n{increment},1.,1e-5,{increment}\n*DLOAD",
        file=file,
    )
    lines((e, f"P{face}", 150.0) for e, face in faces["LOADED"])
    print(
        "*NODE PRINT,NSET=FIX0,TOTALS=ONLY\nRF\n*NODE PRINT,NSET=NALL\nU\n*EL PRINT,ELSET=EALL\nPEEQ\n*END STEP", file=file
    )


def found(blocks):
    """Contact force, largest displacement and plastic elements."""
    return {
        "contact_force": blocks["total force"][0],
        "max_displacement": max(math.hypot(*row[1:]) for row in blocks["displacements"]),
        "plastic_elements": sum(row[2] > 0 for row in blocks.get("equivalent", [])),
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--level", type=int, default=1)
    parser.add_argument("--friction", type=float, metavar="MU", help="of elastic blocks")
    parser.add_argument("--element", choices=ELEMENTS, default="tet4")
    ccx.add_arguments(parser)
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    with open(arguments.out / "two_blocks.inp", "w") as file:
        write(file, arguments.level, ELEMENTS[arguments.element], arguments.friction)
    return ccx.solve("two_blocks", found, arguments)


if __name__ == "__main__":
    sys.exit(main())
