"""Scenes and their runs."""

from __future__ import annotations

import operator
import os
import reprlib
import warnings
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from . import _orthowear
from .errors import NotConvergedWarning
from .fields import FieldAttributes, Fields
from .flexibility import Flexibility
from .mesh import files as meshes
from .result import Result

#: Name of a scene in messages, if the scene was not read from a file.
NAME = "scene"


def _wrong(name: str, value: object, allowed: str) -> TypeError:
    return TypeError(f"{name}: {reprlib.repr(value)} is of the type {type(value).__name__}; allowed: {allowed}")


def _settings(threads: int | None, max_memory: int | str | None, cache: bool) -> dict[str, Any]:
    if threads is not None:
        allowed = "whole numbers from 1 to 1024, or None for all cores"
        if isinstance(threads, bool) or not hasattr(threads, "__index__"):
            raise _wrong("threads", threads, allowed)
        threads = operator.index(threads)
        if not 1 <= threads <= 1024:
            raise ValueError(f"threads: {threads}; allowed: {allowed}")
    if max_memory is not None and (
        isinstance(max_memory, bool) or not (isinstance(max_memory, str | float) or hasattr(max_memory, "__index__"))
    ):
        raise _wrong("max_memory", max_memory, 'a number of bytes, a size like "4 GiB", a share like "50 %", or None')
    if not isinstance(cache, bool | np.bool_):
        raise _wrong("cache", cache, "True or False")
    limit = None if max_memory is None else str(max_memory)
    return {"threads": threads, "max_memory": limit, "cache": bool(cache)}


def _path(name: str, value: str | os.PathLike[str]) -> Path:
    if not isinstance(value, str | os.PathLike):
        raise _wrong(name, value, "a path, as a text or a pathlib.Path")
    return Path(value)


def _directory(out: str | os.PathLike[str] | None) -> Path | None:
    return None if out is None else _path("out", out)


def _with_mesh_paths(name: str, value: Mapping[str, Any], example: str, files: list[meshes.MeshFile]) -> dict[str, Any]:
    """Returns a dict with mesh objects replaced by paths. Appends the files of these meshes to `files`."""
    if not isinstance(value, Mapping):
        raise _wrong(name, value, f"a dict, such as {example}")
    return {key: meshes.meshes_to_paths(part, str(key), files) for key, part in value.items()}


OVERRIDES = '{"gap.radius": 25.0}'
SCENE = '{"body1": {"kind": "rigid"}, ...}'


def _warn(summary: Mapping[str, Any], level: int = 3) -> None:
    if summary["status"] != "converged":
        reason = summary.get("reason")
        text = f"{summary['title']}: {summary['status']}" + (f" ({reason})" if reason else "")
        warnings.warn(f"{text}; the results up to the last converged entry are valid", NotConvergedWarning, stacklevel=level)


class Scene:
    """A scene, parsed and validated: two bodies, a frame, laws and load steps (docs/scene.md).

    Scenes are immutable, and made by `load`, `from_dict` and `replace`. A pickled scene contains its values, the
    meshes made from objects, and the folder of relative paths. It does not contain the mesh files that its keys
    name.
    """

    def __init__(self, core: _orthowear.Scene, path: Path) -> None:
        self._core = core
        # The path is absolute, because the working directory of the process may change.
        self._path = path.absolute()
        self._files = meshes.mesh_files_of(core.to_dict())

    @classmethod
    def load(cls, path: str | os.PathLike[str], overrides: Mapping[str, Any] | None = None) -> Scene:
        """Reads the scene file at `path`. `overrides` replace values: {"gap.radius": 25.0, "steps.indent.approach":
        0.01}.

        Raises InputError with all mistakes of the scene.
        """
        files: list[meshes.MeshFile] = []
        replaced = _with_mesh_paths("overrides", {} if overrides is None else overrides, OVERRIDES, files)
        path = _path("path", path)
        return cls(_orthowear.Scene.load(path, replaced), path)

    @classmethod
    def from_dict(cls, scene: Mapping[str, Any], folder: str | os.PathLike[str] | None = None) -> Scene:
        """Makes a scene from a dict with the keys of a scene file. Relative paths in the dict start in `folder`.

        Values are numbers, texts, booleans, paths, NumPy arrays, and lists and dicts of these. None stands for an
        absent key. A mesh may be an object instead of a path: a `meshio.Mesh`, `gmsh.model`, or an
        `orthowear.mesh.Mesh`. The object is written to a mesh file in a temporary folder. The file exists as long
        as a scene uses it.
        """
        path = _path("folder", "." if folder is None else folder) / NAME
        files: list[meshes.MeshFile] = []
        return cls(_orthowear.Scene.from_dict(_with_mesh_paths("scene", scene, SCENE, files), path), path)

    def to_dict(self) -> dict[str, Any]:
        """The scene as a dict, including overrides."""
        return self._core.to_dict()

    def replace(self, overrides: Mapping[str, Any]) -> Scene:
        """Returns the scene with some values replaced, by dotted keys as in `load`."""
        files: list[meshes.MeshFile] = []
        return Scene(self._core.replace(_with_mesh_paths("overrides", overrides, OVERRIDES, files)), self._path)

    def with_(self, **overrides: Any) -> Scene:
        """Same as `replace`: scene.with_(**{"body1.fibre.tilt": 30})."""
        return self.replace(overrides)

    def __reduce__(self) -> tuple[Any, ...]:
        return _unpickled, (meshes.paths_to_meshes(self.to_dict(), self._files), self._path)

    @property
    def title(self) -> str:
        """Title of the scene, or the name of its file if it has none."""
        return self._core.title

    @property
    def notes(self) -> list[str]:
        """Warnings and hints about the scene, known before it runs."""
        return self._core.notes

    def check(
        self, *, threads: int | None = None, max_memory: int | str | None = None, cache: bool = True
    ) -> dict[str, Any]:
        """Estimates size, memory and time of a run. Returns a dict with cells, contact_problems, memory_bytes,
        seconds, bodies, skipped (omitted work) and notes.
        """
        return self._core.check(_settings(threads, max_memory, cache))

    def run(
        self,
        out: str | os.PathLike[str] | None = None,
        *,
        threads: int | None = None,
        max_memory: int | str | None = None,
        progress: Callable[[str, float, float | None], object] | None = None,
        cache: bool = True,
    ) -> Result:
        """Runs the scene.

        Args:
            out: Directory for the files that the command line writes. By default, no files are written.
            threads: Number of threads, by default the number of cores. The results are bitwise the same for any number.
            max_memory: Bytes, a size like "4 GiB", or a share of the available memory like "50 %".
            progress: Called with the name of the stage, the completed fraction of the stage, and the residual or None.
            cache: Whether flexibilities of meshed bodies are stored for later runs, and reused from earlier runs.

        A run that does not converge raises no exception. It emits NotConvergedWarning, and its `status` is not
        "converged".
        """
        settings = _settings(threads, max_memory, cache)
        if progress is not None and not callable(progress):
            raise _wrong("progress", progress, "a function of (stage, fraction done, residual or None), or None")
        summary, fields = self._core.run(settings, _directory(out), progress)
        _warn(summary)
        return Result(summary, fields)

    def steps(
        self,
        out: str | os.PathLike[str] | None = None,
        *,
        threads: int | None = None,
        max_memory: int | str | None = None,
        cache: bool = True,
    ) -> Steps:
        """Runs the scene step by step: iterates over an `Entry` for each increment or wear jump, as soon as it is
        computed.

        The run is at most one entry ahead of the iteration. `close()` and the end of a `with` block stop the run.
        """
        settings = _settings(threads, max_memory, cache)
        return Steps(self._core.steps(settings, _directory(out)), self)

    def flexibility(
        self,
        body: int | None = None,
        *,
        threads: int | None = None,
        max_memory: int | str | None = None,
        cache: bool = True,
    ) -> Flexibility:
        """Operator from tractions to the change of the gap on the frame. The operator is the flexibility of both
        bodies, or of `body` (1 or 2) alone, with the other body rigid.
        """
        if body not in (None, 1, 2):
            raise ValueError(f"body is {body!r}, but it must be 1, 2 or None")
        scene = self if body is None else self.replace({f"body{3 - body}": {"kind": "rigid"}})
        return Flexibility(scene._core.flexibility(_settings(threads, max_memory, cache)))

    def __repr__(self) -> str:
        return f"<orthowear.Scene {self.title!r}>"


def _unpickled(scene: dict[str, Any], path: Path) -> Scene:
    files: list[meshes.MeshFile] = []
    return Scene(_orthowear.Scene.from_dict(_with_mesh_paths("scene", scene, SCENE, files), path), path)


class Entry(FieldAttributes):
    """An increment or wear jump: its `record`, as in Result.entries, and its fields.

    The arrays of the fields are also attributes of the entry: entry.pressure. Values of the record are items:
    entry["approach"].
    """

    def __init__(self, record: dict[str, Any], fields: dict[str, Any], units: Mapping[str, str] | None = None) -> None:
        self.record = record
        self.fields: Fields = Fields(fields, units, rolling=bool(record.get("rolling")))

    def __getitem__(self, name: str) -> Any:
        return self.record[name]

    def __repr__(self) -> str:
        return f"<orthowear.Entry {self.record['name']!r}, {self.record['increment']}>"


class Steps(Iterator[Entry]):
    """A run in progress, made by `Scene.steps`."""

    def __init__(self, core: _orthowear.Steps, scene: Scene) -> None:
        self._core = core
        # The scene keeps its mesh files until the run ends.
        self._scene = scene
        self._units: Mapping[str, str] = scene.to_dict().get("units", {})
        self._warned = False

    def __next__(self) -> Entry:
        try:
            return Entry(*next(self._core), self._units)
        except StopIteration:
            summary = self.summary
            if summary is not None and not self._warned:
                self._warned = True
                _warn(summary)
            raise

    @property
    def summary(self) -> dict[str, Any] | None:
        """Summary of the completed run. None before the end of the run, and after `close` has stopped the run."""
        return self._core.summary()

    def close(self) -> None:
        """Stops the run."""
        self._core.close()

    def __enter__(self) -> Steps:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
