"""Scenes and their runs."""

from __future__ import annotations

import operator
import os
import warnings
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

from . import _orthowear
from .errors import NotConvergedWarning
from .fields import Fields
from .flexibility import Flexibility
from .result import Result

#: What a scene is called in messages that is no file.
NAME = "scene"


def _settings(threads: int | None, max_memory: int | str | None, cache: bool) -> dict[str, Any]:
    if threads is not None and not 1 <= operator.index(threads) <= 1024:
        raise ValueError(f"threads: {threads}: 1 to 1024 are allowed, or None for all cores")
    limit = None if max_memory is None else str(max_memory)
    return {"threads": threads, "max_memory": limit, "cache": cache}


def _warn(summary: Mapping[str, Any], level: int = 3) -> None:
    if summary["status"] != "converged":
        reason = summary.get("reason")
        text = f"{summary['title']}: {summary['status']}" + (f" ({reason})" if reason else "")
        warnings.warn(f"{text}; what is there up to the last converged entry holds", NotConvergedWarning, stacklevel=level)


class Scene:
    """A scene, read and checked: two bodies, a frame, laws and load steps (docs/scene.md)."""

    def __init__(self, core: _orthowear.Scene) -> None:
        self._core = core

    @classmethod
    def load(cls, path: str | os.PathLike[str], overrides: Mapping[str, Any] | None = None) -> Scene:
        """The scene file at `path`; `overrides` replace values: {"gap.radius": 25.0, "steps.indent.approach": 0.01}.

        Raises InputError with all mistakes at once.
        """
        return cls(_orthowear.Scene.load(Path(path), dict(overrides or {})))

    @classmethod
    def from_dict(cls, scene: Mapping[str, Any], folder: str | os.PathLike[str] | None = None) -> Scene:
        """The scene that a dict says, with the keys of a scene file; relative paths in it begin in `folder`.

        Values are numbers, texts, booleans, paths, NumPy arrays, and lists and dicts of these; None stands for an absent key.
        """
        return cls(_orthowear.Scene.from_dict(dict(scene), Path(folder or ".") / NAME))

    def to_dict(self) -> dict[str, Any]:
        """The scene as a dict, overrides included."""
        return self._core.to_dict()

    def replace(self, overrides: Mapping[str, Any]) -> Scene:
        """The same scene with some values replaced, by dotted keys as those of `load`."""
        return Scene(self._core.replace(dict(overrides)))

    def with_(self, **overrides: Any) -> Scene:
        """As `replace`: scene.with_(**{"body1.fibre.tilt": 30})."""
        return self.replace(overrides)

    @property
    def title(self) -> str:
        """Its title; the file's name if it has none."""
        return self._core.title

    @property
    def notes(self) -> list[str]:
        """What the user should know before running."""
        return self._core.notes

    def check(
        self, *, threads: int | None = None, max_memory: int | str | None = None, cache: bool = True
    ) -> dict[str, Any]:
        """What a run would compute, skip and need: cells, contact_problems, memory_bytes, seconds, bodies, skipped, notes."""
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

        out: directory for the files that the command line writes; without it nothing is written.
        threads: number of threads, default that of the cores; the results are the same bits for any number.
        max_memory: bytes, a size like "4 GiB", or a share of what is available like "50 %".
        progress: called with the stage, the fraction of it done, and the residual or None.
        cache: whether flexibilities of meshed bodies are kept for later runs, and taken from earlier ones.

        A run that does not converge is no exception: its `status` says so, and NotConvergedWarning is given.
        """
        settings = _settings(threads, max_memory, cache)
        summary, fields = self._core.run(settings, None if out is None else Path(out), progress)
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
        """Runs the scene entry by entry: iterates over an `Entry` for each increment or cycle jump, as they come.

        At most one entry is computed before it is asked for. `close()` stops the run; so does leaving a `with` block.
        """
        settings = _settings(threads, max_memory, cache)
        return Steps(self._core.steps(settings, None if out is None else Path(out)))

    def flexibility(
        self,
        body: int | None = None,
        *,
        threads: int | None = None,
        max_memory: int | str | None = None,
        cache: bool = True,
    ) -> Flexibility:
        """The operator from tractions to the gap on the frame, of both bodies, or of body 1 or 2 with the other one rigid."""
        if body not in (None, 1, 2):
            raise ValueError(f"body {body!r}: it is 1, 2 or None")
        scene = self if body is None else self.replace({f"body{3 - body}": {"kind": "rigid"}})
        return Flexibility(scene._core.flexibility(_settings(threads, max_memory, cache)))

    def __repr__(self) -> str:
        return f"<orthowear.Scene {self.title!r}>"


class Entry:
    """An increment or cycle jump: `record` as in Result.entries, and the fields of that moment.

    The arrays are attributes of the entry, too: entry.pressure; values of the record are had by name: entry["approach"].
    """

    def __init__(self, record: dict[str, Any], fields: dict[str, Any]) -> None:
        self.record = record
        self.fields = Fields(fields)

    def __getitem__(self, name: str) -> Any:
        return self.record[name]

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_") or name in ("record", "fields"):
            raise AttributeError(name)
        return getattr(self.fields, name)


class Steps(Iterator[Entry]):
    """A run in progress; made by `Scene.steps`."""

    def __init__(self, core: _orthowear.Steps) -> None:
        self._core = core
        self._warned = False

    def __next__(self) -> Entry:
        try:
            return Entry(*next(self._core))
        except StopIteration:
            summary = self.summary
            if summary is not None and not self._warned:
                self._warned = True
                _warn(summary)
            raise

    @property
    def summary(self) -> dict[str, Any] | None:
        """The summary, when the run has come to its end; None before, and after `close`."""
        return self._core.summary()

    def close(self) -> None:
        """Stops the run."""
        self._core.close()

    def __enter__(self) -> Steps:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
