"""Mesh files in a temporary folder, kept while a scene uses them."""

from __future__ import annotations

import atexit
import os
import shutil
import tempfile
import threading
import time
import weakref
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from ..errors import InputError
from .gmsh_reader import from_gmsh, is_gmsh
from .meshio_reader import from_meshio, is_meshio
from .msh import Mesh, refuse, type_of


def _mesh(value: Any) -> Mesh:
    if isinstance(value, Mesh):
        return value
    if is_meshio(value):
        return from_meshio(value)
    if is_gmsh(getattr(value, "model", value)):
        return from_gmsh(value)
    refuse(
        f"a {type_of(value)} is not a mesh; allowed are a path to a .msh file, a meshio.Mesh, the module gmsh or gmsh.model, and an "
        "orthowear.mesh.Mesh"
    )


class MeshFile:
    """A mesh as a file. The file is removed with the last scene that uses it.

    The file name is a hash of the content, so that equal meshes give equal scenes.
    """

    def __init__(self, mesh: Mesh, path: Path) -> None:
        self.mesh = mesh
        self.path = path
        weakref.finalize(self, _remove, path, os.getpid())


# The lock is reentrant, because garbage collection may remove a file while the same thread writes another file.
_lock = threading.RLock()
_files: weakref.WeakValueDictionary[str, MeshFile] = weakref.WeakValueDictionary()
#: Folders by process id: a forked process does not touch the folder of its parent.
_folders: dict[int, Path] = {}


def _folder() -> Path:
    pid = os.getpid()
    if pid not in _folders:
        _clear_stale()
        folder = Path(tempfile.mkdtemp(prefix=PREFIX))
        # Without file locks, the folder must not contain a lock file. Otherwise, other processes would delete the
        # folder as stale.
        if not _try_lock(folder / LOCK):
            (folder / LOCK).unlink(missing_ok=True)
        _folders[pid] = folder
        atexit.register(_clear, pid)
    return _folders[pid]


def _clear(pid: int) -> None:
    if pid == os.getpid():
        shutil.rmtree(_folders[pid], ignore_errors=True)


#: A folder whose lock file is not locked is stale after STALE_AFTER_SECONDS (s), because its process was killed.
PREFIX, LOCK, STALE_AFTER_SECONDS = "orthowear-meshes-", "lock", 60.0


def _try_lock(path: Path) -> bool:
    """Locks a file until the process ends. Returns whether the lock was obtained."""
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
    """Removes the folders of killed processes of the same user."""
    for lock in Path(tempfile.gettempdir()).glob(f"{PREFIX}*/{LOCK}"):
        try:
            stale = time.time() - lock.stat().st_mtime > STALE_AFTER_SECONDS and _try_lock(lock)
        except OSError:
            continue
        if stale:
            shutil.rmtree(lock.parent, ignore_errors=True)


def _remove(path: Path, pid: int) -> None:
    with _lock:
        if pid == os.getpid() and str(path) not in _files:
            path.unlink(missing_ok=True)


def _file(mesh: Mesh) -> MeshFile:
    with _lock:
        path = _folder() / f"{mesh.sha256[:32]}.msh"
        file = _files.get(str(path))
        if file is None:
            file = MeshFile(mesh, path)
            _files[str(path)] = file
            mesh.write(path)
        return file


#: Largest nesting depth that is searched for meshes. Scenes have at most four levels.
DEEPEST = 8


def meshes_to_paths(value: Any, key: str, files: list[MeshFile]) -> Any:
    """Replaces mesh objects in a part of a scene by paths. Appends the files of these meshes to `files`."""
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
        return {k: meshes_to_paths(part, f"{key}.{k}" if key else str(k), files) for k, part in value.items()}
    return value


def _paths(value: Any) -> Iterator[str]:
    if isinstance(value, dict):
        for key, part in value.items():
            if key == "mesh" and isinstance(part, str):
                yield part
            yield from _paths(part)


def mesh_files_of(scene: Mapping[str, Any]) -> tuple[MeshFile, ...]:
    """Files of the meshes in a scene's dict that were made from objects."""
    found = (_files.get(path) for path in set(_paths(scene)))
    return tuple(file for file in found if file is not None)


def paths_to_meshes(value: Any, files: Iterable[MeshFile]) -> Any:
    """Replaces the paths of mesh files in a part of a scene by mesh objects. This is the inverse of `meshes_to_paths`.
    """
    meshes = {str(file.path): file.mesh for file in files}

    def visit(part: Any) -> Any:
        if not isinstance(part, dict):
            return part
        return {
            key: meshes[inner] if key == "mesh" and isinstance(inner, str) and inner in meshes else visit(inner)
            for key, inner in part.items()
        }

    return visit(value)
