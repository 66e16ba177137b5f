#!/usr/bin/env python3
"""Mesh of the scene `bolt`: a quarter of two plates, a washer and a bolt with two heads through them, made by Gmsh.

    scripts/meshes/bolt.py [--h H] [--out FILE]

H is the width of the elements around the bolt. Volumes `lower`, `upper`, `washer`, `bolt`; surfaces `bottom` and `top` of
plates and washer, `rim` of the plates' outer sides, `head` and `nut` where the bolt holds, and the planes of symmetry `x0`, `y0`.
"""

import argparse

import cad

SHANK, HOLE, HEAD, WASHER = 5.0, 5.5, 8.5, 10.0
PLATE, THICKNESS, WASHER_THICKNESS, HEAD_HEIGHT = 30.0, 8.0, 2.0, 5.0
"""Radii and lengths. The plates meet at z = 0."""


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--h", type=float, default=1.0)
    parser.add_argument("--out", default="scenes/bolt.msh")
    arguments = parser.parse_args()
    occ = cad.start()

    def ring(low, height, outer, inner):
        whole, hole = occ.addCylinder(0, 0, low, 0, 0, height, outer), occ.addCylinder(0, 0, low, 0, 0, height, inner)
        return occ.cut([(3, whole)], [(3, hole)])[0][0][1]

    def plate(low):
        whole, hole = occ.addBox(0, 0, low, PLATE, PLATE, THICKNESS), occ.addCylinder(0, 0, low, 0, 0, THICKNESS, HOLE)
        return occ.cut([(3, whole)], [(3, hole)])[0][0][1]

    def quarter(volume):
        corner = occ.addBox(0, 0, -2 * PLATE, 2 * PLATE, 2 * PLATE, 4 * PLATE)
        return occ.intersect([(3, volume)], [(3, corner)])[0][0][1]

    under, over = -THICKNESS, THICKNESS + WASHER_THICKNESS
    shank = occ.addCylinder(0, 0, under, 0, 0, over - under, SHANK)
    heads = [occ.addCylinder(0, 0, low, 0, 0, HEAD_HEIGHT, HEAD) for low in (under - HEAD_HEIGHT, over)]
    (_, bolt), = occ.fuse([(3, shank)], [(3, head) for head in heads])[0]
    volumes = {
        "lower": plate(under),
        "upper": plate(0.0),
        "washer": quarter(ring(THICKNESS, WASHER_THICKNESS, WASHER, HOLE)),
        "bolt": quarter(bolt),
    }
    of_plates = lambda volume: volume in ("lower", "upper")
    side = lambda axis: lambda volume, low, high: of_plates(volume) and cad.flat(axis, PLATE)(volume, low, high)
    ends = {"lower": (under, 0.0), "upper": (0.0, THICKNESS), "washer": (THICKNESS, over)}
    end = lambda which: lambda volume, low, high: volume in ends and cad.flat(2, ends[volume][which])(volume, low, high)
    surfaces = {"x0": cad.flat(0, 0.0), "y0": cad.flat(1, 0.0), "rim": lambda *at: side(0)(*at) or side(1)(*at)}
    surfaces |= {"bottom": end(0), "top": end(1)}
    surfaces |= {"nut": cad.flat(2, under, "bolt"), "head": cad.flat(2, over, "bolt")}
    cad.name(volumes, surfaces)
    factors = {volumes["lower"]: 1.3, volumes["upper"]: 1.1}
    cad.write(cad.growing(arguments.h, 0.1, "Sqrt(x^2+y^2)", 10.0), arguments.out, 4.0, factors)


if __name__ == "__main__":
    main()
