//! Points of stress recovery: the mesh nodes, duplicated where stress may be discontinuous.

use nalgebra::Vector3;

use crate::fem::assembly::ElementContext;
use crate::fem::loads::face_tangents;
use crate::mesh::Mesh;
use crate::mesh::faces::{SolidFace, SurfaceFace};

/// Cosine of the largest angle between face normals across which surface stress is continuous: 30 degrees.
const SMOOTH_NORMAL_COSINE: f64 = 0.866;

/// Points of stress recovery. A solid body has one point per node and continuous part of the material at the node, so
/// that stress may jump at interfaces. A body given by its surface has one point per node and smooth part of the
/// surface at the node.
#[derive(Debug, Clone, PartialEq)]
pub struct RecoveryPoints {
    /// Mesh node of each point, in ascending order, `[n_points]`.
    pub mesh_nodes: Vec<usize>,
    /// Points of the cells, cell by cell in gmsh's node order. Solid cells are ordered as in [`crate::mesh::Mesh::volume_cells`].
    pub cell_points: Vec<usize>,
    /// Start of each cell in `cell_points`, and the end of the last cell, `[n_cells + 1]`.
    pub offsets: Vec<usize>,
}

impl RecoveryPoints {
    /// Number of points.
    pub fn n_points(&self) -> usize {
        self.mesh_nodes.len()
    }

    /// Number of cells: solids, or faces of a body given by its surface.
    pub fn n_cells(&self) -> usize {
        self.offsets.len() - 1
    }

    /// Points of a cell, in the order of its nodes.
    pub fn points_of_cell(&self, cell: usize) -> &[usize] {
        &self.cell_points[self.offsets[cell]..self.offsets[cell + 1]]
    }

    /// Points on the outer `faces` of a body.
    pub(crate) fn on_surface(mesh: &Mesh, faces: &[SurfaceFace]) -> Self {
        let mut at_nodes: Vec<Vec<(usize, Vector3<f64>)>> = vec![Vec::new(); mesh.n_points()];
        let mut offsets = vec![0];
        for face in faces {
            let first = offsets[offsets.len() - 1];
            for (k, &node) in face.nodes.iter().enumerate() {
                at_nodes[node].push((first + k, normal_at(mesh, face, k)));
            }
            offsets.push(first + face.nodes.len());
        }
        let (mut mesh_nodes, mut cell_points) = (Vec::new(), vec![0; offsets[faces.len()]]);
        for (i, around) in at_nodes.iter().enumerate() {
            let mut parent: Vec<usize> = (0..around.len()).collect();
            for (a, b) in (0..around.len()).flat_map(|a| (0..a).map(move |b| (a, b))) {
                if around[a].1.dot(&around[b].1) > SMOOTH_NORMAL_COSINE {
                    let (a, b) = (find_root(&mut parent, a), find_root(&mut parent, b));
                    parent[a.max(b)] = a.min(b);
                }
            }
            let mut point = vec![0; around.len()];
            for a in 0..around.len() {
                let first = find_root(&mut parent, a);
                if first == a {
                    point[a] = mesh_nodes.len();
                    mesh_nodes.push(i);
                }
                cell_points[around[a].0] = point[first];
            }
        }
        Self { mesh_nodes, cell_points, offsets }
    }

    pub(super) fn new(elements: ElementContext, class: &[usize]) -> Self {
        let cells = || elements.regions.cells.iter().map(|&cell| elements.mesh.cell_nodes(cell));
        let mut pairs: Vec<(usize, usize)> =
            cells().zip(class).flat_map(|(nodes, &class)| nodes.iter().map(move |&n| (n, class))).collect();
        pairs.sort_unstable();
        pairs.dedup();
        let index = |node: usize, class: usize| {
            pairs.binary_search(&(node, class)).expect("every node of every cell is listed")
        };
        let mut offsets = vec![0];
        let mut cell_points = Vec::new();
        for (nodes, &class) in cells().zip(class) {
            cell_points.extend(nodes.iter().map(|&node| index(node, class)));
            offsets.push(cell_points.len());
        }
        Self { mesh_nodes: pairs.into_iter().map(|(node, _)| node).collect(), cell_points, offsets }
    }
}

/// Unit normal of a face at its node `k`. Zero if the face is degenerate at the node.
fn normal_at(mesh: &Mesh, face: &SurfaceFace, k: usize) -> Vector3<f64> {
    let xi = face.kind.face_reference_nodes()[k];
    let [a, b] = face_tangents(face, xi, |node| mesh.points[node].into());
    a.cross(&b).try_normalize(0.0).unwrap_or_default()
}

/// Divides the body into parts of continuous material. Returns, for each element, the index of the first element in its part,
/// `[n_cells]`.
pub(super) fn smooth_parts(elements: ElementContext, faces: &[SolidFace]) -> Vec<usize> {
    let mut parent: Vec<usize> = (0..elements.n_elements()).collect();
    for face in faces {
        let Some(other) = face.neighbour.filter(|&other| other > face.solid) else { continue };
        if elements.regions.is_continuous(face.solid, other) {
            let (a, b) = (find_root(&mut parent, face.solid), find_root(&mut parent, other));
            parent[a.max(b)] = a.min(b);
        }
    }
    (0..elements.n_elements()).map(|i| find_root(&mut parent, i)).collect()
}

fn find_root(parent: &mut [usize], mut i: usize) -> usize {
    while parent[i] != i {
        parent[i] = parent[parent[i]];
        i = parent[i];
    }
    i
}

pub(super) struct PointTopology {
    /// Cells at each point, in ascending order, `[n_points]`.
    pub cells_at: Vec<Vec<usize>>,
    /// Whether a point is a corner of a cell, `[n_points]`.
    pub is_vertex: Vec<bool>,
    /// Whether a point is on the border of its part of continuous material, `[n_points]`. Outer faces belong to the border.
    pub on_material_border: Vec<bool>,
}

impl PointTopology {
    pub fn new(
        elements: ElementContext,
        class: &[usize],
        faces: &[SolidFace],
        points: &RecoveryPoints,
    ) -> Self {
        let n = points.n_points();
        let mut topology = Self {
            cells_at: vec![Vec::new(); n],
            is_vertex: vec![false; n],
            on_material_border: vec![false; n],
        };
        for (i, &cell) in elements.regions.cells.iter().enumerate() {
            let corners = elements.mesh.kind(cell).n_corners();
            for (local, &point) in points.points_of_cell(i).iter().enumerate() {
                topology.cells_at[point].push(i);
                topology.is_vertex[point] |= local < corners;
            }
        }
        for face in faces {
            if face.neighbour.is_some_and(|other| class[other] == class[face.solid]) {
                continue;
            }
            let kind = elements.mesh.kind(elements.regions.cells[face.solid]);
            for &local in kind.local_faces()[face.local_face].1 {
                topology.on_material_border[points.points_of_cell(face.solid)[local]] = true;
            }
        }
        topology.cells_at.iter_mut().for_each(Vec::dedup);
        topology
    }
}
