"""Scenes and fixtures of the tests."""

import importlib
import os
import platform
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import orthowear

ROOT = Path(__file__).resolve().parents[2]
os.environ.setdefault("ORTHOWEAR_CACHE_LIMIT", "0")


def needed(name: str):
    """Imports a package. If the package is missing, the test is skipped. If all tools are required, the test fails
    instead.
    """
    if name == "gmsh" and (sys.platform, platform.machine()) == ("linux", "aarch64"):
        pytest.skip("gmsh has no Python package for Linux on ARM")
    try:
        return importlib.import_module(name)
    except (ImportError, OSError) as error:  # The gmsh package needs system libraries.
        return missing(f"{name} is missing ({error}): scripts/setup installs it")


def missing(what: str):
    """Skips the test, or fails it if all tools are required."""
    if os.environ.get("ORTHOWEAR_REQUIRE_TOOLS"):
        pytest.fail(what)
    pytest.skip(what)


def small() -> dict:
    """Scene of a rigid sphere of radius 10 mm on steel with friction: 16 x 16 cells, pressed and pushed in 5
    increments.
    """
    return {
        "materials": {"steel": {"model": "isotropic", "E": 210e3, "nu": 0.3}},
        "body1": {"kind": "half-space", "material": "steel"},
        "body2": {"kind": "rigid"},
        "frame": {"kind": "grid", "half_width": [0.4, 0.4], "cells": [16, 16]},
        "gap": {"kind": "sphere", "radius": 10.0},
        "friction": {"law": "coulomb", "mu": 0.3},
        "steps": [
            {"name": "press", "normal_force": 1000.0, "increments": 2},
            {"name": "push", "tangential_force": [100.0, 50.0], "increments": 3},
        ],
        "output": {"fields": ["vtu"]},
    }


@pytest.fixture
def scene():
    return orthowear.Scene.from_dict(small())


@pytest.fixture
def program():
    """Runs the command-line program, which is built from the same sources."""
    path = ROOT / "target" / "release" / ("orthowear.exe" if sys.platform == "win32" else "orthowear")
    found = path if path.exists() else shutil.which("orthowear")
    if found is None:
        missing("the program is not built: cargo build --release")

    def run(*arguments, **more):
        return subprocess.run([found, *map(str, arguments)], capture_output=True, text=True, check=False, **more)

    run.path = found
    return run
