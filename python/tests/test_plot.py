"""Plots show the values of results, with their units."""

import subprocess
import sys

import numpy as np
import pytest
from conftest import ROOT, needed, small

import orthowear
from orthowear import plot


@pytest.fixture
def pyplot():
    needed("matplotlib").use("agg")
    module = needed("matplotlib.pyplot")
    yield module
    module.close("all")


@pytest.fixture(scope="module")
def result():
    return orthowear.Scene.from_dict(small()).run()


def drawn(ax):
    """Collection of cells of a map, and the label of its colour bar."""
    return ax.collections[0], ax.figure.axes[-1].get_ylabel()


@pytest.mark.parametrize(
    ("name", "component", "values", "label"),
    [
        ("pressure", None, lambda r: r.pressure, "pressure [MPa]"),
        ("tractions", None, lambda r: np.hypot(r.tractions[:, 0], r.tractions[:, 1]), "tangential traction on body 2 [MPa]"),
        ("tractions", "x", lambda r: r.tractions[:, 0], "traction on body 2 along x [MPa]"),
        ("gap", None, lambda r: r.gap[:, 2], "gap along n [mm]"),
        ("gap", "y", lambda r: r.gap[:, 1], "gap along y [mm]"),
        ("wear_depth", None, lambda r: r.wear_depth, "wear depth [mm]"),
        ("contact", None, lambda r: r.contact, ""),
    ],
)
def test_maps(pyplot, result, name, component, values, label):
    """Truth: the drawn values are the fields of the result. The frame is 0.8 mm by 0.8 mm in 16 by 16 cells."""
    ax = plot.field(result, name, component=component)
    cells, words = drawn(ax)
    assert np.array_equal(np.asarray(cells.get_array()), result.to_grid(values(result)).T)
    corners = cells.get_coordinates()
    assert np.allclose(corners[0, :, 0], np.linspace(-0.4, 0.4, 17), rtol=0, atol=1e-12)
    assert np.allclose(corners[:, 0, 1], np.linspace(-0.4, 0.4, 17), rtol=0, atol=1e-12)
    assert words == label and ax.get_aspect() == 1.0
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("x [mm]", "y [mm]")
    low, high = cells.get_clim()
    if component in ("x", "y"):
        assert -low == high == np.abs(values(result)).max()
    elif name != "contact":
        assert low <= 0 and high == (values(result).max() or 1.0)
    ax.figure.canvas.draw()


def test_slip_is_where_there_is_contact(pyplot, result):
    """Truth: slip is drawn in the cells in contact, and only there."""
    ax = plot.field(result, "slip")
    shown = np.ma.masked_invalid(drawn(ax)[0].get_array())
    assert np.array_equal(~np.ma.getmaskarray(shown), result.to_grid(result.contact).T > 0)
    inside = result.contact > 0
    assert np.array_equal(np.sort(shown.compressed()), np.sort(np.hypot(*result.slip[inside].T)))


def test_arrows_point_along_the_tractions(pyplot, result):
    """Truth: an arrow shows the tangential traction of its cell. Every cell above 1 % of the largest traction has an arrow."""
    ax = plot.field(result, "tractions")
    arrows = ax.collections[1]
    rows = [np.flatnonzero((result.xy == place).all(axis=1))[0] for place in arrows.XY]
    assert np.array_equal(np.column_stack([arrows.U, arrows.V]), result.tractions[rows, :2])
    size = np.hypot(*result.tractions[:, :2].T)
    assert len(rows) == np.count_nonzero(size > 0.01 * size.max())


def test_options_and_axes_of_others(pyplot, result):
    """Truth: plots have the given axes, limits and norm."""
    _, axes = pyplot.subplots(1, 3)
    ax = plot.field(result.fields, ax=axes[0], cmap="cividis", vmax=10.0, colorbar=False)
    assert ax is axes[0] and ax.collections[0].get_clim()[1] == 10.0 and len(ax.figure.axes) == 3
    from matplotlib.colors import SymLogNorm

    norm = SymLogNorm(1.0, vmin=-5.0, vmax=5.0)
    assert plot.field(result, "tractions", component="x", ax=axes[1], norm=norm).collections[0].norm is norm
    with orthowear.Scene.from_dict(small()).steps() as steps:
        entry = next(steps)
    assert np.array_equal(
        np.ravel(plot.field(entry, ax=axes[2]).collections[0].get_array()), entry.to_grid(entry.pressure).T.ravel()
    )


def test_units_are_the_scenes(pyplot):
    """Truth: labels have the units of the scene. The unit of stress is Pa for N and m, and lbf/in² for lbf and in."""
    for units, stress in (({"length": "m", "force": "N"}, "Pa"), ({"length": "in", "force": "lbf"}, "lbf/in²")):
        scene = orthowear.Scene.from_dict({**small(), "units": units})
        result = scene.run()
        assert drawn(plot.field(result))[1] == f"pressure [{stress}]"
        assert plot.history(result, "contact_area").get_ylabel() == f"contact area [{units['length']}²]"
        with scene.steps() as steps:
            assert drawn(plot.field(next(steps)))[1] == f"pressure [{stress}]"


def test_sections(pyplot, result):
    """Truth: a section shows a row of the grid. Of two rows equally near to the middle, the first one is drawn."""
    grid = result.to_grid(result.pressure)
    ax = plot.section(result)
    plot.section(result, along="y", at=0.4, ax=ax)
    x, y = ax.lines
    assert np.array_equal(x.get_ydata(), grid[:, 7]) and np.array_equal(y.get_ydata(), grid[15])
    assert np.allclose(x.get_xdata(), (np.arange(16) + 0.5) * 0.05 - 0.4, rtol=0, atol=1e-15)
    assert [line.get_label() for line in ax.lines] == ["y = -0.025 mm", "x = 0.375 mm"]
    signed = plot.section(result, "tractions", component="x")
    assert signed.get_ylabel() == "traction on body 2 along x [MPa]"


def test_turned_frames_and_outlines(pyplot):
    """Truth: for any azimuth, a section follows a row of the grid. Cells outside the outline are not drawn."""
    scene = orthowear.Scene.from_dict(small())
    turned = scene.replace({"frame.azimuth": 30.0, "frame.outline": {"shape": "circle", "radius": 0.33}}).run()
    ax = plot.section(turned)
    row = turned.to_grid(turned.pressure)[:, 7]
    assert np.array_equal(ax.lines[0].get_ydata(), row[np.isfinite(row)])
    cells = np.ma.masked_invalid(drawn(plot.field(turned))[0].get_array())
    assert cells.count() == len(turned.areas) < 256


def test_mesh_frames(pyplot):
    """Truth: each cell is drawn as a square of its area. The section contains the cells that its line crosses."""
    block = {"kind": "fe", "material": "steel", "mesh": "compare-block.msh", "contact": "contact", "fixed": [{"group": "base"}]}
    frame = {"kind": "mesh", "body": 1, "points": "faces"}
    steps = [{"name": "press", "approach": 0.03}]
    scene = {**small(), "body1": block, "frame": frame, "gap": {"kind": "sphere", "radius": 500.0}, "steps": steps}
    result = orthowear.Scene.from_dict(scene, ROOT / "meshes").run()
    assert result.grid is None and result.pressure.max() > 0
    ax = plot.field(result)
    squares = drawn(ax)[0]
    assert np.array_equal(squares.get_array(), result.pressure)
    corners = np.array([path.vertices[:4] for path in squares.get_paths()])
    assert np.allclose(corners.mean(axis=1), result.xy)
    assert np.allclose(np.ptp(corners[:, :, 0], axis=1) * np.ptp(corners[:, :, 1], axis=1), result.areas)
    line = plot.section(result, at=0.01).lines[0]
    met = np.abs(result.xy[:, 1] - 0.01) <= np.sqrt(result.areas) / 2
    assert sorted(line.get_xdata()) == sorted(result.xy[met, 0])
    moved = plot.field(result, xy=result.xy + [20.0, 0.0])
    assert moved.get_xlim()[0] > 0
    with pytest.raises(ValueError, match=r"xy has the shape \(1, 2\); it must be"):
        plot.field(result, xy=[[0.0, 0.0]])


def test_curved_frames_are_told(pyplot):
    """Truth: the faces of a hole over 180° overlap in the frame's plane, which causes a warning. Along the arc, they
    do not overlap.
    """
    result = orthowear.Scene.load(ROOT / "scenes" / "pin-in-hole.toml").run()
    with pytest.warns(UserWarning, match="give their positions with xy="):
        plot.field(result)
    n = result.axes[:, 2]
    arc = np.column_stack([10.0 * np.arctan2(n[:, 0], n[:, 2]), result.xy[:, 1]])
    line = plot.section(result, xy=arc).lines[0]
    assert len(line.get_xdata()) == len(arc) and np.all(np.diff(line.get_xdata()) > 0)


def test_histories(pyplot, result):
    """Truth: curves show the values of the result's entries."""
    ax = plot.history(result, "tangential_force")
    assert [line.get_label() for line in ax.lines] == ["x", "y"] and ax.get_ylabel() == "tangential force [N]"
    for k, line in enumerate(ax.lines):
        assert list(line.get_ydata()) == [entry["tangential_force"][k] for entry in result.entries]
        assert list(line.get_xdata()) == [1, 2, 3, 4, 5]
    pushed = plot.history(result.entries, "tangential_force.1", over="approach", step="push")
    line = pushed.lines[0]
    entries = [entry for entry in result.entries if entry["name"] == "push"]
    assert list(line.get_xdata()) == [entry["approach"] for entry in entries]
    assert list(line.get_ydata()) == [entry["tangential_force"][1] for entry in entries]
    assert (pushed.get_xlabel(), pushed.get_ylabel()) == ("approach [mm]", "tangential force, y [N]")
    assert plot.history(result.entries[2:], "peak_pressure").get_ylabel() == "peak pressure [force/length²]"
    inner = plot.history(result, "certificate.min_gap")
    assert list(inner.lines[0].get_ydata()) == [entry["certificate"]["min_gap"] for entry in result.entries]


def test_loops_and_cycles(pyplot):
    """Truth: the area enclosed by a loop of force against displacement is the reported dissipation. The trapezoidal
    rule with 32 points approximates this area within 5 %.
    """
    scene = orthowear.Scene.load(
        ROOT / "scenes" / "sphere-wear.toml",
        {"frame.cells": [16, 16], "output.fields": ["loops"], "steps.fretting.cycles.count": 1000},
    )
    result = scene.run()
    ax = plot.loop(result, step="fretting")
    assert len(ax.lines) == len(result.summary["loops"]) == 2
    for line, cycle in zip(ax.lines, result.summary["loops"], strict=True):
        x, y = line.get_xdata(), line.get_ydata()
        area = abs(np.sum((x[1:] - x[:-1]) * (y[1:] + y[:-1]) / 2))
        assert area == pytest.approx(cycle["dissipation"], rel=0.05)
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("tangential displacement along x [mm]", "tangential force along x [N]")
    assert drawn(plot.field(result, "wear_depth"))[0].get_clim() == (0.0, result.wear_depth.max())
    worn = plot.history(result, "worn_volume")
    assert worn.get_xlabel() == "cycles done" and worn.get_ylabel() == "worn volume [mm³]"
    assert list(worn.lines[0].get_xdata()) == [entry["cycles_done"] for entry in result.entries]


def test_path_of_a_stroke(pyplot, result):
    """Truth: the path shows the entries of the step, by default along the larger component, x."""
    ax = plot.loop(result, step="push")
    entries = [entry for entry in result.entries if entry["name"] == "push"]
    assert list(ax.lines[0].get_xdata()) == [entry["shift"][0] for entry in entries]
    assert list(ax.lines[0].get_ydata()) == [entry["tangential_force"][0] for entry in entries]
    other = plot.loop(result, step="push", component="y")
    assert list(other.lines[0].get_ydata()) == [entry["tangential_force"][1] for entry in entries]


def test_convergence(pyplot):
    """Truth: curves show the differences from the last run. Rings show the estimated errors."""
    result = orthowear.Scene.load(ROOT / "scenes" / "hertz.toml", {"accuracy": 0.02}).run()
    ax = plot.convergence(result)
    accuracy = result.summary["accuracy"]
    peaks = np.array([run["values"][-1] for run in accuracy["runs"]])
    lines = {line.get_label(): line for line in ax.lines}
    assert np.allclose(lines["press: peak pressure"].get_ydata(), np.abs(peaks[:-1] / peaks[-1] - 1), rtol=1e-9)
    rings = [line.get_ydata()[0] for line in ax.lines if line.get_marker() == "o"]
    assert rings == [found["relative"] for found in accuracy["results"] if found["relative"] > 0]
    assert ax.lines[-1].get_ydata()[0] == 0.02 and ax.get_yscale() == "log"
    runs = [{key: value for key, value in run.items() if key != "cells"} for run in accuracy["runs"]]
    on_mesh = orthowear.Result({**result.summary, "accuracy": {**accuracy, "runs": runs}}, None)
    labels = [label.get_text() for label in plot.convergence(on_mesh).get_xticklabels()]
    assert len(labels) == len(runs) and all(label.startswith("mesh") for label in labels)


def test_slip_of_rolling(pyplot):
    """Truth: docs/results.md: in rolling, slip is per rolled distance, without a unit."""
    result = orthowear.Scene.load(ROOT / "scenes" / "rolling-cylinders.toml").run()
    bar = plot.field(result, "slip").figure.axes[1]
    assert bar.get_ylabel() == "slip per rolled distance"


def test_refusals(pyplot, result):
    """Truth: the message names the wrong value and the allowed values."""
    cases = [
        (ValueError, "field 'presure': allowed are pressure, tractions", lambda: plot.field(result, "presure")),
        (ValueError, "component 'z' of gap: allowed: n, x, y", lambda: plot.field(result, "gap", component="z")),
        (ValueError, "component 'x' of pressure: allowed: none", lambda: plot.section(result, component="x")),
        (TypeError, "type dict .*allowed: a Result, an Entry or Fields", lambda: plot.field({})),
        (ValueError, "xy is not supported: the cells of a grid frame", lambda: plot.field(result, xy=result.xy)),
        (ValueError, "along 'z'", lambda: plot.section(result, along="z")),
        (ValueError, "no quantity 'worn'; they have .*normal_force.*worn_volume", lambda: plot.history(result, "worn")),
        (ValueError, "no step 'pull'; the result has press, push", lambda: plot.history(result, step="pull")),
        (
            ValueError,
            "over = 'shift' has several components; use one of shift.0, shift.1",
            lambda: plot.history(result, over="shift"),
        ),
        (TypeError, "type int .*allowed: a Result or its entries", lambda: plot.history(3)),
        (ValueError, "component 'n'", lambda: plot.loop(result, component="n")),
        (ValueError, "no runs of different accuracy; give the scene an accuracy", lambda: plot.convergence(result)),
    ]
    for kind, message, draw in cases:
        with pytest.raises(kind, match=message):
            draw()
    empty = orthowear.Result({**result.summary, "steps": []}, None)
    with pytest.raises(ValueError, match="no fields, because no increment was computed"):
        plot.field(empty)
    with pytest.raises(ValueError, match="no entries"):
        plot.history(empty)


def test_without_matplotlib():
    """Truth: the package can be imported without matplotlib. A plot names the missing package and how to install it."""
    code = """
import sys
import orthowear
assert "matplotlib" not in sys.modules
sys.modules["matplotlib"] = None
scene = orthowear.Scene.from_dict({
    "body1": {"kind": "half-space", "material": "steel"}, "body2": {"kind": "rigid"},
    "materials": {"steel": {"model": "isotropic", "E": 210e3, "nu": 0.3}},
    "frame": {"kind": "grid", "half_width": [0.4, 0.4], "cells": [4, 4]},
    "gap": {"kind": "sphere", "radius": 10.0}, "steps": [{"name": "press", "approach": 0.01}]})
try:
    orthowear.plot.field(scene.run())
except ImportError as error:
    print(error)
"""
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert "plots need matplotlib" in said and "pip install matplotlib" in said
