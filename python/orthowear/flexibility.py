"""Flexibility operators."""

from __future__ import annotations

from typing import Any

import numpy as np

from . import _orthowear
from .fields import Array, read_only

#: Default memory limit of a dense matrix, bytes.
MAX_DENSE_BYTES = 1 << 30


class Flexibility:
    """Linear map from tractions on body 2 (force / length^2) in N cells to the change of the gap (length).

    Its matrix S is symmetric positive definite in the inner product weighted by the areas: A S = (A S)^T. A is
    diagonal with the area of each cell three times (`np.repeat(areas, 3)`). If body 1 is rigid, the map gives the
    displacement of body 2 along (x, y, n). If body 2 is rigid, the map gives the displacement of body 1 with the
    opposite sign. In both cases the tractions act on body 2.

    `shape`, `dtype` and `matvec` are the interface of scipy.sparse.linalg.aslinearoperator. Vectors have the shape
    (3 N,), cell by cell.
    """

    dtype = np.dtype(float)

    def __init__(self, core: _orthowear.Flexibility) -> None:
        self._core = core
        cells = read_only(core.places())
        self.points: Array = cells["points"]
        self.areas: Array = cells["areas"]
        self.grid: tuple[int, int] | None = cells["grid"]

    @property
    def shape(self) -> tuple[int, int]:
        """Shape of the matrix, (3 N, 3 N)."""
        return (3 * self._core.cells, 3 * self._core.cells)

    def apply(self, tractions: Any) -> Array:
        """Change of the gap (N, 3) for tractions (N, 3), components along (x, y, n) of each cell."""
        return self._core.apply(np.ascontiguousarray(tractions, dtype=float))

    def matvec(self, tractions: Any) -> Array:
        """Same as `apply`, for vectors (3 N,). A vector contains x, y, n of the first cell, then x, y, n of the second
        cell, and so on.
        """
        return self.apply(np.asarray(tractions, dtype=float).reshape(-1, 3)).ravel()

    def rmatvec(self, values: Any) -> Array:
        """Applies the transpose S^T = A S A^-1. A is diagonal with the area of each cell three times (`np.repeat(areas, 3)`)."""
        weight: Array = np.repeat(self.areas, 3)
        return weight * self.matvec(np.asarray(values, dtype=float).ravel() / weight)

    def to_dense(self, largest: int = MAX_DENSE_BYTES) -> Array:
        """The matrix (3 N, 3 N), computed column by column. Raises ValueError if it takes more than `largest` bytes."""
        n = self.shape[0]
        if 8 * n * n > largest:
            raise ValueError(
                f"the matrix of {n // 3} cells needs {8 * n * n} bytes, but {largest} are allowed; use apply, use fewer cells, or "
                "raise `largest`"
            )
        columns = np.empty((n, n))
        unit = np.zeros(n)
        for k in range(n):
            unit[k] = 1.0
            columns[:, k] = self.matvec(unit)
            unit[k] = 0.0
        return columns
