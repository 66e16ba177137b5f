"""Reads a result file back with h5py and with VTK, independently of the program that wrote it.

    .venv/bin/python -m pytest tests/python/test_read_back.py --result RESULT.vtkhdf
"""

import h5py
import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline
from vtkmodules.vtkCommonDataModel import vtkPartitionedDataSet
from vtkmodules.vtkIOHDF import vtkHDFReader

NODES_OF_TYPE = {10: 4, 12: 8, 24: 10}

NAN_WHERE_UNDEFINED = {"contact_gap"}
"""Fields that exist on a part of the mesh only: there is no gap off the slave surfaces."""


def check_hdf5(path):
    """Groups, lengths and values as the format wants them; returns what VTK should find again."""
    with h5py.File(path) as file:
        assert {"VTKHDF", "provenance", "convergence"} <= set(file), f"groups: {list(file)}"
        grid = file["VTKHDF"]
        assert grid.attrs["Type"] == b"UnstructuredGrid", grid.attrs["Type"]
        assert tuple(grid.attrs["Version"]) == (2, 2), grid.attrs["Version"]
        points, cells, entries = (
            grid[name][:] for name in ("NumberOfPoints", "NumberOfCells", "NumberOfConnectivityIds")
        )
        pieces = len(points)
        assert len(cells) == len(entries) == pieces
        assert grid["Points"].shape == (points.sum(), 3)
        assert grid["Types"].shape == (cells.sum(),)
        assert grid["Connectivity"].shape == (entries.sum(),)
        assert grid["Offsets"].shape == (cells.sum() + pieces,)
        check_pieces(grid, points, cells, entries)
        times = check_steps(grid, pieces)
        for group, rows in (("PointData", points.sum()), ("CellData", cells.sum())):
            for name, field in grid[group].items():
                changes = grid[f"Steps/{group}Offsets/{name}"][-1] > 0 if times is not None else False
                states = len(times) if changes else 1
                assert len(field) == states * rows, f"{name}: {len(field)} rows for {states} states of {rows}"
                odd = ~np.isfinite(field[:]) & ~(np.isnan(field[:]) & (name in NAN_WHERE_UNDEFINED))
                assert not odd.any(), f"{name} has values that are not finite"
        states = 1 if times is None else len(times)
        assert grid["PointData/displacement"].shape == (states * points.sum(), 3)
        columns = {len(column) for column in file["convergence"].values()}
        assert len(columns) <= 1, f"columns of different lengths: {columns}"
        for text in file["provenance"].values():
            text[()].decode()
        fields = {
            group: {name: field[:] for name, field in grid[group].items()} for group in ("PointData", "CellData")
        }
        return grid["Points"][:], cells.sum(), fields, times


def check_steps(grid, pieces):
    """The times of a series, `None` for a single state: one mesh, and fields one state behind the other."""
    if "Steps" not in grid:
        return None
    steps = grid["Steps"]
    times = steps["Values"][:]
    assert steps.attrs["NSteps"] == len(times) > 1 and (np.diff(times) > 0).all(), times
    assert (steps["NumberOfParts"][:] == [pieces] * len(times)).all()
    for name in ("PartOffsets", "PointOffsets", "CellOffsets", "ConnectivityIdOffsets"):
        assert (steps[name][:] == [0] * len(times)).all(), name
    for group in ("PointData", "CellData"):
        assert set(steps[f"{group}Offsets"]) == set(grid[group]), group
    return times


def check_pieces(grid, points, cells, entries):
    """Every piece numbers its own points, and its offsets begin at 0 and end at its number of entries."""
    first_offset = first_cell = first_entry = 0
    for piece, (n_points, n_cells, n_entries) in enumerate(zip(points, cells, entries)):
        offsets = grid["Offsets"][first_offset : first_offset + n_cells + 1]
        types = grid["Types"][first_cell : first_cell + n_cells]
        connectivity = grid["Connectivity"][first_entry : first_entry + n_entries]
        assert offsets[0] == 0 and offsets[-1] == n_entries, f"piece {piece}: offsets {offsets[0]}..{offsets[-1]}"
        expected = [NODES_OF_TYPE[kind] for kind in types]
        assert (np.diff(offsets) == expected).all(), f"piece {piece}: nodes a cell do not fit the types"
        if n_entries:
            assert 0 <= connectivity.min() and connectivity.max() < n_points, f"piece {piece}: point out of range"
        first_offset, first_cell, first_entry = first_offset + n_cells + 1, first_cell + n_cells, first_entry + n_entries


def check_vtk(path, points, cells, fields, times):
    """VTK finds the same points and values, in the same order, at every time."""
    reader = vtkHDFReader()
    assert reader.CanReadFile(path), "VTK does not take it for a VTKHDF file"
    reader.SetFileName(path)
    reader.UpdateInformation()
    if times is None:
        reader.Update()
        check_state(reader.GetOutputDataObject(0), points, cells, fields)
        return
    known = reader.GetOutputInformation(0)
    found = [known.Get(vtkStreamingDemandDrivenPipeline.TIME_STEPS(), i) for i in range(len(times))]
    assert found == list(times), found
    for i, time in enumerate(times):
        rows = {"PointData": len(points), "CellData": cells}
        state = {
            group: {name: v[i * rows[group] :][: rows[group]] if len(v) > rows[group] else v for name, v in all.items()}
            for group, all in fields.items()
        }
        reader.UpdateTimeStep(time)
        check_state(reader.GetOutputDataObject(0), points, cells, state)


def check_state(data, points, cells, fields):
    """VTK's data at one time."""
    if isinstance(data, vtkPartitionedDataSet):
        blocks = [data.GetPartition(i) for i in range(data.GetNumberOfPartitions())]
    else:
        blocks = [data]
    blocks = [block for block in blocks if block is not None and block.GetNumberOfPoints()]
    assert sum(block.GetNumberOfCells() for block in blocks) == cells
    assert (np.concatenate([vtk_to_numpy(b.GetPoints().GetData()) for b in blocks]) == points).all()
    for group, of in (("PointData", "GetPointData"), ("CellData", "GetCellData")):
        for name, values in fields[group].items():
            read = np.concatenate([vtk_to_numpy(getattr(b, of)().GetArray(name)) for b in blocks])
            assert np.array_equal(read, values, equal_nan=True), f"{name} differs"


def test_a_result_is_what_the_format_wants_and_vtk_reads(result):
    path = str(result)
    check_vtk(path, *check_hdf5(path))
