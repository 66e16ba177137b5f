"""Meshes made by formula, handed to Gmsh to be named and written."""

import gmsh
import numpy as np

TET, TRIANGLE = 4, 2


def prisms_to_tets(prisms):
    """Three tetrahedra of each prism (bottom 0 1 2, top 3 4 5). Faces between prisms are cut from their lowest node, alike
    on both sides (Dompierre et al. 1999)."""
    turns = np.array([[0, 1, 2, 3, 4, 5], [1, 2, 0, 4, 5, 3], [2, 0, 1, 5, 3, 4],
                      [3, 5, 4, 0, 2, 1], [4, 3, 5, 1, 0, 2], [5, 4, 3, 2, 1, 0]])
    p = np.take_along_axis(prisms, turns[prisms.argmin(axis=1)], axis=1)
    # The lowest node is 0 now: the two faces with it are cut through it, the face 1 2 5 4 from its own lowest.
    rising = np.minimum(p[:, 1], p[:, 5]) < np.minimum(p[:, 2], p[:, 4])
    up = [[0, 1, 2, 5], [0, 1, 5, 4], [0, 4, 5, 3]]
    down = [[0, 1, 2, 4], [0, 4, 2, 5], [0, 4, 5, 3]]
    return np.concatenate([p[rising][:, up].reshape(-1, 4), p[~rising][:, down].reshape(-1, 4)])


def boundary(tets):
    """Triangles that belong to one tetrahedron, counter-clockwise from outside."""
    faces = tets[:, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]].reshape(-1, 3)
    _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    return faces[first[count == 1]]


class Model:
    """Volumes with their named surfaces; each has nodes of its own."""

    def __init__(self, name):
        gmsh.initialize()
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.model.add(name)
        self.nodes = 0
        self.surfaces = {}

    def volume(self, name, points, tets, surfaces):
        """Adds a volume; `surfaces` maps names to functions that say which points are on them. A triangle of the boundary
        belongs to the first surface that has all its corners."""
        corners = points[tets]
        sign = np.linalg.det(corners[:, 1:] - corners[:, :1])
        assert (np.abs(sign) > 0).all()
        tets = np.where((sign > 0)[:, None], tets, tets[:, [0, 2, 1, 3]])
        number = len(gmsh.model.getEntities(3)) + 1
        gmsh.model.addDiscreteEntity(3, number)
        tags = np.arange(self.nodes + 1, self.nodes + len(points) + 1)
        self.nodes += len(points)
        gmsh.model.mesh.addNodes(3, number, tags, points.ravel())
        gmsh.model.mesh.addElementsByType(number, TET, [], tags[tets].ravel())
        gmsh.model.addPhysicalGroup(3, [number], number, name)
        triangles = boundary(tets)
        for surface, on in surfaces.items():
            of_surface = on(points)[triangles].all(axis=1)
            patch = gmsh.model.addDiscreteEntity(2)
            gmsh.model.mesh.addElementsByType(patch, TRIANGLE, [], tags[triangles[of_surface]].ravel())
            self.surfaces.setdefault(surface, []).append(patch)
            triangles = triangles[~of_surface]

    def write(self, path):
        for number, (name, patches) in enumerate(self.surfaces.items(), start=1):
            gmsh.model.addPhysicalGroup(2, patches, number, name)
        gmsh.option.setNumber("Mesh.MshFileVersion", 4.1)
        gmsh.option.setNumber("Mesh.Binary", 1)
        gmsh.write(str(path))
        gmsh.finalize()
