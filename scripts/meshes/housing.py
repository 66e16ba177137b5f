#!/usr/bin/env python3
"""Mesh of the scenes `housing` and `housing-floor`: a bearing housing, made by Gmsh. A plate with four bolt holes carries a
pedestal with ribs and a boss; fillets round what stands on the plate.

    scripts/meshes/housing.py [--scale S] [--out FILE]

S multiplies the width of all elements: 0.97, 0.64 and 0.437 give about 30, 90 and 260 thousand nodes. Volume `housing`;
surfaces `bolts` of the holes, `bottom`, `load` of the half of the bore that is pressed on, and `bore` of the other half.
"""

import argparse
import math

import gmsh

import cad

PLATE, THICKNESS, CORNER = (200.0, 80.0), 16.0, 12.0
"""Sides of the plate, and the radius of its corners. Its bottom is at z = 0."""
HOLE, HOLES = 6.0, (75.0, 25.0)
"""Radius of the bolt holes, and where they are in each quadrant."""
PEDESTAL, RIB = (60.0, 48.0), 10.0
"""Sides of the pedestal, thickness of the ribs."""
AXIS, BORE, BOSS, LENGTH = 60.0, 22.0, 34.0, 60.0
"""Height of the bore's axis, which is along y; radii; length of the boss."""
FILLET = 4.0
DIRECTION = math.radians(-30.0)
"""Where the shaft presses to, from x towards z."""
SUNK = 10.0
"""Height where the pedestal and the ribs begin, inside the plate."""
FINE, COARSE, REACH = 1.5, 6.0, 25.0
"""Width of elements beside curved faces, and from this distance on."""


def edges_of(occ, body, holds):
    """Edges of a body for which a rule of the lowest and highest corner of their box holds."""
    occ.synchronize()
    found = set()
    for _, face in gmsh.model.getBoundary([(3, body)], oriented=False):
        for _, edge in gmsh.model.getBoundary([(2, face)], oriented=False):
            box = gmsh.model.getBoundingBox(1, edge)
            if holds(box[:3], box[3:]):
                found.add(edge)
    return sorted(found)


def upright(low, high):
    return high[2] - low[2] > 0.9 * THICKNESS and max(high[0] - low[0], high[1] - low[1]) < 1e-3


def foot(low, high):
    """Where the pedestal and the ribs stand on the plate."""
    inside = max(map(abs, (low[0], high[0]))) < PLATE[0] / 2 - 1.0 and max(map(abs, (low[1], high[1]))) < PLATE[1] / 2 - 1.0
    return inside and max(abs(low[2] - THICKNESS), abs(high[2] - THICKNESS)) < 1e-3


def rib(occ, side):
    """A web from the plate up to the pedestal."""
    outline = [(25.0, SUNK), (86.0, SUNK), (86.0, THICKNESS), (30.0, 56.0), (25.0, 56.0)]
    points = [occ.addPoint(side * x, -RIB / 2, z) for x, z in outline]
    lines = [occ.addLine(a, b) for a, b in zip(points, points[1:] + points[:1])]
    swept = occ.extrude([(2, occ.addPlaneSurface([occ.addWire(lines)]))], 0, RIB, 0)
    return next(entity for entity in swept if entity[0] == 3)


def half_bore(occ, towards):
    """The half of a round bar along the axis that lies in a direction."""
    bar = occ.addCylinder(0, -LENGTH, AXIS, 0, 2 * LENGTH, 0, BORE)
    box = occ.addBox(0, -LENGTH, AXIS - 2 * BORE, 2 * BORE, 2 * LENGTH, 4 * BORE)
    occ.rotate([(3, box)], 0, 0, AXIS, 0, 1, 0, -towards)
    return occ.intersect([(3, bar)], [(3, box)])[0][0]


def solid(occ):
    plate = occ.addBox(-PLATE[0] / 2, -PLATE[1] / 2, 0, *PLATE, THICKNESS)
    plate = occ.fillet([plate], edges_of(occ, plate, upright), [CORNER])[0]
    pedestal = occ.addBox(-PEDESTAL[0] / 2, -PEDESTAL[1] / 2, SUNK, *PEDESTAL, AXIS - SUNK)
    boss = occ.addCylinder(0, -LENGTH / 2, AXIS, 0, LENGTH, 0, BOSS)
    (_, body), = occ.fuse([plate], [(3, pedestal), (3, boss), rib(occ, 1), rib(occ, -1)])[0]
    body = occ.fillet([body], edges_of(occ, body, foot), [FILLET])[0]
    holes = [occ.addCylinder(x * HOLES[0], y * HOLES[1], -1, 0, 0, THICKNESS + 2, HOLE) for x in (1, -1) for y in (1, -1)]
    bars = [half_bore(occ, DIRECTION), half_bore(occ, DIRECTION + math.pi)]
    (_, body), = occ.cut([body], [(3, hole) for hole in holes] + bars)[0]
    return body


def in_hole(volume, low, high):
    return all(high[a] - low[a] < 2.01 * HOLE and abs(abs(low[a] + high[a]) / 2 - HOLES[a]) < 0.1 for a in (0, 1))


def in_bore(towards):
    """Whether a face is one of the halves of the bore."""

    def holds(volume, low, high):
        if high[0] - low[0] > 2.01 * BORE or high[2] - low[2] > 2.01 * BORE or high[1] - low[1] < 0.99 * LENGTH:
            return False
        middle = (low[0] + high[0]) / 2, (low[2] + high[2]) / 2 - AXIS
        return min(low[2], high[2]) > AXIS - 1.01 * BORE and middle[0] * math.cos(towards) + middle[1] * math.sin(towards) > 0

    return holds


def rounded(body):
    """Faces that are not flat: of holes, bore and fillets; not the corners of the plate, and not the boss."""
    halves = in_bore(DIRECTION), in_bore(DIRECTION + math.pi)

    def holds(face):
        box = gmsh.model.getBoundingBox(2, face)
        low, high = box[:3], box[3:]
        if gmsh.model.getType(2, face) == "Plane":
            return False
        inside = high[2] < 2 * THICKNESS and max(abs(low[0]), abs(high[0])) < PLATE[0] / 2 - 1.0
        return inside or any(half(None, low, high) for half in halves)

    return [face for _, face in gmsh.model.getBoundary([(3, body)], oriented=False) if holds(face)]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scale", type=float, default=0.97)
    parser.add_argument("--out", default="scenes/peers/housing.msh")
    arguments = parser.parse_args()
    occ = cad.start()
    body = solid(occ)
    surfaces = {"bottom": cad.flat(2, 0.0), "bolts": in_hole}
    surfaces |= {"load": in_bore(DIRECTION), "bore": in_bore(DIRECTION + math.pi)}
    cad.name({"housing": body}, surfaces)
    s = arguments.scale
    size = cad.beside(rounded(body), FINE * s, COARSE * s, REACH)
    cad.write(size, arguments.out, COARSE * s)


if __name__ == "__main__":
    main()
