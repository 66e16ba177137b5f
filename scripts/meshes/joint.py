#!/usr/bin/env python3
"""Mesh of the scene `joint`: a half of two plates that overlap and a bolt with two heads through them, made by Gmsh. All are
hexahedra in layers over one mesh of the plane, so that nodes meet nodes.

    scripts/meshes/joint.py [--h H] [--out FILE]

H is the width of the elements around the bolt. Volumes `lower`, `upper`, `bolt`; surfaces `between` where the plates meet,
`head` and `nut` where the bolt holds them, `end` where they are clamped and pulled, and the plane of symmetry `y0`.
"""

import argparse

import gmsh
import numpy as np

import cad

SHANK, HOLE, HEAD = 5.0, 5.5, 8.5
LENGTH, OVERLAP, WIDTH, THICKNESS, HEIGHT = 50.0, 20.0, 20.0, 8.0, 6.0
"""Plates reach from the axis of the bolt so far out, and so far beyond it; half a width. They meet at z = 0."""
LAYERS = {THICKNESS: 4, HEIGHT: 3}
"""Of elements, in a plate and in a head."""
SLOPE = 0.15
"""By which elements grow outside of the head."""


def plane(occ):
    """Parts of the half plane: shank, clearance, what is under the head, the rest of the overlap, and left and right of it."""
    strips = [(-LENGTH, -OVERLAP), (-OVERLAP, OVERLAP), (OVERLAP, LENGTH)]
    sheets = [(2, occ.addRectangle(low, 0, 0, high - low, WIDTH)) for low, high in strips]
    discs = [(2, occ.addDisk(0, 0, 0, radius, radius)) for radius in (SHANK, HOLE, HEAD)]
    halves, _ = occ.intersect(discs, [(2, occ.addRectangle(-LENGTH, 0, 0, 2 * LENGTH, LENGTH))])
    parts, _ = occ.fragment(sheets, halves)
    names = {-SHANK: "shank", -HOLE: "clearance", -HEAD: "head", -OVERLAP: "overlap", -LENGTH: "left", OVERLAP: "right"}
    return {names[round(occ.getBoundingBox(2, part)[0], 3)]: part for _, part in parts}


def raised(occ, parts, height):
    """Solids over parts of a plane, and the same parts of the plane where they end, by their names."""
    made = occ.extrude([(2, part) for part in parts.values()], 0, 0, height, [LAYERS[abs(height)]], recombine=True)
    at = [place for place, (dimension, _) in enumerate(made) if dimension == 3]
    solids = {name: made[place][1] for name, place in zip(parts, at)}
    return solids, {name: made[place - 1][1] for name, place in zip(parts, at)}


def divide(parts, h):
    """Gives curves of the plane even numbers of edges: where these are paired to quadrangles, no triangle is left. All half circles
    have as many."""
    for _, curve in gmsh.model.getBoundary([(2, part) for part in parts.values()], combined=False, oriented=False):
        (low,), (high,) = gmsh.model.getParametrizationBounds(1, curve)
        points = np.reshape(gmsh.model.getValue(1, curve, np.linspace(low, high, 101)), (-1, 3))
        widths = h + SLOPE * np.maximum(np.linalg.norm(points, axis=1) - HEAD, 0.0)
        edges = (np.linalg.norm(np.diff(points, axis=0), axis=1) / widths[1:]).sum()
        if gmsh.model.getType(1, curve) != "Line":
            edges = np.pi * HOLE / h
        gmsh.model.mesh.setTransfiniteCurve(curve, 1 + 2 * max(1, round(edges / 2)))
    for ring in ("clearance", "head"):
        gmsh.model.mesh.setTransfiniteSurface(parts[ring])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--h", type=float, default=1.25)
    parser.add_argument("--out", default="scenes/joint.msh")
    arguments = parser.parse_args()
    occ = cad.start()
    parts = plane(occ)
    volumes = {"bolt": []}
    for name, side, other in (("lower", -1, "right"), ("upper", 1, "left")):
        solids, ends = raised(occ, {part: tag for part, tag in parts.items() if part != other}, side * THICKNESS)
        bolted = {part: ends[part] for part in ("shank", "clearance", "head")}
        heads, _ = raised(occ, bolted, side * HEIGHT)
        volumes["bolt"] += [solids.pop("shank"), *heads.values()]
        del solids["clearance"]
        volumes[name] = list(solids.values())
    surfaces = {"y0": cad.flat(1, 0.0), "between": cad.flat(2, 0.0)}
    surfaces |= {"head": cad.flat(2, THICKNESS), "nut": cad.flat(2, -THICKNESS)}
    surfaces |= {"end": lambda *of: cad.flat(0, -LENGTH)(*of) or cad.flat(0, LENGTH)(*of)}
    cad.name(volumes, surfaces)
    divide(parts, arguments.h)
    gmsh.option.setNumber("Mesh.RecombineAll", 1)
    gmsh.option.setNumber("Mesh.RecombinationAlgorithm", 3)
    cad.write(cad.growing(arguments.h, SLOPE, "Sqrt(x^2+y^2)", HEAD), arguments.out, 5.0)


if __name__ == "__main__":
    main()
