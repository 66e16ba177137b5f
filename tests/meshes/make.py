"""Writes the mesh files beside this script with Gmsh (pip install gmsh): a block and a square rod standing on it, not
sharing nodes, of tetrahedra in all formats that are read, the block of hexahedra and prisms, and a bar of four parts that do
share nodes."""

import pathlib

import gmsh

HERE = pathlib.Path(__file__).parent
FORMATS = {"41": (4.1, 0), "41-binary": (4.1, 1), "22": (2.2, 0), "22-binary": (2.2, 1)}


def save(name, version, binary):
    gmsh.option.setNumber("Mesh.MshFileVersion", version)
    gmsh.option.setNumber("Mesh.Binary", binary)
    gmsh.write(str(HERE / f"{name}.msh"))


def faces(volume, axis, at):
    """Surfaces of a volume whose boxes are flat at a place along an axis."""
    found = []
    for _, tag in gmsh.model.getBoundary([(3, volume)], oriented=False):
        box = gmsh.model.occ.getBoundingBox(2, tag)
        if abs(box[axis] - at) < 1e-6 and abs(box[3 + axis] - at) < 1e-6:
            found.append(tag)
    return found


def block_and_rod():
    """The block [0, 2] x [0, 1] x [0, 1] and the rod [0.5, 1] x [0.25, 0.75] x [1, 2] on it, sharing no nodes."""
    gmsh.clear()
    block = gmsh.model.occ.addBox(0, 0, 0, 2, 1, 1)
    rod = gmsh.model.occ.addBox(0.5, 0.25, 1, 0.5, 0.5, 1)
    gmsh.model.occ.synchronize()
    return block, rod


def name(block, rod):
    gmsh.model.addPhysicalGroup(3, [block], 1, "block")
    gmsh.model.addPhysicalGroup(3, [rod], 2, "the rod")
    gmsh.model.addPhysicalGroup(2, faces(block, 2, 0), 1, "base")
    gmsh.model.addPhysicalGroup(2, faces(block, 2, 1), 2, "top")
    gmsh.model.addPhysicalGroup(2, faces(block, 2, 1) + faces(rod, 2, 1), 3, "both sides")
    gmsh.model.addPhysicalGroup(2, faces(rod, 2, 2), 9)
    gmsh.model.addPhysicalGroup(1, [1], 1, "an edge")


def quarters():
    """The bar [0, 3] x [0, 1] x [0, 1] of hexahedra in four volumes, cut at x = 1 and at z = 0.25, with its outer surfaces
    and `joint` between left and right."""
    gmsh.clear()
    ends, heights = [0.0, 1.0, 3.0], [0.0, 0.25, 1.0]
    boxes = [(3, gmsh.model.occ.addBox(ends[i], 0, heights[k], ends[i + 1] - ends[i], 1, heights[k + 1] - heights[k]))
             for i in (0, 1) for k in (0, 1)]
    gmsh.model.occ.fragment(boxes, [])
    gmsh.model.occ.synchronize()
    for _, curve in gmsh.model.getEntities(1):
        length = gmsh.model.occ.getMass(1, curve)
        gmsh.model.mesh.setTransfiniteCurve(curve, 5 if length > 1.5 else 3)
    for _, surface in gmsh.model.getEntities(2):
        gmsh.model.mesh.setTransfiniteSurface(surface)
        gmsh.model.mesh.setRecombine(2, surface)
    for number, (name, (_, box)) in enumerate(zip(("left-low", "left-high", "right-low", "right-high"), boxes), start=1):
        gmsh.model.mesh.setTransfiniteVolume(box)
        gmsh.model.addPhysicalGroup(3, [box], number, name)
    sides = {"x0": (0, 0), "x3": (0, 3), "y0": (1, 0), "y1": (1, 1), "z0": (2, 0), "z1": (2, 1), "joint": (0, 1)}
    for number, (name, (axis, at)) in enumerate(sides.items(), start=1):
        found = {tag for _, box in boxes for tag in faces(box, axis, at)}
        gmsh.model.addPhysicalGroup(2, sorted(found), number, name)
    gmsh.model.mesh.generate(3)


def main():
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)

    name(*block_and_rod())
    gmsh.option.setNumber("Mesh.MeshSizeMin", 0.7)
    gmsh.option.setNumber("Mesh.MeshSizeMax", 0.7)
    gmsh.model.mesh.generate(3)
    for form, (version, binary) in FORMATS.items():
        save(f"tets-{form}", version, binary)
    gmsh.option.setNumber("Mesh.SaveParametric", 1)
    save("tets-41-parametric", 4.1, 1)
    gmsh.option.setNumber("Mesh.SaveParametric", 0)

    # The same block, hexahedra up to x = 1 and prisms beyond.
    gmsh.clear()
    points = [(0, 0), (1, 0), (2, 0), (2, 1), (1, 1), (0, 1)]
    points = [gmsh.model.geo.addPoint(x, y, 0) for x, y in points]
    lines = [gmsh.model.geo.addLine(points[k], points[(k + 1) % 6]) for k in range(6)]
    middle = gmsh.model.geo.addLine(points[1], points[4])
    sides = [[lines[0], middle, lines[4], lines[5]], [lines[1], lines[2], lines[3], -middle]]
    squares = [gmsh.model.geo.addPlaneSurface([gmsh.model.geo.addCurveLoop(side)]) for side in sides]
    for curve in lines + [middle]:
        gmsh.model.geo.mesh.setTransfiniteCurve(curve, 4)
    for square in squares:
        gmsh.model.geo.mesh.setTransfiniteSurface(square)
    gmsh.model.geo.mesh.setRecombine(2, squares[0])
    solids = gmsh.model.geo.extrude([(2, s) for s in squares], 0, 0, 1, [3], recombine=True)
    gmsh.model.geo.synchronize()
    gmsh.model.addPhysicalGroup(3, [tag for dim, tag in solids if dim == 3], 1, "block")
    gmsh.model.addPhysicalGroup(2, squares, 1, "base")
    gmsh.model.addPhysicalGroup(2, [s for _, s in gmsh.model.getEntities(2) if all(
        abs(x - 1) < 1e-6 for x in gmsh.model.getBoundingBox(2, s)[2::3])], 2, "top")
    gmsh.model.mesh.generate(3)
    save("hexes-and-prisms", 4.1, 0)

    quarters()
    save("quarters", 4.1, 0)
    gmsh.finalize()


main()
