"""Meshes from objects: of meshio, and of a model in gmsh.

A scene takes them wherever it names a mesh file: `Scene.from_dict({"body1": {"kind": "fe", "mesh": gmsh.model, ...}, ...})`,
`scene.replace({"body1.mesh": mesh})` with a `meshio.Mesh`, the module `gmsh`, `gmsh.model`, or a `Mesh` of this module, which
`from_meshio` and `from_gmsh` make at once. What becomes of an object afterwards changes no scene. Neither package is imported.
"""

from .gmsh_reader import from_gmsh
from .meshio_reader import from_meshio
from .msh import Mesh

__all__ = ["Mesh", "from_gmsh", "from_meshio"]
