"""Green's functions."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from . import _orthowear
from .scene import NAME


def green(
    material: Mapping[str, Any], angles: Any, *, tilt: float = 0.0, azimuth: float = 0.0, body: int = 1
) -> np.ndarray:
    """Surface Green's function of a half-space, Γ(φ), 1 / (force / length^2), (..., 3, 3) for angles of the shape (...).

    A point force F at the origin moves the surface at the distance r in the direction φ by Γ(φ) F / r; rows are components of
    the displacement, columns of the force, along (x, y, n).
    material: as in a scene's [materials.NAME]. angles: φ from x, degrees. tilt, azimuth: direction of the fibre, degrees, as in
    `body1.fibre`; for materials that are not isotropic. body: 1 for the lower half-space, n being its outward normal; 2 for
    the upper one, into which n points.
    """
    if body not in (1, 2):
        raise ValueError(f"body {body!r}: it is 1 or 2")
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
    angles = np.radians(np.asarray(angles, dtype=float))
    core = _orthowear.Scene.from_dict(scene, Path(NAME))
    found = core.green(body, np.ascontiguousarray(angles.ravel()))
    return found.reshape(*angles.shape, 3, 3)
