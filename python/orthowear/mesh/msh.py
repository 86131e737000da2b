"""Meshes with named groups as .msh files."""

from __future__ import annotations

import hashlib
import os
import struct
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
import numpy.typing as npt

from ..errors import InputError

#: Element types by their names in meshio: gmsh's type number, dimension, number of nodes.
ELEMENT_TYPES: dict[str, tuple[int, int, int]] = {
    "vertex": (15, 0, 1),
    "line": (1, 1, 2),
    "line3": (8, 1, 3),
    "triangle": (2, 2, 3),
    "triangle6": (9, 2, 6),
    "quad": (3, 2, 4),
    "quad8": (16, 2, 8),
    "quad9": (10, 2, 9),
    "tetra": (4, 3, 4),
    "tetra10": (11, 3, 10),
    "hexahedron": (5, 3, 8),
    "hexahedron20": (17, 3, 20),
    "hexahedron27": (12, 3, 27),
    "wedge": (6, 3, 6),
    "wedge15": (18, 3, 15),
    "wedge18": (13, 3, 18),
    "pyramid": (7, 3, 5),
    "pyramid13": (19, 3, 13),
    "pyramid14": (14, 3, 14),
}
NAMES = {code: name for name, (code, _, _) in ELEMENT_TYPES.items()}

Groups = tuple[int, ...]
#: Elements of one type in the same groups: type, nodes (n, k) counted from 0 in gmsh's order, and tags of the
#: groups.
ElementBlock = tuple[str, npt.NDArray[np.int64], Groups]


NO_GROUPS = (
    "the mesh has no physical groups: groups name the contact surface and the supports. Create "
    "them in gmsh (addPhysicalGroup), as cell sets of meshio, or as meshio's cell data gmsh:physical"
)


def refuse(message: str) -> NoReturn:
    raise InputError(message, exit_code=2, report=f"error: {message}\n")


def type_of(value: Any) -> str:
    kind = type(value)
    return kind.__name__ if kind.__module__ == "builtins" else f"{kind.__module__}.{kind.__name__}"


class Mesh:
    """A mesh with named groups, as a .msh file of version 4.1. Meshes are equal if their files are equal.

    `groups` is the number of elements of each physical group by dimension and name. `n_nodes` and `n_solids` count the nodes
    and the elements of dimension 3. `sha256` is the hash of the file.
    """

    __slots__ = ("_content", "groups", "n_nodes", "n_solids", "sha256")

    groups: dict[tuple[int, str], int]
    n_nodes: int
    n_solids: int
    sha256: str

    def __init__(
        self,
        points: npt.NDArray[np.float64],
        runs: list[ElementBlock],
        names: Mapping[tuple[int, int], str],
        fields: Mapping[str, tuple[npt.NDArray[np.int64], npt.NDArray[np.float64]]] | None = None,
    ) -> None:
        """Makes a mesh from nodes, elements, groups and fields.

        Args:
            points (N, 3): positions of the nodes, length.
            runs: blocks of elements.
            names: names of the groups by dimension and tag.
            fields: element numbers (from 1) and values of each field, by the name of the field.
        """
        self.groups = {}
        for kind, nodes, groups in runs:
            dim = ELEMENT_TYPES[kind][1]
            for tag in groups:
                name = names.get((dim, tag), str(tag))
                self.groups[dim, name] = self.groups.get((dim, name), 0) + len(nodes)
        dims = {ELEMENT_TYPES[kind][1] for kind, nodes, _ in runs if len(nodes)}
        if not dims & {2, 3}:
            found = "no elements" if not dims else "only points and lines"
            refuse(f'the mesh has {found}: a body is made of solids, or of a closed surface where kind = "be"')
        if not self.groups:
            refuse(NO_GROUPS)
        for name in [*(name for _, name in self.groups), *(fields or {})]:
            if not name or '"' in name or any(ord(letter) < 32 for letter in name):
                refuse(f"the name {name!r} is not allowed: names of groups and fields must not be empty or contain quotation marks or control characters")
        self.n_nodes = len(points)
        self.n_solids = sum(len(nodes) for kind, nodes, _ in runs if ELEMENT_TYPES[kind][1] == 3)
        self._content = b"".join(_sections(points, runs, names, fields or {}))
        self.sha256 = hashlib.sha256(self._content).hexdigest()

    def write(self, path: str | os.PathLike[str]) -> None:
        """Writes the file."""
        Path(path).write_bytes(self._content)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Mesh) and self.sha256 == other.sha256

    def __hash__(self) -> int:
        return hash(self.sha256)

    def __repr__(self) -> str:
        names = ", ".join(repr(name) for _, name in self.groups)
        return f"<orthowear.mesh.Mesh: {self.n_nodes} nodes, {self.n_solids} solids, groups {names}>"


def _sections(
    points: npt.NDArray[np.float64],
    runs: list[ElementBlock],
    names: Mapping[tuple[int, int], str],
    fields: Mapping[str, tuple[npt.NDArray[np.int64], npt.NDArray[np.float64]]],
) -> Iterator[bytes]:
    """Sections of a binary .msh file of version 4.1, in the byte order of the machine."""
    yield b"$MeshFormat\n4.1 1 8\n" + struct.pack("=i", 1) + b"\n$EndMeshFormat\n"
    lines = [f'{dim} {tag} "{name}"\n' for (dim, tag), name in sorted(names.items())]
    yield f"$PhysicalNames\n{len(lines)}\n{''.join(lines)}$EndPhysicalNames\n".encode()

    # In the file, elements belong to the groups of their entity. Each combination of groups therefore becomes one
    # entity.
    entities: list[dict[Groups, int]] = [{}, {}, {}, {}]
    for kind, _, groups in runs:
        of_dim = entities[ELEMENT_TYPES[kind][1]]
        of_dim.setdefault(groups, len(of_dim) + 1)
    box = [*points.min(axis=0), *points.max(axis=0)]
    yield b"$Entities\n" + struct.pack("=4Q", *map(len, entities))
    for dim, of_dim in enumerate(entities):
        for groups, tag in of_dim.items():
            yield struct.pack("=i", tag) + struct.pack("=3d" if dim == 0 else "=6d", *box[: 3 if dim == 0 else 6])
            yield struct.pack(f"=Q{len(groups)}i", len(groups), *groups) + (struct.pack("=Q", 0) if dim else b"")
    yield b"\n$EndEntities\n"

    n = len(points)
    of_nodes = max(dim for dim in range(4) if entities[dim])
    yield b"$Nodes\n" + struct.pack("=4Q3iQ", 1, n, 1, n, of_nodes, 1, 0, n)
    yield np.arange(1, n + 1, dtype=np.uint64).tobytes() + points.astype(np.float64).tobytes() + b"\n$EndNodes\n"

    n = sum(len(nodes) for _, nodes, _ in runs)
    yield b"$Elements\n" + struct.pack("=4Q", len(runs), n, 1, n)
    first = 1
    for kind, nodes, groups in runs:
        code, dim, _ = ELEMENT_TYPES[kind]
        yield struct.pack("=3iQ", dim, entities[dim][groups], code, len(nodes))
        yield np.column_stack([np.arange(first, first + len(nodes)), nodes + 1]).astype(np.uint64).tobytes()
        first += len(nodes)
    yield b"\n$EndElements\n"

    for name, (elements, values) in fields.items():
        k = values.shape[1]
        yield f'$ElementData\n1\n"{name}"\n1\n0.0\n3\n0\n{k}\n{len(elements)}\n'.encode()
        row = np.dtype([("element", "=i4"), ("values", "=f8", (k,))])
        rows = np.empty(len(elements), dtype=row)
        rows["element"], rows["values"] = elements, values
        yield rows.tobytes() + b"\n$EndElementData\n"
