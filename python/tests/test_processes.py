"""Scenes, results and exceptions pass between processes, and arrays of results are read-only."""

import copy
import multiprocessing
import os
import pickle
import tempfile
from concurrent.futures import ProcessPoolExecutor

import numpy as np
import pytest
from conftest import ROOT, small

import orthowear

ARRAYS = ("points", "xy", "areas", "axes", "tractions", "gap", "slip", "contact", "wear_depth", "places")


def same(a, b) -> bool:
    return all(np.array_equal(getattr(a, name), getattr(b, name)) for name in ARRAYS)


def run_of(scene):
    return os.getpid(), scene.run()


def refused(scene):
    return scene.replace({"body1.material": "stel"})


@pytest.fixture(scope="module")
def other():
    """A process that shares no memory with this process and has another working directory."""
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn"), os.chdir, (tempfile.gettempdir(),)) as pool:
        yield pool


def scenes():
    loaded = orthowear.Scene.load(os.path.relpath(ROOT / "scenes" / "hertz.toml"), {"frame.cells": [16, 16]})
    return {
        "dict": orthowear.Scene.from_dict(small()),
        "replaced": orthowear.Scene.from_dict(small()).replace({"friction.mu": 0.25, "gap.radius": 12.5}),
        "file": loaded,
        "mesh file": orthowear.Scene.load(
            os.path.relpath(ROOT / "scenes" / "sphere-on-cfrp-block.toml"),
            {"frame.cells": [8, 8], "steps.fretting.cycles.count": 10, "output.fields": []},
        ),
    }


@pytest.mark.parametrize("name", ["dict", "replaced", "file", "mesh file"])
def test_another_process_gives_the_same_bits(other, name):
    """Truth: a scene run in another process gives the same results as in this process, bit by bit."""
    scene = scenes()[name]
    expected = scene.run(cache=False)
    process, result = other.submit(run_of, scene).result()
    assert process != os.getpid() and same(result, expected)
    assert result.summary["scene"] == expected.summary["scene"] and result.summary["units"] == expected.summary["units"]


def test_copies_are_the_scene():
    """Truth: a copy has the values and the title of the original scene."""
    for scene in scenes().values():
        for twin in (pickle.loads(pickle.dumps(scene)), copy.copy(scene), copy.deepcopy(scene)):
            assert twin.to_dict() == scene.to_dict() and twin.title == scene.title
    untitled = orthowear.Scene.from_dict(small())
    assert pickle.loads(pickle.dumps(untitled)).title == untitled.title == "scene"
    again = pickle.loads(pickle.dumps(untitled)).replace({"friction.mu": 0.2})
    assert again.to_dict()["friction"]["mu"] == 0.2


def test_exceptions_come_back(other):
    """Truth: a mistake raises the same exception in another process as in this process."""
    scene = orthowear.Scene.from_dict(small())
    with pytest.raises(orthowear.InputError) as here:
        refused(scene)
    with pytest.raises(orthowear.InputError) as there:
        other.submit(refused, scene).result()
    assert str(there.value).partition("body1")[2] == str(here.value).partition("body1")[2]
    assert there.value.exit_code == 2
    assert [mistake["key"] for mistake in there.value.mistakes] == ["body1.material"]


def test_arrays_of_results_cannot_be_written_to(scene):
    """Truth: writing is refused, also after pickling. Copies are writable."""
    result = scene.run()
    with scene.steps() as steps:
        entry = next(steps)
    for fields in (result, result.fields, entry, pickle.loads(pickle.dumps(result)), copy.deepcopy(entry), scene.flexibility()):
        for name in ARRAYS:
            if not hasattr(fields, name):
                continue
            with pytest.raises(ValueError, match="read-only"):
                getattr(fields, name)[...] = 0
        if hasattr(fields, "pressure"):
            with pytest.raises(ValueError, match="read-only"):
                fields.pressure[0] = 1.0
    assert np.shares_memory(result.pressure, result.tractions)
    mine = result.tractions.copy()
    mine[:, 2] = 0.0
    assert result.pressure.max() > 0
    assert result.to_grid(result.pressure).flags.writeable


def test_attributes(scene):
    """Truth: results and entries have the attributes of their fields."""
    result = scene.run()
    with scene.steps() as steps:
        entry = next(steps)
    for whole in (result, entry):
        assert {"tractions", "pressure", "to_grid", "fields"} <= set(dir(whole))
        assert whole.pressure is not None and whole.contact.dtype == np.uint8
        with pytest.raises(AttributeError, match=f"{type(whole).__name__} has no attribute 'presure'"):
            _ = whole.presure
    empty = orthowear.Result({**result.summary, "steps": []}, None)
    with pytest.raises(AttributeError, match="pressure: there are no fields, because no increment was computed"):
        _ = empty.pressure
    with pytest.raises(ValueError, match="no increment was computed"):
        empty.to_grid([])
    assert empty.fields is None and repr(entry) == "<orthowear.Entry 'press', 1>"
