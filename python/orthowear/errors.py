"""Exceptions of the package, with the messages and exit codes of the command line."""

from __future__ import annotations

from typing import Any


class OrthowearError(Exception):
    """Base class of all exceptions of failed computations.

    `exit_code` is the exit code of the command line. `report` is the text that the command line prints.
    """

    def __init__(
        self,
        message: str,
        *,
        exit_code: int = 1,
        mistakes: list[dict[str, Any]] | None = None,
        report: str = "",
    ) -> None:
        super().__init__(message)
        self.exit_code = exit_code
        self.mistakes = mistakes or []
        self.report = report


class InputError(OrthowearError, ValueError):
    """A scene, a mesh, a material or an argument is wrong.

    `mistakes` contains all mistakes of a scene, one dict each: `key`, `message`, `mend` (allowed values and how to
    fix the mistake) and `line` (from 1, None if unknown).
    """


class ResourcesError(OrthowearError):
    """Memory or disk space does not suffice, or a file of the results cannot be read or written."""


class NumericalError(OrthowearError):
    """A numerical method failed although the input is valid, or the program has a defect (internal error)."""


class NotConvergedError(OrthowearError):
    """An iteration outside of a run did not converge."""


class InterruptedRunError(OrthowearError):
    """The computation was stopped, because another computation of this process was interrupted."""


class NotConvergedWarning(UserWarning):
    """A run did not converge. Its results are valid only up to the last converged entry of `steps`."""
