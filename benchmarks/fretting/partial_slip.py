#!/usr/bin/env python3
"""Wear of a fretting cycle in partial slip: settings of `cycles.increments` against a calculation stroke by stroke.

usage: partial_slip.py PROGRAM [--scenes 10] [--seed 1] [--cells 16] [--cycles 30]

Scenes are random: a steel sphere on a CFRP half-space with tilted fibres, under an amplitude of force or displacement. The
reference is the last of `--cycles` cycles, with the strokes as load points of a `history` in 32 and 64 increments each. It is
extrapolated with first order in the increments. Wear coefficients are so small that the shape does not change. The program
prints relative errors of the wear volume per cycle, and the estimated errors.
"""
import argparse
import json
import math
import random
import subprocess
import sys
import tempfile
from pathlib import Path

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


def draw(generator):
    """A random scene: fibre, laws, load and path."""
    mu = generator.uniform(0.3, 0.7)
    forced = generator.random() < 0.5
    return {
        "tilt": generator.uniform(-80.0, 80.0),
        "azimuth": generator.uniform(0.0, 180.0),
        "angle": generator.uniform(0.0, 360.0),
        "mu": mu,
        "wear": [1e-16 * generator.uniform(1.0, 3.0) for _ in range(3)],
        "forced": forced,
        # Amplitude of the force (N), or displacement amplitude (mm): from a narrow slip annulus to slip in most of the contact.
        "amplitude": generator.uniform(0.5, 0.95) * mu * 200.0 if forced else generator.uniform(0.002, 0.006),
    }


def text(scene, cells, steps):
    """The scene as TOML, with its `steps`."""
    wear = "\n".join(f"{name} = {value}" for name, value in zip(("i_L", "i_T", "i_N"), scene["wear"]))
    return f"""{MATERIALS}
[body1]
kind = "half-space"
material = "im7"
fibre = {{ tilt = {scene['tilt']}, azimuth = {scene['azimuth']} }}
[frame]
kind = "grid"
half_width = [1.25, 1.25]
cells = [{cells}, {cells}]
[friction]
law = "coulomb"
mu = {scene['mu']}
[wear]
law = "frp"
{wear}
[output]
fields = []
[[steps]]
name = "press"
normal_force = 200.0
{'tangential_force = [0.0, 0.0]' if scene['forced'] else ''}
increments = 4
wear = false
{steps}
"""


def run(program, folder, scene, cells, steps):
    """Entries `steps` of the summary of a run. Raises an error if the run does not converge."""
    path = folder / "scene.toml"
    path.write_text(text(scene, cells, steps))
    out = folder / "out"
    done = subprocess.run([program, "run", path, "--out", out, "--quiet"], capture_output=True, text=True)
    if done.returncode != 0:
        raise RuntimeError(f"exit {done.returncode}: {done.stderr[-400:]}")
    return json.loads((out / "summary.json").read_text())["steps"]


def marched(program, folder, scene, cells, cycles, increments):
    """Wear volumes of the last cycle and of the cycle before, calculated stroke by stroke."""
    x, y = (scene["amplitude"] * f(math.radians(scene["angle"])) for f in (math.cos, math.sin))
    columns = ["tangential_x", "tangential_y"] if scene["forced"] else ["shift_x", "shift_y"]
    # Each stroke is one load point, divided into increments. The first stroke starts at the centre.
    rows = [f"{sign * x},{sign * y}" for _ in range(cycles) for sign in (1, -1)] + [f"{x},{y}"]
    (folder / "loads.csv").write_text("\n".join(rows) + "\n")
    steps = f"""[[steps]]
name = "strokes"
history = {{ file = "loads.csv", columns = {json.dumps(columns)} }}
increments = {increments}
"""
    entries = run(program, folder, scene, cells, steps)[4:]
    volume = [0.0] + [entries[k * increments - 1]["worn_volume"] for k in range(1, len(rows) + 1)]
    return volume[-1] - volume[-3], volume[-3] - volume[-5]


def cycle(program, folder, scene, cells, increments):
    """Wear volume of a cycle, its estimated error, and seconds."""
    key = "force_amplitude" if scene["forced"] else "amplitude"
    chosen = "" if increments is None else f", increments = {json.dumps(increments)}"
    steps = f"""[[steps]]
name = "fretting"
cycles = {{ count = 1, jumps = 1, {key} = {scene['amplitude']}, angle = {scene['angle']}{chosen} }}
"""
    entry = run(program, folder, scene, cells, steps)[-1]
    return entry["worn_volume"], entry["worn_volume_error"], entry["seconds"]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("--scenes", type=int, default=10)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--cells", type=int, default=16)
    parser.add_argument("--cycles", type=int, default=30)
    arguments = parser.parse_args()
    generator = random.Random(arguments.seed)
    settings = [1, 4, "auto", None]
    print("scene                                   marched   64:32  settled", *(f"{s or 'default'!s:>20}" for s in settings))
    worst = 0.0
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        for _ in range(arguments.scenes):
            scene = draw(generator)
            fixed = (arguments.program, folder, scene, arguments.cells)
            coarse, _ = marched(*fixed, arguments.cycles, 32)
            truth, before = marched(*fixed, arguments.cycles, 64)
            drive = f"{scene['amplitude']:.3g} {'N' if scene['forced'] else 'mm'}"
            # The error is of first order in the increments.
            limit = 2 * truth - coarse
            name = f"{scene['tilt']:5.1f} {scene['azimuth']:5.1f} {scene['angle']:5.1f} mu {scene['mu']:.2f} {drive:9}"
            columns = []
            for setting in settings:
                try:
                    wear, claimed, _ = cycle(*fixed, setting)
                except RuntimeError as error:
                    columns.append(f"{str(error)[:20]:>20}")
                    continue
                columns.append(f"{100 * (wear / limit - 1):+8.3f} ({100 * claimed / wear:.3f}) %")
                if setting is None:
                    worst = max(worst, abs(wear / limit - 1))
            print(f"{name:38} {truth:.3e} {100 * (truth / coarse - 1):+6.2f} {100 * (truth / before - 1):+7.3f}",
                  *(f"{c:>20}" for c in columns), flush=True)
    print(f"largest error of the default: {100 * worst:.2f} %")
    return 0


if __name__ == "__main__":
    sys.exit(main())
