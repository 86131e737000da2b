"""Meshes from objects: of meshio, and of a model in gmsh.

A scene takes them wherever it names a mesh file: `Scene.from_dict({"body1": {"kind": "fe", "mesh": gmsh.model, ...}, ...})`,
`scene.replace({"body1.mesh": mesh})` with a `meshio.Mesh`, the module `gmsh`, `gmsh.model`, or a `Mesh` of this module, which
`from_meshio` and `from_gmsh` make at once. What becomes of an object afterwards changes no scene. Neither package is imported.
"""

from __future__ import annotations

import atexit
import hashlib
import os
import shutil
import struct
import tempfile
import threading
import time
import weakref
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
import numpy.typing as npt

from .errors import InputError

__all__ = ["Mesh", "from_gmsh", "from_meshio"]

#: Element types by their names in meshio: gmsh's type number, dimension, number of nodes.
KINDS: dict[str, tuple[int, int, int]] = {
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
NAMES = {code: name for name, (code, _, _) in KINDS.items()}

#: The corners that each node beyond the corners lies between, in gmsh's order and in VTK's, which is meshio's.
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

Groups = tuple[int, ...]
#: Elements of one type in the same groups: type, nodes (n, k) from 0 in gmsh's order, tags of the groups.
Run = tuple[str, npt.NDArray[np.int64], Groups]


def _refuse(message: str) -> NoReturn:
    raise InputError(message, exit_code=2, report=f"error: {message}\n")


class Mesh:
    """A mesh with named groups, as a .msh file of version 4.1; equal where the files are.

    `groups` has the number of elements of each physical group by dimension and name, `n_nodes` and `n_solids` count the nodes
    and the elements of dimension 3, `sha256` is the file's.
    """

    __slots__ = ("_content", "groups", "n_nodes", "n_solids", "sha256")

    groups: dict[tuple[int, str], int]
    n_nodes: int
    n_solids: int
    sha256: str

    def __init__(
        self,
        points: npt.NDArray[np.float64],
        runs: list[Run],
        names: Mapping[tuple[int, int], str],
        fields: Mapping[str, tuple[npt.NDArray[np.int64], npt.NDArray[np.float64]]] | None = None,
    ) -> None:
        """points (N, 3): length. names: of groups by dimension and tag. fields: by name, element numbers from 1 and values."""
        self.groups = {}
        for kind, nodes, groups in runs:
            dim = KINDS[kind][1]
            for tag in groups:
                name = names.get((dim, tag), str(tag))
                self.groups[dim, name] = self.groups.get((dim, name), 0) + len(nodes)
        dims = {KINDS[kind][1] for kind, nodes, _ in runs if len(nodes)}
        if not dims & {2, 3}:
            found = "no elements" if not dims else "only points and lines"
            _refuse(f"the mesh has {found}: a body is made of solids, or of a closed surface where kind = \"be\"")
        if not self.groups:
            _refuse(
                "the mesh has no physical groups: the contact surface and supports are named by groups; give them names in gmsh "
                "(addPhysicalGroup), as cell sets of meshio, or as its cell data gmsh:physical"
            )
        for name in [*(name for _, name in self.groups), *(fields or {})]:
            if not name or '"' in name or any(ord(letter) < 32 for letter in name):
                _refuse(f"the name {name!r}: names of groups and fields have a letter and no quotation marks or line ends")
        self.n_nodes = len(points)
        self.n_solids = sum(len(nodes) for kind, nodes, _ in runs if KINDS[kind][1] == 3)
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
    runs: list[Run],
    names: Mapping[tuple[int, int], str],
    fields: Mapping[str, tuple[npt.NDArray[np.int64], npt.NDArray[np.float64]]],
) -> Iterator[bytes]:
    """The sections of a binary .msh file of version 4.1, in the byte order of the machine."""
    yield b"$MeshFormat\n4.1 1 8\n" + struct.pack("=i", 1) + b"\n$EndMeshFormat\n"
    lines = [f'{dim} {tag} "{name}"\n' for (dim, tag), name in sorted(names.items())]
    yield f"$PhysicalNames\n{len(lines)}\n{''.join(lines)}$EndPhysicalNames\n".encode()

    # An entity for each set of groups: elements have their groups from it.
    entities: list[dict[Groups, int]] = [{}, {}, {}, {}]
    for kind, _, groups in runs:
        of_dim = entities[KINDS[kind][1]]
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
        code, dim, _ = KINDS[kind]
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


# -- meshio


def from_meshio(mesh: Any) -> Mesh:
    """A `meshio.Mesh` with physical groups.

    Groups are its cell sets, and its integer cell data `gmsh:physical` (0: none) with the names that `field_data` has for them.
    Float cell data of 3 or 9 components are fields, which fibres may follow: `fibre = {"field": NAME}`. Order and nodes of the
    elements are kept, of second order too (nodes in meshio's order, that of VTK).
    """
    if not _is_meshio(mesh):
        _refuse(f"a {_type(mesh)} is no meshio.Mesh: it has points, cells, cell_sets and cell_data")
    points = np.zeros((len(mesh.points), 3))
    points[:, : np.shape(mesh.points)[1]] = mesh.points
    unknown = sorted({block.type for block in mesh.cells} - set(KINDS))
    if unknown:
        _refuse(f"elements of the type {', '.join(unknown)} are not read; allowed are {', '.join(KINDS)}")
    names, sets, per_block = _groups_of_meshio(mesh)
    runs: list[Run] = []
    for block, places in zip(mesh.cells, per_block, strict=True):
        nodes = np.asarray(block.data, dtype=np.int64)
        wrong = nodes[(nodes < 0) | (nodes >= len(points))]
        if len(wrong):
            _refuse(f"an element of the type {block.type} names the node {wrong[0]}, but the mesh has {len(points)}, from 0")
        nodes = _gmsh_order(block.type, nodes, points)
        # Runs of the same groups: the order of the elements stays.
        ends = np.flatnonzero(np.diff(places)) + 1
        for start, end in zip([0, *ends], [*ends, len(places)], strict=True):
            if end > start:
                runs.append((block.type, nodes[start:end], sets[places[start]]))
    return Mesh(points, runs, names, _fields_of_meshio(mesh))


def _groups_of_meshio(mesh: Any) -> tuple[dict[tuple[int, int], str], list[Groups], list[npt.NDArray[np.int64]]]:
    """Names by dimension and tag; sets of groups; which of these each element of each block is in."""
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
            _refuse("the cell data gmsh:physical are no whole numbers, one for each element")
        values = np.abs(values.astype(np.int64))
        for tag in np.unique(values[values != 0]).tolist():
            add(i, np.flatnonzero(values == tag), tag)
            taken.add((KINDS[mesh.cells[i].type][1], tag))
    tags = {(dim, name): tag for (dim, tag), name in names.items()}
    for name, chosen in mesh.cell_sets.items():
        # Those are meshio's own notes.
        if name.startswith("gmsh:"):
            continue
        for i, given in enumerate(chosen):
            if given is None or not len(given):
                continue
            cells = np.asarray(given, dtype=np.int64)
            dim = KINDS[mesh.cells[i].type][1]
            if (dim, name) not in tags:
                tags[dim, name] = next(tag for tag in range(1, len(taken) + 2) if (dim, tag) not in taken)
                taken.add((dim, tags[dim, name]))
            wrong = cells[(cells < 0) | (cells >= len(members[i]))]
            if len(wrong):
                kind = mesh.cells[i].type
                _refuse(f"the cell set {name!r} names the element {wrong[0]} of {len(members[i])} of the type {kind}, from 0")
            add(i, cells, tags[dim, name])
    return {(dim, tag): name for (dim, name), tag in tags.items()}, sets, members


def _fields_of_meshio(mesh: Any) -> dict[str, tuple[npt.NDArray[np.int64], npt.NDArray[np.float64]]]:
    """Vectors and tensors of the solids."""
    fields = {}
    firsts = np.cumsum([1, *(len(block.data) for block in mesh.cells)])
    solid = [i for i, block in enumerate(mesh.cells) if KINDS[block.type][1] == 3 and len(block.data)]
    for name, per_block in mesh.cell_data.items():
        values = [np.asarray(per_block[i]).reshape(len(mesh.cells[i].data), -1) for i in solid]
        if solid and all(part.dtype.kind == "f" and part.shape[1] in (3, 9) for part in values):
            elements = [np.arange(firsts[i], firsts[i + 1]) for i in solid]
            fields[name] = (np.concatenate(elements), np.concatenate(values).astype(float))
    return fields


def _gmsh_order(kind: str, nodes: npt.NDArray[np.int64], points: npt.NDArray[np.float64]) -> npt.NDArray[np.int64]:
    """Nodes of elements in gmsh's order."""
    shape = kind.rstrip("0123456789")
    if kind == shape or shape not in GMSH_EDGES or not len(nodes):
        return nodes
    corners = int(KINDS[shape][2])
    gmsh = GMSH_EDGES[shape].split() + GMSH_FACES.get(kind, "").split()
    vtk = VTK_EDGES[shape].split() + VTK_FACES.get(kind, "").split()
    order = [*range(corners), *(corners + vtk.index(between) for between in gmsh)]
    order += range(len(order), nodes.shape[1])
    if kind not in ("wedge18", "pyramid14"):
        return nodes[:, order]
    # meshio leaves these as its formats have them: in the order in which their edges' nodes lie between the corners.
    ends = np.array([[int(corner) for corner in edge] for edge in GMSH_EDGES[shape].split()])

    def off(candidate: npt.NDArray[np.int64]) -> float:
        middles = points[candidate[:, ends]].mean(axis=2)
        return float(np.abs(points[candidate[:, corners : corners + len(ends)]] - middles).sum())

    if off(nodes) <= off(nodes[:, order]):
        return nodes
    if kind == "wedge18":  # the nodes of the sides, too: 0143 0352 1254, of VTK 0143 1254 0352
        order[15:] = [15, 17, 16]
    return nodes[:, order]


# -- gmsh


def from_gmsh(gmsh: Any) -> Mesh:
    """The current model of gmsh, meshed: the module `gmsh` or `gmsh.model`.

    As in the files that gmsh writes the elements of entities in physical groups are taken, in gmsh's order.
    """
    model = getattr(gmsh, "model", gmsh)
    if not _is_gmsh(model):
        _refuse(f"a {_type(gmsh)} is not the module gmsh, nor gmsh.model")
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
                groups.setdefault((int(dim), int(entity)), set()).add(abs(int(tag)))
        found = [(entity, *model.mesh.getElements(*entity)) for entity in sorted(groups)]
    except InputError:
        raise
    except Exception as error:  # gmsh raises plain exceptions
        _refuse(f"gmsh says: {error}; call gmsh.initialize() and make a mesh before, and gmsh.finalize() after")
    if not len(tags):
        _refuse("the current model of gmsh has no mesh: call gmsh.model.mesh.generate(3)")
    index = np.zeros(int(tags.max()) + 1, dtype=np.int64)
    index[tags] = np.arange(len(tags))
    runs: list[Run] = []
    for entity, types, _, nodes_of in found:
        for code, nodes in zip(types, nodes_of, strict=True):
            kind = NAMES.get(int(code))
            if kind is None:
                _refuse(
                    f"elements of gmsh's type {int(code)} ({model.mesh.getElementProperties(code)[0]}) are not read; allowed are "
                    f"{', '.join(KINDS)}: mesh with setOrder(1) or setOrder(2)"
                )
            runs.append((kind, index[nodes].reshape(-1, KINDS[kind][2]), tuple(sorted(groups[entity]))))
    used = np.zeros(len(tags), dtype=bool)
    for _, nodes, _ in runs:
        used[nodes] = True
    number = np.cumsum(used) - 1
    points = np.asarray(coordinates, dtype=float).reshape(-1, 3)[used]
    return Mesh(points, [(kind, number[nodes], groups) for kind, nodes, groups in runs], names)


def _is_meshio(value: Any) -> bool:
    return all(hasattr(value, name) for name in ("points", "cells", "cell_sets", "cell_data", "field_data"))


def _is_gmsh(model: Any) -> bool:
    return hasattr(model, "getPhysicalGroups") and hasattr(getattr(model, "mesh", None), "getElements")


def _type(value: Any) -> str:
    kind = type(value)
    return kind.__name__ if kind.__module__ == "builtins" else f"{kind.__module__}.{kind.__name__}"


def _mesh(value: Any) -> Mesh:
    if isinstance(value, Mesh):
        return value
    if _is_meshio(value):
        return from_meshio(value)
    if _is_gmsh(getattr(value, "model", value)):
        return from_gmsh(value)
    _refuse(
        f"a {_type(value)} is no mesh: allowed are a path to a .msh file, a meshio.Mesh, the module gmsh or gmsh.model, and an "
        "orthowear.mesh.Mesh"
    )


# -- Files of a temporary folder, each as long as a scene uses it


class File:
    """A mesh as a file, which goes with the last scene that uses it; named by its content, so that equal meshes give equal scenes."""

    def __init__(self, mesh: Mesh, path: Path) -> None:
        self.mesh = mesh
        self.path = path
        weakref.finalize(self, _remove, path, os.getpid())


# Collecting garbage may remove a file while another one is made.
_lock = threading.RLock()
_files: weakref.WeakValueDictionary[str, File] = weakref.WeakValueDictionary()
#: By process: a forked one leaves its parent's alone.
_folders: dict[int, Path] = {}


def _folder() -> Path:
    pid = os.getpid()
    if pid not in _folders:
        _clear_stale()
        folder = Path(tempfile.mkdtemp(prefix=PREFIX))
        # Where there are no locks the folder has no such file, so that nobody takes it for stale.
        if not _is_locked(folder / LOCK):
            (folder / LOCK).unlink(missing_ok=True)
        _folders[pid] = folder
        atexit.register(_clear, pid)
    return _folders[pid]


def _clear(pid: int) -> None:
    if pid == os.getpid():
        shutil.rmtree(_folders[pid], ignore_errors=True)


#: Folders have a file that their process keeps locked; without the lock, and after a while, they are those of one that was killed.
PREFIX, LOCK, WHILE = "orthowear-meshes-", "lock", 60.0


def _is_locked(path: Path) -> bool:
    """Locks a file for the life of the process; whether it could be."""
    try:
        import fcntl
    except ImportError:
        return False
    file = os.open(path, os.O_RDWR | os.O_CREAT, 0o600)
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        os.close(file)
        return False
    return True


def _clear_stale() -> None:
    """Removes the folders of processes of the same user that were killed."""
    for lock in Path(tempfile.gettempdir()).glob(f"{PREFIX}*/{LOCK}"):
        try:
            stale = time.time() - lock.stat().st_mtime > WHILE and _is_locked(lock)
        except OSError:
            continue
        if stale:
            shutil.rmtree(lock.parent, ignore_errors=True)


def _remove(path: Path, pid: int) -> None:
    with _lock:
        if pid == os.getpid() and str(path) not in _files:
            path.unlink(missing_ok=True)


def _file(mesh: Mesh) -> File:
    with _lock:
        path = _folder() / f"{mesh.sha256[:32]}.msh"
        file = _files.get(str(path))
        if file is None:
            file = File(mesh, path)
            _files[str(path)] = file
            mesh.write(path)
        return file


#: Tables inside each other that are looked through for meshes; those of a scene are at most four.
DEEPEST = 8


def placed(value: Any, key: str, files: list[File]) -> Any:
    """A part of a scene with paths in place of meshes, whose files are appended."""
    name = key.rpartition(".")[2]
    if name == "mesh" and value is not None and not isinstance(value, str | os.PathLike):
        try:
            files.append(_file(_mesh(value)))
        except InputError as error:
            message = f"{key}: {error}"
            mistake = {"key": key, "message": str(error), "mend": "", "line": None}
            raise InputError(message, exit_code=2, mistakes=[mistake], report=f"error: {message}\n") from None
        return str(files[-1].path)
    if isinstance(value, dict) and key.count(".") < DEEPEST:
        return {k: placed(part, f"{key}.{k}" if key else str(k), files) for k, part in value.items()}
    return value


def _paths(value: Any) -> Iterator[str]:
    if isinstance(value, dict):
        for key, part in value.items():
            if key == "mesh" and isinstance(part, str):
                yield part
            yield from _paths(part)


def held(scene: Mapping[str, Any]) -> tuple[File, ...]:
    """The files of meshes that a scene's dict names."""
    found = (_files.get(path) for path in set(_paths(scene)))
    return tuple(file for file in found if file is not None)


def with_meshes(value: Any, files: Iterable[File]) -> Any:
    """A part of a scene with meshes in place of the paths of their files; the reverse of `placed`."""
    meshes = {str(file.path): file.mesh for file in files}

    def visit(part: Any) -> Any:
        if not isinstance(part, dict):
            return part
        return {
            key: meshes[inner] if key == "mesh" and isinstance(inner, str) and inner in meshes else visit(inner)
            for key, inner in part.items()
        }

    return visit(value)
