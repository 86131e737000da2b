"""Arrays on the contact frame."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

#: An array of numbers.
Array = npt.NDArray[np.float64]

#: Units of a scene that names none; what stands in their place where it is not known.
UNITS = {"length": "mm", "force": "N"}
UNKNOWN_UNITS = {"length": "length", "force": "force"}


def read_only(arrays: dict[str, Any]) -> dict[str, Any]:
    """The same, none of the arrays writable."""
    for array in arrays.values():
        if isinstance(array, np.ndarray):
            array.flags.writeable = False
    return arrays


class Fields:
    """The fields of an entry in the N cells of the frame, as NumPy arrays.

    points (N, 3): centres of the cells, global axes, length; xy (N, 2): the same along the frame's x, y from its origin.
    areas (N,): length^2. axes (N, 3, 3): the local axes x, y, n of each cell as rows.
    tractions (N, 3): on body 2 along (x, y, n), force / length^2. gap (N, 3): along (x, y, n), length.
    slip (N, 2): slip of the increment along (x, y), length; of rolling per rolled distance.
    contact (N,): 0 open, 1 stick, 2 slip. wear_depth (N,): lost by both bodies, length.
    grid: number of cells along x, y, None where the frame is no grid; places (N,): the cells' places in it, y fastest.
    units: of `length` and `force`. rolling: whether the entry is one of rolling.

    The arrays are what was computed and cannot be written to; `pressure` is a view of `tractions`. Copy to change them.
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
        """(N,): pressure, positive in compression, force / length^2."""
        return self.tractions[:, 2]

    def to_grid(self, values: npt.ArrayLike) -> Array:
        """Values by cell, (N, ...), as (nx, ny, ...); nan where an outline leaves a cell out."""
        if self.grid is None:
            raise ValueError("the frame is no grid")
        values = np.asarray(values)
        full: Array = np.full((self.grid[0] * self.grid[1], *values.shape[1:]), np.nan)
        full[self.places] = values
        shaped: Array = full.reshape(*self.grid, *values.shape[1:])
        return shaped

    def _along(self, axis: int) -> Array:
        """Places of the rows of a grid along an axis, of rows that an outline leaves out too."""
        if self.grid is None:
            raise ValueError("the frame is no grid")
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
        """An xarray.Dataset with dimensions x, y, coordinates along the frame's axes; of grids."""
        import xarray

        coords = {name: self._along(k) for k, name in enumerate(("x", "y"))}
        names = {"tractions": ["x", "y", "n"], "gap": ["x", "y", "n"], "slip": ["x", "y"]}
        data = {}
        for name, components in names.items():
            values = self.to_grid(getattr(self, name))
            for k, component in enumerate(components):
                data[f"{name}_{component}"] = (("x", "y"), values[:, :, k])
        for name in ("contact", "wear_depth", "pressure"):
            data[name] = (("x", "y"), self.to_grid(getattr(self, name)))
        return xarray.Dataset(data, coords)


class FieldAttributes:
    """What has the arrays of its `fields` as attributes of its own."""

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
    grid: tuple[int, int] | None
    places: npt.NDArray[np.int64]

    def to_grid(self, values: npt.ArrayLike) -> Array:
        """As that of the fields."""
        if self.fields is None:
            raise ValueError("no fields: no increment was done")
        return self.fields.to_grid(values)

    def __getattr__(self, name: str) -> Any:
        # Called for what is no attribute of the object's own; by copy and pickle, before it has any.
        fields = self.__dict__.get("fields")
        if fields is None and name in FieldAttributes.__annotations__:
            raise AttributeError(f"{name}: there are no fields, for no increment was done")
        if fields is None or name.startswith("_") or not hasattr(fields, name):
            raise AttributeError(f"{type(self).__name__} has no attribute {name!r}")
        return getattr(fields, name)

    def __dir__(self) -> list[str]:
        return sorted({*super().__dir__(), *FieldAttributes.__annotations__})
