"""Studies: a scene run for many combinations of its values, on this machine or on the workers of a Dask client."""

from __future__ import annotations

import functools
import operator
import os
import pickle
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

from . import _orthowear
from .errors import InputError
from .scene import _settings

#: Number of retries of a task that raises an exception. A run that does not converge raises no exception. Dask
#: itself restarts the runs of lost workers (distributed.scheduler.allowed-failures).
RETRIES = 3


class Study:
    """A study file, parsed and validated together with the scenes of all its runs (docs/study.md)."""

    def __init__(self, path: str | os.PathLike[str], overrides: Mapping[str, Any] | None = None) -> None:
        """Reads the study file at `path`. `overrides` replace values of the scene in all runs.

        Raises InputError with all mistakes of the study and of its scenes.
        """
        self.path = Path(path).resolve()
        self.overrides = dict(overrides or {})
        self._core = _orthowear.Study.load(self.path, self.overrides)

    @functools.cached_property
    def plan(self) -> dict[str, Any]:
        """Content of study.json before the runs: title, axes, collect, curves, runs."""
        return self._core.plan()

    @property
    def title(self) -> str:
        """Title of the study."""
        return self.plan["title"]

    @property
    def notes(self) -> list[str]:
        """Warnings and hints about the study, known before it runs."""
        return self._core.notes

    @property
    def runs(self) -> list[dict[str, Any]]:
        """Values of the scene's keys, one dict per run."""
        return [run["values"] for run in self.plan["runs"]]

    def __len__(self) -> int:
        return len(self.plan["runs"])

    def __reduce__(self) -> tuple[Any, ...]:
        return Study, (self.path, self.overrides)

    def __repr__(self) -> str:
        return f"<orthowear.study.Study {self.title!r}: {len(self)} runs>"

    def run(
        self,
        out: str | os.PathLike[str] | None = None,
        *,
        only: Iterable[int] | None = None,
        resume: bool = False,
        threads: int | None = None,
        max_memory: int | str | None = None,
        progress: Callable[[int, int], object] | None = None,
        cache: bool = True,
        client: Any = None,
    ) -> StudyResult:
        """Runs the study. The results are bitwise the same for any number of threads and workers.

        Args:
            out: Folder for the table, with a subfolder per run. Default: name of the study with the suffix .study, next to its file.
            only: Numbers of the runs to compute, from 0 (the command line counts from 1). With `only`, no table is written (see
                `collect`). With a client, the result also contains the runs that were computed earlier.
            resume: Keep converged runs, and resume unfinished runs.
            threads: Number of threads of all runs together, by default the number of cores. With a client: number of threads of each
                run, by default 1.
            max_memory: Memory limit of all runs together. With a client: memory limit of each run.
            progress: Called with the number of finished runs and the number of requested runs.
            cache: Whether flexibilities of meshed bodies are cached and shared.
            client: A dask.distributed.Client. Each run is one task. If a worker is lost, its run starts again on another worker. With
                `resume`, the run continues from its last checkpoint. All workers must see the folders of the study and its results
                under the same paths.

        A run that fails or does not converge raises no exception. Its row has the outcome in `status`.
        """
        folder = (self.path.with_suffix(".study") if out is None else Path(out)).resolve()
        numbers = None if only is None else self._numbers(only)
        if client is None:
            settings = _settings(threads, max_memory, cache)
            return StudyResult(folder, *self._core.run(settings, folder, numbers, resume, progress))
        settings = _settings(1 if threads is None else threads, max_memory, cache)
        wanted = list(range(len(self))) if numbers is None else numbers
        failure = _run_on_workers(client, self, (settings, folder, resume), wanted, progress)
        result = StudyResult(folder, *self._core.collect(folder, numbers is None))
        if failure is not None:
            raise failure
        return result

    def _numbers(self, only: Iterable[int]) -> list[int]:
        numbers = sorted({operator.index(number) for number in only})
        for number in numbers:
            if not 0 <= number < len(self):
                raise InputError(f"run {number} does not exist; the study has runs 0 to {len(self) - 1}", exit_code=2)
        return numbers

    def collect(self, out: str | os.PathLike[str] | None = None) -> StudyResult:
        """Writes the table from the run folders in `out`. Any program may have written these folders. Runs without a
        folder have no status.
        """
        folder = (self.path.with_suffix(".study") if out is None else Path(out)).resolve()
        return StudyResult(folder, *self._core.collect(folder, True))


class StudyResult:
    """Results of the runs of a study. `summary` is the content of study.json (docs/results.md)."""

    def __init__(self, folder: Path, summary: dict[str, Any], exit_code: int, kept: int) -> None:
        self.folder = folder
        self.summary = summary
        #: Exit code of the command line: the most severe code of all runs.
        self.exit_code = exit_code
        #: Number of earlier runs whose results are used. After `collect`: number of runs with results.
        self.kept = kept

    @property
    def runs(self) -> list[dict[str, Any]]:
        """One dict per run: folder, values, status, reason, results, curves, seconds, .."""
        return self.summary["runs"]

    @property
    def unfinished(self) -> list[dict[str, Any]]:
        """Runs that did not converge, failed, or were not run."""
        return [run for run in self.runs if run["status"] != "converged"]

    def to_pandas(self) -> Any:
        """Returns a pandas.DataFrame with a row per run: values by key, status, folder, and collected results by path."""
        import pandas

        fixed = ("status", "reason", "folder", "natural_residual", "seconds")
        return pandas.DataFrame(
            [run["values"] | {key: run[key] for key in fixed} | run["results"] for run in self.runs]
        )

    def to_xarray(self) -> Any:
        """Returns an xarray.Dataset of the collected results over the axes. Missing runs and results are NaN.

        An axis with several keys, or of samples, has the coordinates 0, 1, ... Each key of such an axis gives a
        further coordinate along the axis. Values that are lists or tables, such as `frame.cells`, are coordinates
        as text: "[16, 16]".
        """
        import json

        import numpy
        import xarray

        def label(value: Any) -> Any:
            return json.dumps(value) if isinstance(value, list | dict) else value

        axes = self.summary["axes"]
        coords: dict[str, Any] = {}
        for axis in axes:
            name, keys, values = axis["name"], axis["keys"], axis["values"]
            if len(keys) == 1:
                coords[name] = [label(value) for value in values]
                continue
            coords[name] = list(range(len(values)))
            for k, key in enumerate(keys):
                coords[key] = (name, [label(value[k]) for value in values])
        places = [
            {_key([value] if len(axis["keys"]) == 1 else value): i for i, value in enumerate(axis["values"])}
            for axis in axes
        ]
        shape = [len(axis["values"]) for axis in axes]
        arrays = {path: numpy.full(shape, numpy.nan) for path in self.summary["collect"]}
        for run in self.runs:
            at = tuple(
                place[_key([run["values"][key] for key in axis["keys"]])]
                for axis, place in zip(axes, places, strict=True)
            )
            for path, value in run["results"].items():
                arrays[path][at] = numpy.nan if value is None else value
        dims = [axis["name"] for axis in axes]
        units = self.summary["units"]
        data = {path: (dims, array) for path, array in arrays.items()}
        return xarray.Dataset(data, coords=coords, attrs={"title": self.summary["title"]} | units)

    def __repr__(self) -> str:
        done = len(self.runs) - len(self.unfinished)
        return f"<orthowear.study.StudyResult {self.summary['title']!r}: {done} of {len(self.runs)} runs converged>"


def run(
    path: str | os.PathLike[str],
    out: str | os.PathLike[str] | None = None,
    *,
    overrides: Mapping[str, Any] | None = None,
    **settings: Any,
) -> StudyResult:
    """Reads the study file at `path` and runs it: `Study(path, overrides).run(out, **settings)`."""
    return Study(path, overrides).run(out, **settings)


def _key(values: list[Any]) -> str:
    return repr(values)


@functools.lru_cache(maxsize=1)
def _study(path: Path, modified: float, overrides: bytes) -> Study:
    """Study of a file, cached by its modification time, so that a worker reads it once for all its runs."""
    return Study(path, pickle.loads(overrides))


def _run_one(number: int, path: Path, overrides: bytes, settings: dict[str, Any], folder: Path, resume: bool) -> None:
    """Computes one run on a worker."""
    study = _study(path, path.stat().st_mtime, overrides)
    study._core.run(settings, folder, [number], resume, None)


def _run_on_workers(
    client: Any,
    study: Study,
    arguments: tuple[dict[str, Any], Path, bool],
    numbers: list[int],
    progress: Callable[[int, int], object] | None,
) -> BaseException | None:
    """Computes the runs `numbers`, each in a task of `client`. Returns the first exception of a task, or None."""
    from dask.distributed import as_completed

    settings, folder, resume = arguments
    folder.mkdir(parents=True, exist_ok=True)
    shared = {"settings": settings, "folder": folder, "resume": resume}
    study_file = {"path": study.path, "overrides": pickle.dumps(study.overrides)}
    tasks = client.map(_run_one, numbers, **study_file, **shared, pure=False, retries=RETRIES)
    failure: BaseException | None = None
    try:
        for done, task in enumerate(as_completed(tasks, raise_errors=False), 1):
            if failure is None and task.status == "error":
                failure = task.exception()
            # After its release, a task is not computed again if its worker is lost.
            task.release()
            if progress is not None:
                progress(done, len(numbers))
    finally:
        client.cancel([task for task in tasks if not task.done()])
    return failure
