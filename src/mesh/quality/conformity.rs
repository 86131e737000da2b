//! Faces of neighbouring solids that share nodes, but whose displacements between the nodes differ.

use std::collections::HashMap;

use crate::element::ElementKind;
use crate::mesh::faces::{FaceKey, each_solid_face};
use crate::mesh::{CellRef, Mesh};

/// Pairs of faces that do not match.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct NonconformingFaces {
    /// Number of quadrangles that contain the corners of a triangle of another solid, and the number in the mesh file
    /// of a solid with one of these quadrangles.
    pub split_quadrangles: (usize, u64),
    /// Number of faces with equal corners but different order, and the number in the mesh file of a solid with one of
    /// these faces.
    pub mixed_orders: (usize, u64),
}

pub(super) fn find_nonconforming_faces(mesh: &Mesh) -> NonconformingFaces {
    let mut found = NonconformingFaces::default();
    let face_kinds = mesh.blocks.iter().filter(|block| block.kind.dim() == 3).flat_map(|block| {
        block.kind.local_faces().iter().map(|(kind, _)| *kind).collect::<Vec<ElementKind>>()
    });
    let mut kinds: Vec<ElementKind> = face_kinds.collect();
    kinds.dedup();
    if kinds.iter().all(|kind| *kind == kinds[0]) {
        return found;
    }
    let mut faces: HashMap<FaceKey, (ElementKind, CellRef, bool)> = HashMap::new();
    each_solid_face(mesh, |key, owner, local_face| {
        let kind = mesh.kind(owner).local_faces()[local_face].0;
        let face = faces.entry(key).or_insert((kind, owner, true));
        if face.1 != owner {
            face.2 = false;
            if face.0 != kind {
                found.mixed_orders = (found.mixed_orders.0 + 1, mesh.tag(owner).max(found.mixed_orders.1));
            }
        }
    });
    let lone = |key: &FaceKey| faces.get(key).is_some_and(|(_, _, lone)| *lone);
    for (key, (kind, owner, _)) in &faces {
        let triangle = |left_out: usize| {
            let mut part = *key;
            part[left_out] = usize::MAX;
            part.sort_unstable();
            part
        };
        if kind.n_corners() == 4 && lone(key) && (0..4).any(|corner| lone(&triangle(corner))) {
            found.split_quadrangles =
                (found.split_quadrangles.0 + 1, mesh.tag(*owner).max(found.split_quadrangles.1));
        }
    }
    found
}
