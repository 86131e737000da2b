"""Writes the mesh of benchmarks/pareto/layer.toml without gmsh: a block of 8 x 8 x 1 mm of hexahedra with 27 nodes."""

# Corners of a hexahedron in half side lengths; corners of each edge and face in gmsh's order; nodes of a face in half
# side lengths.
CORNERS = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2)]
EDGES = [(0, 1), (0, 3), (0, 4), (1, 2), (1, 5), (2, 3), (2, 6), (3, 7), (4, 5), (4, 7), (5, 6), (6, 7)]
FACES = [(0, 3, 2, 1), (0, 1, 5, 4), (0, 4, 7, 3), (1, 2, 6, 5), (2, 3, 7, 6), (4, 5, 6, 7)]
SQUARE = [(0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1), (1, 1)]


def places():
    mean = lambda corners: tuple(sum(CORNERS[c][k] for c in corners) // len(corners) for k in range(3))
    return CORNERS + [mean(edge) for edge in EDGES] + [mean(face) for face in FACES] + [(1, 1, 1)]


def halved(ends):
    """Returns the points `ends` with the midpoints between them."""
    return [x for a, b in zip(ends, ends[1:]) for x in (a, (a + b) / 2)] + [ends[-1]]


def make(folder, patch=6, beside=4, down=6):
    """Writes layer.msh with `patch` elements along the frame (1.2 mm), `beside` elements on each side of the frame,
    and `down` elements over the depth.
    """
    growth, sides = 1.6, [0.6]
    first = (4 - 0.6) * (growth - 1) / (growth**beside - 1)
    for i in range(beside):
        sides.append(sides[-1] + first * growth**i)
    across = [-x for x in sides[:0:-1]] + [-0.6 + 1.2 * i / patch for i in range(patch)] + sides
    x, z = halved(across), halved([-1 + i / down for i in range(down + 1)])
    n, m = len(x), len(z)
    node = lambda i, j, k: 1 + i + n * (j + n * k)
    lines = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$PhysicalNames", "3", '2 1 "contact"', '2 2 "base"', '3 3 "body"', "$EndPhysicalNames",
             "$Nodes", str(n * n * m)]
    lines += [f"{node(i, j, k)} {x[i]!r} {x[j]!r} {z[k]!r}" for k in range(m) for j in range(n) for i in range(n)]
    solids = [[node(i + a, j + b, k + c) for a, b, c in places()]
              for k in range(0, m - 1, 2) for j in range(0, n - 1, 2) for i in range(0, n - 1, 2)]
    face = lambda k: [[node(i + a, j + b, k) for a, b in SQUARE] for j in range(0, n - 1, 2) for i in range(0, n - 1, 2)]
    under = [quad for quad in face(m - 1) if all(abs(x[(v - 1) % n]) < 0.6 + 1e-9 and abs(x[(v - 1) // n % n]) < 0.6 + 1e-9 for v in quad)]
    elements = [(10, 1, quad) for quad in under] + [(10, 2, quad) for quad in face(0)] + [(12, 3, solid) for solid in solids]
    lines += ["$EndNodes", "$Elements", str(len(elements))]
    lines += [f"{i + 1} {kind} 2 {group} {group} " + " ".join(map(str, nodes)) for i, (kind, group, nodes) in enumerate(elements)]
    (folder / "layer.msh").write_text("\n".join([*lines, "$EndElements", ""]), encoding="utf-8")
