//! Meshes for tests: mapped boxes with groups of faces, the mesh of MacNeal and Harder, and supports of single nodes.

use std::collections::HashMap;

use orthowear::element::ElementKind::{self, Hex8, Point1, Tet4};
use orthowear::element::ShapeFunctions;
use orthowear::fem::Support;
use orthowear::mesh::faces::outer_faces;
use orthowear::mesh::{CellBlock, CellRef, Mesh, PhysicalGroup};

pub fn add_cells(mesh: &mut Mesh, kind: ElementKind, name: &str, nodes: Vec<usize>) {
    let n = nodes.len() / kind.n_nodes();
    let block = mesh.blocks.len();
    mesh.blocks.push(CellBlock { kind, nodes, tags: (1..=n as u64).collect() });
    let cells = (0..n).map(|cell| CellRef { block, cell }).collect();
    let tag = mesh.groups.len() as i64 + 1;
    mesh.groups.push(PhysicalGroup { name: name.to_string(), dim: kind.dim(), tag, cells });
}

/// Corners of a unit cube in the node order of hexahedra, as coordinates 0 or 1.
const HEX_STEPS: [[usize; 3]; 8] =
    [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]];
/// Kuhn's division of a cube into six positively oriented tetrahedra, which share the diagonal from corner 0 to corner 6.
const KUHN: [[usize; 4]; 6] =
    [[0, 1, 2, 6], [0, 5, 1, 6], [0, 2, 3, 6], [0, 3, 7, 6], [0, 4, 5, 6], [0, 7, 4, 6]];

#[macro_export]
macro_rules! by_kind {
    ($kind:expr, $function:ident($($argument:expr),*)) => {{
        use orthowear::element;
        match $kind {
            ElementKind::Hex8 => $function::<element::Hex8, 8>($($argument),*),
            ElementKind::Hex20 => $function::<element::Hex20, 20>($($argument),*),
            ElementKind::Hex27 => $function::<element::Hex27, 27>($($argument),*),
            ElementKind::Tet4 => $function::<element::Tet4, 4>($($argument),*),
            ElementKind::Tet10 => $function::<element::Tet10, 10>($($argument),*),
            ElementKind::Wedge6 => $function::<element::Wedge6, 6>($($argument),*),
            ElementKind::Wedge15 => $function::<element::Wedge15, 15>($($argument),*),
            ElementKind::Wedge18 => $function::<element::Wedge18, 18>($($argument),*),
            ElementKind::Pyramid5 => $function::<element::Pyramid5, 5>($($argument),*),
            ElementKind::Pyramid13 => $function::<element::Pyramid13, 13>($($argument),*),
            ElementKind::Pyramid14 => $function::<element::Pyramid14, 14>($($argument),*),
            other => panic!("{} is no solid", other.name()),
        }
    }};
}

pub fn reference_nodes<S: ShapeFunctions<N, 3>, const N: usize>() -> Vec<[f64; 3]> {
    S::NODES.to_vec()
}

fn values<S: ShapeFunctions<N, 3>, const N: usize>(xi: [f64; 3]) -> Vec<f64> {
    S::values(xi).to_vec()
}

pub fn linear(kind: ElementKind) -> ElementKind {
    match kind {
        ElementKind::Hex20 | ElementKind::Hex27 => Hex8,
        ElementKind::Tet10 => Tet4,
        ElementKind::Wedge15 | ElementKind::Wedge18 => ElementKind::Wedge6,
        ElementKind::Pyramid13 | ElementKind::Pyramid14 => ElementKind::Pyramid5,
        other => other,
    }
}

fn parts_of_cube(kind: ElementKind) -> Vec<Vec<[f64; 3]>> {
    let corner = |i: usize| HEX_STEPS[i].map(|x| x as f64);
    let corners = |list: &[usize]| list.iter().map(|&i| corner(i)).collect::<Vec<_>>();
    match linear(kind) {
        Hex8 => vec![corners(&[0, 1, 2, 3, 4, 5, 6, 7])],
        Tet4 => KUHN.iter().map(|list| corners(list)).collect(),
        ElementKind::Wedge6 => vec![corners(&[0, 1, 2, 4, 5, 6]), corners(&[0, 2, 3, 4, 6, 7])],
        _ => {
            let pyramid = |face: &[usize]| {
                let mut points = corners(face);
                points.reverse();
                points.push([0.5; 3]);
                points
            };
            Hex8.local_faces().iter().map(|(_, face)| pyramid(face)).collect()
        }
    }
}

fn nodes_of_cube(kind: ElementKind) -> Vec<Vec<[f64; 3]>> {
    let nodes = by_kind!(kind, reference_nodes());
    let place = |corners: &Vec<[f64; 3]>, xi: [f64; 3]| {
        let weights = by_kind!(linear(kind), values(xi));
        std::array::from_fn(|d| corners.iter().zip(&weights).map(|(x, w)| x[d] * w).sum())
    };
    parts_of_cube(kind).iter().map(|corners| nodes.iter().map(|&xi| place(corners, xi)).collect()).collect()
}

/// A box from the origin to `size`, divided into `cells` equal boxes. All nodes are moved by `map`. The mesh has the volume group
/// "body" and the surface groups "x0", "x1", .. "z1".
pub fn block(
    kind: ElementKind,
    cells: [usize; 3],
    size: [f64; 3],
    map: impl Fn([f64; 3]) -> [f64; 3],
) -> Mesh {
    let parts = nodes_of_cube(kind);
    // All nodes lie at multiples of a quarter of a cell. These multiples identify the nodes that cells share.
    let mut known: HashMap<[usize; 3], usize> = HashMap::new();
    let mut straight: Vec<[f64; 3]> = Vec::new();
    let mut nodes = Vec::new();
    for cell in 0..cells.iter().product() {
        let first = [cell / (cells[1] * cells[2]), cell / cells[2] % cells[1], cell % cells[2]];
        for x in parts.iter().flatten() {
            let quarters: [usize; 3] = std::array::from_fn(|d| 4 * first[d] + (4.0 * x[d]).round() as usize);
            nodes.push(*known.entry(quarters).or_insert_with(|| {
                straight.push(std::array::from_fn(|d| size[d] * quarters[d] as f64 / (4 * cells[d]) as f64));
                straight.len() - 1
            }));
        }
    }
    let mut mesh = Mesh { source: "box".into(), points: straight.clone(), ..Default::default() };
    add_cells(&mut mesh, kind, "body", nodes);
    let faces = outer_faces(&mesh);
    for (axis, letter) in ["x", "y", "z"].into_iter().enumerate() {
        for side in 0..2 {
            let plane = size[axis] * side as f64;
            let on = |node: &usize| (straight[*node][axis] - plane).abs() < 1e-12 * size[axis];
            let chosen: Vec<_> = faces.iter().filter(|face| face.nodes.iter().all(on)).collect();
            let nodes = chosen.iter().flat_map(|face| face.nodes.clone()).collect();
            add_cells(&mut mesh, chosen[0].kind, &format!("{letter}{side}"), nodes);
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

pub fn boundary_nodes(mesh: &Mesh) -> Vec<usize> {
    let mut nodes: Vec<usize> = outer_faces(mesh).into_iter().flat_map(|face| face.nodes).collect();
    nodes.sort_unstable();
    nodes.dedup();
    nodes
}

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

/// A smooth distortion of the unit cube along x. The boundary does not change.
pub fn wavy([x, y, z]: [f64; 3]) -> [f64; 3] {
    let bump: f64 = [x, y, z].iter().map(|c| (2.0 * std::f64::consts::PI * c).sin()).product();
    [x + 0.1 * bump, y, z]
}

/// A smooth distortion of the inside of the unit cube in all three directions.
pub fn bulging([x, y, z]: [f64; 3]) -> [f64; 3] {
    let bump = |c: f64| 4.0 * c * (1.0 - c);
    let inside = bump(x) * bump(y) * bump(z);
    [x + 0.06 * inside, y + 0.05 * inside * x, z - 0.04 * inside * (0.5 - y)]
}

/// An irregular distortion of the whole unit cube, which makes its boundary curved.
pub fn rough(x: [f64; 3]) -> [f64; 3] {
    let [a, b, c] = x;
    [
        a + 0.05 * (7.0 * b + 3.0 * c).sin() + 0.03 * b * c,
        b + 0.05 * (5.0 * c - 4.0 * a).cos(),
        c + 0.05 * (6.0 * a * b + 2.0).sin() + 0.04 * a * a,
    ]
}
