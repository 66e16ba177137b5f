"""A scene of fetiplast as its peers see it: points, tetrahedra, supported components, forces at points, contacts.

Reads the scene file and the mesh file that fetiplast reads. A scene may have linear tetrahedra from one file of Gmsh, zero
displacements, loads on surfaces, rigid planes across a coordinate axis and contact of two surfaces; all of it acts at once.
Anything else is refused.
"""

import tomllib
import typing

import numpy as np

from msh import read


class Part(typing.NamedTuple):
    points: np.ndarray
    bodies: dict
    """Tetrahedra of each body, four points each."""
    materials: dict
    """Of each body: young, poisson, yield_stress, hardening."""
    fixed: np.ndarray
    """Of each point and component."""
    forces: np.ndarray
    contacts: list


class Floor(typing.NamedTuple):
    """A rigid plane: `sign * (x - place)` along an axis is not negative."""

    name: str
    slave: np.ndarray
    axis: int
    sign: float
    place: float


class Pair(typing.NamedTuple):
    name: str
    slave: np.ndarray
    """Triangles."""
    master: np.ndarray
    clearance: float | None


def load(scene_file):
    scene = tomllib.loads(scene_file.read_text())
    known = {"title", "units", "material", "body", "support", "load", "contact"}
    if unknown := scene.keys() - known:
        raise ValueError(f"{scene_file}: peers do not know {', '.join(sorted(unknown))}")
    (mesh_file,) = {scene_file.parent / body["gmsh"]["file"] for body in scene["body"].values()}
    mesh = read(mesh_file)
    bodies, materials = {}, {}
    for name, body in scene["body"].items():
        if body["element"] != "tet4":
            raise ValueError(f"{scene_file}: peers know tet4 only, not {body['element']} of {name}")
        bodies[name] = mesh.volumes[body["gmsh"].get("volume") or next(iter(mesh.volumes))]
        materials[name] = scene["material"][body["material"]]
    owner = np.full(len(mesh.points), -1)
    for number, tetrahedra in enumerate(bodies.values()):
        if (owner[tetrahedra] >= 0).any():
            raise ValueError(f"{mesh_file}: two bodies share a node")
        owner[tetrahedra] = number

    def surface(name):
        body, _, group = name.partition(".")
        triangles = mesh.surfaces[group]
        return triangles[(owner[triangles] == list(bodies).index(body)).all(1)]

    fixed = np.zeros(mesh.points.shape, bool)
    for support in scene.get("support", {}).values():
        if any(support.get("displacement", [])):
            raise ValueError(f"{scene_file}: peers know no displacements")
        fixed[np.unique(surface(support["surface"]))[:, None], ["xyz".index(c) for c in support["fix"]]] = True
    forces = np.zeros(mesh.points.shape)
    for of in scene.get("load", {}).values():
        body = bodies[of["surface"].partition(".")[0]]
        add_load(forces, mesh.points, surface(of["surface"]), body, of)
    contacts = [contact(name, of, surface) for name, of in scene.get("contact", {}).items()]
    return Part(mesh.points, bodies, materials, fixed, forces, contacts)


def add_load(forces, points, triangles, tetrahedra, load):
    """A third of each triangle's force to its corners."""
    a, b, c = (points[triangles[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a) / 2
    if "pressure" in load:
        outward = np.einsum("ij,ij->i", normals, a - points[apexes(triangles, tetrahedra)])
        of_triangles = -load["pressure"] * normals * np.sign(outward)[:, None]
    else:
        of_triangles = np.linalg.norm(normals, axis=1)[:, None] * np.array(load["traction"])
    for corner in range(3):
        np.add.at(forces, triangles[:, corner], of_triangles / 3)


def apexes(triangles, tetrahedra):
    """Of each triangle the fourth point of the tetrahedron it is a face of."""
    _, place = faces_of(triangles, tetrahedra)
    return tetrahedra[place // 4, 3 - place % 4]


FACES = [(0, 1, 2), (0, 1, 3), (0, 2, 3), (1, 2, 3)]
"""Corners of a tetrahedron's faces; opposite are corners 3, 2, 1, 0."""


def faces_of(triangles, tetrahedra):
    """Tetrahedra that triangles are faces of, and four times that plus the number of the face in `FACES`."""
    count = int(tetrahedra.max()) + 1

    def key(faces):
        a, b, c = np.sort(faces, axis=-1).reshape(-1, 3).T
        return (a * count + b) * count + c

    near = np.flatnonzero(np.isin(tetrahedra, triangles).sum(1) >= 3)
    keys = key(tetrahedra[near][:, FACES])
    order = np.argsort(keys)
    place = order[np.searchsorted(keys[order], key(triangles))]
    place = 4 * near[place // 4] + place % 4
    return place // 4, place


def contact(name, of, surface):
    if "rigid" not in of:
        if of.get("gap"):
            raise ValueError(f"contact.{name}: peers know a clearance, but no gap")
        return Pair(name, surface(of["slave"]), surface(of["master"]), of.get("clearance"))
    plane = of["rigid"]["plane"]
    axis = int(np.argmax(np.abs(plane["normal"])))
    if np.count_nonzero(plane["normal"]) != 1:
        raise ValueError(f"contact.{name}: peers know planes across a coordinate axis only")
    return Floor(name, surface(of["slave"]), axis, float(np.sign(plane["normal"][axis])), plane["point"][axis])
