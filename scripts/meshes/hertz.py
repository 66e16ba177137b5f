#!/usr/bin/env python3
"""Mesh of the scene `hertz`: a quarter of a hemisphere of radius 100 on a quarter of a block, made by Gmsh. Elements are H
wide where the bodies touch, within a radius of about 1, and grow with the distance from there.

    scripts/meshes/hertz.py [--h H] [--out FILE]

Volumes `ball` and `block`; surfaces `skin` of the ball, `top`, `bottom`, and the planes of symmetry `x0`, `y0`.
"""

import argparse

import cad

RADIUS = 100.0


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--h", type=float, default=0.1)
    parser.add_argument("--out", default="scenes/hertz.msh")
    arguments = parser.parse_args()
    occ, r = cad.start(), RADIUS
    ball, corner = occ.addSphere(0, 0, r, r), occ.addBox(0, 0, 0, r, r, r)
    (_, ball), = occ.intersect([(3, ball)], [(3, corner)])[0]
    block = occ.addBox(0, 0, -r, r, r, r)
    skin = lambda volume, low, high: volume == "ball"
    planes = {"x0": cad.flat(0, 0.0), "y0": cad.flat(1, 0.0)}
    ends = {"top": cad.flat(2, r, "ball"), "face": cad.flat(2, 0.0, "block"), "bottom": cad.flat(2, -r)}
    cad.name({"ball": ball, "block": block}, planes | ends | {"skin": skin})
    slope = 2.5 * arguments.h
    cad.write(cad.growing(arguments.h, slope, "Sqrt(x^2+y^2+z^2)", 1.15), arguments.out, r / 4)


if __name__ == "__main__":
    main()
