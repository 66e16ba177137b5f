"""Meshes of linear tetrahedra from files of Gmsh in MSH 4.1, binary."""

import typing

import numpy as np

TRIANGLE, TETRAHEDRON = 2, 4
"""Types of elements in the file."""
NODES = {15: 1, 1: 2, TRIANGLE: 3, TETRAHEDRON: 4}


class Mesh(typing.NamedTuple):
    points: np.ndarray
    volumes: dict
    """Tetrahedra of each physical volume, four points each."""
    surfaces: dict
    """Triangles of each physical surface."""


class Bytes:
    """A cursor in a section."""

    def __init__(self, data, at):
        self.data, self.at = data, at

    def take(self, kind, count):
        found = np.frombuffer(self.data, kind, count, self.at)
        self.at += found.nbytes
        return found


def read(path):
    data = path.read_bytes()
    at = {name: data.index(f"${name}\n".encode()) + len(name) + 2 for name in ("MeshFormat", "PhysicalNames", "Entities")}
    at |= {name: data.index(f"\n${name}\n".encode(), at["Entities"]) + len(name) + 3 for name in ("Nodes", "Elements")}
    if not data.startswith(b"4.1 1 8", at["MeshFormat"]):
        raise ValueError(f"{path} is not in MSH 4.1, binary")
    lines = data[at["PhysicalNames"] : data.index(b"$EndPhysicalNames")].decode().splitlines()[1:]
    names = {(int(line.split()[0]), int(line.split()[1])): line.split('"')[1] for line in lines}
    groups = entities(Bytes(data, at["Entities"]), names)
    tags, points = nodes(Bytes(data, at["Nodes"]))
    place = np.zeros(int(tags.max()) + 1, np.int64)
    place[tags] = np.arange(len(tags))
    found = {TRIANGLE: {}, TETRAHEDRON: {}}
    for dimension, entity, kind, of in elements(Bytes(data, at["Elements"])):
        for name in groups.get((dimension, entity), ()) if kind in found else ():
            found[kind].setdefault(name, []).append(place[of])
    volumes, surfaces = ({n: np.concatenate(parts) for n, parts in found[kind].items()} for kind in (TETRAHEDRON, TRIANGLE))
    return Mesh(points, volumes, surfaces)


def entities(section, names):
    """Names of the physical groups of each entity."""
    groups = {}
    for dimension, count in enumerate(section.take("<u8", 4)):
        for _ in range(count):
            tag = int(section.take("<i4", 1)[0])
            section.take("<f8", 6 if dimension else 3)
            tags = section.take("<i4", int(section.take("<u8", 1)[0]))
            groups[dimension, tag] = [names[dimension, int(t)] for t in tags if (dimension, int(t)) in names]
            if dimension:
                section.take("<i4", int(section.take("<u8", 1)[0]))
    return groups


def nodes(section):
    tags, points = [], []
    for _ in range(int(section.take("<u8", 4)[0])):
        section.take("<i4", 3)
        count = int(section.take("<u8", 1)[0])
        tags.append(section.take("<u8", count))
        points.append(section.take("<f8", 3 * count).reshape(-1, 3))
    return np.concatenate(tags).astype(np.int64), np.concatenate(points)


def elements(section):
    """Dimension and number of the entity, type, nodes of its elements; block by block."""
    for _ in range(int(section.take("<u8", 4)[0])):
        dimension, entity, kind = map(int, section.take("<i4", 3))
        width = 1 + NODES[kind]
        rows = section.take("<u8", int(section.take("<u8", 1)[0]) * width)
        yield dimension, entity, kind, rows.reshape(-1, width)[:, 1:]
