"""Green's functions."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from . import _orthowear
from .errors import InputError
from .fields import Array
from .scene import NAME


def green(
    material: Mapping[str, Any], angles: Any, *, tilt: float = 0.0, azimuth: float = 0.0, body: int = 1
) -> Array:
    """Surface Green's function Γ(φ) of a half-space, 1 / (force / length^2), shape (..., 3, 3) for angles of shape
    (...).

    A point force F at the origin displaces the surface at distance r in direction φ by Γ(φ) F / r. Rows of Γ belong
    to components of the displacement, columns to components of the force, both along (x, y, n).

    Args:
        material: As in a scene's [materials.NAME].
        angles: φ from x, degrees.
        tilt, azimuth: Fibre direction, degrees, as in `body1.fibre`; tilt from -90 to 90. No effect on isotropic materials.
        body: 1 for the lower half-space, whose outward normal is n. 2 for the upper half-space, into which n points.
    """
    if body not in (1, 2):
        raise ValueError(f"body is {body!r}, but it must be 1 or 2")
    if not isinstance(material, Mapping):
        raise TypeError(
            f"material: {material!r} is of the type {type(material).__name__}; allowed: a dict as in a scene's [materials.NAME], "
            'such as {"model": "isotropic", "E": 210e3, "nu": 0.3}'
        )
    angles = _degrees("angles", angles)
    tilt, azimuth = (float(_degrees(name, value, 0)) for name, value in (("tilt", tilt), ("azimuth", azimuth)))
    if not -90 <= tilt <= 90:
        _refuse(f"tilt: {tilt:g}; allowed: at least -90 and at most 90, degrees")
    half_space: dict[str, Any] = {"kind": "half-space", "material": "material"}
    if material.get("model") != "isotropic":
        half_space["fibre"] = {"tilt": tilt, "azimuth": azimuth}
    scene = {
        "materials": {"material": dict(material)},
        f"body{body}": half_space,
        f"body{3 - body}": {"kind": "rigid"},
        "frame": {"kind": "grid", "half_width": [1.0, 1.0], "cells": [2, 2]},
        "gap": {"kind": "sphere", "radius": 1.0},
        "steps": [{"name": "press", "approach": 0.1}],
    }
    angles = np.radians(angles)
    core = _orthowear.Scene.from_dict(scene, Path(NAME))
    found = core.green(body, np.ascontiguousarray(angles.ravel()))
    return found.reshape(*angles.shape, 3, 3)


def _degrees(name: str, value: Any, dimension: int | None = None) -> Array:
    """Converts `value` to an array of finite numbers. `dimension` is the required number of array dimensions."""
    try:
        found = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        kind = type(value).__name__
        raise TypeError(f"{name}: {value!r} is of the type {kind}; allowed: finite numbers, degrees") from None
    if dimension is not None and found.ndim != dimension:
        _refuse(f"{name}: an array of the shape {found.shape}; allowed: one finite number, degrees")
    if not np.isfinite(found).all():
        wrong = found[~np.isfinite(found)].flat[0]
        _refuse(f"{name}: {wrong}; allowed: finite numbers, degrees")
    return found


def _refuse(message: str) -> None:
    raise InputError(message, exit_code=2, report=f"error: {message}\n")
