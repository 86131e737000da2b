"""Meshes from objects of meshio and gmsh.

A scene accepts a mesh object in place of the path of a mesh file:
`Scene.from_dict({"body1": {"kind": "fe", "mesh": gmsh.model, ...}, ...})`, `scene.replace({"body1.mesh": mesh})`.
The object is a `meshio.Mesh`, the module `gmsh`, `gmsh.model`, or a `Mesh` of this module, made by `from_meshio` or
`from_gmsh`. Later changes of the object do not change the scene. This module imports neither meshio nor gmsh.
"""

from .gmsh_reader import from_gmsh
from .meshio_reader import from_meshio
from .msh import Mesh

__all__ = ["Mesh", "from_gmsh", "from_meshio"]
