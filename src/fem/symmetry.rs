//! Symmetry planes: the displacement component that vanishes on a physical group of plane faces.

use nalgebra::Vector3;

use crate::error::{Error, Result};
use crate::geometry::AXIS_NAMES;
use crate::mesh::Mesh;
use crate::mesh::faces::group_faces;

/// Largest angle (radians) between faces of a plane, and between the normal of the plane and an axis. Also the largest distance of
/// nodes from the plane, relative to the size of the group.
const PLANARITY_TOLERANCE: f64 = 1e-6;

/// Displacement component (0, 1, 2) along the normal of the plane faces of the physical group `name`.
///
/// # Errors
/// If the group is missing, is no outer surface, or is not plane. If the normal is not along a global axis.
pub fn symmetry_component(mesh: &Mesh, name: &str) -> Result<usize> {
    let faces = group_faces(mesh, name)?;
    let corner = |node: usize| Vector3::from(mesh.points[node]);
    let mut normals = Vec::new();
    let mut nodes: Vec<usize> = faces.iter().flat_map(|face| face.nodes.iter().copied()).collect();
    nodes.sort_unstable();
    nodes.dedup();
    for face in &faces {
        let [a, b, c] = [0, 1, 2].map(|i| corner(face.nodes[i]));
        normals.push((b - a).cross(&(c - a)).normalize());
    }
    let (Some(normal), Some(&first)) = (normals.first(), nodes.first()) else {
        return Err(Error::input(format!("the group \"{name}\" has no faces")));
    };
    let size = nodes.iter().map(|&node| (corner(node) - corner(first)).norm()).fold(0.0, f64::max);
    let bent = normals.iter().any(|other| (other - normal).norm() > PLANARITY_TOLERANCE);
    let off = nodes
        .iter()
        .any(|&node| normal.dot(&(corner(node) - corner(first))).abs() > PLANARITY_TOLERANCE * size);
    if bent || off {
        return Err(Error::input(format!(
            "the group \"{name}\" is not plane, but a symmetry plane must be a single plane; give the faces of each plane their own group"
        )));
    }
    (0..3).find(|&c| (normal[c].abs() - 1.0).abs() < PLANARITY_TOLERANCE * PLANARITY_TOLERANCE).ok_or_else(|| {
        Error::input(format!(
            "the group \"{name}\" has the normal ({:.4}, {:.4}, {:.4}), but the normal of a symmetry plane must be along {}; rotate the mesh accordingly",
            normal.x,
            normal.y,
            normal.z,
            AXIS_NAMES.join(", ")
        ))
    })
}
