"""Reads meshes of meshio."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from .msh import ELEMENT_TYPES, ElementBlock, Groups, Mesh, refuse, type_of

#: Nodes of second-order elements after the corner nodes, in gmsh's order and in VTK's order. meshio uses VTK's order.
#: Each node is given by the corners of its edge, face or solid: node "01" lies between corners 0 and 1.
GMSH_EDGES = {
    "tetra": "01 12 02 03 23 13",
    "hexahedron": "01 03 04 12 15 23 26 37 45 47 56 67",
    "wedge": "01 02 03 12 14 25 34 35 45",
    "pyramid": "01 03 04 12 14 23 24 34",
}
VTK_EDGES = {
    "tetra": "01 12 02 03 13 23",
    "hexahedron": "01 12 23 03 45 56 67 47 04 15 26 37",
    "wedge": "01 12 02 34 45 35 03 14 25",
    "pyramid": "01 12 23 03 04 14 24 34",
}
GMSH_FACES = {"hexahedron27": "0123 0145 0347 1256 2367 4567 01234567"}
VTK_FACES = {"hexahedron27": "0347 1256 0145 2367 0123 4567 01234567"}


def is_meshio(value: Any) -> bool:
    return all(hasattr(value, name) for name in ("points", "cells", "cell_sets", "cell_data", "field_data"))


def from_meshio(mesh: Any) -> Mesh:
    """Reads a `meshio.Mesh` with physical groups.

    The groups are the cell sets of the mesh, and its integer cell data `gmsh:physical` (0: no group) with names
    from `field_data`. Float cell data of 3 or 9 components are fields, for fibres along a field:
    `fibre = {"field": NAME}`. The order of the elements is kept. Nodes of second-order elements must be in meshio's
    order, that is, in the order of VTK.
    """
    if not is_meshio(mesh):
        refuse(f"a {type_of(mesh)} is not a meshio.Mesh with points, cells, cell_sets and cell_data")
    points = np.zeros((len(mesh.points), 3))
    points[:, : np.shape(mesh.points)[1]] = mesh.points
    unknown = sorted({block.type for block in mesh.cells} - set(ELEMENT_TYPES))
    if unknown:
        refuse(f"elements of the type {', '.join(unknown)} are not supported; allowed are {', '.join(ELEMENT_TYPES)}")
    names, sets, per_block = _groups(mesh)
    runs: list[ElementBlock] = []
    for block, places in zip(mesh.cells, per_block, strict=True):
        nodes = np.asarray(block.data, dtype=np.int64)
        wrong = nodes[(nodes < 0) | (nodes >= len(points))]
        if len(wrong):
            refuse(f"an element of the type {block.type} refers to node {wrong[0]}, but the mesh has {len(points)} nodes, counted from 0")
        nodes = _gmsh_order(block.type, nodes, points)
        # Consecutive elements in the same groups form one block.
        ends = np.flatnonzero(np.diff(places)) + 1
        for start, end in zip([0, *ends], [*ends, len(places)], strict=True):
            if end > start:
                runs.append((block.type, nodes[start:end], sets[places[start]]))
    return Mesh(points, runs, names, _fields(mesh))


def _groups(mesh: Any) -> tuple[dict[tuple[int, int], str], list[Groups], list[npt.NDArray[np.int64]]]:
    """Groups of the elements: names of the groups by dimension and tag, all combinations of groups, and an array per
    block. The array contains the index of the combination for each element of the block.
    """
    sets: list[Groups] = [()]
    index: dict[Groups, int] = {(): 0}
    members = [np.zeros(len(block.data), dtype=np.int64) for block in mesh.cells]

    def add(i: int, cells: npt.NDArray[np.int64], tag: int) -> None:
        now = members[i][cells]
        for old in np.unique(now):
            groups = tuple(sorted({*sets[old], tag}))
            if groups not in index:
                index[groups] = len(sets)
                sets.append(groups)
            members[i][cells[now == old]] = index[groups]

    names = {(int(value[1]), int(value[0])): name for name, value in mesh.field_data.items() if np.size(value) == 2}
    taken = set(names)
    for i, given in enumerate(mesh.cell_data.get("gmsh:physical", ())):
        values = np.asarray(given)
        if values.shape != members[i].shape or not np.array_equal(values, np.round(values)):
            refuse("the cell data gmsh:physical must be whole numbers, one for each element")
        values = np.abs(values.astype(np.int64))
        for tag in np.unique(values[values != 0]).tolist():
            add(i, np.flatnonzero(values == tag), tag)
            taken.add((ELEMENT_TYPES[mesh.cells[i].type][1], tag))
    tags = {(dim, name): tag for (dim, tag), name in names.items()}
    for name, chosen in mesh.cell_sets.items():
        # Cell sets with this prefix are meshio's own metadata.
        if name.startswith("gmsh:"):
            continue
        for i, given in enumerate(chosen):
            if given is None or not len(given):
                continue
            cells = np.asarray(given, dtype=np.int64)
            dim = ELEMENT_TYPES[mesh.cells[i].type][1]
            if (dim, name) not in tags:
                tags[dim, name] = next(tag for tag in range(1, len(taken) + 2) if (dim, tag) not in taken)
                taken.add((dim, tags[dim, name]))
            wrong = cells[(cells < 0) | (cells >= len(members[i]))]
            if len(wrong):
                kind = mesh.cells[i].type
                refuse(f"the cell set {name!r} refers to element {wrong[0]}, but there are {len(members[i])} of the type {kind}, counted from 0")
            add(i, cells, tags[dim, name])
    return {(dim, tag): name for (dim, name), tag in tags.items()}, sets, members


def _fields(mesh: Any) -> dict[str, tuple[npt.NDArray[np.int64], npt.NDArray[np.float64]]]:
    """Vector and tensor fields of the solid elements."""
    fields = {}
    firsts = np.cumsum([1, *(len(block.data) for block in mesh.cells)])
    solid = [i for i, block in enumerate(mesh.cells) if ELEMENT_TYPES[block.type][1] == 3 and len(block.data)]
    for name, per_block in mesh.cell_data.items():
        values = [np.asarray(per_block[i]).reshape(len(mesh.cells[i].data), -1) for i in solid]
        if solid and all(part.dtype.kind == "f" and part.shape[1] in (3, 9) for part in values):
            elements = [np.arange(firsts[i], firsts[i + 1]) for i in solid]
            fields[name] = (np.concatenate(elements), np.concatenate(values).astype(float))
    return fields


def _gmsh_order(kind: str, nodes: npt.NDArray[np.int64], points: npt.NDArray[np.float64]) -> npt.NDArray[np.int64]:
    """Nodes of elements, reordered from meshio's to gmsh's order."""
    shape = kind.rstrip("0123456789")
    if kind == shape or shape not in GMSH_EDGES or not len(nodes):
        return nodes
    corners = int(ELEMENT_TYPES[shape][2])
    gmsh = GMSH_EDGES[shape].split() + GMSH_FACES.get(kind, "").split()
    vtk = VTK_EDGES[shape].split() + VTK_FACES.get(kind, "").split()
    order = [*range(corners), *(corners + vtk.index(between) for between in gmsh)]
    order += range(len(order), nodes.shape[1])
    if kind not in ("wedge18", "pyramid14"):
        return nodes[:, order]
    # meshio keeps the order of the file for these types. Therefore, the positions of the nodes decide: in gmsh's order,
    # each mid-edge node lies between the corners of its edge in GMSH_EDGES.
    ends = np.array([[int(corner) for corner in edge] for edge in GMSH_EDGES[shape].split()])

    def off(candidate: npt.NDArray[np.int64]) -> float:
        middles = points[candidate[:, ends]].mean(axis=2)
        return float(np.abs(points[candidate[:, corners : corners + len(ends)]] - middles).sum())

    if off(nodes) <= off(nodes[:, order]):
        return nodes
    if kind == "wedge18":  # Nodes on the quadrilateral faces: 0143 0352 1254 in gmsh, 0143 1254 0352 in VTK.
        order[15:] = [15, 17, 16]
    return nodes[:, order]
