#!/usr/bin/env python3
"""Mesh of the scene `punch`: a quarter of a round bar of radius 5 with a round nose on a quarter of a block, made by Gmsh.

    scripts/meshes/punch.py [--h H] [--out FILE]

H is the width of the elements where the bodies touch. Volumes `punch` and `block`; surfaces `top`, `nose`, `face`, `bottom`,
and the planes of symmetry `x0`, `y0`.
"""

import argparse

import cad

RADIUS, HEIGHT = 5.0, 9.0
BLOCK = (12.0, 12.0, 8.0)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--h", type=float, default=0.15)
    parser.add_argument("--out", default="scenes/punch.msh")
    arguments = parser.parse_args()
    occ, r = cad.start(), RADIUS
    bar, ball = occ.addCylinder(0, 0, r, 0, 0, HEIGHT - r, r), occ.addSphere(0, 0, r, r)
    (_, bar), = occ.fuse([(3, bar)], [(3, ball)])[0]
    corner = occ.addBox(0, 0, 0, r, r, HEIGHT)
    (_, bar), = occ.intersect([(3, bar)], [(3, corner)])[0]
    width, depth, height = BLOCK
    block = occ.addBox(0, 0, -height, width, depth, height)
    surfaces = {
        "x0": cad.flat(0, 0.0),
        "y0": cad.flat(1, 0.0),
        "top": cad.flat(2, HEIGHT),
        "face": cad.flat(2, 0.0, "block"),
        "bottom": cad.flat(2, -height),
        "nose": lambda volume, low, high: volume == "punch" and low[2] < 0.5 * r,
    }
    cad.name({"block": block, "punch": bar}, surfaces)
    # The bar stays elastic: its elements may be a little larger.
    size = cad.growing(arguments.h, 0.3, "Sqrt(x^2+y^2+z^2)", 1.6)
    cad.write(size, arguments.out, 2.0, {bar: 1.2})


if __name__ == "__main__":
    main()
