//! Hexahedral meshes of mapped boxes, and conversion of linear meshes to order 2.

use std::collections::HashMap;

use orthowear::element::ElementKind;
use orthowear::mesh::{CellBlock, CellRef, Mesh, PhysicalGroup};

/// Names of the groups of faces at the low and high end of each coordinate.
pub const SIDES: [&str; 6] = ["low0", "high0", "low1", "high1", "low2", "high2"];

pub fn steps(from: f64, to: f64, n: usize) -> Vec<f64> {
    (0..=n).map(|i| from + (to - from) * i as f64 / n as f64).collect()
}

/// `n` + 1 points from `from` to `to`. The `n` steps between the points grow geometrically from the length `first`.
pub fn growing(from: f64, to: f64, first: f64, n: usize) -> Vec<f64> {
    let sum = |ratio: f64| (0..n).map(|i| ratio.powi(i as i32)).sum::<f64>();
    let (mut low, mut high) = (0.1, 10.0);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if sum(middle) * first < (to - from).abs() { low = middle } else { high = middle }
    }
    let total = sum(low);
    let mut points = vec![from];
    let mut done = 0.0;
    for i in 0..n {
        done += low.powi(i as i32);
        points.push(from + (to - from) * done / total);
    }
    points
}

/// Hexahedra on the grid of `axes`, with the groups [`SIDES`]. `place` maps the points and must keep the orientation of the
/// elements. If `closed`, the last plane of the first coordinate coincides with the first plane.
pub fn boxes(axes: &[Vec<f64>; 3], closed: bool, place: impl Fn([f64; 3]) -> [f64; 3]) -> Mesh {
    let [nx, ny, nz] = [0, 1, 2].map(|k: usize| axes[k].len() - 1);
    let planes = if closed { nx } else { nx + 1 };
    let node = |i: usize, j: usize, k: usize| ((i % planes) * (ny + 1) + j) * (nz + 1) + k;
    let mut points = Vec::new();
    for &x in &axes[0][..planes] {
        for &y in &axes[1] {
            points.extend(axes[2].iter().map(|&z| place([x, y, z])));
        }
    }
    let mut solids = Vec::new();
    let mut faces: [Vec<usize>; 6] = Default::default();
    for i in 0..nx {
        for j in 0..ny {
            for k in 0..nz {
                let at = |[a, b, c]: [usize; 3]| node(i + a, j + b, k + c);
                const CORNERS: [[usize; 3]; 8] =
                    [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]];
                solids.extend(CORNERS.map(at));
                let (here, last) = ([i, j, k], [nx, ny, nz].map(|n| n - 1));
                for axis in 0..3 {
                    for (end, outer) in [(0, 0), (1, last[axis])] {
                        if here[axis] == outer && !(closed && axis == 0) {
                            let (a, b) = ((axis + 1) % 3, (axis + 2) % 3);
                            faces[2 * axis + end].extend([[0, 0], [1, 0], [1, 1], [0, 1]].map(|[s, t]| {
                                let mut corner = [end; 3];
                                (corner[a], corner[b]) = (s, t);
                                at(corner)
                            }));
                        }
                    }
                }
            }
        }
    }
    let mut blocks = vec![block(ElementKind::Hex8, solids, 1)];
    let mut groups = vec![group("volume", 3, 0, blocks[0].tags.len())];
    for (side, (name, nodes)) in SIDES.iter().zip(faces).enumerate() {
        if !nodes.is_empty() {
            blocks.push(block(ElementKind::Quad4, nodes, 1_000_000 * (side as u64 + 1)));
            groups.push(group(name, 2, blocks.len() - 1, blocks[blocks.len() - 1].tags.len()));
        }
    }
    Mesh { source: "boxes".into(), points, blocks, groups, ..Mesh::default() }
}

fn block(kind: ElementKind, nodes: Vec<usize>, first: u64) -> CellBlock {
    let n = (nodes.len() / kind.n_nodes()) as u64;
    CellBlock { kind, nodes, tags: (first..first + n).collect() }
}

fn group(name: &str, dim: usize, block: usize, n: usize) -> PhysicalGroup {
    let cells = (0..n).map(|cell| CellRef { block, cell }).collect();
    PhysicalGroup { name: name.into(), dim, tag: 10 * dim as i64 + block as i64, cells }
}

/// Converts a mesh to order 2. `raised` returns the new kind of an element. New nodes lie in the middle of edges, faces and
/// solids.
pub fn raise(mesh: &Mesh, raised: impl Fn(ElementKind) -> ElementKind) -> Mesh {
    let mut points = mesh.points.clone();
    let mut known: HashMap<Vec<usize>, usize> = HashMap::new();
    let mut middle = |nodes: &[usize]| {
        let mut key = nodes.to_vec();
        key.sort_unstable();
        *known.entry(key).or_insert_with(|| {
            let mean =
                [0, 1, 2].map(|c| nodes.iter().map(|&i| points[i][c]).sum::<f64>() / nodes.len() as f64);
            points.push(mean);
            points.len() - 1
        })
    };
    let blocks = mesh
        .blocks
        .iter()
        .map(|old| {
            let kind = raised(old.kind);
            let n = old.kind.n_nodes();
            let mut nodes = Vec::new();
            for corners in old.nodes.chunks_exact(n) {
                let mut all = vec![usize::MAX; kind.n_nodes()];
                all[..n].copy_from_slice(corners);
                let whole: Vec<usize> = (0..n).collect();
                let faces: Vec<(ElementKind, Vec<usize>)> = if kind.dim() == 3 {
                    kind.local_faces().iter().map(|(kind, nodes)| (*kind, nodes.to_vec())).collect()
                } else if kind.dim() == 2 {
                    vec![(kind, (0..kind.n_nodes()).collect())]
                } else {
                    Vec::new()
                };
                for (face, local) in faces {
                    let m = face.n_corners();
                    let corner = |i: usize| corners[local[i % m]];
                    for i in 0..m {
                        if let Some(&place) = local.get(m + i) {
                            all[place] = middle(&[corner(i), corner(i + 1)]);
                        }
                    }
                    if let Some(&place) = local.get(2 * m) {
                        all[place] = middle(&(0..m).map(corner).collect::<Vec<usize>>());
                    }
                }
                if kind == ElementKind::Hex27 {
                    all[26] = middle(&whole.iter().map(|&i| corners[i]).collect::<Vec<usize>>());
                }
                nodes.extend(all);
            }
            CellBlock { kind, nodes, tags: old.tags.clone() }
        })
        .collect();
    Mesh { points, blocks, groups: mesh.groups.clone(), ..mesh.clone() }
}

/// Element kind of order 2 with the fewest nodes.
pub fn serendipity(kind: ElementKind) -> ElementKind {
    match kind {
        ElementKind::Hex8 => ElementKind::Hex20,
        ElementKind::Quad4 => ElementKind::Quad8,
        ElementKind::Wedge6 => ElementKind::Wedge15,
        ElementKind::Tet4 => ElementKind::Tet10,
        ElementKind::Tri3 => ElementKind::Tri6,
        other => other,
    }
}

/// Element kind of order 2 that also has nodes in the middle of quadrangles.
pub fn full(kind: ElementKind) -> ElementKind {
    match kind {
        ElementKind::Hex8 => ElementKind::Hex27,
        ElementKind::Quad4 => ElementKind::Quad9,
        ElementKind::Wedge6 => ElementKind::Wedge18,
        other => serendipity(other),
    }
}
/// Splits each hexahedron into two wedges along a diagonal of the faces "low2" and "high2".
pub fn wedges(mesh: &Mesh) -> Mesh {
    let mut split = mesh.clone();
    let sets = |kind: ElementKind, name: Option<&str>| -> Vec<Vec<usize>> {
        match (kind, name) {
            (ElementKind::Hex8, _) => vec![vec![0, 1, 2, 4, 5, 6], vec![0, 2, 3, 4, 6, 7]],
            (_, Some("low2" | "high2" | "contact" | "base")) => vec![vec![0, 1, 2], vec![0, 2, 3]],
            _ => vec![(0..kind.n_nodes()).collect()],
        }
    };
    for (index, block) in split.blocks.iter_mut().enumerate() {
        let group = mesh.groups.iter().find(|g| g.cells.first().is_some_and(|cell| cell.block == index));
        let parts = sets(block.kind, group.map(|g| g.name.as_str()));
        let kind = match (block.kind, parts.len()) {
            (ElementKind::Hex8, _) => ElementKind::Wedge6,
            (_, 2) => ElementKind::Tri3,
            (kind, _) => kind,
        };
        let old = block.nodes.chunks_exact(block.kind.n_nodes());
        block.nodes =
            old.flat_map(|c| parts.iter().flatten().map(|&i| c[i]).collect::<Vec<usize>>()).collect();
        let n = (block.nodes.len() / kind.n_nodes()) as u64;
        let first = block.tags[0];
        block.tags = (first..first + n).collect();
        block.kind = kind;
        for group in split.groups.iter_mut().filter(|g| g.cells.first().is_some_and(|c| c.block == index)) {
            group.cells = (0..n as usize).map(|cell| CellRef { block: index, cell }).collect();
        }
    }
    split
}
