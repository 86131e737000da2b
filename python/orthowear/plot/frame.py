"""Plots of fields on the frame: maps and sections."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from ..fields import Array, Fields
from ..result import Result
from .axes import axes_of, unit_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..scene import Entry

#: Colour map for values from zero, and colour map for signed values.
FROM_ZERO, SIGNED = "viridis", "RdBu_r"
#: Colours of open, sticking and slipping cells (Okabe and Ito 2008).
CONTACT = {"open": "#e6e6e6", "stick": "#0072b2", "slip": "#e69f00"}

#: Largest number of arrows along the longer side of a map.
ARROWS = 16


class _Part(NamedTuple):
    """Values of a field (N,), their label with the unit, and whether they are signed."""

    values: Array
    label: str
    signed: bool


#: For each field: label, dimension of its unit, and components. By default, the first component is shown.
FIELDS: dict[str, tuple[str, str, tuple[str, ...]]] = {
    "pressure": ("pressure", "stress", ()),
    "tractions": ("traction on body 2", "stress", ("tangential", "x", "y", "n")),
    "gap": ("gap", "length", ("n", "x", "y")),
    "slip": ("slip", "length", ("tangential", "x", "y")),
    "wear_depth": ("wear depth", "length", ()),
    "wear_depth_error": ("error of the wear depth", "length", ()),
    "contact": ("contact", "", ()),
}


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
    """Draws a map of a field over the frame, along the frame's x and y from its origin.

    Args:
        name: pressure, tractions, gap, slip, wear_depth, wear_depth_error or contact.
        component: `tractions` have tangential (magnitude along x and y), x, y and n. `slip` has tangential, x and y. `gap` has n, x
            and y. The first component of each list is the default.
        arrows: Whether to draw the directions of tangential magnitudes.
        colorbar: Whether to draw a colour bar with the unit.
        xy: Positions of the cells (N, 2) in the plot, for frames that are not grids. Give positions if the cells of a curved frame
            overlap in its plane. An example is arc length and height on a cylinder.
        options: Options of matplotlib's pcolormesh, such as cmap, vmin and vmax.

    Signed components have a colour map centred at 0. Slip is not drawn in open cells. Cells of frames that are not
    grids are drawn as squares of the same area.
    """
    fields = _fields(of)
    part = _part(fields, name, component)
    places = _places(fields, xy)
    ax = axes_of(ax)
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
    """Draws a field in a row of cells along x or y. `at` is the position of the row on the other axis (default:
    middle).

    name, component, xy: as in `field`. options: options of matplotlib's plot. By default, the label of the line
    gives the position of the row. On frames that are not grids, the cells on the line at `at` are drawn.
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
        # Of two equally near rows, the first row is drawn. Rounding does not change this choice.
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
        raise ValueError(f"at = {wanted:g} is outside the frame, which extends from {across.min():g} to {across.max():g}")
    chosen = chosen[np.argsort(places[chosen, k], kind="stable")]
    ax = axes_of(ax)
    length = fields.units["length"]
    ax.plot(places[chosen, k], part.values[chosen], **{"label": f"{'yx'[k]} = {row:.4g} {length}", **options})
    ax.set(xlabel=f"{along} [{length}]", ylabel=part.label)
    if name == "contact":
        ax.set_yticks([0, 1, 2], list(CONTACT))
    elif part.signed:
        ax.axhline(0.0, color="0.6", linewidth=0.8, zorder=0)
    return ax


def _fields(of: Any) -> Fields:
    found = of if isinstance(of, Fields) else getattr(of, "fields", None)
    if isinstance(found, Fields):
        return found
    if isinstance(of, Result):
        raise ValueError("the result has no fields, because no increment was computed")
    raise TypeError(f"a value of the type {type(of).__name__} cannot be drawn; allowed: a Result, an Entry or Fields")


def _places(fields: Fields, xy: npt.ArrayLike | None) -> Array:
    if xy is None:
        if fields.grid is None:
            normals = fields.axes[:, 2]
            mean = normals.mean(axis=0)
            # For a cylindrical frame over 180°, the normals at its two ends are perpendicular to the mean normal.
            if not (normals @ mean).min() > 0.1 * np.linalg.norm(mean):
                warnings.warn(
                    "the frame is curved so strongly that its cells overlap in its plane; give their positions with xy=, such "
                    "as arc length and height",
                    UserWarning,
                    stacklevel=3,
                )
        return fields.xy
    if fields.grid is not None:
        raise ValueError("xy is not supported: the cells of a grid frame have fixed positions")
    places: Array = np.asarray(xy, dtype=float)
    if places.shape != fields.xy.shape:
        raise ValueError(f"xy has the shape {places.shape}; it must be {fields.xy.shape}, one row for each cell")
    return places


def _part(fields: Fields, name: str, component: str | None) -> _Part:
    if name not in FIELDS:
        raise ValueError(f"field {name!r}: allowed are {', '.join(FIELDS)}")
    words, dimension, components = FIELDS[name]
    if component is not None and component not in components:
        allowed = ", ".join(components) if components else "none, because it is a scalar"
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
        if fields.rolling:
            words, dimension = f"{words} per rolled distance", ""
    label = f"{words} [{unit_of(dimension, fields.units)}]" if dimension else words
    return _Part(values, label, signed=component in ("x", "y"))


def _cells(ax: Axes, fields: Fields, places: Array, values: Array, options: dict[str, Any]) -> Any:
    if fields.grid is not None:
        edges = _edges(fields)
        # If the outline leaves a single row, the positions of the other rows are unknown.
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
    """Cell boundaries of a grid along x and y."""
    centres = [fields._along(axis) for axis in (0, 1)]
    spacing = [(c[-1] - c[0]) / (len(c) - 1) if len(c) > 1 else np.nan for c in centres]
    for k in (0, 1):
        # The width of a single row of cells follows from their area.
        if np.isnan(spacing[k]):
            other = spacing[1 - k]
            spacing[k] = np.sqrt(fields.areas[0]) if np.isnan(other) else fields.areas[0] / other
    x, y = (np.append(c - h / 2, c[-1] + h / 2) for c, h in zip(centres, spacing, strict=True))
    return x, y


def _arrows(ax: Axes, fields: Fields, places: Array, vectors: Array) -> None:
    """Draws arrows at every n-th cell. Arrows are shorter than the distance between them. Vectors below 1 % of the
    largest vector get no arrow.
    """
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
