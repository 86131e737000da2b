"""What can go wrong, with the messages and exit codes of the command line."""

from __future__ import annotations

from typing import Any


class OrthowearError(Exception):
    """A failure of a computation.

    `exit_code` is that of the command line, `report` the text that it prints.
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
    """Something is wrong with a scene, a mesh, a material or an argument.

    `mistakes` has one dict for each mistake of a scene, all of them at once: `key`, `message`, `mend` (what is allowed and how
    to mend it) and `line` (from 1; None where it has none).
    """


class ResourcesError(OrthowearError):
    """Memory or disk do not suffice, or a file cannot be read or written."""


class NumericalError(OrthowearError):
    """A numerical stage failed in a way that the input does not explain."""


class NotConvergedError(OrthowearError):
    """An iteration outside of a run did not converge."""


class InterruptedRunError(OrthowearError):
    """The work was stopped, as another one of this process was."""


class NotConvergedWarning(UserWarning):
    """A run has not converged: its last entries are no solution."""
