//! Meshes of the structural tests: elements with given corners, joined blocks, and the seven hexahedra of MacNeal and Harder.

use std::collections::HashMap;

use orthowear::element::ElementKind::{self, Hex8, Tet4};
use orthowear::element::ShapeFunctions;
use orthowear::mesh::Mesh;

use crate::by_kind;
use crate::fem_meshes::{add_cells, block, linear, macneal_harder};

fn values<S: ShapeFunctions<N, 3>, const N: usize>(xi: [f64; 3]) -> Vec<f64> {
    S::values(xi).to_vec()
}

/// Numbers points. Points at the same position (to 1e-9) have the same number.
#[derive(Default)]
struct Places {
    known: HashMap<[i64; 3], usize>,
    points: Vec<[f64; 3]>,
}

impl Places {
    fn number(&mut self, x: [f64; 3]) -> usize {
        *self.known.entry(x.map(|c| (c * 1e9).round() as i64)).or_insert_with(|| {
            self.points.push(x);
            self.points.len() - 1
        })
    }
}

/// Mesh of elements of `kind` with the given corners, in the volume group "body". Coincident nodes are merged.
pub fn between_corners(kind: ElementKind, cells: &[Vec<[f64; 3]>]) -> Mesh {
    let mut places = Places::default();
    let mut nodes = Vec::new();
    for corners in cells {
        for xi in kind.reference_nodes() {
            let weights = by_kind!(linear(kind), values(xi));
            let x = std::array::from_fn(|d| corners.iter().zip(&weights).map(|(x, w)| x[d] * w).sum());
            nodes.push(places.number(x));
        }
    }
    let mut mesh = Mesh { source: "corners".into(), points: places.points, ..Default::default() };
    add_cells(&mut mesh, kind, "body", nodes);
    mesh
}

/// Joins meshes to one mesh. Coincident nodes are merged, and groups of the same name are united.
pub fn joined(meshes: &[Mesh]) -> Mesh {
    let mut places = Places::default();
    let mut groups: Vec<(ElementKind, String, Vec<usize>)> = Vec::new();
    for mesh in meshes {
        for (block, group) in mesh.blocks.iter().zip(&mesh.groups) {
            let nodes = block.nodes.iter().map(|&node| places.number(mesh.points[node]));
            match groups.iter_mut().find(|(_, name, _)| *name == group.name) {
                Some((.., all)) => all.extend(nodes),
                None => groups.push((block.kind, group.name.clone(), nodes.collect())),
            }
        }
    }
    let mut mesh = Mesh { source: "joined".into(), points: places.points, ..Default::default() };
    for (kind, name, nodes) in groups {
        add_cells(&mut mesh, kind, &name, nodes);
    }
    mesh
}

/// The six pyramids of a hexahedron. Each has a face of the hexahedron as base and the mean of the eight corners as tip.
fn pyramids(hexahedron: &[usize], points: &mut Vec<[f64; 3]>) -> Vec<Vec<usize>> {
    let mean = |d: usize| hexahedron.iter().map(|&node| points[node][d]).sum::<f64>() / 8.0;
    points.push(std::array::from_fn(mean));
    let tip = points.len() - 1;
    let pyramid =
        |face: &[usize]| -> Vec<usize> { face.iter().rev().map(|&i| hexahedron[i]).chain([tip]).collect() };
    Hex8.local_faces().iter().map(|(_, face)| pyramid(face)).collect()
}

/// The two tetrahedra of a pyramid. The diagonal that divides the base starts at the corner with the smallest node number.
fn tetrahedra(pyramid: &[usize]) -> [Vec<usize>; 2] {
    let least = (0..4).min_by_key(|&i| pyramid[i]).unwrap();
    let base = |step: usize| pyramid[(least + step) % 4];
    let [a, b, c, d] = [0, 1, 2, 3].map(base);
    [vec![a, b, c, pyramid[4]], vec![a, c, d, pyramid[4]]]
}

/// Two wedges for each of the seven hexahedra. Three hexahedra, the inner one and its neighbours below and above, are cut along a
/// diagonal of their lower and upper faces. The other four are cut along diagonals from lower inner nodes to upper outer nodes.
fn wedges_of_the_seven() -> Vec<Vec<usize>> {
    let inner = [8, 9, 10, 11, 12, 13, 14, 15];
    let mut hexahedra = vec![inner.to_vec()];
    hexahedra.push([0, 3, 2, 1].map(|i| i + 8).into_iter().chain([0, 3, 2, 1]).collect());
    hexahedra.push([4, 5, 6, 7].map(|i| i + 8).into_iter().chain([4, 5, 6, 7]).collect());
    for a in 0..4 {
        let side = |i: usize| [i + 8, i + 12, i + 4, i];
        hexahedra.push(side(a).into_iter().chain(side((a + 1) % 4)).collect());
    }
    let halves =
        |h: Vec<usize>| [[0, 1, 2, 4, 5, 6], [0, 2, 3, 4, 6, 7]].map(|half| half.map(|i| h[i]).to_vec());
    hexahedra.into_iter().flat_map(halves).collect()
}

/// The seven hexahedra of MacNeal and Harder (1985), whole or cut into two wedges, six pyramids or twelve tetrahedra each.
pub fn seven_hexahedra(kind: ElementKind) -> Mesh {
    let hexahedra = macneal_harder();
    let mut points = hexahedra.points.clone();
    let solids = &hexahedra.blocks[0];
    let in_pyramids = |points: &mut Vec<[f64; 3]>| -> Vec<Vec<usize>> {
        (0..solids.n_cells()).flat_map(|cell| pyramids(solids.cell_nodes(cell), points)).collect()
    };
    let cells: Vec<Vec<usize>> = match linear(kind) {
        Hex8 => (0..solids.n_cells()).map(|cell| solids.cell_nodes(cell).to_vec()).collect(),
        ElementKind::Wedge6 => wedges_of_the_seven(),
        Tet4 => in_pyramids(&mut points).iter().flat_map(|pyramid| tetrahedra(pyramid)).collect(),
        _ => in_pyramids(&mut points),
    };
    let corners: Vec<Vec<[f64; 3]>> =
        cells.iter().map(|cell| cell.iter().map(|&node| points[node]).collect()).collect();
    between_corners(kind, &corners)
}

/// A quarter of the plate of NAFEMS LE1 and LE10. It lies between the ellipses x²/2² + y²/1² = 1 ("x0") and x²/3.25² + y²/2.75² =
/// 1 ("x1"). The quarter ends on the axes y = 0 ("y0") and x = 0 ("y1").
pub fn ellipses(kind: ElementKind, cells: [usize; 3], thickness: f64) -> Mesh {
    block(kind, cells, [1.0, 1.0, thickness], |[s, t, z]| {
        // Nodes on the axis x = 0 need a cosine of exactly zero, but the floating-point cosine of a right angle is not zero.
        let (sin, cos) = if t == 1.0 { (1.0, 0.0) } else { (t * std::f64::consts::FRAC_PI_2).sin_cos() };
        [(2.0 + 1.25 * s) * cos, (1.0 + 1.75 * s) * sin, z]
    })
}
