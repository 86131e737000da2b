"""Reads meshes from models of gmsh."""

from __future__ import annotations

from typing import Any

import numpy as np

from .msh import ELEMENT_TYPES, NAMES, NO_GROUPS, ElementBlock, Mesh, refuse, type_of


def is_gmsh(model: Any) -> bool:
    return hasattr(model, "getPhysicalGroups") and hasattr(getattr(model, "mesh", None), "getElements")


def from_gmsh(gmsh: Any) -> Mesh:
    """Reads the mesh of the current gmsh model, given as the module `gmsh` or `gmsh.model`.

    As in files written by gmsh, only elements of entities in physical groups are read, in gmsh's order.
    """
    model = getattr(gmsh, "model", gmsh)
    if not is_gmsh(model):
        refuse(f"a {type_of(gmsh)} is neither the module gmsh nor gmsh.model")
    try:
        physical = model.getPhysicalGroups()
        tags, coordinates, _ = model.mesh.getNodes()
        groups: dict[tuple[int, int], set[int]] = {}
        names = {}
        for dim, tag in physical:
            name = model.getPhysicalName(dim, tag)
            if name:
                names[int(dim), abs(int(tag))] = name
            for entity in model.getEntitiesForPhysicalGroup(dim, tag):
                # A negative tag reverses the orientation of the elements. The orientation is not used here.
                groups.setdefault((int(dim), abs(int(entity))), set()).add(abs(int(tag)))
        found = [(entity, *model.mesh.getElements(*entity)) for entity in sorted(groups)]
    except Exception as error:  # gmsh raises plain exceptions
        refuse(f"gmsh failed: {error}; call gmsh.initialize() and create a mesh first, and call gmsh.finalize() afterwards")
    if not len(tags):
        refuse("the current model of gmsh has no mesh: call gmsh.model.mesh.generate(3)")
    if not groups:
        refuse(NO_GROUPS)
    index = np.zeros(int(tags.max()) + 1, dtype=np.int64)
    index[tags] = np.arange(len(tags))
    runs: list[ElementBlock] = []
    for entity, types, _, nodes_of in found:
        for code, nodes in zip(types, nodes_of, strict=True):
            kind = NAMES.get(int(code))
            if kind is None:
                refuse(
                    f"elements of gmsh's type {int(code)} ({model.mesh.getElementProperties(code)[0]}) are not supported; allowed are "
                    f"{', '.join(ELEMENT_TYPES)}: mesh with setOrder(1) or setOrder(2)"
                )
            runs.append((kind, index[nodes].reshape(-1, ELEMENT_TYPES[kind][2]), tuple(sorted(groups[entity]))))
    used = np.zeros(len(tags), dtype=bool)
    for _, nodes, _ in runs:
        used[nodes] = True
    number = np.cumsum(used) - 1
    points = np.asarray(coordinates, dtype=float).reshape(-1, 3)[used]
    return Mesh(points, [(kind, number[nodes], groups) for kind, nodes, groups in runs], names)
