"""Runs: closed-form solutions, steps, threads, signals."""

import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from conftest import ROOT

import orthowear


def test_hertz():
    """Truth: Hertz 1882 (K. L. Johnson, Contact Mechanics, 1985, chapter 4). The contact radius is 26 cells."""
    result = orthowear.Scene.load(ROOT / "scenes" / "hertz.toml").run()
    modulus, radius, force = 210e3 / (1 - 0.3**2), 10.0, 1000.0
    a = (3 * force * radius / (4 * modulus)) ** (1 / 3)
    assert result.entries[-1]["approach"] == pytest.approx(a**2 / radius, rel=5e-3)
    peak = 3 * force / (2 * np.pi * a**2)
    assert result.pressure.max() == pytest.approx(peak, rel=1e-2)
    assert (result.pressure * result.areas).sum() == pytest.approx(force, rel=1e-6)
    inside = np.hypot(*result.xy.T) < 0.8 * a
    exact = peak * np.sqrt(1 - (np.hypot(*result.xy[inside].T) / a) ** 2)
    assert np.allclose(result.pressure[inside], exact, rtol=2e-2)


def test_cattaneo_mindlin():
    """Truth: Cattaneo 1938, Mindlin 1949 (Johnson 1985, 7.2), exact for a Poisson ratio of 0. Signs: docs/results.md."""
    result = orthowear.Scene.load(ROOT / "scenes" / "cattaneo-mindlin.toml").run()
    last = result.entries[-1]
    assert last["tangential_force"] == pytest.approx([270.0, 0.0], abs=1e-4)
    assert last["shift"][0] == pytest.approx(0.0040519, rel=1e-2)
    # Tractions act on body 2. Friction opposes its motion.
    assert (result.tractions[:, 0] * result.areas).sum() == pytest.approx(-270.0, rel=1e-6)
    assert np.all(np.hypot(*result.tractions[:, :2].T) <= 0.3 * result.pressure * (1 + 1e-6) + 1e-6)
    stick = result.areas[result.contact == 1].sum()
    assert stick == pytest.approx(np.pi * 0.19259**2, rel=0.1)


def test_steps_are_the_run(scene):
    """Truth: a run gives the same bits with and without iteration over its entries."""
    result = scene.run()
    steps = scene.steps()
    entries = list(steps)
    assert [entry["increment"] for entry in entries] == [1, 2, 1, 2, 3]
    for entry, expected in zip(entries, result.entries, strict=True):
        assert {**entry.record, "seconds": 0} == {**expected, "seconds": 0}
    for name in ("tractions", "gap", "slip", "contact", "wear_depth", "points"):
        assert np.array_equal(getattr(entries[-1], name), getattr(result, name)), name
    assert steps.summary["status"] == "converged" and next(steps, None) is None


def test_closed_steps_stop(scene):
    """Truth: after a stopped run, the next run is complete."""
    with scene.steps() as steps:
        assert next(steps)["name"] == "press"
        next(steps)
    assert next(steps, None) is None and steps.summary is None
    assert len(scene.run().entries) == 5


def test_threads_give_the_same_bits(scene):
    """Truth: docs/command-line.md: the results are bitwise the same for any number of threads."""
    one, two = scene.run(threads=1), scene.run(threads=2)
    assert np.array_equal(one.tractions, two.tractions) and np.array_equal(one.gap, two.gap)


def test_progress(scene):
    """Truth: stages have names, and fractions are from 0 to 1. An exception of the callback ends the run."""
    heard = []
    scene.run(progress=lambda *told: heard.append(told))
    assert "frame" in {stage for stage, _, _ in heard}
    assert all(0.0 <= done <= 1.0 for _, done, _ in heard)

    def refuse(*_):
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        scene.run(progress=refuse)
    assert scene.run().status == "converged"


def test_not_converged_is_said_aloud(scene):
    """Truth: friction transmits at most mu times the normal force, 300 N. A force of 400 N has no equilibrium."""
    sliding = scene.replace({"steps.push.tangential_force": [400.0, 0.0]})
    with pytest.warns(orthowear.NotConvergedWarning, match="gross-sliding"):
        result = sliding.run()
    assert (result.status, result.reason) == ("not-converged", "gross-sliding")


def test_check(scene):
    """Truth: `check` reports the numbers of cells and increments of the scene."""
    plan = scene.check()
    assert (plan["cells"], plan["contact_problems"]) == (256, 5)
    assert plan["memory_bytes"] > 0 and len(plan["bodies"]) == 2
    # `orthowear check` reports the same error (docs/accuracy.md).
    with pytest.raises(orthowear.InputError, match=r"accuracy\.of"):
        scene.replace({"accuracy": {"relative": 1e-3, "of": ["worn_volume"]}}).check()


def test_grids(scene):
    """Truth: on 16 by 8 cells, cell (ix, iy) has the index ix * 8 + iy."""
    result = scene.with_(**{"frame.cells": [16, 8]}).run()
    pressure = result.to_grid(result.pressure)
    assert pressure.shape == (16, 8)
    assert np.allclose(result.to_grid(result.xy)[:, 0, 0], (np.arange(16) + 0.5) * 0.05 - 0.4, rtol=0, atol=1e-15)
    assert pressure[8, 4] == result.pressure[8 * 8 + 4]


SLOW = """
import signal, sys, orthowear
# Shells start what they put into the background deaf to it.
signal.signal(signal.SIGINT, signal.default_int_handler)
scene = orthowear.Scene.load(sys.argv[1], {
    "frame.cells": [256, 256], "steps.press.increments": 500, "output.fields": []})
try:
    print("ready", flush=True)
    %s
except KeyboardInterrupt:
    small = scene.replace({"frame.cells": [16, 16], "steps.press.increments": 1})
    print("stopped", small.run().status, flush=True)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
@pytest.mark.parametrize("work", ["scene.run()", "list(scene.steps())"])
def test_interrupt(work):
    """Truth: Ctrl-C raises KeyboardInterrupt, and a later run in the same process converges."""
    path = ROOT / "scenes" / "hertz.toml"
    child = subprocess.Popen([sys.executable, "-c", SLOW % work, path], stdout=subprocess.PIPE, text=True)
    assert child.stdout.readline() == "ready\n"
    time.sleep(0.5)
    sent = time.monotonic()
    os.kill(child.pid, signal.SIGINT)
    assert child.stdout.readline() == "stopped converged\n"
    assert time.monotonic() - sent < 2.0
    assert child.wait(10) == 0


def test_import_is_quick():
    """Truth: on an idle machine, the import takes 0.3 s after the import of NumPy. The limit of 1 s allows for a busy
    machine.
    """
    code = "import time, numpy; t = time.perf_counter(); import orthowear; print(time.perf_counter() - t)"
    times = [float(subprocess.check_output([sys.executable, "-c", code])) for _ in range(3)]
    assert min(times) < 1.0


def test_what_no_scene_has():
    """Truth: scenes have fewer than ten levels. The command line accepts 1 to 1024 threads."""
    endless: dict = {}
    endless["a"] = endless
    deep: dict = {}
    for _ in range(20_000):
        deep = {"a": deep}
    for materials in (endless, deep):
        with pytest.raises(orthowear.InputError, match="nested too deeply"):
            orthowear.Scene.from_dict({"materials": materials})
    for threads in (0, -1):
        with pytest.raises(ValueError, match="1 to 1024"):
            orthowear.Scene.load(ROOT / "scenes" / "hertz.toml").run(threads=threads)


def test_places_that_an_outline_leaves_out(scene):
    """Truth: on both axes, the centres are those of 16 cells over 0.8 mm, although the outline removes whole rows at
    the frame's edge.
    """
    outlined = scene.replace({"frame.outline": {"shape": "circle", "radius": 0.33}}).run()
    places = (np.arange(16) + 0.5) * 0.05 - 0.4
    assert outlined.fields.places.size < 256
    for axis in (0, 1):
        assert np.allclose(outlined.fields._along(axis), places, rtol=0, atol=1e-14)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"threads": "two"}, r"threads: 'two' is of the type str; allowed: whole numbers from 1 to 1024, or None"),
        ({"threads": 2.0}, "threads: 2.0 is of the type float; allowed: whole numbers"),
        ({"threads": True}, "threads: True is of the type bool"),
        ({"max_memory": [1]}, r'max_memory: \[1\] is of the type list; allowed: a number of bytes, a size like "4 GiB"'),
        ({"max_memory": True}, "max_memory: True is of the type bool"),
        ({"cache": "yes"}, "cache: 'yes' is of the type str; allowed: True or False"),
        ({"progress": 3}, "progress: 3 is of the type int; allowed: a function of"),
        ({"out": 3}, "out: 3 is of the type int; allowed: a path"),
    ],
)
def test_settings_of_wrong_types(scene, settings, message):
    """Truth: the error gives the name of the setting, the wrong value and the allowed values."""
    with pytest.raises(TypeError, match=message):
        scene.run(**settings)
    if "progress" in settings:
        return
    with pytest.raises(TypeError, match=message):
        scene.steps(**settings)
    if "out" not in settings:
        for method in (scene.check, scene.flexibility):
            with pytest.raises(TypeError, match=message):
                method(**settings)


def test_settings_of_numpy(scene):
    """Truth: NumPy values of the settings are accepted like the equal Python values."""
    assert scene.run(threads=np.int64(1), max_memory=np.int64(1 << 30), cache=np.bool_(False)).status == "converged"


def test_arguments_of_wrong_types(scene):
    """Truth: the message names the allowed values."""
    with pytest.raises(TypeError, match="path: 3 is of the type int; allowed: a path"):
        orthowear.Scene.load(3)
    with pytest.raises(TypeError, match="folder: 3 is of the type int; allowed: a path"):
        orthowear.Scene.from_dict({}, 3)
    for wrong in (3, "frame.cells", [("a", 1)]):
        with pytest.raises(TypeError, match="scene: .*allowed: a dict, such as"):
            orthowear.Scene.from_dict(wrong)
        with pytest.raises(TypeError, match="overrides: .*allowed: a dict, such as"):
            scene.replace(wrong)
        with pytest.raises(TypeError, match="overrides: .*allowed: a dict, such as"):
            orthowear.Scene.load(ROOT / "scenes" / "hertz.toml", wrong)
