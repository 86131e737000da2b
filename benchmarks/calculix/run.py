#!/usr/bin/env python3
"""Compares orthowear and CalculiX: a steel cap pressed on a CFRP block with friction, on the same gmsh meshes.

    cargo build --release
    .venv/bin/python benchmarks/calculix/run.py [--out DIR] [CELLS ...] [--own CELLS ...] [--near-field CELLS ...]

Needs gmsh, CalculiX (`ccx`, Debian package calculix-ccx) and the Python environment of scripts/setup. CELLS are
numbers of elements along the contact patch (default 10). The numbers after --own (default 14 20) are for orthowear
only. The numbers after --near-field (default 4 6 8) are elements along the edges of a block without refinement at
the contact. These runs use near fields of half-spaces (near-field.toml).

Both programs get one thread. Times are CPU seconds (user and system) of the whole run: the least of three runs of
orthowear, one run of CalculiX. CalculiX enforces contact by a penalty, and each penalty stiffness has its own row.
Errors of the normal force are relative to REFERENCE.
"""

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
from datetime import date
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
PROGRAM = ROOT / "target/release/orthowear"
PENALTIES = [1e6, 1e7]


def cpu_seconds(command, cwd, log):
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    with open(log, "w", encoding="utf-8") as out:
        subprocess.run(command, cwd=cwd, stdout=out, stderr=subprocess.STDOUT, check=True,
                       env={**os.environ, "OMP_NUM_THREADS": "1"})
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def meshes(cells, folder):
    """Writes the meshes of block and cap with `cells` elements along the patch. Outside the patch, element sizes are
    approximately proportional to 1 / `cells`.
    """
    outer, depth = round(0.32 * cells) + 1, round(3.6 + 0.34 * cells)
    common = {"patch_cells": cells, "outer_cells": outer}
    for script, name, own in [
        ("cfrp-block", "block", {"depth_cells": depth, "first_depth": 3 / cells}),
        ("steel-cap", "cap", {"height_cells": depth, "first_height": 3 / cells}),
    ]:
        numbers = [text for key, value in {**common, **own}.items() for text in ("-setnumber", key, str(value))]
        subprocess.run(["gmsh", "-v", "1", "-3", "-nt", "1", str(ROOT / f"meshes/{script}.geo"), "-format", "msh22",
                        "-bin", *numbers, "-o", str(folder / f"{name}.msh")], check=True)


def coarse_meshes(cells, folder):
    """Writes meshes of the same bodies with `cells` elements along the edges of the block."""
    for script, name, own in [
        ("far-field-block", "block", {"half_size": 12, "depth": 12, "cells": cells}),
        ("steel-cap", "cap", {"patch_cells": 2, "outer_cells": cells // 2, "height_cells": cells // 2, "first_height": 2}),
    ]:
        numbers = [text for key, value in own.items() for text in ("-setnumber", key, str(value))]
        subprocess.run(["gmsh", "-v", "1", "-3", "-nt", "1", str(ROOT / f"meshes/{script}.geo"), "-format", "msh22",
                        "-bin", *numbers, "-o", str(folder / f"{name}.msh")], check=True)


def ours(folder, scene="scene.toml"):
    seconds, summary = [], None
    for _ in range(3):
        command = [PROGRAM, "run", HERE / scene, "--out", folder / "out", "--threads", "1", "--quiet",
                   "--set", f'body1.mesh="{folder}/block.msh"', "--set", f'body2.mesh="{folder}/cap.msh"']
        if "--no-cache" in subprocess.run([PROGRAM, "run", "--help"], capture_output=True, text=True).stdout:
            command.append("--no-cache")
        seconds.append(cpu_seconds([str(c) for c in command], folder, folder / "ours.log"))
    with open(folder / "out/summary.json", encoding="utf-8") as file:
        summary = json.load(file)
    return summary["steps"][-1]["normal_force"], min(seconds)


def calculix(folder, stiffness):
    subprocess.run([sys.executable, HERE / "deck.py", folder / "block.msh", folder / "cap.msh", folder / "job.inp",
                    "--stiffness", str(stiffness)], check=True)
    seconds = cpu_seconds(["ccx", "job"], folder, folder / "ccx.log")
    force = float((folder / "job.dat").read_text(encoding="ascii").split()[-1])
    equations = (folder / "ccx.log").read_text(encoding="utf-8").split("number of equations")[-1].split()[0]
    iterations = (folder / "job.sta").read_text(encoding="ascii").split()[-4]
    return force, seconds, equations, iterations


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cells", nargs="*", type=int, default=[10])
    parser.add_argument("--own", nargs="*", type=int, default=[14, 20])
    parser.add_argument("--near-field", nargs="*", type=int, default=[4, 6, 8])
    parser.add_argument("--out", type=Path, default=ROOT / "docs/benchmarks")
    parser.add_argument("--reference", type=float, default=REFERENCE)
    arguments = parser.parse_args()
    rows = ["program,cells,normal_force_N,relative_error,cpu_seconds,note"]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        def row(program, cells, force, seconds, note):
            error = force / arguments.reference - 1
            rows.append(f"{program},{cells},{force:.3f},{error:.5f},{seconds:.2f},{note}")
            print(rows[-1], flush=True)
        for cells in arguments.near_field:
            coarse_meshes(cells, folder)
            row("orthowear", cells, *ours(folder, "near-field.toml"), "near fields of half-spaces; cells along the block")
        for cells in arguments.cells + arguments.own:
            meshes(cells, folder)
            row("orthowear", cells, *ours(folder), "condensed meshes; cells along the patch")
            for stiffness in PENALTIES if cells in arguments.cells else []:
                force, seconds, equations, iterations = calculix(folder, stiffness)
                row("calculix", cells, force, seconds,
                    f"{equations} equations; {iterations} iterations; penalty {stiffness:g} N/mm3")
    version = subprocess.run(["ccx", "-v"], capture_output=True, text=True, check=False).stdout.split()[-1]
    load = " ".join(f"{value:.1f}" for value in os.getloadavg())
    processor = next((line.split(":")[1].strip() for line in open("/proc/cpuinfo", encoding="utf-8")
                      if line.startswith("model name")), "unknown")
    head = [f"# date: {date.today()}; machine: {processor}; load {load}; CalculiX {version}; one thread each",
            f"# reference: {arguments.reference} N"]
    (arguments.out / "calculix.csv").write_text("\n".join(head + rows) + "\n", encoding="utf-8")


# Limit of orthowear's normal force under mesh refinement, N (see benchmarks/README.md).
REFERENCE = 440.0

if __name__ == "__main__":
    main()
