#!/usr/bin/env python3
"""Mesh of the scene `flange`: two pipes with flanges and the bolts between them, made by Gmsh. Each part is meshed by itself, so
that no two meshes match.

    scripts/meshes/flange.py [--scale S] [--out FILE]

S multiplies the width of all elements: 1.2, 0.74 and 0.52 give about 20, 60 and 150 thousand nodes. Volumes `lower`, `upper`,
`bolts` (all of them, with a head at both ends); surfaces `end` of each pipe, `bore` and `side` inside and outside of it, `seat`
where the flanges meet, `back` where the heads press on them; of the bolts `nut` and `head`, which press, and `top`, the end of
the head.
"""

import argparse
import math

import gmsh

import cad

BORE, PIPE, LENGTH = 40.0, 46.0, 75.0
"""Radii of the pipe, and how long it is with its flange."""
RIM, THICKNESS = 86.0, 16.0
"""Of the flanges, which meet at z = 0."""
SEAT, STEP = 56.0, 1.5
"""Outer radius of the ring where they meet, and how far it stands out."""
HUB = 8.0
"""Radius of the fillet between pipe and flange."""
BOLTS, CIRCLE, SHANK, HOLE, HEAD, HEIGHT = 8, 70.0, 6.0, 6.75, 10.0, 8.0
"""Number, radius of the circle they are on, radii of shank, hole and head, height of the head."""
FINE, COARSE, REACH = 2.0, 6.0, 14.0
"""Width of elements at the fillets, seats and holes, and from this distance on."""
FACTORS = {"lower": 1.0, "upper": 1.15, "bolts": 0.85}
"""Of the widths, so that the meshes differ."""


def places():
    return [(CIRCLE * math.cos(a), CIRCLE * math.sin(a)) for a in (2 * math.pi * (k + 0.5) / BOLTS for k in range(BOLTS))]


def pipe(occ, side):
    """A profile turned about the z axis, above or below z = 0, without the holes."""
    corners = [(BORE, 0), (SEAT, 0), (SEAT, STEP), (RIM, STEP), (RIM, THICKNESS), (PIPE + HUB, THICKNESS)]
    corners += [(PIPE, THICKNESS + HUB), (PIPE, LENGTH), (BORE, LENGTH)]
    points = [occ.addPoint(r, 0, side * z) for r, z in corners]
    centre = occ.addPoint(PIPE + HUB, 0, side * (THICKNESS + HUB))
    lines = []
    for k, start in enumerate(points):
        end = points[(k + 1) % len(points)]
        lines.append(occ.addCircleArc(start, centre, end) if k == 5 else occ.addLine(start, end))
    profile = occ.addPlaneSurface([occ.addCurveLoop(lines)])
    turned = occ.revolve([(2, profile)], 0, 0, 0, 0, 0, 1, 2 * math.pi)
    whole = next(entity for entity in turned if entity[0] == 3)
    holes = [(3, occ.addCylinder(x, y, 0, 0, 0, side * 2 * THICKNESS, HOLE)) for x, y in places()]
    (_, drilled), = occ.cut([whole], holes)[0]
    return drilled


def bolt(occ, x, y):
    def cylinder(low, height, radius):
        return 3, occ.addCylinder(x, y, low, 0, 0, height, radius)

    heads = [cylinder(-THICKNESS - HEIGHT, HEIGHT, HEAD), cylinder(THICKNESS, HEIGHT, HEAD)]
    (_, volume), = occ.fuse([cylinder(-THICKNESS, 2 * THICKNESS, SHANK)], heads)[0]
    return volume


def wide(radius):
    """Whether a face is upright and as wide as a circle about a vertical axis."""
    return lambda volume, low, high: high[2] - low[2] > 1.0 and abs(high[0] - low[0] - 2 * radius) < 1e-3


def at_height(z):
    """Whether a face is flat, so far above or below the plane where the flanges meet."""
    return lambda *face: cad.flat(2, z)(*face) or cad.flat(2, -z)(*face)


def fine(volume):
    """Faces beside which elements are fine: fillets, seats, holes and shanks."""
    rules = [wide(HOLE), wide(SHANK), at_height(0.0)]

    def holds(face):
        box = gmsh.model.getBoundingBox(2, face)
        flat_or_round = gmsh.model.getType(2, face) in ("Plane", "Cylinder")
        return not flat_or_round or any(rule(None, box[:3], box[3:]) for rule in rules)

    return [face for _, face in gmsh.model.getBoundary([(3, volume)], oriented=False) if holds(face)]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scale", type=float, default=1.2)
    parser.add_argument("--out", default="scenes/peers/flange.msh")
    arguments = parser.parse_args()
    occ = cad.start()
    volumes = {"lower": [pipe(occ, -1)], "upper": [pipe(occ, 1)], "bolts": [bolt(occ, x, y) for x, y in places()]}
    surfaces = {"nut": cad.flat(2, -THICKNESS, "bolts"), "head": cad.flat(2, THICKNESS, "bolts")}
    surfaces |= {"top": cad.flat(2, THICKNESS + HEIGHT), "seat": cad.flat(2, 0.0)}
    surfaces |= {"end": at_height(LENGTH), "back": at_height(THICKNESS)}
    surfaces |= {"bore": wide(BORE), "side": wide(PIPE)}
    cad.name(volumes, surfaces)
    s = arguments.scale
    faces = [face for tags in volumes.values() for tag in tags for face in fine(tag)]
    factors = {tag: FACTORS[name] for name, tags in volumes.items() for tag in tags}
    cad.write(cad.beside(faces, FINE * s, COARSE * s, REACH), arguments.out, COARSE * s, factors)


if __name__ == "__main__":
    main()
