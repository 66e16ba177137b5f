"""What the meshes that Gmsh makes of solids have in common: names by place, sizes, the file."""

import gmsh


def start():
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    return gmsh.model.occ


def name(volumes, surfaces):
    """Names volumes, each of one solid or of a list of them, and those of their surfaces for which a name's rule holds: a
    function of the volume's name and of the lowest and highest corner of the surface's box. The first rule counts."""
    gmsh.model.occ.synchronize()
    found = {}
    for number, (volume, solids) in enumerate(volumes.items(), start=1):
        tags = solids if isinstance(solids, list) else [solids]
        gmsh.model.addPhysicalGroup(3, tags, number, volume)
        for _, surface in gmsh.model.getBoundary([(3, tag) for tag in tags], oriented=False):
            box = gmsh.model.getBoundingBox(2, surface)
            for rule_name, holds in surfaces.items():
                if holds(volume, box[:3], box[3:]):
                    found.setdefault(rule_name, {})[surface] = None  # Two volumes may share it.
                    break
    for number, (rule_name, tags) in enumerate(found.items(), start=1):
        gmsh.model.addPhysicalGroup(2, list(tags), number, rule_name)


def flat(axis, place, of=None):
    """Whether a surface lies in a plane across an axis, on a volume if one is given."""
    near = lambda x: abs(x - place) < 1e-5 * (1 + abs(place))
    return lambda volume, low, high: (of is None or volume == of) and near(low[axis]) and near(high[axis])


def write(size, path, largest, factors=None, order=1):
    """Meshes with elements as wide as a formula in x, y and z says, and writes the file. Factors make those of a volume, by
    its number, larger, so that it does not match its neighbours. Elements of order 2 follow curved surfaces."""
    field = gmsh.model.mesh.field
    parts = []
    for _, volume in gmsh.model.getEntities(3):
        by_formula, of_volume = field.add("MathEval"), field.add("Restrict")
        field.setString(by_formula, "F", f"{(factors or {}).get(volume, 1.0)} * ({size})")
        field.setNumber(of_volume, "InField", by_formula)
        field.setNumbers(of_volume, "VolumesList", [volume])
        parts.append(of_volume)
    smallest = field.add("Min")
    field.setNumbers(smallest, "FieldsList", parts)
    field.setAsBackgroundMesh(smallest)
    for option in ("MeshSizeExtendFromBoundary", "MeshSizeFromPoints", "MeshSizeFromCurvature"):
        gmsh.option.setNumber(f"Mesh.{option}", 0)
    gmsh.option.setNumber("Mesh.MeshSizeMax", largest)
    gmsh.option.setNumber("Mesh.Algorithm3D", 10)
    gmsh.model.mesh.generate(3)
    gmsh.model.mesh.setOrder(order)
    gmsh.option.setNumber("Mesh.MshFileVersion", 4.1)
    gmsh.option.setNumber("Mesh.Binary", 1)
    gmsh.write(str(path))
    gmsh.finalize()


def growing(h, slope, distance, within):
    """The formula of elements of width `h` within a distance from somewhere, growing with a slope beyond."""
    return f"{h} + {slope} * ({distance} - {within} + Fabs({distance} - {within})) / 2"


def beside(surfaces, least, most, reach):
    """The formula of elements that are `least` wide at surfaces and grow to `most` within a distance."""
    field = gmsh.model.mesh.field
    distance, width = field.add("Distance"), field.add("Threshold")
    field.setNumbers(distance, "SurfacesList", surfaces)
    field.setNumber(distance, "Sampling", 60)
    for key, value in {"InField": distance, "SizeMin": least, "SizeMax": most, "DistMin": 1.0, "DistMax": reach}.items():
        field.setNumber(width, key, value)
    return f"F{width}"
