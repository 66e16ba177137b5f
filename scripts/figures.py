#!/usr/bin/env python3
"""Pictures of a result: von Mises stress and total displacement on the deformed bodies.

    scripts/figures.py RESULT.vtkhdf --out DIR [--scale S]

Writes DIR/von_mises.png (Fig. 2 of the paper) and DIR/displacement.png (Fig. 3). Renders off-screen, without an X server.
Needs vtk, h5py, numpy and matplotlib.
"""

import argparse
import pathlib
import re

import h5py
import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import ListedColormap
from matplotlib.ticker import MaxNLocator
from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkLookupTable, vtkObject, vtkPoints
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkNonMergingPointLocator, vtkUnstructuredGrid
from vtkmodules.vtkFiltersCore import vtkCellDataToPointData, vtkFeatureEdges
from vtkmodules.vtkFiltersGeneral import vtkWarpVector
from vtkmodules.vtkFiltersGeometry import vtkGeometryFilter
from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper, vtkRenderer, vtkRenderWindow, vtkWindowToImageFilter
import vtkmodules.vtkRenderingOpenGL2  # noqa: F401  (registers the renderer)

PIXELS = (2000, 1100)
BANDS_PER_TICK = 2
MOVES_TOGETHER = 1e-4
"""Copies of a node whose displacements differ by less than this part of the largest one belong to one body."""


class Result:
    """All pieces of a result file as one mesh, with the copies of each node that subdomains made."""

    def __init__(self, path):
        with h5py.File(path) as file:
            grid = file["VTKHDF"]
            n_points, n_cells, n_entries = (
                grid[name][:] for name in ("NumberOfPoints", "NumberOfCells", "NumberOfConnectivityIds")
            )
            self.points = grid["Points"][:]
            self.displacement = grid["PointData/displacement"][:]
            self.types = grid["Types"][:]
            self.von_mises = grid["CellData/von_mises"][:]
            self.subdomain = grid["CellData/subdomain"][:].astype(np.int64)
            # Pieces count their own points and entries: shift them behind one another.
            first_point, first_entry = np.cumsum(n_points) - n_points, np.cumsum(n_entries) - n_entries
            self.connectivity = grid["Connectivity"][:] + np.repeat(first_point, n_entries)
            ends = np.cumsum(n_cells + 1) - 1
            self.offsets = np.append(
                np.delete(grid["Offsets"][:], ends) + np.repeat(first_entry, n_cells), n_entries.sum()
            )
            self.units = units_of(file)

    def glued(self):
        """Point numbers after gluing: one a node of a body. Nodes of two bodies in contact stay apart."""
        nodes = np.unique(self.points, axis=0, return_inverse=True)[1].ravel()
        of_point = np.zeros(len(nodes), dtype=np.int64)
        of_point[self.connectivity] = np.repeat(self.subdomain, np.diff(self.offsets))
        body = self.bodies(nodes, of_point)[of_point]
        return np.unique(np.stack([body, nodes], axis=1), axis=0, return_index=True, return_inverse=True)[1:]

    def bodies(self, nodes, subdomain):
        """A number for each subdomain, equal for those whose common nodes all move together."""
        order = np.lexsort((subdomain, nodes))
        pairs = np.stack([order[:-1], order[1:]], axis=1)[np.diff(nodes[order]) == 0]
        jumps = np.linalg.norm(self.displacement[pairs[:, 0]] - self.displacement[pairs[:, 1]], axis=1)
        neighbours, which = np.unique(subdomain[pairs], axis=0, return_inverse=True)
        largest = np.zeros(len(neighbours))
        np.maximum.at(largest, which.ravel(), jumps)
        body = np.arange(self.subdomain.max() + 1)
        limit = MOVES_TOGETHER * np.linalg.norm(self.displacement, axis=1).max()
        for a, b in neighbours[largest <= limit]:
            body[body == body[b]] = body[a]
        return body

    def grid(self):
        """The glued mesh for VTK; cell values are averaged to the nodes."""
        first, number = self.glued()
        points = vtkPoints()
        points.SetData(numpy_to_vtk(self.points[first], deep=True))
        cells = vtkCellArray()
        cells.SetData(
            numpy_to_vtkIdTypeArray(self.offsets.astype(np.int64), deep=True),
            numpy_to_vtkIdTypeArray(number.ravel()[self.connectivity].astype(np.int64), deep=True),
        )
        grid = vtkUnstructuredGrid()
        grid.SetPoints(points)
        grid.SetCells(numpy_to_vtk(self.types, deep=True), cells)
        displacement = self.displacement[first]
        add(grid.GetPointData(), "displacement", displacement)
        add(grid.GetPointData(), "total", np.linalg.norm(displacement, axis=1))
        add(grid.GetCellData(), "von_mises", self.von_mises)
        average = vtkCellDataToPointData()
        average.SetInputData(grid)
        average.Update()
        return average.GetOutput()


def units_of(file):
    """If the scene's text says them in the order "length, force, stress"."""
    text = file["provenance/scene"][()].decode() if "provenance/scene" in file else ""
    line = re.search(r'^units = "(.*)"$', text, re.MULTILINE)
    names = [name.strip() for name in line[1].split(",")] if line else []
    return dict(zip(("length", "force", "stress"), names if len(names) == 3 else ("", "", "")))


def add(data, name, values):
    array = numpy_to_vtk(np.ascontiguousarray(values), deep=True)
    array.SetName(name)
    data.AddArray(array)


def nice_scale(points, displacement):
    """The largest of 1, 2, 5, 10, ... that shows displacements of at most a tenth of the scene."""
    largest = np.linalg.norm(displacement, axis=1).max()
    if largest == 0:
        return 1.0
    wanted = 0.1 * np.linalg.norm(np.ptp(points, axis=0)) / largest
    power = 10.0 ** np.floor(np.log10(wanted))
    return max(1.0, power * max(step for step in (1, 2, 5) if step * power <= wanted * (1 + 1e-12)))


def warped(data, scale):
    data.GetPointData().SetActiveVectors("displacement")
    warp = vtkWarpVector()
    warp.SetInputData(data)
    warp.SetScaleFactor(scale)
    warp.Update()
    return warp.GetOutput()


def edges_of(surface):
    """Where the undeformed surface has an edge: bending bodies get no new ones."""
    edges = vtkFeatureEdges()
    edges.SetLocator(vtkNonMergingPointLocator())  # Bodies that touch have edges at the same place.
    edges.SetInputData(surface)
    edges.SetFeatureAngle(30)
    edges.ColoringOff()
    edges.NonManifoldEdgesOff()
    edges.ManifoldEdgesOff()
    edges.Update()
    return edges.GetOutput()


def line_actor(data, colour, width, nearer):
    mapper = vtkPolyDataMapper()
    mapper.SetInputData(data)
    mapper.ScalarVisibilityOff()
    mapper.SetResolveCoincidentTopologyToPolygonOffset()
    mapper.SetRelativeCoincidentTopologyLineOffsetParameters(0, -nearer)
    actor = vtkActor()
    actor.SetMapper(mapper)
    actor.GetProperty().SetColor(*colour)
    actor.GetProperty().SetLineWidth(width)
    actor.GetProperty().LightingOff()
    return actor


def surface_actor(data, field, limits, colours):
    table = vtkLookupTable()
    table.SetNumberOfTableValues(colours.N)
    for index in range(colours.N):
        table.SetTableValue(index, *colours(index))
    mapper = vtkPolyDataMapper()
    mapper.SetInputData(data)
    mapper.SetScalarModeToUsePointFieldData()
    mapper.SelectColorArray(field)
    mapper.SetScalarRange(*limits)
    mapper.SetLookupTable(table)
    mapper.InterpolateScalarsBeforeMappingOn()
    actor = vtkActor()
    actor.SetMapper(mapper)
    actor.GetProperty().SetAmbient(0.7)
    actor.GetProperty().SetDiffuse(0.32)
    return actor


def render(actors, close=None):
    """The actors seen from the front, the right and above, as an array of pixels cropped to what is drawn; or, `close` to a
    point, what is within a distance of it."""
    renderer = vtkRenderer()
    renderer.SetBackground(1, 1, 1)
    for actor in actors:
        renderer.AddActor(actor)
    window = vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.SetMultiSamples(8)
    window.SetSize(*PIXELS)
    window.AddRenderer(renderer)
    camera = renderer.GetActiveCamera()
    camera.SetPosition(0.45, -1, 0.42)
    camera.SetFocalPoint(0, 0, 0)
    camera.SetViewUp(0, 0, 1)
    camera.SetViewAngle(20)
    renderer.ResetCamera()
    if close is not None:
        (x, y, z), distance = close
        renderer.ResetCamera(x - distance, x + distance, y - distance, y + distance, z - distance, z + distance)
        renderer.ResetCameraClippingRange()
        window.SetSize(PIXELS[1], PIXELS[1])
    window.Render()
    capture = vtkWindowToImageFilter()
    capture.SetInput(window)
    capture.ReadFrontBufferOff()
    capture.Update()
    image = capture.GetOutput()
    width, height, _ = image.GetDimensions()
    pixels = vtk_to_numpy(image.GetPointData().GetScalars()).reshape(height, width, -1)[::-1, :, :3]
    drawn = np.argwhere((pixels < 255).any(axis=2))
    (top, left), (bottom, right) = drawn.min(axis=0), drawn.max(axis=0) + 1
    return pixels[top:bottom, left:right]


def bands_of(colours, count):
    """A colour a band, without the darkest end of the map, where black edges would drown."""
    return ListedColormap(matplotlib.colormaps[colours](np.linspace(0.07, 1, count)))


def compose(pixels, title, label, ticks, colours, note, path):
    height = 6.4 * pixels.shape[0] / pixels.shape[1]
    figure = plt.figure(figsize=(8, height + 0.9), dpi=250)
    total = height + 0.9
    picture = figure.add_axes((0.02, 0.35 / total, 0.8, height / total))
    picture.imshow(pixels, interpolation="antialiased")
    picture.set_axis_off()
    figure.text(0.02, 1 - 0.12 / total, title, fontsize=12, va="top")
    figure.text(0.02, 0.1 / total, note, fontsize=8, color="0.35", va="bottom")
    bar_axes = figure.add_axes((0.86, 0.45 / total, 0.022, (height - 0.2) / total))
    shades = plt.cm.ScalarMappable(plt.Normalize(ticks[0], ticks[-1]), colours)
    bar = figure.colorbar(shades, cax=bar_axes, ticks=ticks, format="%.4g")
    bar.set_label(label, fontsize=10)
    bar.ax.tick_params(labelsize=8)
    bar.outline.set_linewidth(0.5)
    figure.savefig(path, facecolor="white")
    plt.close(figure)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("result", type=pathlib.Path, help="a .vtkhdf file written by fetiplast")
    parser.add_argument("--out", type=pathlib.Path, required=True, help="directory for the pictures")
    parser.add_argument("--scale", type=float, help="factor on the displacements (default: chosen to be visible)")
    arguments = parser.parse_args()
    vtkObject.GlobalWarningDisplayOff()  # VTK complains about the missing X server, then renders without it.
    arguments.out.mkdir(parents=True, exist_ok=True)

    result = Result(arguments.result)
    scale = arguments.scale if arguments.scale is not None else nice_scale(result.points, result.displacement)
    extract = vtkGeometryFilter()
    extract.SetInputData(result.grid())
    extract.Update()
    surface = extract.GetOutput()
    outline = edges_of(surface)
    lines = [
        line_actor(outline, (0.65, 0.65, 0.65), 1.5, nearer=-100),
        line_actor(warped(outline, scale), (0.1, 0.1, 0.1), 2.5, nearer=8),
    ]
    deformed = warped(surface, scale)

    length = f" [{result.units['length']}]" if result.units["length"] else ""
    stress = f" [{result.units['stress']}]" if result.units["stress"] else ""
    note = f"displacements x {scale:g}, grey: undeformed outline"
    figures = [
        ("von_mises", "Von Mises stress", f"von Mises stress{stress}", "turbo", "averaged to nodes; "),
        ("total", "Total displacement", f"total displacement{length}", "viridis", ""),
    ]
    for field, title, label, colours, remark in figures:
        values = vtk_to_numpy(surface.GetPointData().GetArray(field))
        ticks = MaxNLocator(7).tick_values(0.0, float(values.max()) or 1.0)
        bands = bands_of(colours, BANDS_PER_TICK * (len(ticks) - 1))
        pixels = render([surface_actor(deformed, field, (ticks[0], ticks[-1]), bands), *lines])
        path = arguments.out / f"{'displacement' if field == 'total' else field}.png"
        compose(pixels, title, label, ticks, bands, remark + note, path)
        print(path)


if __name__ == "__main__":
    main()
