"""Random contact pairs with meshed bodies: outcome, checks and time of each run, for one program or two.

    python pairs.py PROGRAM [--other PROGRAM2] [--count 200] [--seed 1] [--out FILE.csv] [--keep DIR]

Pair k of a seed is always the same. One body of each pair is a finite-element block. Its partner is a second block,
a half-space or a rigid body. `--only K` runs one pair. `--keep DIR` keeps the files of pairs that do not converge,
are refused, or fail a check.
"""
import argparse
import csv
import json
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import numpy as np

TIME_LIMIT = 400.0  # s per run; condensation of the largest contact surfaces takes minutes
TOLERANCE = 1e-8  # largest natural residual of a converged run (default of solver.tolerance)
FORCE_TOLERANCE = 1e-6  # largest difference of the forces of two programs, over the largest force of the run
SLOWER = 1.5  # factor of time from which a pair is reported as slower
MIN_SECONDS = 0.05  # times of the contact solver below this are not compared
HALF_LENGTH = 5.0  # half side length of the contact region along x, mm

# For each element: gmsh's type number, solids of one grid cell, faces (local corners), and edges with a mid-side node.
# The corners of a grid cell are numbered x + 2 y + 4 z with x, y, z = 0 or 1.
HEX = (0, 1, 3, 2, 4, 5, 7, 6)
HEX_FACES = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))
HEX_EDGES = ((0, 1), (0, 3), (0, 4), (1, 2), (1, 5), (2, 3), (2, 6), (3, 7), (4, 5), (4, 7), (5, 6), (6, 7))
WEDGES = ((0, 1, 3, 4, 5, 7), (0, 3, 2, 4, 7, 6))
WEDGE_FACES = ((0, 2, 1), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5))
WEDGE_EDGES = ((0, 1), (0, 2), (0, 3), (1, 2), (1, 4), (2, 5), (3, 4), (3, 5), (4, 5))
TETS = ((0, 1, 3, 7), (0, 5, 1, 7), (0, 3, 2, 7), (0, 2, 6, 7), (0, 4, 5, 7), (0, 6, 4, 7))
TET_FACES = ((0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3))
TET_EDGES = ((0, 1), (1, 2), (2, 0), (3, 0), (2, 3), (1, 3))
SOLIDS = {"hex8": (5, (HEX,), HEX_FACES, ()), "hex20": (17, (HEX,), HEX_FACES, HEX_EDGES), "tet10": (11, TETS, TET_FACES, TET_EDGES),
          "wedge6": (6, WEDGES, WEDGE_FACES, ()), "wedge15": (18, WEDGES, WEDGE_FACES, WEDGE_EDGES)}
FACE_TYPE = {(3, False): 2, (4, False): 3, (3, True): 9, (4, True): 16}
NODES_PER_CELL = {"hex8": 1, "hex20": 3, "tet10": 4, "wedge6": 1, "wedge15": 4}  # contact nodes per grid cell on a large contact surface
FACES_PER_CELL = {"hex8": 1, "hex20": 1, "tet10": 2, "wedge6": 2, "wedge15": 2}


def mesh_text(element, xs, ys, zs, contact, top, bulge):
    """Mesh of a block in gmsh format 2.2, number of its contact nodes, and number of its contact faces.

    Groups: "body"; "contact", the faces of the top or bottom within |x| <= contact[0] and |y| <= contact[1];
    "opposite", all faces of the opposite side; "left" and "right", the ends along x. `top` states whether the
    contact is at the top. `bulge(x, y)` moves the contact surface along z. This motion decreases linearly to zero
    at the opposite side.
    """
    gmsh_type, solids, faces, edges = SOLIDS[element]
    cell = np.array([[b & 1, b >> 1 & 1, b >> 2] for b in range(8)]) * 2
    grid = [np.interp(np.arange(2 * len(c) - 1) / 2, np.arange(len(c)), c) for c in (xs, ys, zs)]
    numbers, points, elements, outer = {}, [], [], {}

    def node(p):
        p = tuple(int(v) for v in p)
        if p not in numbers:
            numbers[p] = len(numbers) + 1
            x, y, z = (g[v] for g, v in zip(grid, p))
            height = (z - zs[0]) / (zs[-1] - zs[0])
            points.append((x, y, z + bulge(x, y) * (height if top else 1 - height)))
        return numbers[p]

    for i in np.ndindex(len(xs) - 1, len(ys) - 1, len(zs) - 1):
        for solid in solids:
            corners = [2 * np.array(i) + cell[b] for b in solid]
            elements.append((gmsh_type, 1, [node(p) for p in corners] + [node((corners[a] + corners[b]) // 2) for a, b in edges]))
            for face in faces:
                p = [tuple(map(int, corners[c])) for c in face]
                outer.setdefault(tuple(sorted(p)), []).append(p)
    contact_nodes, contact_faces = set(), 0
    k_contact, k_opposite = (2 * len(zs) - 2, 0) if top else (0, 2 * len(zs) - 2)
    for (p,) in (same for same in outer.values() if len(same) == 1):
        x, y, k = [grid[0][q[0]] for q in p], [grid[1][q[1]] for q in p], {q[2] for q in p}
        tags = [tag for tag, inside in (
            (2, k == {k_contact} and np.max(np.abs(x)) < contact[0] + 1e-9 and np.max(np.abs(y)) < contact[1] + 1e-9), (3, k == {k_opposite}),
            (4, {q[0] for q in p} == {0}), (5, {q[0] for q in p} == {2 * len(xs) - 2})) if inside]
        ids = [node(q) for q in p] + ([node((np.array(a) + b) // 2) for a, b in zip(p, p[1:] + p[:1])] if edges else [])
        elements += [(FACE_TYPE[len(p), bool(edges)], tag, ids) for tag in tags]
        if 2 in tags:
            contact_nodes.update(ids)
            contact_faces += 1
    names = ['3 1 "body"', '2 2 "contact"', '2 3 "opposite"', '2 4 "left"', '2 5 "right"']
    lines = ["$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n5", *names, f"$EndPhysicalNames\n$Nodes\n{len(points)}"]
    lines += [f"{n} {x:.12g} {y:.12g} {z:.12g}" for n, (x, y, z) in enumerate(points, 1)] + [f"$EndNodes\n$Elements\n{len(elements)}"]
    lines += [f"{n} {t} 2 {g} {g} {' '.join(map(str, c))}" for n, (t, g, c) in enumerate(elements, 1)] + ["$EndElements\n"]
    return "\n".join(lines), len(contact_nodes), contact_faces


def log_uniform(random, low, high):
    return float(np.exp(random.uniform(np.log(low), np.log(high))))


def material(random, name, modulus):
    """Text of a material in the scene with Young's modulus `modulus` (along the fibre), and whether the material has a
    fibre.
    """
    if random.random() < 0.6:
        return f'[materials.{name}]\nmodel = "isotropic"\nE = {modulus}\nnu = {random.uniform(0.0, 0.42)}\n', False
    return (f'[materials.{name}]\nmodel = "transversely-isotropic"\nE1 = {modulus}\nE2 = {modulus * random.uniform(0.05, 0.5)}\n'
            f"G12 = {modulus * random.uniform(0.03, 0.2)}\nnu12 = 0.27\nnu23 = 0.37\n"), True


def draw(seed, k):
    """Draws pair k. Returns a dict with `scene` (text), `meshes` (text by file name), and the values that the checks
    and tables need.
    """
    random = np.random.default_rng([seed, k])
    choose = lambda options, weights=None: options[random.choice(len(options), p=weights)]
    a = HALF_LENGTH
    cells = log_uniform(random, 50, 600) if random.random() < 0.95 else log_uniform(random, 600, 5000)
    partner = choose(["fe", "half-space", "rigid"], [0.5, 0.2, 0.3])
    on_mesh = random.random() < 0.65
    # A slice has one element across y and no displacement along y, as in plane strain.
    sliced = partner != "half-space" and on_mesh and cells < 400 and random.random() < 0.25
    b = a * log_uniform(random, 0.3, 1.0)
    kinds = ["fe", partner]
    if random.random() < 0.5:
        kinds.reverse()
    blocks = [i for i in (0, 1) if kinds[i] == "fe"]
    frame_body = choose(blocks)
    curved = choose(["flat", "sphere", "cylinder", "bulge"], [0.35, 0.25, 0.15, 0.25])
    if sliced and curved == "sphere":
        curved = "cylinder"
    if partner == "half-space" and on_mesh and curved == "bulge":
        curved = "sphere"  # half-spaces need a plane frame
    mu = choose([0.0, random.uniform(0.05, 0.6), random.uniform(0.6, 1.2)], [0.1, 0.65, 0.25])
    ratio = choose([1.0, log_uniform(random, 0.1, 10.0), log_uniform(random, 1e-4, 1e4)], [0.3, 0.35, 0.35])
    moduli = [70e3 * ratio ** 0.5, 70e3 * ratio ** -0.5]
    soft = min(moduli[i] for i in (0, 1) if kinds[i] != "rigid")

    # At most one body is unconstrained. It has no supports, or supports along x and y only.
    free = choose(blocks) if random.random() < 0.35 else None
    free_kind = choose(["all", "normal"])
    indent = a * log_uniform(random, 3e-4, 5e-3)  # approach of a solid block
    radius = (b if not sliced else a) ** 2 * random.uniform(0.04, 0.6) / indent
    across = 90.0 if sliced else choose([0.0, 90.0, random.uniform(0, 180)])  # direction of a cylinder's axis

    width, meshes, bodies, materials, notes = 2 * b, {}, [], [], []
    density = log_uniform(random, 0.6, 1.7)  # number of grid squares of the other block, divided by that of the frame's block
    points, rho = None, random.uniform(1.05, 2.5)
    elements = [choose(["hex8", "hex8-eas", "hex8-default", "hex20", "tet10", "wedge6", "wedge15"], [0.1, 0.2, 0.2, 0.15, 0.12, 0.13, 0.1])
                for _ in (0, 1)]
    if sliced or cells > 1500:
        elements = [choose(["hex8", "hex8-eas", "hex8-default"]) for _ in (0, 1)]
    kind_of = [e.split("-")[0] for e in elements]
    if on_mesh:
        points = choose(["nodes", "faces"])
        if kind_of[frame_body] in ("hex20", "tet10", "wedge15"):
            points = "faces"  # cells around nodes need first-order faces
        elif points == "faces" and (kind_of[frame_body] == "wedge6" or sliced):
            points = "nodes"  # 3-node faces as cells are smaller than the program allows
    # Number of grid squares in the contact region of the frame's body. With these squares, the frame has approximately
    # `cells` cells.
    e = kind_of[frame_body]
    frame_squares = cells / FACES_PER_CELL[e] if points == "faces" else cells * (1.0 if points else rho) / NODES_PER_CELL[e]
    rows, contact_nodes, limits = 0, [], []
    for i in (0, 1):
        if kinds[i] != "fe":
            bodies.append(f'kind = "{kinds[i]}"\n' + ('material = "m%d"\n' % i if kinds[i] == "half-space" else ""))
        if kinds[i] == "rigid":
            continue
        text, fibrous = material(random, f"m{i}", moduli[i])
        materials.append(text)
        if kinds[i] == "half-space":
            if fibrous:
                bodies[-1] += f"fibre = {{ tilt = {random.uniform(-90, 90)}, azimuth = {random.uniform(0, 180)} }}\n"
            continue
        e = kind_of[i]
        squares = frame_squares if i == frame_body else frame_squares * density * NODES_PER_CELL[kind_of[frame_body]] / NODES_PER_CELL[e]
        if sliced:
            nx, ny = max(6, round(squares / 2)), 1
            width = width if meshes else 2 * a * random.uniform(0.02, 0.2)
        else:
            nx, ny = max(3, round((squares * a / b) ** 0.5)), max(2, round((squares * b / a) ** 0.5))
        support = choose(["base", "end", "ends", "foundation"], [0.35, 0.35, 0.15, 0.15]) if i != free else "free"
        height = (2 * a if sliced else width) * log_uniform(random, 0.03, 2.0)
        # Grid lines along x. The block extends beyond the contact at supported ends, and sometimes at free ends.
        side = choose(["left", "right"])
        step = 2 * a / nx
        x = np.linspace(-a, a, nx + 1)
        if random.random() < 0.25:
            x = x + random.uniform(-0.6, 0.6) * a * np.sin(np.pi * x / a) / np.pi
        for end, sign in (("left", -1), ("right", 1)):
            held = support == "ends" or support == "end" and side == end
            if held or support != "free" and random.random() < 0.25:
                beyond = a * random.uniform(0.3, 3.0 if support == "end" else 1.0)
                x = np.r_[x, sign * np.linspace(a, a + beyond, min(12, max(1, round(beyond / step))) + 1)[1:]]
        x = np.unique(x)
        y = np.linspace(-width / 2, width / 2, ny + 1)
        plies = choose([0, 2, 3], [0.5, 0.25, 0.25]) if fibrous else 0
        solids = len(x) * ny * len(SOLIDS[e][1])
        nz = int(np.clip(round(height / step), 1, max(1, min(6, (4000 if SOLIDS[e][3] else 16000) // solids))))
        nz = max(plies, nz // max(plies, 1) * max(plies, 1))
        z = np.linspace(-height, 0.0, nz + 1) if i == 0 else np.linspace(0.0, height, nz + 1)
        if not plies and height > 4 * nz * step:
            z = np.sign(z) * height * (np.abs(z) / height) ** 1.8
        bulged = curved == "bulge" and (i == frame_body or random.random() < 0.5)
        rb = max(radius, 5 * a * a / height)
        bulge = (lambda u, v: (1 if i else -1) * (u * u + (0 if sliced else v * v)) / (2 * rb)) if bulged else (lambda u, v: 0.0)
        meshes[f"body{i + 1}.msh"], nodes, faces = mesh_text(e, x, y, z, (a, width / 2), i == 0, bulge)
        contact_nodes.append(faces / FACES_PER_CELL[e] * NODES_PER_CELL[e])
        if i == frame_body and points:
            rows = nodes if points == "nodes" else faces
        fixed = {"base": ["opposite"], "end": [side], "ends": ["left", "right"], "foundation": [], "free": []}[support]
        fixed = [f'{{ group = "{g}" }}' for g in fixed]
        if i == free and free_kind == "normal":
            fixed.append('{ group = "opposite", components = ["x", "y"] }')
        if sliced:
            fixed.append('{ group = "body", components = ["y"] }')
        text = f'kind = "fe"\nmaterial = "m{i}"\nmesh = "body{i + 1}.msh"\ncontact = "contact"\nnear_field = "mesh"\n'
        text += f"fixed = [{', '.join(fixed)}]\n"
        if elements[i] != "hex8-default":
            text += f'element = "{elements[i]}"\n'
        if support == "foundation":
            text += f'foundation = [{{ group = "opposite", stiffness = [{", ".join(str(moduli[i] / a * log_uniform(random, 0.01, 1)) for _ in "xyz")}] }}]\n'
        if plies:
            angles = [choose([0.0, 90.0, 45.0, -45.0, random.uniform(0, 180)]) for _ in range(plies)]
            text += f"layup = {{ plies = [{', '.join(f'{{ thickness = {height / plies}, angle = {g} }}' for g in angles)}] }}\n"
        elif fibrous:
            text += f"fibre = {{ tilt = {random.uniform(-90, 90)}, azimuth = {random.uniform(0, 180)} }}\n"
        bodies.append(text)
        if support in ("end", "ends"):  # force that bends a beam by the half length of the contact region
            stiffness = moduli[i] * width * (height / (x[-1] - x[0])) ** 3 * (16 if support == "ends" else 0.25)
            limits.append(stiffness * a)
        notes.append(f"{elements[i]} {support if support != 'free' else 'free' if free_kind == 'all' else 'free along z'}"
                     f"{f' {plies} plies' if plies else ''}{' bulged' if bulged else ''} t/w {height / (2 * a if sliced else width):.2g}")
    if not points:
        n = max(9.0, min(cells, max(contact_nodes) / 1.05))
        grid = (max(3, int((n * a / b) ** 0.5)), max(3, int((n * b / a) ** 0.5)))
        rows = grid[0] * grid[1]
        frame = f'kind = "grid"\nhalf_width = [{a}, {b}]\ncells = [{grid[0]}, {grid[1]}]\n'
    else:
        frame = f'kind = "mesh"\nbody = {frame_body + 1}\npoints = "{points}"\n'
    if curved == "bulge":
        gap = 'kind = "mesh"\n'
    elif curved == "flat":
        gap = 'kind = "flat"\n' if random.random() < 0.5 else 'kind = "mesh"\n'
    else:
        gap = f'kind = "{curved}"\nradius = {radius}\n' + (f"angle = {across}\n" if curved == "cylinder" else "")

    # Loads. The reference force corresponds to a strain of indent / a of the softer body in the contact region.
    area = 4 * a * b if not sliced else 2 * a * width
    force = soft * indent / a * area * random.uniform(0.05, 0.5) * (1.0 if curved == "flat" else 0.3)
    force = min([force, *limits])
    loads_on_body, total = "", 0.0
    forced = free is not None or random.random() < 0.5
    if free is not None and random.random() < 0.4:
        share = random.uniform(0.2, 1.0)
        # The group "opposite" of an unconstrained block has the size of the contact region.
        bodies[free] += f'pressure = [{{ group = "opposite", value = {share * force / area} }}]\n'
        total = share * force
    press = f"normal_force = {max(0.0, force - total)}" if forced else f"approach = {indent * random.uniform(0.5, 2.0)}"
    move = choose(["shift", "pull", "cycles", "none"], [0.35, 0.35, 0.2, 0.1])
    if free is not None and free_kind == "all" and move == "shift":
        move = "pull"
    if move == "cycles" and cells > 250:
        move = "pull"  # cycles solve many increments
    if move == "pull" and not forced:
        move = "shift"
    if mu == 0.0 and move != "none":
        move = "none" if free is not None else "shift"
    angle = choose([0.0, 180.0]) if sliced else choose([0.0, 90.0, random.uniform(0, 360)])
    reach = max(mu, 0.1) * indent * random.uniform(0.1, 3.0)
    increments = int(random.integers(1, 5))
    steps = f'[[steps]]\nname = "press"\n{press}\nincrements = {choose([1, 1, 2, 4])}\n'
    if mu > 0 and random.random() < 0.15:
        steps += "friction = false\n"
    if mu > 0 and free is not None and free_kind == "all" and move == "none":
        steps += "tangential_force = [0.0, 0.0]\n"
    wear = ""
    direction = np.array([np.cos(np.radians(angle)), 0.0 if sliced else np.sin(np.radians(angle))])
    share = choose([0.95, random.uniform(0.2, 0.95)])
    if move == "shift":
        steps += f'[[steps]]\nname = "shift"\nshift = {{ distance = {reach}, angle = {angle} }}\nincrements = {increments}\n'
    elif move == "pull":
        q = share * mu * max(force, total) * direction
        steps += f'[[steps]]\nname = "pull"\ntangential_force = [{q[0]}, {q[1]}]\nincrements = {increments}\n'
    elif move == "cycles":
        by_force = free is not None and free_kind == "all"
        size = f"force_amplitude = {share * 0.9 * mu * max(force, total)}" if by_force else f"amplitude = {reach / 2}"
        count = int(random.integers(1, 6))
        steps += f'[[steps]]\nname = "cycles"\ncycles = {{ count = {count}, {size}, angle = {angle}, increments = {increments} }}\n'
        if random.random() < 0.5:
            wear = '[wear]\nlaw = "energy"\nk = 1e-9\n'
    friction = f'law = "coulomb"\nmu = {mu}\n' if mu > 0 else 'law = "none"\n'
    scene = "".join(materials) + "".join(f"[body{i + 1}]\n{t}" for i, t in enumerate(bodies))
    scene += f"[frame]\n{frame}[gap]\n{gap}[friction]\n{friction}{wear}[output]\nfields = []\n{steps}"
    about = (f"{'-'.join(kinds)}{' slice' if sliced else ''} ({'; '.join(notes)}) {points or 'grid'} {curved} E1/E2 {ratio:.1e} mu {mu:.2f} "
             f"{'force' if forced else 'approach'}+{move}{f' {share:.2f}' if move == 'pull' else ''}")
    slope = 2 * a / radius if curved == "bulge" else 0.0
    return {"scene": f'title = "pair {k}: {about}"\n{scene}', "meshes": meshes, "about": about, "mu": mu, "slope": slope,
            "rows": rows * (3 if mu > 0 else 1), "cells": rows}


def run(program, pair, folder, threads):
    """Runs the program on a pair. Returns the row of the table (outcome, numbers, failed checks), and the forces and
    motions.
    """
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "scene.toml").write_text(pair["scene"])
    for name, text in pair["meshes"].items():
        (folder / name).write_text(text)
    out = folder / Path(program).name
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
    command = [program, "run", folder / "scene.toml", "--out", out, "--no-cache", "--quiet", "--threads", str(threads)]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=TIME_LIMIT)
        code, message = done.returncode, done.stderr.strip()
    except subprocess.TimeoutExpired:
        code, message = None, ""
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    row = {"outcome": "", "message": "", "residual": 0.0, "iterations": 0, "operator_applications": 0, "wall": time.monotonic() - start,
           "seconds": after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime, "contact_seconds": 0.0, "method": "", "faults": ""}
    summary = json.loads((out / "summary.json").read_text()) if code is not None and (out / "summary.json").exists() else {}
    entries = summary.get("steps", [])
    if code is None:
        row["outcome"] = "time limit"
    elif summary.get("status") == "converged":
        row["outcome"] = "converged"
    elif summary.get("status") == "not-converged":
        row["outcome"] = summary["reason"]
        row["message"] = " | ".join(w for w in summary.get("warnings", []) if w.startswith("WARNING") and ("slid" in w or "converge" in w))
    else:
        row["outcome"] = "refused" if code == 2 else f"exit {code}"
        row["message"] = str(summary.get("error") or message)
    for entry in entries:
        row["residual"] = max(row["residual"], entry["certificate"]["natural_residual"])
        row["iterations"] = max(row["iterations"], entry["iterations"])
        row["operator_applications"] += entry["operator_applications"]
        row["contact_seconds"] += entry["seconds"]
    row["method"] = " | ".join(dict.fromkeys(e["method"] for e in entries))
    row["faults"] = " | ".join(faults(entries, pair)) if row["outcome"] == "converged" else ""
    return row, states(entries)


def states(entries):
    """Forces (x, y, n) and motions (x, y, n) of body 2 at the end of each entry. Cycles give two rows: the + and the -
    reversal point.
    """
    forces, motions = [], []
    for entry in entries:
        for end in entry.get("stroke_ends") or [entry]:
            forces.append([*end["tangential_force"], end["normal_force"]])
            motions.append([*end["shift"], end.get("approach", entry["approach"])])
    return np.array(forces).reshape(-1, 3), np.array(motions).reshape(-1, 3)


def faults(entries, pair):
    """Failed checks of a converged run. The checks are the residual, the friction limit of the tangential force, and
    the dissipation of each increment.
    """
    found = []
    forces, motions = states(entries)
    scale = np.abs(forces).max(initial=0.0)
    worst = max(e["certificate"]["natural_residual"] for e in entries)
    if not worst <= TOLERANCE:
        found.append(f"residual {worst:.1e}")
    # On a curved frame, normals are inclined by up to `slope`. Pressures then have a tangential part.
    excess = np.max(np.hypot(forces[:, 0], forces[:, 1]) - (pair["mu"] + pair["slope"]) * forces[:, 2])
    if not excess <= 1e-7 * scale:
        found.append(f"tangential force exceeds mu N by {excess / scale:.1e} of the largest force")
    # Errors of the tractions within the tolerance change the dissipation by about TOLERANCE times the work of the
    # loads.
    work = np.array([0.0] + [e["dissipation"] for e in entries])
    scale = np.abs(work).max() + np.max(np.abs(forces).max(axis=0) * np.abs(motions).max(axis=0))
    if not np.all(np.diff(work) >= -TOLERANCE * scale):
        found.append(f"negative dissipation {np.min(np.diff(work)):.1e} of {work[-1]:.1e}, work of the loads {scale:.1e}")
    return found


def difference(one, other):
    """Largest difference of two arrays, divided by the largest value of the first array. Infinite if the shapes
    differ.
    """
    if one.shape != other.shape:
        return np.inf
    return float(np.abs(one - other).max(initial=0.0) / max(np.abs(one).max(initial=0.0), 1e-300))


def summarise(name, rows):
    """Prints a table of the outcomes of one program."""
    print(f"{name}: {len(rows)} pairs")
    for outcome, count in Counter(r["outcome"] for r in rows).most_common():
        print(f"  {outcome:14} {count:4}  " + ("" if outcome == "converged" else ", ".join(str(r["pair"]) for r in rows if r["outcome"] == outcome)))
    done = [r for r in rows if r["outcome"] == "converged"]
    for key in ("iterations", "operator_applications", "contact_seconds", "seconds") if done else ():
        values = [r[key] for r in done]
        print(f"  {key:22} median {np.median(values):9.4g}  90 % {np.percentile(values, 90):9.4g}  worst {max(values):9.4g} (pair "
              f"{done[int(np.argmax(values))]['pair']})")
    print(f"  seconds in all {sum(r['seconds'] for r in rows):.0f}; with method bb: "
          f"{sum('bb' in r['method'] for r in rows)}")
    for r in rows:
        if r["faults"]:
            print(f"  FAULT pair {r['pair']}: {r['faults']} [{r['about']}]")


def main():
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("program")
    options.add_argument("--other")
    options.add_argument("--count", type=int, default=200)
    options.add_argument("--seed", type=int, default=1)
    options.add_argument("--only", type=int, action="append", help="number of a pair to run; may be repeated")
    options.add_argument("--minutes", type=float, default=np.inf, help="no further pair begins after this time")
    options.add_argument("--threads", type=int, default=1)
    options.add_argument("--out", type=Path)
    options.add_argument("--keep", type=Path)
    chosen = options.parse_args()
    programs = [chosen.program] + ([chosen.other] if chosen.other else [])
    begin, tables, disagree, slower = time.monotonic(), [[] for _ in programs], [], []
    with tempfile.TemporaryDirectory() as temporary:
        for k in chosen.only or range(chosen.count):
            if time.monotonic() - begin > 60 * chosen.minutes:
                break
            pair = draw(chosen.seed, k)
            folder = (chosen.keep or Path(temporary)) / str(k)
            results = [run(program, pair, folder, chosen.threads) for program in programs]
            for table, (row, _) in zip(tables, results):
                table.append({"pair": k, "about": pair["about"], "cells": pair["cells"], "rows": pair["rows"], **row})
            keep = any(row["outcome"] != "converged" or row["faults"] for row, _ in results)
            if len(results) == 2 and all(row["outcome"] == "converged" for row, _ in results):
                (first, (forces, motions)), (second, (forces2, motions2)) = results
                apart = difference(forces, forces2), difference(motions, motions2)
                if not apart[0] <= FORCE_TOLERANCE:
                    disagree.append((k, *apart, pair["about"]))
                    keep = True
                for key in ("contact_seconds", "seconds"):
                    if second[key] > SLOWER * max(first[key], MIN_SECONDS):
                        slower.append((k, key, first[key], second[key], pair["about"]))
            if not keep or not chosen.keep:
                shutil.rmtree(folder)
            print(f"{k:4} {pair['cells']:5} cells  " + "  ".join(
                f"{row['outcome']} {row['iterations']} it {row['seconds']:.2f} s{' FAULT ' + row['faults'] if row['faults'] else ''}" for row, _ in results)
                + f"  {pair['about']}", flush=True)
    for program, table in zip(programs, tables):
        summarise(program, table)
    for k, forces, motions, about in disagree:
        print(f"forces differ by {forces:.1e}, motions by {motions:.1e}: pair {k} [{about}]")
    for k, key, first, second, about in slower:
        print(f"slower: pair {k} {key} {first:.3f} to {second:.3f} [{about}]")
    if chosen.out:
        with chosen.out.open("w", newline="") as file:
            writer = csv.DictWriter(file, ["program", *tables[0][0]])
            writer.writeheader()
            writer.writerows({"program": program, **row} for program, table in zip(programs, tables) for row in table)
    failed = any(row["outcome"] != "converged" or row["faults"] for row in tables[-1]) or disagree
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
