#!/usr/bin/env python3
"""Small pictures of results for the gallery: one field on the deformed bodies, symmetric parts completed but for a cut; or the
loop of a load cycle.

    scripts/gallery.py [SCENE ...] --results DIR [--out docs]

Reads DIR/SCENE.vtkhdf, writes SCENE.png. Renders off-screen, without an X server.
"""

import argparse
import dataclasses
import itertools
import pathlib

import h5py
import hysteresis
import numpy as np
from figures import add, bands_of, compose, edges_of, line_actor, render, surface_actor, units_of, warped
from matplotlib.ticker import MaxNLocator
from PIL import Image
from studies.curved import Fields
from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray
from vtkmodules.vtkCommonCore import vtkObject, vtkPoints
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData

FIELDS = {
    "von_mises": ("von Mises stress", "stress", "turbo"),
    "equivalent_plastic_strain": ("equivalent plastic strain", None, "YlOrRd"),
}

@dataclasses.dataclass
class View:
    """What to draw of a scene."""

    title: str
    field: str = "von_mises"
    scale: float = 1
    """Factor on the displacements."""
    planes: str = "xy"
    """Axes across which the scene is symmetric; images complete it but for the part that faces the camera."""
    centre: tuple = (0.0, 0.0, 0.0)
    """Where these planes meet."""
    close: float | None = None
    """Shows only what is this near to the centre."""
    body: int | None = None
    """Shows this body only, by its place among the names."""


SCENES = {
    "punch": View("Imprint of a round punch, after its release", "equivalent_plastic_strain", 2, close=3.0, body=0),
    "hertz": View("Hertz contact of a ball and a block, close to the contact", scale=10, close=2.0),
    "ring": View("Nested spheres under pressure, an octant cut out", scale=200, planes="xyz"),
    "bolt": View("Bolted plates, pulled apart at their rim", scale=20),
    "step-42": View("A rigid ball on a cube (deal.II step-42)", scale=5, centre=(0.5, 0.5, 1.0)),
}
CYCLES = {"joint": hysteresis.Cycle("A bolted joint through a load cycle", "pull", (2, 4), 0.0, (0, 1, 4), copies=2)}


class Picture:
    """The boundary of a result's bodies and their images, with a field at its nodes."""

    def __init__(self, path, view):
        result = Fields(path)
        shown = np.ones(len(result.tets), bool) if view.body is None else result.of_cells["body"] == view.body
        tets, values, volumes = result.tets[shown], result.of_cells[view.field][shown], result.volumes()[shown]
        body = result.body_of_points()
        points, displacement, faces = [], [], []
        for mirror in self.images(view):
            # Adding zero makes -0 a 0, so that images share the nodes between them.
            points.append((result.points - view.centre) * mirror + view.centre + 0.0)
            displacement.append(result.of_points["displacement"] * mirror)
            outward = self.faces(tets, result.points)
            faces.append((outward if mirror.prod() > 0 else outward[:, ::-1]) + len(faces) * len(body))
        copies = len(faces)
        keys = np.column_stack([np.tile(body, copies), np.concatenate(points)])
        _, first, node = np.unique(keys, axis=0, return_index=True, return_inverse=True)
        node = node.ravel()
        sums = np.zeros((2, len(first)))
        for corner in tets.T:
            np.add.at(sums[0], node[corner], volumes * values)
            np.add.at(sums[1], node[corner], volumes)
        # Images of a node have its value.
        original = node[first % len(body)]
        faces = node[np.concatenate(faces)]
        _, once, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
        used, faces = np.unique(faces[once[count == 1]], return_inverse=True)
        self.faces = faces.reshape(-1, 3)
        self.points, self.displacement = (np.concatenate(of)[first][used] for of in (points, displacement))
        self.values = (sums[0][original] / np.maximum(sums[1][original], 1e-300))[used]

    @staticmethod
    def images(view):
        axes = ["xyz".index(plane) for plane in view.planes]
        for signs in itertools.product([1, -1], repeat=len(axes)):
            mirror = np.ones(3)
            mirror[axes] = signs
            if tuple(mirror) != (1, -1, 1):
                yield mirror

    @staticmethod
    def faces(tets, points):
        """Those of all elements, counter-clockwise from outside."""
        corners = points[tets]
        positive = np.linalg.det(corners[:, 1:] - corners[:, :1]) > 0
        tets = np.where(positive[:, None], tets, tets[:, [0, 2, 1, 3]])
        return tets[:, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]].reshape(-1, 3)

    def surface(self, field):
        points = vtkPoints()
        points.SetData(numpy_to_vtk(np.ascontiguousarray(self.points), deep=True))
        offsets = np.arange(0, 3 * len(self.faces) + 1, 3, dtype=np.int64)
        cells = vtkCellArray()
        corners = numpy_to_vtkIdTypeArray(self.faces.ravel().astype(np.int64), deep=True)
        cells.SetData(numpy_to_vtkIdTypeArray(offsets, deep=True), corners)
        surface = vtkPolyData()
        surface.SetPoints(points)
        surface.SetPolys(cells)
        for name, values in [("displacement", self.displacement), (field, self.values)]:
            add(surface.GetPointData(), name, values)
        return surface


def draw(name, path, out):
    view = SCENES[name]
    label, unit, colours = FIELDS[view.field]
    with h5py.File(path) as file:
        units = units_of(file)
    picture = Picture(path, view)
    surface = picture.surface(view.field)
    ticks = MaxNLocator(6).tick_values(0.0, float(picture.values.max()))
    bands = bands_of(colours, 2 * (len(ticks) - 1))
    actors = [
        surface_actor(warped(surface, view.scale), view.field, (ticks[0], ticks[-1]), bands),
        line_actor(warped(edges_of(surface), view.scale), (0.1, 0.1, 0.1), 2.0, nearer=8),
    ]
    label += f" [{units[unit]}]" if unit and units[unit] else ""
    pixels = render(actors, view.close and (view.centre, view.close))
    compose(pixels, view.title, label, ticks, bands, f"displacements x {view.scale:g}", out / f"{name}.png")


def make_small(file):
    image = Image.open(file).convert("RGB")
    image = image.resize((900, round(900 * image.height / image.width)), Image.LANCZOS)
    image.quantize(128, dither=Image.Dither.NONE).save(file, optimize=True)
    print(file, file.stat().st_size)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenes", nargs="*", metavar="SCENE", help=", ".join([*SCENES, *CYCLES]))
    parser.add_argument("--results", type=pathlib.Path, required=True)
    parser.add_argument("--out", type=pathlib.Path, default="docs")
    arguments = parser.parse_args()
    vtkObject.GlobalWarningDisplayOff()  # VTK complains about the missing X server, then renders without it.
    for name in arguments.scenes or [*SCENES, *CYCLES]:
        result = arguments.results / f"{name}.vtkhdf"
        if name in CYCLES:
            hysteresis.draw(name, CYCLES[name], result, arguments.out)
        else:
            draw(name, result, arguments.out)
        make_small(arguments.out / f"{name}.png")


if __name__ == "__main__":
    main()
