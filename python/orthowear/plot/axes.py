"""Axes and units of the plots."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def axes_of(ax: Axes | None) -> Axes:
    if ax is not None:
        return ax
    try:
        from matplotlib import pyplot
    except ImportError as error:
        raise ImportError(
            f"plots need matplotlib, which cannot be imported ({error}); install it with pip install matplotlib"
        ) from error
    return pyplot.subplots(layout="constrained")[1]


def _stress(units: Mapping[str, str]) -> str:
    force, length = units["force"], units["length"]
    return {("N", "mm"): "MPa", ("N", "m"): "Pa"}.get((force, length), f"{force}/{length}\N{SUPERSCRIPT TWO}")


def unit_of(dimension: str, units: Mapping[str, str]) -> str:
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
