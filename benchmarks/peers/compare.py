"""Runs the case with every program alternately, and prints medians, ratios and errors as a Markdown table.

The script benchmarks/peers/run calls this program. Each measurement is a separate process. The seconds of the peers
(the other programs) are the time of operator set-up and solution, without imports. The seconds of orthowear are the
time of all its stages from the cold start to the certificate. The wall-clock time of the process is a separate
column.
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from datetime import date
from pathlib import Path

import meshio
import numpy as np

import hertz

HERE = Path(__file__).resolve().parent
PEERS = {
    "tamaas": "tamaas-and-contact-mechanics",
    "ContactMechanics": "tamaas-and-contact-mechanics",
    "slippy": "slippy",
}
SCENE = """
[materials.steel]
model = "isotropic"
E = {young}
nu = {poisson}
[body1]
kind = "half-space"
material = "steel"
[body2]
kind = "rigid"
[frame]
kind = "grid"
half_width = [{half_width}, {half_width}]
cells = [{cells}, {cells}]
[gap]
kind = "sphere"
radius = {radius}
[friction]
law = "none"
[[steps]]
name = "press"
normal_force = {force}
[solver]
tolerance = {tolerance}
[output]
fields = []
"""


def orthowear(target, folder, n, threads):
    """Runs orthowear without fields. Returns the seconds of set-up, solution and process, the iterations, and the
    pressures. The pressures come from another run with fields.
    """
    scene = folder / "hertz.toml"
    scene.write_text(SCENE.format(young=hertz.YOUNG, poisson=hertz.POISSON, half_width=repr(hertz.WIDTH / 2), cells=n,
                                  radius=hertz.RADIUS, force=hertz.FORCE, tolerance=hertz.TOLERANCE), encoding="utf-8")
    command = [target / "release/orthowear", "run", scene, "--quiet", "--threads", str(threads)]
    started = time.perf_counter()
    subprocess.run([*command, "--out", folder / "out"], check=True)
    process = time.perf_counter() - started
    summary = json.loads((folder / "out/summary.json").read_text(encoding="utf-8"))
    if n not in ORTHOWEAR_PRESSURES:
        subprocess.run([*command, "--out", folder / "fields", "--set", 'output.fields=["vtu"]'], check=True)
        (path,) = (folder / "fields").glob("frame_*.vtu")
        ORTHOWEAR_PRESSURES[n] = cell_pressures(path, n)
    step = summary["steps"][-1]
    return {"set_up": sum(summary["timings"].values()) - step["seconds"], "solve": step["seconds"], "process": process,
            "iterations": step["iterations"], "pressure": ORTHOWEAR_PRESSURES[n]}


ORTHOWEAR_PRESSURES = {}


def cell_pressures(path, n):
    """Reads the pressures of a VTU file, [n, n], sorted by cell position."""
    mesh = meshio.read(path)
    middle = mesh.points[mesh.cells[0].data].mean(axis=1)
    index = np.rint((middle[:, :2] / hertz.WIDTH + 0.5) * n - 0.5).astype(int)
    pressure = np.zeros((n, n))
    pressure[index[:, 0], index[:, 1]] = mesh.cell_data["pressure"][0]
    return pressure


def peer(program, target, folder, n, threads):
    """Runs a peer. Returns the seconds of set-up and solution, iterations and pressures, or None if the run fails."""
    file = folder / "pressure.npy"
    environment = {**os.environ, "OMP_NUM_THREADS": str(threads), "OPENBLAS_NUM_THREADS": str(threads)}
    python = target / "peers" / PEERS[program] / "bin/python"
    done = subprocess.run([python, HERE / "solve.py", program, str(n), str(threads), file], env=environment,
                          capture_output=True, text=True, check=False)
    if done.returncode != 0:
        print(f"{program}, {n} cells: {done.stderr.strip().splitlines()[-1]}", file=sys.stderr)
        return None
    return {**json.loads(done.stdout.splitlines()[-1]), "pressure": np.load(file)}


def measure(run, programs, repeats):
    """Runs all programs in turn, `repeats` times. Returns {program: [run]}."""
    runs = {program: [] for program in programs}
    for _ in range(repeats):
        for program in programs:
            one = run(program)
            if one is not None:
                runs[program].append(one)
    return runs


def row(n, threads, program, runs, reference):
    """A row of the table (medians of the times, errors of the last run), and the median of the seconds of set-up and
    solution.
    """
    seconds = [one["set_up"] + one["solve"] for one in runs]
    median = statistics.median(seconds)
    solve = statistics.median(one["solve"] for one in runs)
    process = statistics.median(one["process"] for one in runs) if "process" in runs[0] else None
    found = hertz.errors(runs[-1]["pressure"])
    cells = [str(n), str(threads), program, f"{median:.3g}", f"{solve:.3g}", f"{process:.3g}" if process else "",
             f"{median / reference:.1f}" if reference else "1", f"{min(seconds):.3g} to {max(seconds):.3g}"]
    cells += [f"{found[key]:.1e}" for key in ("force", "approach", "area", "peak", "l2", "residual")]
    return "| " + " | ".join(cells) + " |", median


def installed(target):
    """Peers with a complete environment."""
    return [name for name, folder in PEERS.items() if (target / "peers" / folder / "made-from").exists()]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--target", type=Path, required=True)
    parser.add_argument("--cells", type=int, nargs="+", default=[128, 256, 512])
    parser.add_argument("--threads", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--out", type=Path)
    arguments = parser.parse_args()
    processor = next((line.split(":")[1].strip() for line in open("/proc/cpuinfo", encoding="utf-8")
                      if line.startswith("model name")), "unknown")
    load = os.getloadavg()[0]
    lines = ["| cells | threads | program | s | of which solve | process | times as long | range | force | approach | area "
             "| peak | L2 | residual |", "|" + "---|" * 14]
    programs = ["orthowear", *installed(arguments.target)]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for n in arguments.cells:
            for threads in arguments.threads:
                def run(program, n=n, threads=threads):
                    if program == "orthowear":
                        return orthowear(arguments.target, folder, n, threads)
                    return peer(program, arguments.target, folder, n, threads)
                runs = measure(run, programs, arguments.repeats)
                reference = None
                for program in programs:
                    if not runs[program]:
                        lines.append(f"| {n} | {threads} | {program} | failed |" + " |" * 10)
                        continue
                    line, median = row(n, threads, program, runs[program], reference)
                    reference = reference or median
                    lines.append(line)
                print("\n".join(lines[-len(programs):]), file=sys.stderr, flush=True)
    head = (f"{date.today()}; {processor}; load {load:.1f} at the start, {os.getloadavg()[0]:.1f} at the end; medians of "
            f"{arguments.repeats} runs, alternating.")
    text = head + "\n\n" + "\n".join(lines) + "\n"
    print(text)
    if arguments.out:
        arguments.out.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
