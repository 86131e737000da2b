"""Results of a run."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from .fields import UNITS, UNKNOWN_UNITS, FieldAttributes, Fields


class Entries(list[dict[str, Any]]):
    """Increments and wear jumps of a run, one dict each (docs/results.md). Forces and moments act on body 1.

    units: names of the units of `length` and `force`. By default, the words "length" and "force".
    """

    def __init__(self, entries: Iterable[dict[str, Any]] = (), units: Mapping[str, str] | None = None) -> None:
        super().__init__(entries)
        self.units: dict[str, str] = {**UNKNOWN_UNITS, **(units or {})}

    def to_pandas(self) -> Any:
        """Returns a pandas.DataFrame with a row per entry. Lists and dicts become several columns, such as shift.0 and
        certificate.min_gap.
        """
        import pandas

        return pandas.DataFrame([flatten(entry) for entry in self])


def flatten(value: Any, key: str = "") -> dict[str, Any]:
    """Flattens nested dicts and lists to one dict with dotted keys."""
    if not isinstance(value, dict | list):
        return {key: value}
    parts = value.items() if isinstance(value, dict) else enumerate(value)
    found: dict[str, Any] = {}
    for name, part in parts:
        found.update(flatten(part, f"{key}.{name}" if key else str(name)))
    return found


class Result(FieldAttributes):
    """Summary of a run, and the fields of its last entry.

    `summary` is the content of summary.json (docs/results.md). `fields` is None if no increment was computed. The arrays of the
    fields are also attributes of the result: result.tractions, result.pressure.
    """

    def __init__(self, summary: dict[str, Any], fields: dict[str, Any] | None) -> None:
        self.summary = summary
        rolling = bool(summary["steps"] and summary["steps"][-1].get("rolling"))
        self.fields = None if fields is None else Fields(fields, summary.get("units"), rolling=rolling)

    @property
    def status(self) -> str:
        """Outcome of the run: converged, not-converged, failed or interrupted."""
        return str(self.summary["status"])

    @property
    def reason(self) -> str | None:
        """Reason why the run did not converge; None if it converged."""
        return self.summary.get("reason")

    @property
    def warnings(self) -> list[str]:
        """Warnings of the run."""
        return list(self.summary.get("warnings", []))

    @property
    def entries(self) -> Entries:
        """Increments and wear jumps of the run."""
        return Entries(self.summary["steps"], self.summary.get("units", UNITS))

    def __repr__(self) -> str:
        return f"<orthowear.Result {self.summary['title']!r}: {self.status}, {len(self.summary['steps'])} entries>"
