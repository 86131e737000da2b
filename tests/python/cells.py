"""Compares the cells of VTU files with text files, by VTK and by meshio.

    cells.py DIR

For each file NAME.vtu in DIR, NAME.txt has a line "VTK's type, volume" for each cell.
"""

import sys
from pathlib import Path

import meshio
import numpy as np
from meshio._mesh import topological_dimension
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import mutable
from vtkmodules.vtkCommonDataModel import vtkGenericCell
from vtkmodules.vtkFiltersVerdict import vtkCellSizeFilter
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

MESHIO = {10: "tetra", 24: "tetra10", 12: "hexahedron", 25: "hexahedron20", 29: "hexahedron27", 13: "wedge",
          26: "wedge15", 32: "wedge18", 14: "pyramid", 27: "pyramid13"}

def line_rule(n):
    x, w = np.polynomial.legendre.leggauss(n)
    return 0.5 * (1 + x), 0.5 * w


def rule(code):
    """Gauss points in VTK's reference cells. The reference cell is the unit cube or a part of it. VTK maps the unit
    cube to pyramids.
    """
    x, w = line_rule(5)
    points = []
    for (a, u), (b, v), (c, s) in ((p, q, r) for p in zip(x, w) for q in zip(x, w) for r in zip(x, w)):
        if code in (10, 24):  # The cube is collapsed to a tetrahedron.
            points.append(((a, b * (1 - a), c * (1 - a) * (1 - b)), u * v * s * (1 - a) ** 2 * (1 - b)))
        elif code in (13, 26, 32):  # The cube is collapsed to a wedge.
            points.append(((a, b * (1 - a), c), u * v * s * (1 - a)))
        else:
            points.append(((a, b, c), u * v * s))
    return points


def volume(cell, weights):
    """Volume of a cell: integral of the Jacobian of VTK's own map. Central differences give the exact Jacobian of
    quadratic maps.
    """
    def at(xi):
        x = [0.0] * 3
        cell.EvaluateLocation(mutable(0), list(xi), x, weights)
        return np.array(x)

    step, sum_ = 1e-3, 0.0
    for xi, weight in rule(cell.GetCellType()):
        slopes = [(at(xi + e) - at(xi - e)) / (2 * step) for e in step * np.eye(3)]
        sum_ += weight * np.linalg.det(slopes)
    return sum_


def check(path):
    wanted = np.loadtxt(path.with_suffix(".txt"), ndmin=2)
    reader = vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(path))
    reader.Update()
    grid = reader.GetOutput()
    assert grid.GetNumberOfCells() == len(wanted), path
    sizes = vtkCellSizeFilter()
    sizes.SetInputData(grid)
    sizes.Update()
    sizes = vtk_to_numpy(sizes.GetOutput().GetCellData().GetArray("Volume"))
    cell = vtkGenericCell()
    worst = 0.0
    for i, (code, own) in enumerate(wanted):
        grid.GetCell(i, cell)
        assert cell.GetCellType() == code, (path, i, cell.GetCellType())
        error = abs(volume(cell, [0.0] * 32) / own - 1)
        worst = max(worst, error)
        assert error < 1e-9, (path, i, error)
        # VTK's filter is less accurate for curved cells, because it cuts them into a few straight tetrahedra.
        assert abs(sizes[i] / own - 1) < 0.2, (path, i, sizes[i] / own - 1)
    print(f"{path.name}: volumes differ by {worst:.1e}, by VTK's filter by {np.abs(sizes / wanted[:, 1] - 1).max():.1e}")
    if MESHIO[int(wanted[0, 0])] not in topological_dimension:
        return  # meshio 5.3 knows the names of wedges with 15 nodes and pyramids with 13 nodes, but cannot read them.
    mesh = meshio.read(path)
    assert [block.type for block in mesh.cells] == [MESHIO[int(wanted[0, 0])]], path
    assert np.array_equal(mesh.points, vtk_to_numpy(grid.GetPoints().GetData())), path
    nodes = vtk_to_numpy(grid.GetCells().GetConnectivityArray()).reshape(len(wanted), -1)
    # meshio reverses the node order of the triangles of wedges.
    turned = [0, 2, 1, 3, 5, 4] if mesh.cells[0].type == "wedge" else range(nodes.shape[1])
    assert np.array_equal(mesh.cells[0].data, nodes[:, turned]), path
    assert np.array_equal(mesh.point_data["displacement"], mesh.points), path


for file in sorted(Path(sys.argv[1]).glob("*.vtu")):
    check(file)
