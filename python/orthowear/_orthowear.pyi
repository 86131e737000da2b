from collections.abc import Callable
from pathlib import Path
from typing import Any, final

import numpy as np
import numpy.typing as npt

__all__ = ["__version__", "Scene", "Steps", "Study", "Flexibility"]

_Array = npt.NDArray[np.float64]

__version__: str

@final
class Scene:
    title: str
    sha256: str
    notes: list[str]
    has_accuracy: bool
    @staticmethod
    def load(path: Path, overrides: dict[str, Any]) -> Scene: ...
    @staticmethod
    def from_dict(scene: dict[str, Any], path: Path) -> Scene: ...
    def replace(self, overrides: dict[str, Any]) -> Scene: ...
    def to_dict(self) -> dict[str, Any]: ...
    def check(self, settings: dict[str, Any]) -> dict[str, Any]: ...
    def run(
        self,
        settings: dict[str, Any],
        out: Path | None,
        progress: Callable[[str, float, float | None], object] | None,
    ) -> tuple[dict[str, Any], dict[str, Any] | None]: ...
    def steps(self, settings: dict[str, Any], out: Path | None) -> Steps: ...
    def flexibility(self, settings: dict[str, Any]) -> Flexibility: ...
    def green(self, body: int, angles: _Array) -> _Array: ...

@final
class Steps:
    def __iter__(self) -> Steps: ...
    def __next__(self) -> tuple[dict[str, Any], dict[str, Any]]: ...
    def close(self) -> None: ...
    def summary(self) -> dict[str, Any] | None: ...

@final
class Study:
    notes: list[str]
    @staticmethod
    def load(path: Path, overrides: dict[str, Any]) -> Study: ...
    def plan(self) -> dict[str, Any]: ...
    def run(
        self,
        settings: dict[str, Any],
        out: Path,
        numbers: list[int] | None,
        resume: bool,
        progress: Callable[[int, int], object] | None,
    ) -> tuple[dict[str, Any], int, int]: ...
    def collect(self, out: Path, write: bool) -> tuple[dict[str, Any], int, int]: ...

@final
class Flexibility:
    cells: int
    def places(self) -> dict[str, Any]: ...
    def apply(self, tractions: _Array) -> _Array: ...
