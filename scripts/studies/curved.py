"""Runs on refined meshes whose fields are compared with closed forms, for the study of accuracy."""

import itertools
import json
import pathlib
import re
import subprocess
import sys
import tempfile

import h5py
import numpy as np

from .deal_ii import limit_of_deal_ii
from .measure import ROOT


class Fields:
    """Points and elements of a result, pieces one behind the other; fields of the last state."""

    def __init__(self, path):
        with h5py.File(path) as file:
            grid = file["VTKHDF"]
            points, entries = (grid[f"NumberOf{name}"][:] for name in ("Points", "ConnectivityIds"))
            self.points = grid["Points"][:]
            connectivity = grid["Connectivity"][:] + np.repeat(np.cumsum(points) - points, entries)
            self.cells = connectivity.reshape(grid["NumberOfCells"][:].sum(), -1)
            self.tets = self.cells[:, :4]
            self.of_points = {name: data[-len(self.points) :] for name, data in grid["PointData"].items()}
            self.of_cells = {name: data[-len(self.tets) :] for name, data in grid["CellData"].items()}

    def centres(self):
        return self.points[self.tets].mean(axis=1)

    def volumes(self):
        corners = self.points[self.tets]
        return np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])) / 6.0

    def body_of_points(self):
        body = np.zeros(len(self.points), dtype=int)
        body[self.cells] = self.of_cells["body"][:, None]
        return body


def bisect(low, high, above):
    """Where `above` begins to hold."""
    for _ in range(200):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if above(middle) else (middle, high)
    return 0.5 * (low + high)


class Solver:
    def __init__(self, program, ranks):
        self.program, self.ranks = program, ranks

    def summary(self, scene, sets, directory):
        """Of a scene that is solved in a directory."""
        command = [*self.program.on(self.ranks), "solve", scene, "--out", directory, "--progress", "off"]
        for key in sets:
            command += ["--set", key]
        subprocess.run(command, env=self.program.environment, check=True, stdout=subprocess.DEVNULL)
        return json.loads((directory / f"{scene.stem}.json").read_text())

    def solve(self, scene, sets, directory):
        """Summary and fields."""
        return self.summary(scene, sets, directory), Fields(directory / f"{scene.stem}.vtkhdf")

    def meshed(self, name, arguments, sets):
        """Summary and fields of one of the scenes, on a mesh that its script makes."""
        with tempfile.TemporaryDirectory() as directory:
            directory = pathlib.Path(directory)
            scene = directory / f"{name}.toml"
            scene.write_text((ROOT / f"scenes/{name}.toml").read_text())
            command = [sys.executable, str(ROOT / f"scripts/meshes/{name}.py"), "--out", str(scene.with_suffix(".msh"))]
            subprocess.run(command + [str(a) for a in arguments], check=True)
            return self.solve(scene, sets, directory)


# Nested spheres: radii, pressure, clearance, and the material of src/scene; formulas as in src/analytic.
A, B, D, PRESSURE, GAP = 100.0, 200.0, 300.0, 600.0, 0.05
YOUNG, POISSON, YIELD, HARDENING = 210000.0, 0.29, 450.0, 10000.0


def nested_spheres():
    """Contact pressure, plastic front, displacement of the outer sphere at the interface."""
    h = 2 * (1 - POISSON) * HARDENING / YOUNG
    h /= 1 + h

    def pressure_of(c):
        shell = (1 - h) * np.log(c / A) + h / 3 * (c**3 / A**3 - 1)
        return 2 * YIELD * shell + 2 * YIELD / 3 * (1 - c**3 / B**3)

    def outer(q):
        shape = (1 - 2 * POISSON) + (1 + POISSON) * D**3 / (2 * B**3)
        return q * B**4 / (YOUNG * (D**3 - B**3)) * shape

    def front(q):
        return bisect(A, B, lambda c: pressure_of(c) > PRESSURE - q)

    def open_gap(q):
        inner = (1 - POISSON) * YIELD * front(q) ** 3 / (YOUNG * B**2) - (1 - 2 * POISSON) * q * B / YOUNG
        return inner - outer(q) < GAP

    q = bisect(0.0, PRESSURE, open_gap)
    return q, front(q), outer(q)


def ring_errors(summary, fields):
    q, front, displacement = nested_spheres()
    radius = np.linalg.norm(fields.points, axis=1)
    outward = fields.points / radius[:, None]
    radial = (fields.of_points["displacement"] * outward).sum(axis=1)
    slaves = fields.of_points["contact_status"] >= 0
    pressure = fields.of_points["contact_pressure"][slaves]
    force = np.abs(summary["contact_force"]).mean() / (0.25 * np.pi * B**2)
    body = fields.body_of_points()
    at_interface = (body == 1) & (np.abs(radius - B) < 1e-6 * B)
    kappa, volumes = fields.of_cells["equivalent_plastic_strain"], fields.volumes()
    r = np.linalg.norm(fields.centres(), axis=1)
    slope = 2 * (1 - POISSON) * HARDENING / YOUNG
    exact = 2 * (1 - POISSON) * YIELD / YOUNG * np.maximum(front**3 / r**3 - 1, 0) / (1 + slope)
    exact[fields.of_cells["body"] == 1] = 0.0
    inner = volumes[fields.of_cells["body"] == 0].sum()
    yielded = (B**3 - A**3) * volumes[kappa > 0].sum() / inner
    return {
        "contact force": abs(force / q - 1),
        "contact pressure": np.sqrt(np.mean((pressure / q - 1) ** 2)),
        "plastic front": abs((A**3 + yielded) ** (1 / 3) / front - 1),
        "plastic strain": np.sqrt((volumes * (kappa - exact) ** 2).sum() / (volumes * exact**2).sum()),
        "displacement": np.sqrt(np.mean((radial[at_interface] / displacement - 1) ** 2)),
    }


FACETS = ["contact.joint={surfaces=['inner.interface', 'outer.interface'], gap=0.05}"]
"""Without a clearance: the gap is added to what lies between the facets of both surfaces."""


def ring(solver):
    families = {
        "matching": ([(8, 8), (16, 16), (32, 32)], ["contact.joint.clearance=0.05"]),
        "inner finer": ([(8, 6), (16, 12), (32, 24)], ["contact.joint.clearance=0.05"]),
        "outer finer": ([(8, 11), (16, 22), (32, 44)], ["contact.joint.clearance=0.05"]),
        "distance of the facets": ([(8, 6), (16, 12), (32, 24)], FACETS),
    }
    for family, (sizes, sets) in families.items():
        for inner, outer in sizes:
            summary, fields = solver.meshed("ring", ["--inner", inner, "--outer", outer], sets)
            width = 0.5 * np.pi * B / inner
            yield {"family": family, "h": width, "mesh": f"{inner}/{outer}"}, summary, ring_errors(summary, fields)


def spheres(solver):
    """The nested spheres of structured meshes, whose nodes are on the spheres, of quadratic tetrahedra."""
    families = {"matching": [(2, 2), (4, 4), (8, 8)], "3 : 2": [(3, 2), (6, 4), (9, 6)], "2 : 3": [(2, 3), (4, 6), (6, 9)]}
    for family, sizes in families.items():
        for inner, outer in sizes:
            sets = [f"body.inner.sphere.cells=[{inner}, {inner}]", f"body.outer.sphere.cells=[{outer}, {outer}]"]
            sets += [f"body.{body}.element=tet10" for body in ("inner", "outer")]
            with tempfile.TemporaryDirectory() as directory:
                scene = ROOT / "scenes/precision/nested-spheres.toml"
                summary, fields = solver.solve(scene, sets, pathlib.Path(directory))
            width = 0.25 * np.pi * B / inner
            errors = ring_errors(summary, fields)
            del errors["plastic front"]  # by whole elements, too large to tell it
            yield {"family": family, "h": width, "mesh": f"{inner}/{outer}"}, summary, errors


def patch(solver):
    """Pressure in and around two elastic spheres: each is under that pressure alone, and displacements are linear."""
    sets = ["material.paper.yield_stress=1e9", "contact.joint.clearance=0", "load.bore.pressure=100"]
    sets += ["load.outside={surface='outer.outside', pressure=100}", "solver.residual_tolerance=1e-10"]
    sets += ["solver.newton_tolerance=1e-9", "solver.qp_tolerance=1e-11"]
    families = {
        "matching": [(8, 8)],
        "3 : 2": [(6, 4), (12, 8), (24, 16)],
        "4 : 3": [(8, 6), (16, 12), (32, 24)],
    }
    for family, sizes in families.items():
        for inner, outer in sizes:
            summary, fields = solver.meshed("ring", ["--inner", inner, "--outer", outer], sets)
            pressure = fields.of_points["contact_pressure"][fields.of_points["contact_status"] >= 0] / 100 - 1
            stress, volumes = fields.of_cells["von_mises"] / 100, fields.volumes()
            errors = {
                "contact pressure": np.sqrt(np.mean(pressure**2)),
                "worst contact pressure": np.abs(pressure).max(),
                "von Mises stress": np.sqrt((volumes * stress**2).sum() / volumes.sum()),
                "worst von Mises stress": stress.max(),
            }
            yield {"family": family, "h": 0.5 * np.pi * B / inner, "mesh": f"{inner}/{outer}"}, summary, errors


# Hertz: two bodies of one material, a ball and a block.
RADIUS, APPROACH, HERTZ_POISSON = 100.0, 0.01, 0.3


def nodal_areas(fields, nodes):
    """Areas of those triangles of the boundary whose corners are all among some nodes, a third to each corner."""
    faces = fields.tets[:, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]].reshape(-1, 3)
    _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    faces = faces[first[count == 1]]
    faces = faces[nodes[faces].all(axis=1)]
    corners = fields.points[faces]
    areas = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    found = np.zeros(len(fields.points))
    np.add.at(found, faces, areas[:, None] / 3)
    return found


def hertz_errors(summary, fields):
    """Against Hertz for the force that was found: contact radius, peak pressure, approach."""
    modulus = YOUNG / (2 * (1 - HERTZ_POISSON**2))
    force = 4 * abs(summary["contact_force"][2])
    radius = (0.75 * force * RADIUS / modulus) ** (1 / 3)
    slaves = fields.of_points["contact_status"] >= 0
    areas = nodal_areas(fields, slaves)
    pressure = fields.of_points["contact_pressure"][slaves]
    closed = fields.of_points["contact_status"] == 1
    r = np.linalg.norm(fields.points[slaves][:, :2], axis=1)
    load = pressure * areas[slaves]
    peak = 1.5 * force / (np.pi * radius**2)
    profile = peak * np.sqrt(np.maximum(1 - (r / radius) ** 2, 0))
    weights = areas[slaves]
    return {
        "contact radius": np.sqrt(4 * areas[closed].sum() / np.pi) / radius - 1,
        "radius of inertia": np.sqrt(2.5 * (load * r**2).sum() / load.sum()) / radius - 1,
        "pressure on the axis": pressure[r.argmin()] / peak - 1,
        "largest nodal pressure": pressure.max() / peak - 1,
        "pressure": np.sqrt((weights * (pressure - profile) ** 2).sum() / (weights * profile**2).sum()),
        "approach": APPROACH / (radius**2 / RADIUS) - 1,
    }


def hertz(solver):
    for h in (0.2, 0.1, 0.05):
        summary, fields = solver.meshed("hertz", ["--h", h], [])
        yield {"family": "hertz", "h": h, "mesh": f"a/{1 / h:.0f}"}, summary, hertz_errors(summary, fields)


SPHERE, TOP, TOUCHED = 0.6, 1.59, 0.15
"""Radius of the ball and height of its centre over the bottom of the unit cube; what the contact surely stays within."""


def graded(width, length):
    """Planes from 0 to `length`: `width` apart where the ball touches, then ever wider."""
    planes, step = [0.0], width
    while planes[-1] + step < length:
        planes.append(planes[-1] + step)
        if planes[-1] >= TOUCHED:
            step *= 1.25
    if length - planes[-1] < 0.5 * step:
        planes.pop()
    return [*planes, length]


def upright(width):
    """The ball as a height field of level treads around the nodes: contact holds along z, as in deal.II, and not along the
    ball's normals."""
    treads = np.arange(int(TOUCHED / width) + 1) * width
    rim = np.repeat(treads, 2)
    heights = TOP - np.sqrt(SPHERE**2 - rim[:, None] ** 2 - rim[None, :] ** 2)
    rows = ", ".join(f"[{', '.join(map(repr, map(float, row)))}]" for row in heights)
    corner, spacing = [0.5 - width / 4] * 2, [width / 2] * 2
    return f"heightfield = {{ origin = {corner}, spacing = {spacing}, heights = [{rows}], above = true }}"


def ball(solver):
    """The force that holds deal.II's rigid ball in the cube of step-42, on meshes graded towards the contact."""
    scene = (ROOT / "src/scene/library/step-42.toml").read_text().partition("[decomposition]")[0]
    limit = limit_of_deal_ii()
    # Quadratic elements have nodes in the middle of their edges, too.
    meshes = [("tet4", (32, 64), 1), ("hex8", (16, 32, 64), 1), ("tet10", (8, 16, 32), 2)]
    for (element, cells, degree), held in itertools.product(meshes, ("along normals", "along z")):
        for per_edge in cells:
            side, height = graded(1 / per_edge, 0.5), graded(1 / per_edge, 1.0)
            planes = {"x": [0.5 + p for p in side], "y": [0.5 + p for p in side], "z": [1.0 - p for p in height[::-1]]}
            grid = ", ".join(f"{axis} = {values}" for axis, values in planes.items())
            text = re.sub(r"brick = .*", f"grid = {{ {grid} }}", scene).replace('"tet4"', f'"{element}"')
            if held == "along z":
                text = re.sub(r"sphere = {.*?}", upright(1 / (degree * per_edge)), text)
            with tempfile.TemporaryDirectory() as directory:
                directory = pathlib.Path(directory)
                (directory / "step-42.toml").write_text(text)
                summary = solver.summary(directory / "step-42.toml", [], directory)
            force = 4 * abs(summary["contact_force"][2])
            errors = {"force": force, "beside deal.II's": force / limit - 1}
            mesh = f"{len(side) - 1} x {len(side) - 1} x {len(height) - 1}"
            yield {"family": f"{element}, {held}", "h": 1 / per_edge, "mesh": mesh}, summary, errors


CASES = {"ring": ring, "spheres": spheres, "patch": patch, "hertz": hertz, "step-42": ball}
