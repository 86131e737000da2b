"""Compares the forces in summary.json with the traction fields. The force is the sum over the cells of traction x
area.

    resultants.py DIR

DIR is the output directory of a run on a frame along x, y, with one frame file per entry.
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
        on_body2 = (field["traction"] * field["area"][:, None]).sum(axis=0)
        scale = abs(step["normal_force"])
        # Tractions act on body 2. summary.json contains the tangential force on body 1, and the normal force as
        # positive compression.
        assert abs(on_body2[2] - step["normal_force"]) < 1e-12 * scale, (number, on_body2, step["normal_force"])
        assert np.abs(on_body2[:2] + step["tangential_force"]).max() < 1e-12 * scale, (number, on_body2)
        area = field["area"][field["pressure"] > 0].sum()
        assert abs(area - step["contact_area"]) < 1e-12 * area, (number, area, step["contact_area"])
        assert field["pressure"].max() == step["peak_pressure"], number
        assert np.array_equal(field["status"] > 0, field["pressure"] > 0), number
        assert field["wear_depth"].max() == step["max_wear_depth"], number
        # Pressure pushes the two surfaces apart: body 1 is displaced downwards, and body 2 upwards.
        u1, u2 = (meshio.read(out / f"{body}_{number:04d}.vtu") for body in ("body1", "body2"))
        u1, u2 = (np.concatenate(body.cell_data["displacement"]) for body in (u1, u2))
        assert (u1[field["pressure"] > 0, 2] < 0).all() and (u2[field["pressure"] > 0, 2] > 0).all(), number
    print(f"{len(steps)} entries agree")


main(Path(sys.argv[1]))
