#!/usr/bin/env python3
"""Writes the scene "steel cap pressed on a CFRP block" as an input deck of CalculiX, from the two gmsh meshes.

    deck.py BLOCK.msh CAP.msh OUT.inp [--stiffness K] [--friction MU] [--approach D] [--tilt DEG]

The meshes have the groups of meshes/README.md. K is the contact stiffness of CalculiX's penalty method, N/mm3.
"""

import argparse
import math

import meshio
import numpy as np

# Faces S1 to S6 of CalculiX's 8-node brick, by local nodes.
FACES = [(0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0)]


def read(path):
    mesh = meshio.read(path)
    names = {(dim, tag): name for name, (tag, dim) in mesh.field_data.items()}
    hexahedra = mesh.cells_dict["hexahedron"]
    quads = mesh.cells_dict["quad"]
    tags = mesh.cell_data_dict["gmsh:physical"]["quad"]
    groups = {names[2, tag]: quads[tags == tag] for tag in np.unique(tags)}
    return mesh.points, hexahedra, groups


def faces_of(hexahedra, quads):
    """Returns (element, face number) of each quadrilateral."""
    wanted = {tuple(sorted(quad)) for quad in quads.tolist()}
    found = []
    for element, nodes in enumerate(hexahedra.tolist()):
        for number, face in enumerate(FACES):
            if tuple(sorted(nodes[i] for i in face)) in wanted:
                found.append((element, number + 1))
    assert len(found) == len(wanted)
    return found


def write_set(out, keyword, numbers):
    out.write(f"{keyword}\n")
    for start in range(0, len(numbers), 12):
        out.write(", ".join(str(n) for n in numbers[start:start + 12]) + ",\n")


def write_part(out, part, name, first_node, first_element):
    points, hexahedra, _ = part
    out.write("*NODE\n")
    for i, (x, y, z) in enumerate(points):
        out.write(f"{i + first_node}, {x:.12g}, {y:.12g}, {z:.12g}\n")
    out.write(f"*ELEMENT, TYPE=C3D8I, ELSET={name}\n")
    for i, nodes in enumerate(hexahedra):
        out.write(f"{i + first_element}, " + ", ".join(str(n + first_node) for n in nodes) + "\n")


def write_surface(out, part, group, name, first_element):
    _, hexahedra, groups = part
    out.write(f"*SURFACE, NAME={name}, TYPE=ELEMENT\n")
    for element, face in faces_of(hexahedra, groups[group]):
        out.write(f"{element + first_element}, S{face}\n")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("block")
    parser.add_argument("cap")
    parser.add_argument("out")
    parser.add_argument("--stiffness", type=float, default=1e7)
    parser.add_argument("--friction", type=float, default=0.5)
    parser.add_argument("--approach", type=float, default=0.02)
    parser.add_argument("--tilt", type=float, default=30.0)
    arguments = parser.parse_args()
    block, cap = read(arguments.block), read(arguments.cap)
    node, element = len(block[0]) + 1, len(block[1]) + 1
    c, s = math.cos(math.radians(arguments.tilt)), math.sin(math.radians(arguments.tilt))
    with open(arguments.out, "w", encoding="ascii") as out:
        write_part(out, block, "BLOCK", 1, 1)
        write_part(out, cap, "CAP", node, element)
        write_set(out, "*NSET, NSET=BASE", sorted(set((block[2]["base"] + 1).ravel().tolist())))
        write_set(out, "*NSET, NSET=TOP", sorted(set((cap[2]["top"] + node).ravel().tolist())))
        write_surface(out, block, "contact", "LOWER", 1)
        write_surface(out, cap, "contact", "UPPER", element)
        out.write(f"""*MATERIAL, NAME=CFRP
*ELASTIC, TYPE=ENGINEERING CONSTANTS
167230., 9544., 9544., 0.272, 0.272, 0.369, 5292., 5292.
3483., 293.
*ORIENTATION, NAME=FIBRE, SYSTEM=RECTANGULAR
{c:.15g}, 0., {s:.15g}, 0., 1., 0.
*MATERIAL, NAME=STEEL
*ELASTIC
210000., 0.3
*SOLID SECTION, ELSET=BLOCK, MATERIAL=CFRP, ORIENTATION=FIBRE
*SOLID SECTION, ELSET=CAP, MATERIAL=STEEL
*SURFACE INTERACTION, NAME=TOUCH
*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR
{arguments.stiffness:g}
""")
        if arguments.friction > 0.0:
            out.write(f"*FRICTION\n{arguments.friction:g}, {arguments.stiffness / 10:g}\n")
        out.write(f"""*CONTACT PAIR, INTERACTION=TOUCH, TYPE=SURFACE TO SURFACE
UPPER, LOWER
*BOUNDARY
BASE, 1, 3
TOP, 1, 2
*STEP, INC=1000
*STATIC
1., 1.
*BOUNDARY
TOP, 3, 3, {-arguments.approach:g}
*NODE PRINT, NSET=BASE, TOTALS=ONLY
RF
*END STEP
""")


main()
