"""Compares the difference fields of `orthowear compare` with the fields of the variants.

    differences.py DIR

DIR is the output directory of `orthowear compare` with the variants HS-rigid and FE-rigid. Each step has one entry.
"""

import sys
import xml.etree.ElementTree as xml
from pathlib import Path

import meshio
import numpy as np

root = Path(sys.argv[1])
files = [entry.get("file") for entry in xml.parse(root / "differences.pvd").iter("DataSet")]
assert files == ["differences_0001.vtu", "differences_0002.vtu"], files


def cells(grid, name):
    return np.concatenate(grid.cell_data[name])


for number, file in enumerate(files, 1):
    grid = meshio.read(root / file)
    for field in ("pressure", "traction", "wear_depth"):
        values = {}
        for variant in ("HS-rigid", "FE-rigid"):
            alone = meshio.read(root / variant.lower() / f"frame_{number:04}.vtu")
            assert np.array_equal(alone.points, grid.points)
            values[variant] = cells(alone, field)
            assert np.array_equal(values[variant], cells(grid, f"{field}_{variant}")), (file, field, variant)
        difference = cells(grid, f"{field}_FE-rigid_minus_HS-rigid")
        assert np.array_equal(difference, values["FE-rigid"] - values["HS-rigid"]), (file, field)
    assert np.abs(cells(grid, "pressure_FE-rigid_minus_HS-rigid")).max() > 0.0
