"""Plots of values of the entries, and of the runs of an accuracy search."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from ..fields import UNKNOWN_UNITS, Array
from ..result import Entries, Result, flatten
from .axes import axes_of, unit_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: Dimension of each quantity of an entry, or its unit.
ENTRIES = {
    "approach": "length",
    "shift": "length",
    "rotation": "degrees",
    "twist": "degrees",
    "normal_force": "force",
    "tangential_force": "force",
    "moment": "moment",
    "contact_area": "area",
    "stick_area": "area",
    "peak_pressure": "stress",
    "worn_volume": "volume",
    "worn_volume_error": "volume",
    "worn_volume_by_energy": "volume",
    "worn_volume_by_body": "volume",
    "max_wear_depth": "length",
    "max_wear_depth_error": "length",
    "wear_depth_error": "length",
    "distance_slid": "length",
    "dissipation": "moment",
    "seconds": "s",
}
COMPONENTS = {"worn_volume_by_body": ("body 1", "body 2")}


def history(
    of: Result | Entries,
    name: str = "normal_force",
    *,
    over: str | None = None,
    step: str | None = None,
    ax: Axes | None = None,
    **options: Any,
) -> Axes:
    """Draws a quantity of the entries (docs/results.md), such as a force, an area or the wear volume. A vector gives
    one line per component.

    Args:
        name: For example normal_force, tangential_force, tangential_force.0, contact_area, worn_volume, certificate.min_gap.
        over: Quantity on the x axis. Default: `cycles_done` if an entry has cycles, otherwise the number of the entry, from 1.
        step: Draw only the entries of this step.
        options: Options of matplotlib's plot.
    """
    entries, _ = _entries(of, step)
    rows = [flatten(entry) for entry in entries]
    columns = _columns(rows, name)
    if over is None:
        over = "cycles_done" if any(row.get("cycles_done") for row in rows) else "entry"
    if over == "entry":
        x, xlabel = np.arange(1.0, len(rows) + 1), "entry"
    else:
        places = _columns(rows, over)
        if len(places) != 1:
            raise ValueError(f"over = {over!r} has several components; use one of {', '.join(places)}")
        x, xlabel = _numbers(rows, next(iter(places))), _words(over, entries.units)
    ax = axes_of(ax)
    for column, words in columns.items():
        ax.plot(x, _numbers(rows, column), **{"marker": ".", "label": words, **options})
    ax.set(xlabel=xlabel, ylabel=_words(name, entries.units))
    if over == "entry":
        from matplotlib.ticker import MaxNLocator

        ax.xaxis.set_major_locator(MaxNLocator(integer=True))
    if len(columns) > 1:
        ax.legend()
    return ax


def loop(
    of: Result | Entries,
    *,
    step: str | None = None,
    component: Literal["x", "y"] | None = None,
    ax: Axes | None = None,
    **options: Any,
) -> Axes:
    """Draws the tangential force on body 1 against the tangential displacement (`shift`) of body 2.

    Results with resolved cycles (`output.fields` with "loops") give a closed loop per cycle. Other results give the
    path through the entries.

    Args:
        step: Draw only this step.
        component: x or y, by default the direction in which body 2 moves further.
        options: Options of matplotlib's plot.
    """
    if component not in (None, "x", "y"):
        raise ValueError(f"component {component!r}: allowed are 'x', 'y' and None")
    summary = of.summary if isinstance(of, Result) else {}
    cycles = [cycle for cycle in summary.get("loops", []) if step in (None, cycle["name"])]
    entries, units = _entries(of, None if cycles else step)
    curves: list[tuple[str, Array, Array]] = []
    for cycle in cycles:
        points = np.array(cycle["points"], dtype=float)
        closed = np.vstack([points, points[:1]])
        label = f"{cycle['name']}, {cycle['cycles_done']:g} cycles"
        curves.append((label, closed[:, :2], closed[:, 2:4]))
    if not curves:
        path = [[*entry["shift"], *entry["tangential_force"]] for entry in entries]
        points = np.array(path, dtype=float)
        curves.append(("entries" if step is None else step, points[:, :2], points[:, 2:]))
    extent = np.ptp(np.vstack([shift for _, shift, _ in curves]), axis=0)
    k = ("x", "y").index(component) if component else int(extent[1] > extent[0])
    ax = axes_of(ax)
    for label, shift, force in curves:
        ax.plot(shift[:, k], force[:, k], **{"marker": ".", "label": label, **options})
    if len(curves) > 1:
        ax.legend()
    axis = "xy"[k]
    ax.set(xlabel=f"tangential displacement along {axis} [{units['length']}]", ylabel=f"tangential force along {axis} [{units['force']}]")
    return ax


def convergence(of: Result, *, step: str | None = None, ax: Axes | None = None, **options: Any) -> Axes:
    """Draws the convergence of a scene with `accuracy`: the relative difference of each result from its value in the
    last run.

    Each result of each step (or of `step` only) gives a line over the runs. Runs are labelled by their cells and
    the factor of their increments. Rings show the estimated errors of the last run. The dashed line shows the
    requested accuracy. options: options of matplotlib's plot.
    """
    accuracy = of.summary.get("accuracy")
    if not accuracy or len(accuracy["runs"]) < 2:
        raise ValueError(
            "the result has no runs of different accuracy; give the scene an accuracy, such as accuracy = 0.01 "
            "(scene.replace({'accuracy': 0.01}))"
        )
    runs = accuracy["runs"]
    values = np.array([run["values"] for run in runs], dtype=float)
    steps = [result["step"] for result in accuracy["results"]]
    if step is not None and step not in steps:
        raise ValueError(f"there is no step {step!r}; the result has {', '.join(dict.fromkeys(steps))}")
    ax = axes_of(ax)
    for i, result in enumerate(accuracy["results"]):
        last = values[-1, i]
        off = np.abs(values[:-1, i] - last) / abs(last) if last else np.zeros(len(runs) - 1)
        if step not in (None, result["step"]) or not off.any():
            continue
        label = f"{result['step']}: {result['name'].replace('_', ' ')}"
        off = np.where(off > 0, off, np.nan)
        (line,) = ax.plot(np.arange(1, len(runs)), off, **{"marker": ".", "label": label, **options})
        if result.get("relative"):
            ax.plot([len(runs)], [result["relative"]], "o", markerfacecolor="none", color=line.get_color())
    ax.axhline(accuracy["requested"], linestyle="--", color="0.4", linewidth=1.0)
    names = ["\N{MULTIPLICATION SIGN}".join(map(str, run.get("cells", ["mesh"]))) for run in runs]
    if any(run["increments"] != 1 for run in runs):
        names = [f"{name}\n{run['increments']} incr." for name, run in zip(names, runs, strict=True)]
    ax.set_xticks(np.arange(1, len(runs) + 1), names)
    ax.set(yscale="log", xlabel="cells of the runs", ylabel="relative difference from the last run")
    if ax.get_legend_handles_labels()[1]:
        ax.legend()
    return ax


def _entries(of: Any, step: str | None) -> tuple[Entries, dict[str, str]]:
    found: Sequence[Mapping[str, Any]] = of.entries if isinstance(of, Result) else of
    if isinstance(found, Entries):
        units = found.units
    elif isinstance(found, Sequence) and not isinstance(found, str) and all(isinstance(entry, Mapping) for entry in found):
        units = dict(UNKNOWN_UNITS)
    else:
        raise TypeError(f"a value of the type {type(of).__name__} cannot be drawn; allowed: a Result or its entries")
    chosen = [entry for entry in found if step in (None, entry["name"])]
    if not chosen:
        names = ", ".join(dict.fromkeys(entry["name"] for entry in found))
        raise ValueError(f"there is no step {step!r}; the result has {names}" if names else "the result has no entries")
    return Entries(map(dict, chosen), units), units


def _columns(rows: list[dict[str, Any]], name: str) -> dict[str, str]:
    """Columns of a scalar quantity, or of the components of a vector, with a label for each column."""
    known = dict.fromkeys(column for row in rows for column, value in row.items() if _is_number(value))
    found = [column for column in known if column == name or column.rpartition(".")[0] == name]
    if not found:
        names = dict.fromkeys(column.rstrip("0123456789").rstrip(".") for column in known)
        raise ValueError(f"the entries have no quantity {name!r}; they have {', '.join(names)}")
    components = COMPONENTS.get(name, ("x", "y", "n"))

    def words(column: str) -> str:
        last = column.rpartition(".")[2]
        return components[int(last)] if column != name and last.isdigit() and int(last) < len(components) else last

    return {column: words(column).replace("_", " ") for column in found}


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float)


def _numbers(rows: list[dict[str, Any]], column: str) -> Array:
    """Values of a column. NaN if an entry has no number in this column."""
    values = (row.get(column) for row in rows)
    return np.array([value if _is_number(value) else np.nan for value in values], dtype=float)


def _words(name: str, units: Mapping[str, str]) -> str:
    base, _, component = name.partition(".")
    words = base.replace("_", " ")
    if component.isdigit():
        words += f", {COMPONENTS.get(base, ('x', 'y', 'n'))[int(component)]}"
    elif component:
        words = component.replace("_", " ").replace(".", " ")
    dimension = ENTRIES.get(base)
    return f"{words} [{unit_of(dimension, units)}]" if dimension else words
