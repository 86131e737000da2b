//! Stress on the surface of a meshed body.

use nalgebra::{Matrix3, Vector3};

use crate::body::StressField;
use crate::mesh::Mesh;
use crate::mesh::faces::SurfaceFace;

/// Unit normal at each mesh node, `[n_nodes]`: the direction of the sum of the area vectors of the adjacent `faces`.
/// Zero at nodes without faces.
fn normals<'a>(mesh: &Mesh, faces: impl Iterator<Item = &'a SurfaceFace>) -> Vec<Vector3<f64>> {
    let mut sums = vec![Vector3::zeros(); mesh.n_points()];
    for face in faces {
        let area = face.area_vector(mesh);
        face.nodes.iter().for_each(|&node| sums[node] += area);
    }
    sums.into_iter().map(|sum| sum.try_normalize(0.0).unwrap_or_default()).collect()
}

/// Stress at points of the outer faces of a body.
pub(crate) struct SurfaceStress<'a> {
    field: &'a StressField,
    contact_point: Vec<Option<usize>>,
    normals: Vec<Vector3<f64>>,
    tractions: &'a [[f64; 3]],
}

impl<'a> SurfaceStress<'a> {
    /// Prepares the stress on the outer `faces` of a body. `tractions` act on the contact surface of the body, in global axes,
    /// `[n_nodes]`.
    pub fn new(
        mesh: &Mesh,
        faces: &[SurfaceFace],
        field: &'a StressField,
        tractions: &'a [[f64; 3]],
    ) -> Self {
        let mut contact_point = vec![None; field.points.n_points()];
        field.contact.iter().enumerate().for_each(|(i, found)| contact_point[found.point] = Some(i));
        Self { field, contact_point, normals: normals(mesh, faces.iter()), tractions }
    }

    /// Stress at a recovery point, and the largest principal stress in the tangent plane. On the contact surface, surface strain
    /// and traction determine the stress.
    pub fn at(&self, point: usize) -> ([f64; 6], f64) {
        let node = self.field.points.mesh_nodes[point];
        match self.contact_point[point] {
            Some(i) => {
                let contact = &self.field.contact[i];
                let stress = contact.stress(&self.tractions[node]);
                (stress, max_principal_in_plane(&stress, &contact.axes.column(2).into()))
            }
            None => {
                let stress = self.field.stress[point];
                (stress, max_principal_in_plane(&stress, &self.normals[node]))
            }
        }
    }
}

/// Larger principal stress in the plane with normal `n`, tension positive.
fn max_principal_in_plane(stress: &[f64; 6], n: &Vector3<f64>) -> f64 {
    let plane = Matrix3::identity() - n * n.transpose();
    let inner = plane * tensor(stress) * plane;
    // Larger of the two eigenvalues in the plane, from the trace and the sum of squares.
    let (trace, squares) = (inner.trace(), inner.norm_squared());
    0.5 * (trace + (2.0 * squares - trace * trace).max(0.0).sqrt())
}

fn tensor(s: &[f64; 6]) -> Matrix3<f64> {
    Matrix3::new(s[0], s[5], s[4], s[5], s[1], s[3], s[4], s[3], s[2])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: the larger eigenvalue of the 2 x 2 stress in the plane, in closed form.
    #[test]
    fn largest_stress_in_a_plane() {
        let stress = [3.0, -2.0, 7.0, 0.5, -1.5, 4.0];
        let n = Vector3::new(1.0, -2.0, 2.0) / 3.0;
        let a = n.cross(&Vector3::x()).normalize();
        let b = n.cross(&a);
        let s = |u: Vector3<f64>, v: Vector3<f64>| u.dot(&(tensor(&stress) * v));
        let radius = (0.25 * (s(a, a) - s(b, b)).powi(2) + s(a, b).powi(2)).sqrt();
        assert!((max_principal_in_plane(&stress, &n) - 0.5 * (s(a, a) + s(b, b)) - radius).abs() < 1e-13);
    }
}
