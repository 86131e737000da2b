"""Opens .vtu files with meshio and with VTK, and compares every array with the expected values.

    compare_fields.py EXPECTED.json

EXPECTED.json contains { "files": { file: { "points", "cells", "types", "straight", "point_data", "cell_data" } },
"collections": { file: [..] } }. Paths are relative to EXPECTED.json. A field is { "components": [names], "values":
[tuples or scalars] }. Numbers must be equal to the last bit.
"""

import json
import sys
from pathlib import Path
from xml.etree import ElementTree

import meshio
import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader


def equal(what, found, wanted):
    found, wanted = np.asarray(found), np.asarray(wanted)
    assert found.shape == wanted.shape, f"{what}: shape {found.shape}, wanted {wanted.shape}"
    assert np.array_equal(found, wanted), f"{what}: values differ by up to {np.abs(found - wanted).max()}"


def midpoints(what, cell, points):
    """Tests the edges of a quadratic cell, as VTK defines them: the third point lies midway between the first two
    points.
    """
    for i in range(cell.GetNumberOfEdges()):
        edge = cell.GetEdge(i).GetPointIds()
        ids = [edge.GetId(k) for k in range(edge.GetNumberOfIds())]
        if len(ids) == 3:
            gap = np.abs(points[ids[2]] - 0.5 * (points[ids[0]] + points[ids[1]])).max()
            assert gap < 1e-12, f"{what}: the mid-point of edge {i} is off by {gap}"


def with_vtk(path, wanted):
    reader = vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(path))
    reader.Update()
    assert reader.GetErrorCode() == 0, f"VTK cannot read {path}: error {reader.GetErrorCode()}"
    grid = reader.GetOutput()
    points = vtk_to_numpy(grid.GetPoints().GetData())
    equal(f"{path.name} (VTK): points", points, wanted["points"])
    types = [grid.GetCellType(i) for i in range(grid.GetNumberOfCells())]
    assert types == wanted["types"], f"{path.name} (VTK): cell types"
    for i, nodes in enumerate(wanted["cells"]):
        cell = grid.GetCell(i)
        found = [cell.GetPointId(k) for k in range(cell.GetNumberOfPoints())]
        assert found == nodes, f"{path.name} (VTK): cell {i} is {found}, wanted {nodes}"
        if wanted["straight"]:
            midpoints(f"{path.name} (VTK): cell {i}", cell, points)
    for section, data in (("point_data", grid.GetPointData()), ("cell_data", grid.GetCellData())):
        assert data.GetNumberOfArrays() == len(wanted[section]), f"{path.name} (VTK): number of arrays in {section}"
        for name, field in wanted[section].items():
            array = data.GetArray(name)
            assert array is not None, f"{path.name} (VTK): no array {name} in {section}"
            equal(f"{path.name} (VTK): {name}", vtk_to_numpy(array), field["values"])
            names = [array.GetComponentName(k) for k in range(len(field["components"]))]
            assert names == field["components"], f"{path.name} (VTK): components of {name} are {names}"


def with_meshio(path, wanted):
    mesh = meshio.read(path)
    equal(f"{path.name} (meshio): points", mesh.points, wanted["points"])
    assert sum(len(block.data) for block in mesh.cells) == len(wanted["cells"])
    assert set(mesh.point_data) == set(wanted["point_data"]) and set(mesh.cell_data) == set(wanted["cell_data"])
    for name, field in wanted["point_data"].items():
        equal(f"{path.name} (meshio): {name}", mesh.point_data[name], field["values"])
    for name, field in wanted["cell_data"].items():
        equal(f"{path.name} (meshio): {name}", np.concatenate(mesh.cell_data[name]), field["values"])


def main(path):
    expected = json.loads(path.read_text())
    for name, wanted in expected["files"].items():
        with_vtk(path.parent / name, wanted)
        with_meshio(path.parent / name, wanted)
    for name, wanted in expected["collections"].items():
        sets = ElementTree.parse(path.parent / name).getroot().findall("./Collection/DataSet")
        found = [[float(entry.get("timestep")), entry.get("file")] for entry in sets]
        assert found == wanted, f"{name}: {found}, wanted {wanted}"
        assert all((path.parent / file).exists() for _, file in wanted), f"{name}: a file is missing"
    print(f"{len(expected['files'])} files and {len(expected['collections'])} collections agree")


main(Path(sys.argv[1]))
