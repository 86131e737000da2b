"""The package gives the same results as the command line, bit by bit."""

import json
from pathlib import Path

import numpy as np
import pytest
from conftest import ROOT, small

import orthowear

#: Keys whose values differ from run to run.
CLOCKS = ("seconds", "timings", "peak_memory_bytes", "files", "saved")


def without_clocks(value):
    if isinstance(value, dict):
        return {key: without_clocks(part) for key, part in value.items() if key not in CLOCKS}
    return [without_clocks(part) for part in value] if isinstance(value, list) else value


SCENES = ["cattaneo-mindlin", "hertz", "sphere-on-cfrp-halfspaces"]


@pytest.mark.parametrize("name", SCENES)
def test_summary_and_fields(name, program, tmp_path):
    """Truth: the program built from the same sources gives the same summary and fields."""
    meshio = pytest.importorskip("meshio")
    path = ROOT / "scenes" / f"{name}.toml"
    frame = {"frame.cells": [32, 32]}
    said = program("run", path, "--set", "frame.cells=[32, 32]", "--set", 'output.fields=["vtu"]', "--out", tmp_path)
    assert said.returncode == 0, said.stderr
    result = orthowear.Scene.load(path, {**frame, "output.fields": ["vtu"]}).run()
    told = json.loads((tmp_path / "summary.json").read_text())
    assert result.status == "converged"
    assert without_clocks(result.summary) == without_clocks(told)
    last = sorted(file for file in told["files"] if file.startswith("frame_"))[-1]
    cells = {key: value[0] for key, value in meshio.read(tmp_path / last).cell_data.items()}
    assert np.array_equal(result.pressure, cells["pressure"])
    assert np.array_equal(result.wear_depth, cells["wear_depth"])


def test_files_are_written(scene, program, tmp_path):
    """Truth: the program writes files of the same names, and the same VTU and PVD files byte for byte."""
    scene.run(tmp_path / "a")
    path = tmp_path / "scene.toml"
    path.write_text(toml(scene))
    assert program("run", path, "--out", tmp_path / "b").returncode == 0
    names = sorted(path.name for path in (tmp_path / "b").iterdir())
    assert names == sorted(path.name for path in (tmp_path / "a").iterdir()) and "frame_0005.vtu" in names
    for name in names:
        if name.endswith((".vtu", ".pvd")):
            assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes(), name


def toml(scene) -> str:
    """TOML text of a scene of plain values, with inline tables."""

    def value(part) -> str:
        if isinstance(part, dict):
            return "{" + ", ".join(f"{key} = {value(inner)}" for key, inner in part.items()) + "}"
        return "[" + ", ".join(map(value, part)) + "]" if isinstance(part, list) else json.dumps(part)

    return "\n".join(f"{key} = {value(part)}" for key, part in scene.to_dict().items())


def test_dict_is_the_file(tmp_path):
    """Truth: a file with the same values gives the same results."""
    scene = orthowear.Scene.from_dict(small())
    assert scene.to_dict() == json.loads(json.dumps(small()))
    path = tmp_path / "scene.toml"
    path.write_text(toml(scene))
    a, b = scene.run(), orthowear.Scene.load(path).run()
    assert np.array_equal(a.tractions, b.tractions) and np.array_equal(a.slip, b.slip)
    assert without_clocks(a.entries) == without_clocks(b.entries)


def test_mistakes_are_those_of_the_program(program, tmp_path):
    """Truth: the program prints the same report and ends with the same exit code."""
    path = ROOT / "scenes" / "hertz.toml"
    with pytest.raises(orthowear.InputError) as caught:
        orthowear.Scene.load(path, {"frame.cels": [8, 8], "body1.material": "stel"})
    said = program("check", path, "--set", "frame.cels=[8, 8]", "--set", 'body1.material="stel"')
    assert said.returncode == caught.value.exit_code == 2
    assert caught.value.report == said.stderr
    assert {mistake["key"] for mistake in caught.value.mistakes} == {"frame.cels", "body1.material"}
    assert "steel" in str(caught.value) and isinstance(caught.value, ValueError)


def test_missing_file_and_wrong_values(tmp_path):
    """Truth: docs/command-line.md: wrong input raises InputError, insufficient memory raises ResourcesError."""
    with pytest.raises(orthowear.InputError, match="cannot read the scene"):
        orthowear.Scene.load(tmp_path / "none.toml")
    with pytest.raises(orthowear.InputError, match=r"gap\.radius: this is not a value of a scene \(Python type complex\)"):
        orthowear.Scene.from_dict({**small(), "gap": {"kind": "sphere", "radius": 1j}})
    with pytest.raises(orthowear.InputError, match="max_memory"):
        orthowear.Scene.from_dict(small()).run(max_memory="much")
    with pytest.raises(orthowear.ResourcesError) as caught:
        orthowear.Scene.from_dict(small()).replace({"frame.cells": [512, 512]}).run(max_memory=1 << 20)
    assert caught.value.exit_code == 4 and "--max-memory" in str(caught.value)


def test_values_of_numpy_and_paths():
    """Truth: a scene with NumPy values, a path and None equals the scene with plain values."""
    scene = small()
    scene["frame"]["half_width"] = np.array([0.4, 0.4])
    scene["gap"]["radius"] = np.float64(10.0)
    scene["frame"]["cells"] = (np.int64(16), 16)
    scene["title"] = Path("a title")
    scene["wear"] = None
    read = orthowear.Scene.from_dict(scene)
    assert read.title == "a title"
    assert read.to_dict() == {**orthowear.Scene.from_dict(small()).to_dict(), "title": "a title"}
