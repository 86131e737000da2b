"""Frictional contact and wear of orthotropic bodies: finite elements and half-spaces coupled on a contact frame.

A scene is read (`Scene.load`), made (`Scene.from_dict`) and changed (`Scene.replace`), then run (`Scene.run`,
`Scene.steps`). Meshes of bodies may be objects of meshio and gmsh (`mesh`). `plot` draws results with matplotlib.

Numbers are in the scene's own units, by default N, mm, MPa. Angles in scenes are degrees. Tractions act on body 2,
the upper body. Forces and moments in summaries and entries act on body 1. Components are along (x, y, n); n is the
outward normal of body 1.
"""

from . import mesh, plot, study
from ._orthowear import __version__
from .errors import (
    InputError,
    InterruptedRunError,
    NotConvergedError,
    NotConvergedWarning,
    NumericalError,
    OrthowearError,
    ResourcesError,
)
from .fields import Fields
from .flexibility import Flexibility
from .green import green
from .result import Entries, Result
from .scene import Entry, Scene, Steps

__all__ = [
    "Entries",
    "Entry",
    "Fields",
    "Flexibility",
    "InputError",
    "InterruptedRunError",
    "NotConvergedError",
    "NotConvergedWarning",
    "NumericalError",
    "OrthowearError",
    "ResourcesError",
    "Result",
    "Scene",
    "Steps",
    "__version__",
    "green",
    "mesh",
    "plot",
    "study",
]
