#!/usr/bin/env python3
"""Mesh of the scene `notch`: an eighth of a round bar with a round notch about its middle, made by Gmsh, of quadratic
tetrahedra that follow its round surfaces.

    scripts/meshes/notch.py [--h H] [--out FILE]

H is the width of the elements at the root of the notch. Volume `bar`; surfaces `end`, and the planes of symmetry `x0`, `y0`, `z0`.
"""

import argparse

import cad

RADIUS, HEIGHT = 10.0, 30.0
NOTCH, DEPTH = 2.0, 4.0
"""Radius of the notch's root, and how deep it is."""


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--h", type=float, default=1.6)
    parser.add_argument("--out", default="scenes/notch.msh")
    arguments = parser.parse_args()
    occ, root = cad.start(), RADIUS - DEPTH
    bar = occ.addCylinder(0, 0, 0, 0, 0, HEIGHT, RADIUS)
    groove = [(3, occ.addTorus(0, 0, 0, root + NOTCH, NOTCH))]
    # Beyond the round root the notch has straight sides.
    outer, inner = occ.addCylinder(0, 0, 0, 0, 0, NOTCH, 2 * RADIUS), occ.addCylinder(0, 0, 0, 0, 0, NOTCH, root + NOTCH)
    groove += occ.cut([(3, outer)], [(3, inner)])[0]
    (_, bar), = occ.cut([(3, bar)], groove)[0]
    corner = occ.addBox(0, 0, 0, RADIUS, RADIUS, HEIGHT)
    (_, bar), = occ.intersect([(3, bar)], [(3, corner)])[0]
    planes = {f"{axis}0": cad.flat(number, 0.0) for number, axis in enumerate("xyz")}
    cad.name({"bar": bar}, {**planes, "end": cad.flat(2, HEIGHT)})
    away = f"Sqrt((Sqrt(x^2+y^2)-{root + NOTCH})^2 + z^2)"
    cad.write(cad.growing(arguments.h, 0.3, away, NOTCH), arguments.out, 4.0, order=2)


if __name__ == "__main__":
    main()
