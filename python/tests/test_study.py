"""Studies from Python give the same results as the command line, bit by bit. This also holds on several threads, and
if workers are killed.
"""

import csv
import json
import os
import pickle
import signal
from pathlib import Path

import numpy as np
import orthowear
import pytest
from orthowear.study import Study

SCENES = Path(__file__).resolve().parents[2] / "scenes"
STUDY = """
[study]
scene = "scene.toml"
[[axes]]
keys = ["body1.fibre.tilt"]
range = { from = 0, to = 90, count = 3 }
[[axes]]
name = "depth"
keys = ["steps.indent.approach", "gap.radius"]
values = [[0.02, 50.0], [0.01, 40.0]]
[[axes]]
keys = ["steps.shift.shift.angle"]
values = [0, 60]
[output]
collect = ["shift.normal_force", "shift.tangential_force.0"]
curves = ["shift.normal_force"]
"""


@pytest.fixture
def folder(tmp_path):
    """A folder with a study of two half-spaces."""
    text = (SCENES / "sphere-on-cfrp-halfspaces.toml").read_text()
    (tmp_path / "scene.toml").write_text(text.replace("cells = [64, 64]", "cells = [24, 24]"))
    (tmp_path / "study.toml").write_text(STUDY)
    return tmp_path


def test_command_line(folder, program):
    """Truth: the command line writes the same files, byte by byte."""
    program("study", folder / "study.toml", "--quiet", "--out", folder / "line")
    told = []
    result = orthowear.study.run(folder / "study.toml", folder / "own", threads=2, progress=lambda *now: told.append(now))
    for name in ("study.csv", "study.npz", "shift.normal_force.svg"):
        assert (folder / "line" / name).read_bytes() == (folder / "own" / name).read_bytes(), name
    assert told == [(done, 12) for done in range(1, 13)]
    assert (result.exit_code, result.unfinished, result.kept) == (0, [], 0)
    with (folder / "own" / "study.csv").open() as file:
        rows = list(csv.DictReader(file))
    arrays = np.load(folder / "own" / "study.npz")
    for name in ("body1.fibre.tilt", "gap.radius", "shift.normal_force", "natural_residual"):
        assert [float(row[name]) for row in rows] == arrays[name].tolist(), name
    assert arrays["converged"].tolist() == [1.0] * 12
    for run, curve in zip(result.runs, arrays["curves/shift.normal_force"], strict=True):
        assert run["curves"]["shift.normal_force"] == curve.tolist()


def test_tables(folder):
    """Truth: data frames and data sets contain the results of the runs."""
    pytest.importorskip("pandas")
    pytest.importorskip("xarray")
    result = Study(folder / "study.toml").run()
    table = result.to_pandas()
    assert list(table["shift.normal_force"]) == [run["results"]["shift.normal_force"] for run in result.runs]
    data = result.to_xarray()
    assert data["shift.normal_force"].dims == ("tilt", "depth", "angle")
    assert data["gap.radius"].values.tolist() == [50.0, 40.0]
    for run in result.runs:
        place = {"tilt": run["values"]["body1.fibre.tilt"], "angle": run["values"]["steps.shift.shift.angle"]}
        depth = [50.0, 40.0].index(run["values"]["gap.radius"])
        found = data["shift.normal_force"].sel(place).isel(depth=depth).item()
        assert found == run["results"]["shift.normal_force"]


def test_values_that_are_lists(tmp_path):
    """Truth: the text of an axis value that is a list selects the result of its run."""
    pytest.importorskip("xarray")
    text = f'[study]\nscene = "{SCENES.as_posix()}/hertz.toml"\n[[axes]]\nkeys = ["frame.cells"]\nvalues = [[8, 8], [12, 12]]\n'
    (tmp_path / "study.toml").write_text(text + '[output]\ncollect = ["press.normal_force"]\n')
    result = Study(tmp_path / "study.toml").run()
    data = result.to_xarray()["press.normal_force"]
    for run in result.runs:
        cells = str(run["values"]["frame.cells"])
        assert data.sel(cells=cells).item() == run["results"]["press.normal_force"]


def test_parts(folder):
    """Truth: runs computed in parts give the table of the whole study."""
    study = pickle.loads(pickle.dumps(Study(folder / "study.toml", {})))
    whole = study.run(folder / "whole")
    study.run(folder / "parts", only=[7, 0, 1])
    some = study.collect(folder / "parts")
    assert (some.kept, some.exit_code) == (3, 1)
    assert [run["status"] for run in some.runs].count(None) == 9
    all_of_it = study.run(folder / "parts", resume=True)
    assert all_of_it.kept == 3
    assert (folder / "parts/study.csv").read_bytes() == (folder / "whole/study.csv").read_bytes()
    assert [run["results"] for run in all_of_it.runs] == [run["results"] for run in whole.runs]
    for wrong in (12, -1):
        with pytest.raises(orthowear.InputError, match=f"run {wrong} does not exist; the study has runs 0 to 11"):
            study.run(folder / "parts", only=[wrong])


def test_notes(folder):
    """Truth: docs/study.md: `symmetry` has no effect, and a note says so."""
    assert Study(folder / "study.toml").notes == []
    (folder / "study.toml").write_text(STUDY.replace('"scene.toml"', '"scene.toml"\nsymmetry = true'))
    (note,) = Study(folder / "study.toml").notes
    assert "study.symmetry has no effect" in note


def test_elsewhere(folder, monkeypatch):
    """Truth: results are written beside the study's file, even if the working directory changes."""
    monkeypatch.chdir(folder)
    study = Study("study.toml")
    monkeypatch.chdir("/")
    assert study.run(only=[3]).runs[3]["status"] == "converged"
    assert (folder / "study.study").is_dir()


def test_mistakes(folder):
    """Truth: the exception has all mistakes, with the messages of the command line."""
    (folder / "study.toml").write_text(STUDY.replace("fibre.tilt", "fibre.tlit").replace("[0, 60]", '["up"]'))
    with pytest.raises(orthowear.InputError) as caught:
        Study(folder / "study.toml")
    text = str(caught.value)
    assert "did you mean `tilt`" in caught.value.report and "angle" in text
    assert len(caught.value.mistakes) == 2


@pytest.fixture
def client():
    """Three worker processes with a thread each."""
    if not os.environ.get("ORTHOWEAR_REQUIRE_TOOLS"):
        pytest.importorskip("distributed")
    import dask
    from dask.distributed import Client, LocalCluster

    dask.config.set({"distributed.comm.timeouts.connect": "60s", "distributed.admin.system-monitor.disk": False})
    with (
        LocalCluster(n_workers=3, threads_per_worker=1, dashboard_address=None) as cluster,
        Client(cluster) as client,
    ):
        yield client


def test_workers_that_die(folder, client):
    """Truth: although workers are killed, the table equals the table of the study in one process, byte by byte."""
    (folder / "scene.toml").write_text((folder / "scene.toml").read_text().replace("[24, 24]", "[96, 96]"))
    study = Study(folder / "study.toml")
    study.run(folder / "whole")
    killed, finished = [], {}

    def progress(done, of):
        assert of == 12
        if len(killed) < 3 and done >= (2, 5, 11)[len(killed)]:
            for file in (folder / "parts").glob("*/summary.json"):
                finished.setdefault(file, file.stat().st_mtime_ns)
            processes = client.run(os.getpid)
            pid = next(pid for pid in processes.values() if pid not in killed)
            killed.append(pid)
            os.kill(pid, signal.SIGKILL)

    result = study.run(folder / "parts", client=client, progress=progress)
    assert len(killed) == 3 and len(finished) >= 11
    # A worker may be killed after it wrote a summary. Its run is then computed again.
    assert sum(file.stat().st_mtime_ns != time for file, time in finished.items()) <= 1
    assert (result.exit_code, result.kept, result.unfinished) == (0, 12, [])
    assert (folder / "parts/study.csv").read_bytes() == (folder / "whole/study.csv").read_bytes()
    assert len({run["folder"] for run in result.runs}) == 12
    some = study.run(folder / "some", client=client, only=[4, 9])
    assert [run["status"] for run in some.runs].count("converged") == 2
    assert some.runs[9]["results"] == result.runs[9]["results"]
    assert not (folder / "some/study.csv").exists()
    # All runs are kept, so no run is computed again.
    times = [run["seconds"] for run in result.runs]
    again = study.run(folder / "parts", client=client, resume=True)
    assert [run["seconds"] for run in again.runs] == times
    (folder / "study.toml").rename(folder / "other.toml")
    for resume in (False, True):
        with pytest.raises(OSError):
            study.run(folder / "none", client=client, resume=resume)
