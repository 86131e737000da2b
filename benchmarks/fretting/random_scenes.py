#!/usr/bin/env python3
"""Random fretting scenes: errors of wear volumes and tangential forces, estimated errors and times.

    random_scenes.py PROGRAM [--count 200] [--only N ..] [--seed 1] [--increments N] [--whole] [--processes 2]
                     [--truth FILE.json] [--check FILE.json] [--out FILE.csv]

A steel sphere is pressed by a force on steel or CFRP, and moved along a line. In a tenth of the scenes it moves
along an ellipse. In three quarters of the scenes the amplitude of force or displacement is 0.3 to 0.99 of the
amplitude at gross slip. In the others it exceeds this amplitude: forces by up to 20 %, displacements by a factor of
up to 20. Each scene runs twice:

* One cycle with negligible wear. The reference is a `history` of load points with 32 and 64 equal increments per
  stroke (ellipse: 64 and 128). The cycles repeat until their second half and the quarter before change the wear of
  a cycle by at most 1e-4 of its value, at most 400 times. If the wear volumes of 32 and 64 increments differ by more than half the tolerance, 64
  and 128 are used. The reference is extrapolated with first order in the increments.
* All cycles, if `--whole` is given. The reference is extrapolated with first order in the increments, from two runs
  with a tenth of the tolerance and with 32 and 64 increments per stroke (ellipse: 64 and 128).

Errors are relative to the wear volume, or to the largest force at a reversal point. Each scene has a row. The last
lines count the rows within the tolerance.
"""
import argparse
import csv
import json
import math
import multiprocessing
import os
import random
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

NORMAL_FORCE = 200.0  # N
TOLERANCE = 1e-3  # default of wear.tolerance
MATERIALS = """
[materials.steel]
model = "isotropic"
E = 210e3
nu = 0.3
[materials.im7]
model = "orthotropic"
E1 = 167230.0
E2 = 9544.0
E3 = 9544.0
G12 = 5292.0
G13 = 5292.0
G23 = 3483.0
nu12 = 0.272
nu13 = 0.272
nu23 = 0.369
[body2]
kind = "half-space"
material = "steel"
[gap]
kind = "sphere"
radius = 50.0
"""


def draw(seed, number):
    """Draws a random scene: bodies, laws, path and cells. `share` is the ratio of the amplitude to the amplitude at
    gross slip.
    """
    generator = random.Random(f"{seed} {number}")
    uniform = generator.uniform
    forced = generator.random() < 0.5
    beyond = generator.random() < 0.25
    scene = {
        "cfrp": generator.random() < 0.75,
        "tilt": uniform(-80.0, 80.0),
        "azimuth": uniform(0.0, 180.0),
        "angle": uniform(0.0, 360.0),
        "mu": [uniform(0.2, 0.7) for _ in range(2)],
        "elliptic": generator.random() < 0.5,
        "wear": [1e-8 * uniform(1.0, 3.0) for _ in range(3)],
        "count": round(10.0 ** uniform(3.0, 5.0)),
        "forced": forced,
        "share": (uniform(1.001, 1.2) if forced else 10.0 ** uniform(0.0, 1.3)) if beyond else uniform(0.3, 0.99),
        "minor": uniform(0.3, 1.0) if generator.random() < 0.1 else None,
        "cells": generator.choices([16, 20, 24, 32, 48], [6, 4, 3, 2, 1])[0],
    }
    if not scene["elliptic"]:
        scene["mu"][1] = scene["mu"][0]
    return scene


def largest_force(scene, angle):
    """Tangential force along the direction `angle` (degrees) at which the whole contact slips, N."""
    first, second = scene["mu"]
    turned = math.radians(angle - scene["azimuth"])
    return NORMAL_FORCE / math.hypot(math.cos(turned) / first, math.sin(turned) / second)


def text(scene, steps, wear=1.0, tolerance=TOLERANCE):
    """Returns the scene as TOML with the given `steps`. `wear` is a factor on the wear coefficients."""
    body = f'material = "im7"\nfibre = {{ tilt = {scene["tilt"]}, azimuth = {scene["azimuth"]} }}' if scene["cfrp"] else 'material = "steel"'
    first, second = scene["mu"]
    friction = f'law = "elliptic"\nmu1 = {first}\nmu2 = {second}\nangle = {scene["azimuth"]}' if scene["elliptic"] else f'law = "coulomb"\nmu = {first}'
    coefficients = [wear * value for value in scene["wear"]]
    names = ("i_L", "i_T", "i_N")
    worn = 'law = "frp"\n' + "\n".join(f"{name} = {value}" for name, value in zip(names, coefficients)) if scene["cfrp"] else f'law = "archard"\ni = {coefficients[0]}'
    side = 1.25 if scene["cfrp"] else 0.7
    return f"""{MATERIALS}
[body1]
kind = "half-space"
{body}
[frame]
kind = "grid"
half_width = [{side}, {side}]
cells = [{scene['cells']}, {scene['cells']}]
[friction]
{friction}
[wear]
{worn}
tolerance = {tolerance}
[output]
fields = []
[[steps]]
name = "press"
normal_force = {NORMAL_FORCE}
{'tangential_force = [0.0, 0.0]' if scene['forced'] else ''}
increments = 4
wear = false
{steps}
"""


class Failed(Exception):
    """A run did not converge. The message is its status."""


def run(program, folder, scene, steps, **changes):
    """Runs a scene, and returns the summary and the seconds of the run."""
    path, out = folder / "scene.toml", folder / "out"
    path.write_text(text(scene, steps, **changes))
    start = time.perf_counter()
    environment = {**os.environ, "RAYON_NUM_THREADS": "1"}
    done = subprocess.run([program, "run", path, "--out", out, "--quiet"], capture_output=True, text=True, env=environment)
    seconds = time.perf_counter() - start
    if done.returncode not in (0, 3, 4):
        raise RuntimeError(f"exit {done.returncode}: {done.stderr[-400:]}")
    summary = json.loads((out / "summary.json").read_text())
    if done.returncode != 0:
        raise Failed(summary["status"])
    return summary, seconds


def amplitude(program, folder, scene):
    """Amplitude of the force (N), or of the displacement (mm). The displacement at gross slip is 1.5 times the
    displacement at which the initial stiffness gives the friction limit (Mindlin).
    """
    if scene["forced"]:
        return scene["share"] * largest_force(scene, scene["angle"])
    way = 1e-6
    step = f'[[steps]]\nname = "touch"\nshift = {{ distance = {way}, angle = {scene["angle"]} }}\nwear = false\n'
    summary, _ = run(program, folder, scene, step)
    # If fibres are inclined, pressing alone gives a tangential force, which is subtracted.
    pressed, moved = (entry["tangential_force"] for entry in summary["steps"][-2:])
    force = [now - before for now, before in zip(moved, pressed)]
    direction = math.degrees(math.atan2(force[1], force[0]))
    return scene["share"] * 1.5 * largest_force(scene, direction) * way / math.hypot(*force)


def path_points(scene, size, increments):
    """Positions of a cycle after its + reversal point, with `increments` positions per stroke."""
    cosine, sine = (f(math.radians(scene["angle"])) for f in (math.cos, math.sin))
    points = []
    for point in range(1, 2 * increments + 1):
        phase = math.pi * point / increments
        along = size * math.cos(phase)
        across = (scene["minor"] or 0.0) * size * math.sin(phase)
        if scene["minor"] is None:
            along = size * (abs(2 * point / increments - 2) - 1)
        points.append((along * cosine - across * sine, along * sine + across * cosine))
    return points


def marched(program, folder, scene, size, increments, cycles):
    """Computes `cycles` cycles in increments. Returns the wear volume of each cycle, and the tangential forces at the
    reversal points (+, -) of the last cycle.
    """
    columns = ["tangential_x", "tangential_y"] if scene["forced"] else ["shift_x", "shift_y"]
    points = path_points(scene, size, increments)
    first = points[-1]
    rows = [(first[0] * k / increments, first[1] * k / increments) for k in range(1, increments + 1)] + cycles * points
    (folder / "loads.csv").write_text("".join(f"{x!r},{y!r}\n" for x, y in rows))
    steps = f'[[steps]]\nname = "strokes"\nhistory = {{ file = "loads.csv", columns = {json.dumps(columns)} }}\n'
    summary, _ = run(program, folder, scene, steps, wear=1e-8)
    entries = summary["steps"]
    volume = [entries[-1 - 2 * increments * k]["worn_volume"] for k in range(cycles, -1, -1)]
    forces = [entries[-1 - increments * k]["tangential_force"] for k in range(2)]
    return [after - before for before, after in zip(volume, volume[1:])], forces


def settled(program, folder, scene, size, increments, least=20):
    """As `marched`, with at least `least` cycles, and more until the wear of a cycle settles. Returns the number of
    cycles, the wear volume of the last cycle, its change since half as many cycles, and the forces of the last cycle. A
    small change from one cycle to the next is no proof: in some scenes the wear of a cycle has a maximum and a minimum
    before it settles.
    """
    for cycles in (20, 50, 120, 400):
        if cycles < least:
            continue
        volumes, forces = marched(program, folder, scene, size, increments, cycles)
        last, half, quarter = (volumes[cycles // share - 1] for share in (1, 2, 4))
        if max(abs(last - half), abs(half - quarter)) <= 1e-4 * last:
            break
    return cycles, last, last - half, forces


def cycles_step(scene, size, count, increments, more=""):
    key = "force_amplitude" if scene["forced"] else "amplitude"
    minor = f', path = "ellipse", amplitude2 = {scene["minor"] * size}' if scene["minor"] else ""
    chosen = "" if increments is None else f", increments = {json.dumps(increments)}"
    return f'[[steps]]\nname = "fretting"\ncycles = {{ count = {count}, {key} = {size}, angle = {scene["angle"]}{minor}{chosen}{more} }}\n'


def truth_of_cycle(program, folder, scene, size):
    """Reference of one cycle: extrapolated wear volume, its changes by refinement and by the last half of the cycles,
    and extrapolated forces at the reversal points.
    """
    first = 32 if scene["minor"] is None else 64
    cycles, coarse, _, coarse_forces = settled(program, folder, scene, size, first)
    cycles, fine, settling, fine_forces = settled(program, folder, scene, size, 2 * first, cycles)
    if scene["minor"] is None and abs(fine - coarse) > 0.5 * TOLERANCE * fine:
        coarse, coarse_forces = fine, fine_forces
        _, fine, settling, fine_forces = settled(program, folder, scene, size, 4 * first, cycles)
    return {
        "volume": 2 * fine - coarse,
        "change": fine - coarse,
        "settling": settling,
        "forces": [[2 * f - c for f, c in zip(*both)] for both in zip(fine_forces, coarse_forces)],
    }


def truth_of_all(program, folder, scene, size):
    """Reference of all cycles with a tenth of the tolerance: extrapolated wear volume, and its change by refinement.
    The program does not extrapolate a given number of increments, so this function does.
    """
    first = 32 if scene["minor"] is None else 64
    both = [run(program, folder, scene, cycles_step(scene, size, scene["count"], n), tolerance=TOLERANCE / 10)[0] for n in (first, 2 * first)]
    coarse, fine = (summary["steps"][-1]["worn_volume"] for summary in both)
    return {"volume": 2 * fine - coarse, "change": fine - coarse}


def one_cycle(program, folder, scene, size, increments, truth):
    """Errors of one cycle, its estimated error, and the time of the run."""
    summary, seconds = run(program, folder, scene, cycles_step(scene, size, 1, increments, ", jumps = 1"), wear=1e-8)
    entry = summary["steps"][-1]
    largest = max(math.hypot(*force) for force in truth["forces"])
    found = [end["tangential_force"] for end in entry["stroke_ends"]]
    relative = lambda value: value / truth["volume"] if truth["volume"] > 0.0 else value
    return {
        "cycle_error": relative(entry["worn_volume"] - truth["volume"]),
        "cycle_estimate": relative(entry["worn_volume_error"]),
        "force_error": max(math.dist(*both) for both in zip(found, truth["forces"])) / largest,
        "truth_change": relative(truth["change"]),
        "truth_settling": relative(truth["settling"]),
        "cycle_seconds": seconds,
        "cycle_warnings": len(summary.get("warnings", [])),
    }


def checked_scene(seed, number, size, truth):
    """Scene of one cycle with its reference values, for tests/data/fretting-cycles.json."""
    scene = draw(seed, number)
    steps = cycles_step(scene, size, 1, None, ", jumps = 1")
    return {"number": number, "ellipse": scene["minor"] is not None, "volume": truth["volume"], "forces": truth["forces"], "scene": text(scene, steps, wear=1e-8)}


def all_cycles(program, folder, scene, size, increments, truth):
    """Error of the wear volume of all cycles, its estimated error, and the time of the run."""
    summary, seconds = run(program, folder, scene, cycles_step(scene, size, scene["count"], increments))
    entry = summary["steps"][-1]
    relative = lambda value: value / truth["volume"] if truth["volume"] > 0.0 else value
    return {
        "error": relative(entry["worn_volume"] - truth["volume"]),
        "estimate": relative(entry["worn_volume_error"]),
        "reference_change": relative(truth["change"]),
        "max_wear_depth": entry["max_wear_depth"],
        "seconds": seconds,
        "warnings": len(summary.get("warnings", [])),
    }


def measure(task):
    """Computes the row of a scene in the table, and the reference values of the scene."""
    program, seed, number, increments, whole, truth = task
    scene = draw(seed, number)
    row = {"number": number, **{key: scene[key] for key in ("cfrp", "tilt", "angle", "share", "forced", "cells", "minor", "elliptic")}}
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        fixed = (program, folder, scene)
        try:
            size = amplitude(*fixed)
            row["amplitude"] = size
            if "cycle" not in truth:
                truth["cycle"] = truth_of_cycle(*fixed, size)
            row |= one_cycle(*fixed, size, increments, truth["cycle"])
            if whole:
                if "all" not in truth:
                    truth["all"] = truth_of_all(*fixed, size)
                row |= all_cycles(*fixed, size, increments, truth["all"])
            row["status"] = "converged"
        except Failed as failed:
            row["status"] = str(failed)
    return row, truth


COLUMNS = [
    "number", "cfrp", "tilt", "angle", "share", "forced", "cells", "minor", "elliptic", "amplitude", "status", "cycle_error", "cycle_estimate",
    "force_error", "truth_change", "truth_settling", "cycle_seconds", "cycle_warnings", "error", "estimate", "reference_change", "seconds",
    "warnings", "max_wear_depth",
]


def report(rows, error, estimate, seconds):
    """Prints how many errors are within the tolerance, and how many estimates are close to the errors."""
    found = [row for row in rows if row.get(error) is not None]
    if not found:
        return
    share = lambda test: f"{sum(map(test, found))} of {len(found)}"
    size = lambda row: abs(row[error])
    print(f"{error} within {TOLERANCE:g}: {share(lambda row: size(row) <= TOLERANCE)}; "
          f"estimate within a factor of 3: {share(lambda row: size(row) / 3 <= row[estimate] <= 3 * size(row))}; "
          f"below a tenth of the error: {share(lambda row: row[estimate] < size(row) / 10)}; "
          f"below the error: {share(lambda row: row[estimate] < size(row))}")
    times = [row[seconds] for row in found]
    print(f"{seconds}: median {statistics.median(times):.2f}, worst {max(times):.2f}; largest {error} {max(map(size, found)):.2e}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=Path)
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--only", type=int, nargs="+", help="numbers of scenes")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--increments", type=json.loads, help='value of cycles.increments, "auto" in quotes; default: not given')
    parser.add_argument("--whole", action="store_true", help="run all cycles, too")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--truth", type=Path, help="JSON file of truths: those of scenes not in it are calculated and added")
    parser.add_argument("--check", type=Path, help="JSON file for the scenes with their truths, as tests/data/fretting-cycles.json")
    parser.add_argument("--out", type=Path)
    chosen = parser.parse_args()
    program = chosen.program.resolve()
    truths = json.loads(chosen.truth.read_text()) if chosen.truth and chosen.truth.exists() else {}
    numbers = chosen.only or range(chosen.count)
    tasks = [(program, chosen.seed, number, chosen.increments, chosen.whole, truths.get(f"{chosen.seed} {number}", {})) for number in numbers]
    rows, checked = [], []
    file = open(chosen.out, "w", newline="") if chosen.out else sys.stdout
    writer = csv.DictWriter(file, COLUMNS)
    writer.writeheader()
    with multiprocessing.Pool(chosen.processes) as pool:
        for row, truth in pool.imap(measure, tasks):
            rows.append(row)
            if chosen.check and row["status"] == "converged":
                checked.append(checked_scene(chosen.seed, row["number"], row["amplitude"], truth["cycle"]))
                chosen.check.write_text(json.dumps(checked, indent=1) + "\n")
            if chosen.truth:
                truths[f"{chosen.seed} {row['number']}"] = truth
                chosen.truth.write_text(json.dumps(truths, indent=1) + "\n")
            writer.writerow({key: f"{value:.5g}" if isinstance(value, float) else value for key, value in row.items()})
            file.flush()
    for status in sorted({row["status"] for row in rows}):
        print(f"{status}: {sum(row['status'] == status for row in rows)}")
    report(rows, "cycle_error", "cycle_estimate", "cycle_seconds")
    report(rows, "error", "estimate", "seconds")
    forces = [row["force_error"] for row in rows if "force_error" in row]
    print(f"force_error within 1 %: {sum(error <= 0.01 for error in forces)} of {len(forces)}, largest {max(forces):.2e}")


if __name__ == "__main__":
    main()
