//! Meshes for the finite-element tests: mapped boxes of hexahedra or tetrahedra, with named faces and nodes.

use orthowear::element::ElementKind::{self, Hex8, Point1, Quad4, Tet4, Tri3};
use orthowear::fem::Support;
use orthowear::mesh::faces::outer_faces;
use orthowear::mesh::{Block, CellRef, Mesh, PhysicalGroup};

/// Adds cells of one kind with a group of all of them.
pub fn add_cells(mesh: &mut Mesh, kind: ElementKind, name: &str, nodes: Vec<usize>) {
    let n = nodes.len() / kind.n_nodes();
    let block = mesh.blocks.len();
    mesh.blocks.push(Block { kind, nodes, tags: (1..=n as u64).collect() });
    let cells = (0..n).map(|cell| CellRef { block, cell }).collect();
    let tag = mesh.groups.len() as i64 + 1;
    mesh.groups.push(PhysicalGroup { name: name.to_string(), dim: kind.dim(), tag, cells });
}

/// Corner `c` of a cell in the hexahedron's order, as steps along x, y, z.
const HEX_STEPS: [[usize; 3]; 8] =
    [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]];
/// Kuhn's six tetrahedra of a cell (paths from corner 0 to corner 6), positively oriented.
const KUHN: [[usize; 4]; 6] =
    [[0, 1, 2, 6], [0, 5, 1, 6], [0, 2, 3, 6], [0, 3, 7, 6], [0, 4, 5, 6], [0, 7, 4, 6]];

/// The box 0..size in `cells` cells moved by `map`, with the volume group "body" and surface groups "x0", "x1", .. "z1".
pub fn block(
    kind: ElementKind,
    cells: [usize; 3],
    size: [f64; 3],
    map: impl Fn([f64; 3]) -> [f64; 3],
) -> Mesh {
    let at = |i: usize, j: usize, k: usize| (i * (cells[1] + 1) + j) * (cells[2] + 1) + k;
    let mut straight = Vec::new();
    for i in 0..=cells[0] {
        for j in 0..=cells[1] {
            for k in 0..=cells[2] {
                let s = [i, j, k];
                straight.push(std::array::from_fn(|d| size[d] * s[d] as f64 / cells[d] as f64));
            }
        }
    }
    let mut nodes = Vec::new();
    for i in 0..cells[0] {
        for j in 0..cells[1] {
            for k in 0..cells[2] {
                let corner = HEX_STEPS.map(|s| at(i + s[0], j + s[1], k + s[2]));
                match kind {
                    Tet4 => nodes.extend(KUHN.iter().flatten().map(|&c| corner[c])),
                    _ => nodes.extend(corner),
                }
            }
        }
    }
    let mut mesh = Mesh { source: "box".into(), points: straight.clone(), ..Default::default() };
    add_cells(&mut mesh, if kind == Tet4 { Tet4 } else { Hex8 }, "body", nodes);
    let faces = outer_faces(&mesh);
    for (axis, letter) in ["x", "y", "z"].into_iter().enumerate() {
        for side in 0..2 {
            let plane = size[axis] * side as f64;
            let on = |node: &usize| (straight[*node][axis] - plane).abs() < 1e-12 * size[axis];
            let chosen = faces.iter().filter(|face| face.nodes.iter().all(on));
            let nodes = chosen.flat_map(|face| face.nodes.clone()).collect();
            add_cells(&mut mesh, if kind == Tet4 { Tri3 } else { Quad4 }, &format!("{letter}{side}"), nodes);
        }
    }
    mesh.points.iter_mut().for_each(|x| *x = map(*x));
    mesh
}

/// The seven distorted hexahedra of MacNeal and Harder (1985) in the unit cube.
pub fn macneal_harder() -> Mesh {
    let outer = HEX_STEPS.map(|s| s.map(|x| x as f64));
    let inner = [
        [0.249, 0.342, 0.192],
        [0.826, 0.288, 0.288],
        [0.850, 0.649, 0.263],
        [0.273, 0.750, 0.230],
        [0.320, 0.186, 0.643],
        [0.677, 0.305, 0.683],
        [0.788, 0.693, 0.644],
        [0.165, 0.745, 0.702],
    ];
    let mut nodes: Vec<usize> = (8..16).collect();
    for (_, face) in Hex8.local_faces() {
        nodes.extend(face.iter().map(|&i| i + 8));
        nodes.extend(face.iter());
    }
    let points = outer.into_iter().chain(inner).collect();
    let mut mesh = Mesh { source: "MacNeal-Harder".into(), points, ..Default::default() };
    add_cells(&mut mesh, Hex8, "body", nodes);
    mesh
}

/// Nodes on the outside of the mesh, ascending.
pub fn boundary_nodes(mesh: &Mesh) -> Vec<usize> {
    let mut nodes: Vec<usize> = outer_faces(mesh).into_iter().flat_map(|face| face.nodes).collect();
    nodes.sort_unstable();
    nodes.dedup();
    nodes
}

/// Supports that give each of `nodes` the displacement `u` of its point along `components`.
pub fn prescribe(
    mesh: &mut Mesh,
    nodes: &[usize],
    components: [bool; 3],
    u: impl Fn([f64; 3]) -> [f64; 3],
) -> Vec<Support> {
    nodes
        .iter()
        .map(|&node| {
            let group = format!("node {node} {components:?}");
            add_cells(mesh, Point1, &group, vec![node]);
            Support { group, components, value: u(mesh.points[node]), gradient: [[0.0; 3]; 3] }
        })
        .collect()
}

/// The catalogue's smooth distortion of the unit cube, which keeps its boundary.
pub fn wavy([x, y, z]: [f64; 3]) -> [f64; 3] {
    let bump: f64 = [x, y, z].iter().map(|c| (2.0 * std::f64::consts::PI * c).sin()).product();
    [x + 0.1 * bump, y, z]
}

/// A distortion of inner nodes that follows no pattern, and a curved boundary.
pub fn rough(x: [f64; 3]) -> [f64; 3] {
    let [a, b, c] = x;
    [
        a + 0.05 * (7.0 * b + 3.0 * c).sin() + 0.03 * b * c,
        b + 0.05 * (5.0 * c - 4.0 * a).cos(),
        c + 0.05 * (6.0 * a * b + 2.0).sin() + 0.04 * a * a,
    ]
}
