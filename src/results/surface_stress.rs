//! Stress on the surface of a meshed body, with the tractions that are known there put in.
//!
//! Recovered stress does not meet the boundary conditions of the surface. On the contact surface the three components
//! that act on the surface are known, σ·n = t: they are replaced, the three components in the tangent plane stay as
//! recovered. With P = 1 - n nᵀ: σ' = P σ P + t nᵀ + n tᵀ - (n·t) n nᵀ.

use nalgebra::{Matrix3, Vector3};

use crate::material::VOIGT;
use crate::mesh::Mesh;
use crate::mesh::faces::SurfaceFace;

/// Mean outward normal of the faces at each mesh node, weighted by area, `[n_nodes]`; zero at nodes on none of them.
fn normals<'a>(mesh: &Mesh, faces: impl Iterator<Item = &'a SurfaceFace>) -> Vec<Vector3<f64>> {
    let mut sums = vec![Vector3::zeros(); mesh.n_points()];
    for face in faces {
        let corner = |i: usize| Vector3::from(mesh.points[face.nodes[i]]);
        let fan = 1..face.kind.n_corners() - 1;
        let area: Vector3<f64> =
            fan.map(|i| (corner(i) - corner(0)).cross(&(corner(i + 1) - corner(0)))).sum();
        face.nodes.iter().for_each(|&node| sums[node] += area);
    }
    sums.into_iter().map(|sum| sum.try_normalize(0.0).unwrap_or_default()).collect()
}

/// The stress on the outer faces of a body.
pub(crate) struct SurfaceStress<'a> {
    /// Normals of the contact faces, and of all faces.
    contact: Vec<Vector3<f64>>,
    all: Vec<Vector3<f64>>,
    tractions: &'a [[f64; 3]],
}

impl<'a> SurfaceStress<'a> {
    /// For the `faces` of a body of which those whose nodes are all `contact_nodes` bear the `tractions` on the body,
    /// global axes, `[n_nodes]`.
    pub fn new(
        mesh: &Mesh,
        faces: &[SurfaceFace],
        contact_nodes: &[usize],
        tractions: &'a [[f64; 3]],
    ) -> Self {
        let mut in_contact = vec![false; mesh.n_points()];
        contact_nodes.iter().for_each(|&node| in_contact[node] = true);
        let contact_faces = faces.iter().filter(|face| face.nodes.iter().all(|&node| in_contact[node]));
        Self { contact: normals(mesh, contact_faces), all: normals(mesh, faces.iter()), tractions }
    }

    /// The stress at a node, with the traction put in on the contact surface.
    pub fn at(&self, node: usize, recovered: &[f64; 6]) -> [f64; 6] {
        let n = &self.contact[node];
        if *n == Vector3::zeros() {
            return *recovered;
        }
        with_traction(recovered, n, &self.tractions[node].into())
    }

    /// The largest principal stress in the tangent plane at a node.
    pub fn tangential(&self, node: usize, stress: &[f64; 6]) -> f64 {
        let contact = &self.contact[node];
        tangential(stress, if *contact == Vector3::zeros() { &self.all[node] } else { contact })
    }
}

/// The stress whose components on the surface of normal `n` are those of the traction `t` on the body, the others
/// those of `stress` (Voigt, global axes).
pub fn with_traction(stress: &[f64; 6], n: &Vector3<f64>, t: &Vector3<f64>) -> [f64; 6] {
    let plane = Matrix3::identity() - n * n.transpose();
    let known = t * n.transpose();
    let whole = plane * tensor(stress) * plane + known + known.transpose() - n * n.transpose() * n.dot(t);
    VOIGT.map(|(i, j)| whole[(i, j)])
}

/// The largest principal stress among those in the plane of normal `n`, tension positive.
pub fn tangential(stress: &[f64; 6], n: &Vector3<f64>) -> f64 {
    let plane = Matrix3::identity() - n * n.transpose();
    let inner = plane * tensor(stress) * plane;
    // Of the two eigenvalues in the plane, from the trace and the sum of squares.
    let (trace, squares) = (inner.trace(), inner.norm_squared());
    0.5 * (trace + (2.0 * squares - trace * trace).max(0.0).sqrt())
}

fn tensor(s: &[f64; 6]) -> Matrix3<f64> {
    Matrix3::new(s[0], s[5], s[4], s[5], s[1], s[3], s[4], s[3], s[2])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truths: σ' n = t, the components in the plane are kept, the largest of them is the eigenvalue of the 2 x 2 part.
    #[test]
    fn known_tractions_are_put_in() {
        let stress = [3.0, -2.0, 7.0, 0.5, -1.5, 4.0];
        let n = Vector3::new(1.0, -2.0, 2.0) / 3.0;
        let t = Vector3::new(0.3, 9.0, -4.0);
        let replaced = tensor(&with_traction(&stress, &n, &t));
        assert!((replaced * n - t).norm() < 1e-14);
        let a = n.cross(&Vector3::x()).normalize();
        let b = n.cross(&a);
        for (u, v) in [(a, a), (a, b), (b, b)] {
            assert!((u.dot(&((replaced - tensor(&stress)) * v))).abs() < 1e-14);
        }
        let s = |u: Vector3<f64>, v: Vector3<f64>| u.dot(&(tensor(&stress) * v));
        let radius = (0.25 * (s(a, a) - s(b, b)).powi(2) + s(a, b).powi(2)).sqrt();
        assert!((tangential(&stress, &n) - 0.5 * (s(a, a) + s(b, b)) - radius).abs() < 1e-13);
    }
}
