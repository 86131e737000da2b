"""Arrays on the contact frame."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

#: Default units of a scene.
UNITS = {"length": "mm", "force": "N"}
#: Placeholders for unknown units.
UNKNOWN_UNITS = {"length": "length", "force": "force"}


def read_only(arrays: dict[str, Any]) -> dict[str, Any]:
    """Makes all arrays of the dict read-only, and returns the dict."""
    for array in arrays.values():
        if isinstance(array, np.ndarray):
            array.flags.writeable = False
    return arrays


class Fields:
    """Fields of an entry in the N cells of the frame, as NumPy arrays.

    Attributes:
        points (N, 3): centres of the cells in global axes, length.
        xy (N, 2): centres along the frame's x, y from its origin, length.
        areas (N,): areas of the cells, length^2.
        axes (N, 3, 3): local axes x, y, n of each cell as rows.
        tractions (N, 3): tractions on body 2 along (x, y, n), force / length^2.
        gap (N, 3): gap along (x, y, n), length.
        slip (N, 2): slip of the increment along (x, y), length; in rolling, slip per rolled distance.
        contact (N,): 0 open, 1 stick, 2 slip.
        wear_depth (N,): wear depth, sum over both bodies, length.
        wear_depth_error (N,): estimated error of the wear depth, length.
        grid: number of cells along x, y, or None if the frame is not a grid.
        places (N,): grid index of each cell, y fastest.
        units: names of the units of `length` and `force`.
        rolling: whether the entry belongs to a rolling step.

    The arrays are read-only. Copy them to change values. `pressure` is a view of `tractions`.
    """

    points: Array
    xy: Array
    areas: Array
    axes: Array
    tractions: Array
    gap: Array
    slip: Array
    contact: npt.NDArray[np.uint8]
    wear_depth: Array
    wear_depth_error: Array
    grid: tuple[int, int] | None
    places: npt.NDArray[np.int64]
    units: dict[str, str]
    rolling: bool

    def __init__(
        self, arrays: dict[str, Any], units: Mapping[str, str] | None = None, *, rolling: bool = False
    ) -> None:
        self.__setstate__({**arrays, "units": {**UNITS, **(units or {})}, "rolling": rolling})

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(read_only(state))

    @property
    def pressure(self) -> Array:
        """Pressure (N,), positive in compression, force / length^2."""
        return self.tractions[:, 2]

    def to_grid(self, values: npt.ArrayLike) -> Array:
        """Reshapes values per cell from (N, ...) to (nx, ny, ...). Cells outside of an outline are NaN."""
        if self.grid is None:
            raise ValueError("the frame is not a grid")
        values = np.asarray(values)
        full: Array = np.full((self.grid[0] * self.grid[1], *values.shape[1:]), np.nan)
        full[self.places] = values
        shaped: Array = full.reshape(*self.grid, *values.shape[1:])
        return shaped

    def _along(self, axis: int) -> Array:
        """Positions of all rows of a grid along an axis, including rows outside of the outline. If only one row has
        cells, the positions of the other rows are unknown (NaN).
        """
        if self.grid is None:
            raise ValueError("the frame is not a grid")
        rows = self.places // self.grid[1] if axis == 0 else self.places % self.grid[1]
        known, first = np.unique(rows, return_index=True)
        at = self.xy[first, axis]
        places = np.arange(self.grid[axis])
        if len(known) < 2:
            return np.where(places == known[0], at[0], np.nan)
        spacing = (at[-1] - at[0]) / (known[-1] - known[0])
        filled: Array = at[0] + (places - known[0]) * spacing
        filled[known] = at
        return filled

    def to_xarray(self) -> Any:
        """Returns an xarray.Dataset with dimensions x, y and coordinates along the frame's axes. Grids only."""
        import xarray

        coords = {name: self._along(k) for k, name in enumerate(("x", "y"))}
        names = {"tractions": ["x", "y", "n"], "gap": ["x", "y", "n"], "slip": ["x", "y"]}
        data = {}
        for name, components in names.items():
            values = self.to_grid(getattr(self, name))
            for k, component in enumerate(components):
                data[f"{name}_{component}"] = (("x", "y"), values[:, :, k])
        for name in ("contact", "wear_depth", "wear_depth_error", "pressure"):
            data[name] = (("x", "y"), self.to_grid(getattr(self, name)))
        return xarray.Dataset(data, coords)


class FieldAttributes:
    """Base class that exposes the arrays of its `fields` as its own attributes."""

    fields: Fields | None
    points: Array
    xy: Array
    areas: Array
    axes: Array
    tractions: Array
    pressure: Array
    gap: Array
    slip: Array
    contact: npt.NDArray[np.uint8]
    wear_depth: Array
    wear_depth_error: Array
    grid: tuple[int, int] | None
    places: npt.NDArray[np.int64]

    def to_grid(self, values: npt.ArrayLike) -> Array:
        """Same as `Fields.to_grid`."""
        if self.fields is None:
            raise ValueError("there are no fields, because no increment was computed")
        return self.fields.to_grid(values)

    def __getattr__(self, name: str) -> Any:
        # `copy` and `pickle` call this method before the object has attributes.
        fields = self.__dict__.get("fields")
        if fields is None and name in FieldAttributes.__annotations__:
            raise AttributeError(f"{name}: there are no fields, because no increment was computed")
        if fields is None or name.startswith("_") or not hasattr(fields, name):
            raise AttributeError(f"{type(self).__name__} has no attribute {name!r}")
        return getattr(fields, name)

    def __dir__(self) -> list[str]:
        return sorted({*super().__dir__(), *FieldAttributes.__annotations__})
