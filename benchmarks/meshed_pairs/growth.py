"""Iterations of the contact solver against the number of cells and the thickness, for two overlapping plates.

    python growth.py PROGRAM [--cells 8 16 32 50] [--thickness 1 0.25 0.08 0.03]

Each plate is of aluminium, 15 mm long and 10 mm wide, and fixed at its outer end. The plates overlap by 10 mm. They
are pressed together and pulled by 0.8 of the friction limit at 30 degrees, in four increments. The cells are the
nodes of one contact surface. --cells is the number of nodes along each side, --thickness the thickness of a plate
divided by its width.
"""
import argparse
import tempfile
from pathlib import Path

import numpy as np
from pairs import mesh_text, run

WIDTH = 10.0  # mm
LAYERS = 4
MU = 0.3
PRESSURE = 1.0  # mean contact pressure, MPa


def plates(n, thickness):
    """Makes the scene and the meshes with `n` nodes along each side of the contact surface."""
    half, height = WIDTH / 2, thickness * WIDTH
    inner, ys = np.linspace(-half, half, n), np.linspace(-half, half, n)
    outer = np.linspace(half, 2 * half, max(2, n // 2 + 1))[1:]
    flat = lambda x, y: 0.0
    zs = np.linspace(0.0, height, LAYERS + 1)
    meshes = {
        "body1.msh": mesh_text("hex8", np.concatenate([-outer[::-1], inner]), ys, zs - height, (half, half), True, flat)[0],
        "body2.msh": mesh_text("hex8", np.concatenate([inner, outer]), ys, zs, (half, half), False, flat)[0],
    }
    body = '[body{}]\nkind = "fe"\nmaterial = "aluminium"\nmesh = "body{}.msh"\ncontact = "contact"\nnear_field = "mesh"\nfixed = [{{ group = "{}" }}]\n'
    normal = PRESSURE * WIDTH**2
    pull = 0.8 * MU * normal * np.array([np.cos(np.radians(30)), np.sin(np.radians(30))])
    scene = '[materials.aluminium]\nmodel = "isotropic"\nE = 70e3\nnu = 0.3\n' + body.format(1, 1, "left") + body.format(2, 2, "right")
    scene += f'[frame]\nkind = "mesh"\nbody = 1\npoints = "nodes"\n[gap]\nkind = "flat"\n[friction]\nlaw = "coulomb"\nmu = {MU}\n[output]\nfields = []\n'
    scene += f'[[steps]]\nname = "press"\nnormal_force = {normal}\n[[steps]]\nname = "pull"\ntangential_force = [{pull[0]}, {pull[1]}]\nincrements = 4\n'
    return {"scene": scene, "meshes": meshes, "mu": MU, "slope": 0.0}


def main():
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("program")
    options.add_argument("--cells", type=int, nargs="+", default=[8, 16, 32, 50], help="contact nodes along each side")
    options.add_argument("--thickness", type=float, nargs="+", default=[1.0, 0.25, 0.08, 0.03])
    chosen = options.parse_args()
    print("cells,thickness_over_width,outcome,iterations,operator_applications,contact_seconds,seconds")
    with tempfile.TemporaryDirectory() as folder:
        for n in chosen.cells:
            for thickness in chosen.thickness:
                row, _ = run(chosen.program, plates(n, thickness), Path(folder) / f"{n}-{thickness}", threads=2)
                print(f"{n * n},{thickness},{row['outcome']},{row['iterations']},{row['operator_applications']},{row['contact_seconds']:.2f},{row['wall']:.1f}", flush=True)


if __name__ == "__main__":
    main()
