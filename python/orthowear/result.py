"""What a run has come to."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from .fields import UNITS, UNKNOWN_UNITS, FieldAttributes, Fields


class Entries(list[dict[str, Any]]):
    """The increments and cycle jumps of a run, one dict each (docs/results.md); forces and moments act on body 1.

    units: of `length` and `force`; those words where it is not given.
    """

    def __init__(self, entries: Iterable[dict[str, Any]] = (), units: Mapping[str, str] | None = None) -> None:
        super().__init__(entries)
        self.units: dict[str, str] = {**UNKNOWN_UNITS, **(units or {})}

    def to_pandas(self) -> Any:
        """A pandas.DataFrame with a row for each; lists and dicts become columns like shift.0 and certificate.min_gap."""
        import pandas

        return pandas.DataFrame([flatten(entry) for entry in self])


def flatten(value: Any, key: str = "") -> dict[str, Any]:
    """The numbers and texts of dicts and lists inside each other, by dotted keys."""
    if not isinstance(value, dict | list):
        return {key: value}
    parts = value.items() if isinstance(value, dict) else enumerate(value)
    found: dict[str, Any] = {}
    for name, part in parts:
        found.update(flatten(part, f"{key}.{name}" if key else str(name)))
    return found


class Result(FieldAttributes):
    """The summary of a run, and the fields of its last entry.

    `summary` is what summary.json says (docs/results.md). `fields` is None where no increment was done; its arrays are
    attributes of the result, too: result.tractions, result.pressure.
    """

    def __init__(self, summary: dict[str, Any], fields: dict[str, Any] | None) -> None:
        self.summary = summary
        rolling = bool(summary["steps"] and summary["steps"][-1].get("rolling"))
        self.fields = None if fields is None else Fields(fields, summary.get("units"), rolling=rolling)

    @property
    def status(self) -> str:
        """converged, not-converged, failed or interrupted."""
        return str(self.summary["status"])

    @property
    def reason(self) -> str | None:
        """Why it did not converge."""
        return self.summary.get("reason")

    @property
    def warnings(self) -> list[str]:
        """What the user should know."""
        return list(self.summary.get("warnings", []))

    @property
    def entries(self) -> Entries:
        """The increments and cycle jumps."""
        return Entries(self.summary["steps"], self.summary.get("units", UNITS))

    def __repr__(self) -> str:
        return f"<orthowear.Result {self.summary['title']!r}: {self.status}, {len(self.summary['steps'])} entries>"
