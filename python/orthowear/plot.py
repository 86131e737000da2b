"""Pictures of results with matplotlib, which is imported when the first one is made.

Each function draws into `ax`, or into a figure of its own, and returns the axes: titles, limits, legends and more lines are
matplotlib's. Numbers are drawn as they are, with the scene's units. Colours are told apart by the colour-blind, too.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from .fields import UNKNOWN_UNITS, Array, Fields
from .result import Entries, Result, _flat

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from .scene import Entry

__all__ = ["convergence", "field", "history", "loop", "section"]

#: Colours of numbers from 0, of signed numbers, and of open, sticking and slipping cells (Okabe and Ito 2008).
FROM_ZERO, SIGNED = "viridis", "RdBu_r"
CONTACT = {"open": "#e6e6e6", "stick": "#0072b2", "slip": "#e69f00"}

#: Most arrows along the longer side of a map.
ARROWS = 16


class _Part(NamedTuple):
    """Values of a field (N,), what they are called with their unit, and whether they have a sign."""

    values: Array
    label: str
    signed: bool


#: By name: its words, the dimension of its unit, its components; the first of these is shown by default.
FIELDS: dict[str, tuple[str, str, tuple[str, ...]]] = {
    "pressure": ("pressure", "stress", ()),
    "tractions": ("traction on body 2", "stress", ("tangential", "x", "y", "n")),
    "gap": ("gap", "length", ("n", "x", "y")),
    "slip": ("slip", "length", ("tangential", "x", "y")),
    "wear_depth": ("worn depth", "length", ()),
    "contact": ("contact", "", ()),
}

#: Dimensions of the numbers of entries; their components by the last part of the name.
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
    "wear_depth_error": "length",
    "distance_slid": "length",
    "dissipation": "moment",
    "seconds": "s",
}
COMPONENTS = {"worn_volume_by_body": ("body 1", "body 2")}


def field(
    of: Result | Entry | Fields,
    name: str = "pressure",
    *,
    component: str | None = None,
    arrows: bool = True,
    colorbar: bool = True,
    xy: npt.ArrayLike | None = None,
    ax: Axes | None = None,
    **options: Any,
) -> Axes:
    """A map of a field over the frame, along the frame's x and y from its origin.

    name: pressure, tractions, gap, slip, wear_depth or contact. component: of `tractions` and `slip` tangential (the magnitude
    along x and y, the default), x or y; of `tractions` n, too; of `gap` n (the default), x or y. arrows: directions on
    magnitudes. colorbar: with the unit. xy: other places of the cells (N, 2), such as arc length and height on a cylinder, where
    those in the frame's plane lie over each other; only for frames that are no grids. options: of matplotlib's pcolormesh, such as cmap, vmin and vmax.

    Signed components have colours about 0. Slip is left out in open cells, where nothing slips. Cells of frames that are no
    grids are squares of the cells' areas.
    """
    fields = _fields(of)
    part = _part(fields, name, component)
    places = _places(fields, xy)
    ax = _axes(ax)
    if name == "contact":
        from matplotlib.colors import BoundaryNorm, ListedColormap

        options = {"cmap": ListedColormap(list(CONTACT.values())), "norm": BoundaryNorm([-0.5, 0.5, 1.5, 2.5], 3), **options}
    else:
        known = part.values[np.isfinite(part.values)]
        most = float(np.abs(known).max(initial=0.0)) or 1.0
        least = -most if part.signed else min(0.0, float(known.min(initial=0.0)))
        limits = {} if "norm" in options else {"vmin": least, "vmax": most}
        options = {"cmap": SIGNED if part.signed else FROM_ZERO, **limits, **options}
    drawn = _cells(ax, fields, places, part.values, options)
    if arrows and component in (None, "tangential") and name in ("tractions", "slip"):
        _arrows(ax, fields, places, np.where(np.isfinite(part.values)[:, None], getattr(fields, name)[:, :2], 0.0))
    if colorbar and ax.figure is not None:
        if name == "contact":
            bar = ax.figure.colorbar(drawn, ax=ax, ticks=[0, 1, 2])
            bar.ax.set_yticklabels(list(CONTACT))
        else:
            ax.figure.colorbar(drawn, ax=ax, label=part.label)
    ax.set_aspect("equal")
    for axis in ("x", "y"):
        ax.set(**{f"{axis}label": f"{axis} [{fields.units['length']}]"})
    return ax


def section(
    of: Result | Entry | Fields,
    name: str = "pressure",
    *,
    component: str | None = None,
    along: Literal["x", "y"] = "x",
    at: float | None = None,
    xy: npt.ArrayLike | None = None,
    ax: Axes | None = None,
    **options: Any,
) -> Axes:
    """A field in the row of cells along x or y through the middle of the frame, or the one nearest to `at` on the other axis.

    name, component, xy: as of `field`. options: of matplotlib's plot; by default the line's label says where the row is. Of frames
    that are no grids the cells that the line meets are drawn.
    """
    if along not in ("x", "y"):
        raise ValueError(f"along {along!r}: allowed are 'x' and 'y'")
    fields = _fields(of)
    part = _part(fields, name, component)
    k = 0 if along == "x" else 1
    places = _places(fields, xy)
    across = places[:, 1 - k]
    wanted = (across.min() + across.max()) / 2 if at is None else float(at)
    if fields.grid is not None:
        rows = fields.places % fields.grid[1] if along == "x" else fields.places // fields.grid[1]
        # Of two rows as near the first, whatever the rounding.
        distance = np.abs(across - wanted)
        near = rows[distance <= distance.min() + 1e-6 * np.sqrt(fields.areas[0])]
        chosen = np.flatnonzero(rows == near.min())
        row = float(across[chosen].mean())
        options = {"marker": "."} | options
    else:
        row = wanted
        chosen = np.flatnonzero(np.abs(across - row) <= np.sqrt(fields.areas) / 2)
        options = {"marker": ".", "linestyle": "none"} | options
    if not len(chosen):
        raise ValueError(f"at {wanted:g}: the frame is from {across.min():g} to {across.max():g} there")
    chosen = chosen[np.argsort(places[chosen, k], kind="stable")]
    ax = _axes(ax)
    length = fields.units["length"]
    ax.plot(places[chosen, k], part.values[chosen], **{"label": f"{'yx'[k]} = {row:.4g} {length}", **options})
    ax.set(xlabel=f"{along} [{length}]", ylabel=part.label)
    if name == "contact":
        ax.set_yticks([0, 1, 2], list(CONTACT))
    elif part.signed:
        ax.axhline(0.0, color="0.6", linewidth=0.8, zorder=0)
    return ax


def history(
    of: Result | Entries,
    name: str = "normal_force",
    *,
    over: str | None = None,
    step: str | None = None,
    ax: Axes | None = None,
    **options: Any,
) -> Axes:
    """A number of the entries (docs/results.md): a force, an area, the worn volume; of vectors a line for each component.

    name: normal_force, tangential_force, tangential_force.0, contact_area, worn_volume, certificate.min_gap. over: another
    number, by default `cycles_done` where there are cycles, else the number of the entry, from 1. step: entries of this step
    only. options: of matplotlib's plot.
    """
    entries, _ = _entries(of, step)
    rows = [_flat(entry) for entry in entries]
    columns = _columns(rows, name)
    if over is None:
        over = "cycles_done" if any(row.get("cycles_done") for row in rows) else "entry"
    if over == "entry":
        x, xlabel = np.arange(1.0, len(rows) + 1), "entry"
    else:
        places = _columns(rows, over)
        if len(places) != 1:
            raise ValueError(f"over {over!r}: it has components; allowed is one of {', '.join(places)}")
        x, xlabel = _numbers(rows, next(iter(places))), _words(over, entries.units)
    ax = _axes(ax)
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
    """The tangential force on body 1 over the shift of body 2.

    Of results with resolved cycles (`output.fields` with "loops") a closed loop for each of them, else the path through the
    entries. step: of this step only. component: x or y; by default the one along which body 2 moves further. options: of
    matplotlib's plot.
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
    ax = _axes(ax)
    for label, shift, force in curves:
        ax.plot(shift[:, k], force[:, k], **{"marker": ".", "label": label, **options})
    if len(curves) > 1:
        ax.legend()
    axis = "xy"[k]
    ax.set(xlabel=f"shift along {axis} [{units['length']}]", ylabel=f"tangential force along {axis} [{units['force']}]")
    return ax


def convergence(of: Result, *, step: str | None = None, ax: Axes | None = None, **options: Any) -> Axes:
    """How the results of a scene with an `accuracy` came to their ends: their relative difference from the last run's.

    A line for each value of each step (of `step` only, if it is given) over the runs, which are named by their cells and the
    factor of their increments. Rings are the estimated errors of the last run, the dashed line the accuracy that was asked for.
    options: of matplotlib's plot.
    """
    accuracy = of.summary.get("accuracy")
    if not accuracy or len(accuracy["runs"]) < 2:
        raise ValueError(
            "the result has no runs of different accuracy: give the scene one, such as accuracy = 0.01 "
            "(scene.replace({'accuracy': 0.01}))"
        )
    runs = accuracy["runs"]
    values = np.array([run["values"] for run in runs], dtype=float)
    steps = [result["step"] for result in accuracy["results"]]
    if step is not None and step not in steps:
        raise ValueError(f"step {step!r}: the result has {', '.join(dict.fromkeys(steps))}")
    ax = _axes(ax)
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
    names = [f"{run['cells'][0]}\N{MULTIPLICATION SIGN}{run['cells'][1]}" for run in runs]
    if any(run["increments"] != 1 for run in runs):
        names = [f"{name}\n{run['increments']} incr." for name, run in zip(names, runs, strict=True)]
    ax.set_xticks(np.arange(1, len(runs) + 1), names)
    ax.set(yscale="log", xlabel="cells of the runs", ylabel="relative difference from the last run")
    if ax.get_legend_handles_labels()[1]:
        ax.legend()
    return ax


# -- What is drawn


def _fields(of: Any) -> Fields:
    found = of if isinstance(of, Fields) else getattr(of, "fields", None)
    if isinstance(found, Fields):
        return found
    if isinstance(of, Result):
        raise ValueError("the result has no fields: no increment was done")
    raise TypeError(f"{_named(of)}; allowed: a Result, an Entry or Fields")


def _entries(of: Any, step: str | None) -> tuple[Entries, dict[str, str]]:
    found: Sequence[Mapping[str, Any]] = of.entries if isinstance(of, Result) else of
    if isinstance(found, Entries):
        units = found.units
    elif isinstance(found, Sequence) and not isinstance(found, str) and all(isinstance(entry, Mapping) for entry in found):
        units = dict(UNKNOWN_UNITS)
    else:
        raise TypeError(f"{_named(of)}; allowed: a Result or its entries")
    chosen = [entry for entry in found if step in (None, entry["name"])]
    if not chosen:
        names = ", ".join(dict.fromkeys(entry["name"] for entry in found))
        raise ValueError(f"step {step!r}: the result has {names}" if names else "the result has no entries")
    return Entries(map(dict, chosen), units), units


def _named(of: Any) -> str:
    return f"a value of the type {type(of).__name__} has nothing to draw"


def _places(fields: Fields, xy: npt.ArrayLike | None) -> Array:
    if xy is None:
        if fields.grid is None:
            normals = fields.axes[:, 2]
            mean = normals.mean(axis=0)
            # A cylinder's cells over half a turn, 0 at its ends.
            if not (normals @ mean).min() > 0.1 * np.linalg.norm(mean):
                warnings.warn(
                    "the frame is curved so far that its cells lie over each other in its plane: give their places with xy=, such "
                    "as arc length and height",
                    UserWarning,
                    stacklevel=3,
                )
        return fields.xy
    if fields.grid is not None:
        raise ValueError("xy: the frame is a grid, whose cells have their places")
    places: Array = np.asarray(xy, dtype=float)
    if places.shape != fields.xy.shape:
        raise ValueError(f"xy of the shape {places.shape}: it must be {fields.xy.shape}, a row for each cell")
    return places


def _stress(units: Mapping[str, str]) -> str:
    force, length = units["force"], units["length"]
    return {("N", "mm"): "MPa", ("N", "m"): "Pa"}.get((force, length), f"{force}/{length}\N{SUPERSCRIPT TWO}")


def _unit(dimension: str, units: Mapping[str, str]) -> str:
    length, force = units["length"], units["force"]
    known = {
        "length": length,
        "area": f"{length}\N{SUPERSCRIPT TWO}",
        "volume": f"{length}\N{SUPERSCRIPT THREE}",
        "force": force,
        "moment": f"{force} {length}",
        "stress": _stress(units),
    }
    return known.get(dimension, dimension)


def _part(fields: Fields, name: str, component: str | None) -> _Part:
    if name not in FIELDS:
        raise ValueError(f"field {name!r}: allowed are {', '.join(FIELDS)}")
    words, dimension, components = FIELDS[name]
    if component is not None and component not in components:
        allowed = ", ".join(components) if components else "none, for it is a number"
        raise ValueError(f"component {component!r} of {name}: allowed: {allowed}")
    component = component or (components[0] if components else None)
    values = np.asarray(getattr(fields, name), dtype=float)
    if component == "tangential":
        values = np.hypot(values[:, 0], values[:, 1])
        words = f"tangential {words}" if name == "tractions" else words
    elif component is not None:
        values = values[:, "xyn".index(component)]
        words = f"{words} along {component}"
    if name == "slip":
        values = np.where(fields.contact == 0, np.nan, values)
    label = f"{words} [{_unit(dimension, fields.units)}]" if dimension else words
    return _Part(values, label, signed=component in ("x", "y"))


def _columns(rows: list[dict[str, Any]], name: str) -> dict[str, str]:
    """Columns of a number or of the components of a vector, with words for each."""
    known = dict.fromkeys(column for row in rows for column, value in row.items() if _is_number(value))
    found = [column for column in known if column == name or column.rpartition(".")[0] == name]
    if not found:
        names = dict.fromkeys(column.rstrip("0123456789").rstrip(".") for column in known)
        raise ValueError(f"{name!r}: the entries have {', '.join(names)}")
    components = COMPONENTS.get(name, ("x", "y", "n"))

    def words(column: str) -> str:
        last = column.rpartition(".")[2]
        return components[int(last)] if column != name and last.isdigit() and int(last) < len(components) else last

    return {column: words(column).replace("_", " ") for column in found}


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float)


def _numbers(rows: list[dict[str, Any]], column: str) -> Array:
    """The column; nan where an entry has no such number."""
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
    return f"{words} [{_unit(dimension, units)}]" if dimension else words


# -- How


def _axes(ax: Axes | None) -> Axes:
    if ax is not None:
        return ax
    try:
        from matplotlib import pyplot
    except ImportError as error:
        raise ImportError(
            f"pictures are made with matplotlib, which cannot be imported ({error}): pip install matplotlib"
        ) from error
    return pyplot.subplots(layout="constrained")[1]


def _cells(ax: Axes, fields: Fields, places: Array, values: Array, options: dict[str, Any]) -> Any:
    if fields.grid is not None:
        edges = _edges(fields)
        # An outline that leaves a single row does not say where others would be.
        if np.isfinite(np.concatenate(edges)).all():
            return ax.pcolormesh(*edges, fields.to_grid(values).T, **options)
    from matplotlib.collections import PolyCollection

    half = np.sqrt(fields.areas)[:, None, None] / 2
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    low, high = options.pop("vmin", None), options.pop("vmax", None)
    squares = PolyCollection(places[:, None, :] + half * corners, array=values, **{"edgecolors": "face", **options})
    squares.set_clim(low, high)
    ax.add_collection(squares)
    ax.autoscale_view()
    return squares


def _edges(fields: Fields) -> tuple[Array, Array]:
    """Where the cells of a grid begin and end along x and y."""
    centres = [fields._along(axis) for axis in (0, 1)]
    spacing = [(c[-1] - c[0]) / (len(c) - 1) if len(c) > 1 else np.nan for c in centres]
    for k in (0, 1):
        # A single row of cells is as wide as their area says.
        if np.isnan(spacing[k]):
            other = spacing[1 - k]
            spacing[k] = np.sqrt(fields.areas[0]) if np.isnan(other) else fields.areas[0] / other
    x, y = (np.append(c - h / 2, c[-1] + h / 2) for c, h in zip(centres, spacing, strict=True))
    return x, y


def _arrows(ax: Axes, fields: Fields, places: Array, vectors: Array) -> None:
    """Arrows of at most the distance between them, at every so many cells; none where there is less than a percent."""
    size = np.hypot(vectors[:, 0], vectors[:, 1])
    largest = size.max(initial=0.0)
    if not largest > 0:
        return
    if fields.grid is not None:
        every = max(1, -(-max(fields.grid) // ARROWS))
        nx, ny = fields.places // fields.grid[1], fields.places % fields.grid[1]
        chosen = (nx % every == every // 2) & (ny % every == every // 2)
    else:
        every = max(1, -(-len(size) // ARROWS**2))
        chosen = np.arange(len(size)) % every == 0
    chosen &= size > 0.01 * largest
    between = np.sqrt(fields.areas.mean() * (every**2 if fields.grid is not None else every))
    ax.quiver(
        *places[chosen].T,
        *vectors[chosen].T,
        angles="xy",
        scale_units="xy",
        scale=largest / (0.95 * between),
        pivot="middle",
        units="xy",
        width=0.12 * between,
        headwidth=4.0,
        headlength=4.0,
        headaxislength=3.5,
        color="white",
        edgecolor="black",
        linewidth=0.4,
    )
