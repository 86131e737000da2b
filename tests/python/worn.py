"""Compares the wear volumes in summary.json with the wear depths of the bodies. The volume is the sum over the cells
of depth x area.

    worn.py DIR

DIR is the output directory of a run with one frame file per entry.
"""

import json
import sys
from pathlib import Path

import meshio
import numpy as np


def main(out):
    steps = json.loads((out / "summary.json").read_text())["steps"]
    for number, step in enumerate(steps, 1):
        mesh = meshio.read(out / f"frame_{number:04d}.vtu")
        field = {name: np.concatenate(blocks) for name, blocks in mesh.cell_data.items()}
        depths = [field["wear_depth_body1"], field["wear_depth_body2"]]
        assert np.abs(depths[0] + depths[1] - field["wear_depth"]).max() <= 1e-15 * field["wear_depth"].max(), number
        for depth, volume in zip(depths, step["worn_volume_by_body"]):
            assert abs((depth * field["area"]).sum() - volume) <= 1e-12 * step["worn_volume"], (number, volume)
    assert steps[-1]["worn_volume_by_body"][1] > steps[-1]["worn_volume_by_body"][0] > 0
    print(f"{len(steps)} entries agree")


main(Path(sys.argv[1]))
