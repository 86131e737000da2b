//! Elastic (Winkler) foundations on surfaces: K += ∫ N_a k N_b dS, with the foundation stiffness k and the shape
//! functions N.

use nalgebra::{Matrix3, Vector3};

use super::loads::{FaceLoad, LoadedFace, face_points, face_rule};
use super::spec::{FeSpec, FoundationStiffness};
use crate::error::{Context, Error, Result};
use crate::mesh::Mesh;
use crate::mesh::faces::{SurfaceFace, group_faces};

pub(super) struct FoundationFace {
    pub face: LoadedFace,
    pub nodes: Vec<usize>,
    /// Stiffness matrix, lower triangle row by row, N/mm; component c of node a has index 3 a + c.
    pub packed: Vec<f64>,
}

/// Node of a foundation and a direction in which the foundation resists motion.
pub(super) type RestrainedDirection = (usize, Vector3<f64>);

/// Stiffness of all faces on foundations.
///
/// # Errors
/// If a group is missing or is no outer surface. If a stiffness is not finite, is negative, or is zero in all components.
pub(super) fn foundation_faces(spec: &FeSpec) -> Result<Vec<FoundationFace>> {
    let mut faces = Vec::new();
    for_each_face(spec, |mesh, face, bedding| faces.push(stiffness(mesh, face, bedding)))?;
    Ok(faces)
}

/// Nodes and directions in which foundations resist motion.
pub(super) fn restrained_directions(spec: &FeSpec) -> Result<Vec<RestrainedDirection>> {
    let mut resistances = Vec::new();
    for_each_face(spec, |mesh, face, bedding| {
        let stiffness = stiffness(mesh, face, bedding);
        let n = 3 * face.nodes.len();
        let entry = |i: usize, j: usize| stiffness.packed[i.max(j) * (i.max(j) + 1) / 2 + i.min(j)];
        debug_assert_eq!(stiffness.packed.len(), n * (n + 1) / 2);
        for (a, &node) in face.nodes.iter().enumerate() {
            // The columns are scaled, because only their directions matter.
            let block = Matrix3::from_fn(|i, j| entry(3 * a + i, 3 * a + j));
            let largest = block.diagonal().max();
            for c in (0..3).filter(|&c| block[(c, c)] > 1e-12 * largest) {
                resistances.push((node, block.column(c).into_owned() / largest));
            }
        }
    })?;
    Ok(resistances)
}

fn for_each_face(
    spec: &FeSpec,
    mut visit: impl FnMut(&Mesh, &SurfaceFace, FoundationStiffness),
) -> Result<()> {
    for foundation in &spec.foundations {
        let name = || format!("foundation of the group \"{}\"", foundation.group);
        check_stiffness(foundation.stiffness).context(name)?;
        for face in group_faces(&spec.mesh, &foundation.group).context(|| "foundation".to_string())? {
            visit(&spec.mesh, &face, foundation.stiffness);
        }
    }
    Ok(())
}

fn check_stiffness(bedding: FoundationStiffness) -> Result<()> {
    let values = bedding.values();
    if values.iter().all(|k| k.is_finite() && *k >= 0.0) && values.iter().any(|k| *k > 0.0) {
        return Ok(());
    }
    Err(Error::input(format!(
        "the stiffness {values:?} must be positive (some components may be 0, but not all)"
    )))
}

/// Stiffness ∫ N_a k N_b dS of the foundation of one face. The integration rules are exact on flat faces with straight
/// edges.
fn stiffness(mesh: &Mesh, face: &SurfaceFace, bedding: FoundationStiffness) -> FoundationFace {
    let n = 3 * face.nodes.len();
    let mut packed = vec![0.0; n * (n + 1) / 2];
    for (values, area) in face_points(mesh, face, &face_rule(face.kind, 2)) {
        let stiffness = bedding.over_area(&area);
        let mut at = 0;
        for i in 0..n {
            for j in 0..=i {
                packed[at] += values[i / 3] * values[j / 3] * stiffness[(i % 3, j % 3)];
                at += 1;
            }
        }
    }
    let (owner, local_face) = face.id();
    let face_and_bed = LoadedFace { owner, local_face, load: FaceLoad::Foundation(bedding) };
    FoundationFace { face: face_and_bed, nodes: face.nodes.clone(), packed }
}
