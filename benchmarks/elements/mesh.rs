//! Blocks of every element type on the same graded grid, written as .msh files.

use std::collections::HashMap;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use orthowear::element::ElementKind::{self, Quad4, Quad9, Tri3, Wedge6};
use orthowear::mesh::{CellBlock, CellRef, Mesh};

use crate::Outcome;
use crate::structured::{BlockElements, GradedBlock};

/// Half the edge length of the contact patch, mm.
pub const PATCH: f64 = 1.5;
/// Half the edge length of the block, which equals its height, mm.
const SIZE: f64 = 12.0;

/// Block of 24 x 24 x 12 mm with `n` elements along the edge of the contact patch. The elements grow with the distance
/// from the patch.
pub fn block(kind: ElementKind, n: usize) -> Outcome<Mesh> {
    let solids = if kind.n_corners() == 4 { BlockElements::Tet4 } else { BlockElements::Hex8 };
    let mesh = GradedBlock {
        patch_half_width: [PATCH; 2],
        patch_cells: [n; 2],
        outer_cells: n.div_ceil(4) + 1,
        depth_cells: n / 2 + 1,
        first_depth: Some(2.0 * PATCH / n as f64),
        solids,
        ..GradedBlock::uniform([SIZE; 2], SIZE, [n; 3])
    };
    let mesh = mesh.mesh()?;
    let mesh = if kind.n_corners() == 6 { wedges(&mesh) } else { mesh };
    Ok(if kind.n_nodes() > kind.n_corners() { raised(mesh, kind) } else { mesh })
}

fn face_kind(solid: ElementKind, face: ElementKind) -> ElementKind {
    let mut kinds = solid.local_faces().iter().map(|(kind, _)| *kind);
    kinds.find(|kind| kind.n_corners() == face.n_corners()).expect("a face of the solid")
}

/// Copy of a mesh with each hexahedron split into two wedges, and quadrangles of other groups than "sides" into two
/// triangles.
fn wedges(mesh: &Mesh) -> Mesh {
    let mut cut = Mesh { source: mesh.source.clone(), points: mesh.points.clone(), ..Mesh::default() };
    let kinds: [(ElementKind, &[&[usize]]); 3] = [
        (Tri3, &[&[0, 1, 2], &[0, 2, 3]]),
        (Quad4, &[&[0, 1, 2, 3]]),
        (Wedge6, &[&[0, 1, 2, 4, 5, 6], &[0, 2, 3, 4, 6, 7]]),
    ];
    cut.blocks = kinds.map(|(kind, _)| CellBlock { kind, nodes: vec![], tags: vec![] }).to_vec();
    for group in &mesh.groups {
        let block = match (group.dim, group.name.as_str()) {
            (3, _) => 2,
            (_, "sides") => 1,
            _ => 0,
        };
        let first = cut.blocks[block].nodes.len() / kinds[block].0.n_nodes();
        for &cell in &group.cells {
            let nodes = mesh.cell_nodes(cell);
            for part in kinds[block].1 {
                cut.blocks[block].nodes.extend(part.iter().map(|&i| nodes[i]));
            }
        }
        let last = cut.blocks[block].nodes.len() / kinds[block].0.n_nodes();
        let mut group = group.clone();
        group.cells = (first..last).map(|cell| CellRef { block, cell }).collect();
        cut.groups.push(group);
    }
    numbered(cut)
}

fn numbered(mut mesh: Mesh) -> Mesh {
    let mut next = 1;
    for block in &mut mesh.blocks {
        let n = (block.nodes.len() / block.kind.n_nodes()) as u64;
        block.tags = (next..next + n).collect();
        next += n;
    }
    mesh
}

/// For each node of a solid beyond its corner nodes: the corners whose mean is the position of the node.
fn between(kind: ElementKind) -> Vec<Vec<usize>> {
    let nodes = kind.reference_nodes();
    let corners = kind.n_corners();
    let is_mean = |list: &[usize], x: [f64; 3]| {
        (0..3).all(|k| {
            let mean = list.iter().map(|&i| nodes[i][k]).sum::<f64>() / list.len() as f64;
            (mean - x[k]).abs() < 1e-12
        })
    };
    // Diagonals of faces are omitted, because the mean of two opposite corners is the centre of the face.
    let faces = || kind.local_faces().iter().map(|(face, local)| &local[..face.n_corners()]);
    let edges = || faces().flat_map(|f| (0..f.len()).map(move |i| vec![f[i], f[(i + 1) % f.len()]]));
    let all = || std::iter::once((0..corners).collect::<Vec<_>>());
    let lists = || edges().chain(faces().map(<[usize]>::to_vec)).chain(all());
    nodes[corners..].iter().map(|&x| lists().find(|list| is_mean(list, x)).expect("a mean")).collect()
}

/// Mesh with elements of second order in place of first-order elements. The solids become elements of type `kind`.
fn raised(mut mesh: Mesh, kind: ElementKind) -> Mesh {
    let mut known: HashMap<Vec<usize>, usize> = HashMap::new();
    for block in 0..mesh.blocks.len() {
        let old = mesh.blocks[block].clone();
        let new = if old.kind.dim() == 3 { kind } else { face_kind(kind, old.kind) };
        let corners = new.n_corners();
        let lists = if new.dim() == 3 { between(new) } else { between_on_face(new) };
        let mut nodes = Vec::with_capacity(old.n_cells() * new.n_nodes());
        for cell in 0..old.n_cells() {
            let own = old.cell_nodes(cell);
            nodes.extend(&own[..corners]);
            for list in &lists {
                let mut key: Vec<usize> = list.iter().map(|&i| own[i]).collect();
                key.sort_unstable();
                let mean = |k: usize| key.iter().map(|&i| mesh.points[i][k]).sum::<f64>() / key.len() as f64;
                let x = std::array::from_fn(mean);
                nodes.push(*known.entry(key).or_insert_with(|| {
                    mesh.points.push(x);
                    mesh.points.len() - 1
                }));
            }
        }
        mesh.blocks[block] = CellBlock { kind: new, nodes, tags: old.tags };
    }
    mesh
}

/// As [`between`], for a face: first its edges in order, then the centre of a quadrilateral with nine nodes.
fn between_on_face(face: ElementKind) -> Vec<Vec<usize>> {
    let n = face.n_corners();
    let edges = (0..n).map(|i| vec![i, (i + 1) % n]);
    let middle = (face == Quad9).then(|| (0..n).collect());
    edges.chain(middle).collect()
}

pub fn write(mesh: &Mesh, path: &Path) -> Outcome<()> {
    let mut text = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n".to_owned();
    writeln!(text, "{}", mesh.groups.len())?;
    for group in &mesh.groups {
        writeln!(text, "{} {} \"{}\"", group.dim, group.tag, group.name)?;
    }
    writeln!(text, "$EndPhysicalNames\n$Nodes\n{}", mesh.n_points())?;
    for (i, [x, y, z]) in mesh.points.iter().enumerate() {
        writeln!(text, "{} {x} {y} {z}", i + 1)?;
    }
    let cells: usize = mesh.groups.iter().map(|group| group.cells.len()).sum();
    writeln!(text, "$EndNodes\n$Elements\n{cells}")?;
    for group in &mesh.groups {
        for &cell in &group.cells {
            write!(text, "{} {} 2 {} {}", mesh.tag(cell), mesh.kind(cell).gmsh_code(), group.tag, group.tag)?;
            for node in mesh.cell_nodes(cell) {
                write!(text, " {}", node + 1)?;
            }
            writeln!(text)?;
        }
    }
    text += "$EndElements\n";
    Ok(fs::write(path, text)?)
}
