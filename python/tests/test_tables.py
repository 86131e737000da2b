"""Tables and labelled arrays, if pandas and xarray are installed."""

import numpy as np
import pytest


def test_pandas(scene):
    """Truth: the table contains the values of the entries."""
    pytest.importorskip("pandas")
    result = scene.run()
    table = result.entries.to_pandas()
    assert list(table["name"]) == ["press"] * 2 + ["push"] * 3
    assert table["tangential_force.1"].iloc[-1] == result.entries[-1]["tangential_force"][1]


def test_xarray(scene):
    """Truth: the data set contains the arrays by cell, at the centres of 16 cells of 0.05 mm."""
    pytest.importorskip("xarray")
    result = scene.run()
    data = result.fields.to_xarray()
    assert np.allclose(data["x"], (np.arange(16) + 0.5) * 0.05 - 0.4, rtol=0, atol=1e-12)
    assert np.array_equal(data["pressure"].values.ravel(), result.pressure)
    assert float(data["tractions_x"].sum()) == pytest.approx(result.tractions[:, 0].sum(), rel=1e-12)
