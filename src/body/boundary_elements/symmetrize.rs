//! Makes a nearly symmetric flexibility symmetric, with little change of its response to constant and linear tractions.
//!
//! Let D = (F - Fᵀ) / 2 be the antisymmetric part of the flexibility F. The columns of V are the nodal forces of
//! constant and linear tractions over the frame. W contains nodal tractions with Wᵀ V = 1. The matrix
//!
//! F' = (F + Fᵀ) / 2 + D V Wᵀ + W (D V)ᵀ
//!
//! is symmetric, and F' V = F V - W Vᵀ D V. Only the last term changes the response to V. Vᵀ D V is the antisymmetric
//! part of the works Vᵀ F V, and measures the discretisation error.

use nalgebra::DMatrix;

use crate::frame::{ContactFrame, FaceMap};
use crate::linalg::vector::dot;

/// Tolerance for linear dependence: the norm of a force vector after orthogonalisation, divided by its norm before.
/// Vectors with a smaller ratio are omitted.
const DEPENDENCE_TOLERANCE: f64 = 1e-9;

pub(super) struct Symmetrization {
    /// W, `[columns][3 n]`.
    tractions: Vec<Vec<f64>>,
    /// D V, `[columns][3 n]`.
    antisymmetric: Vec<Vec<f64>>,
    /// Vᵀ F V.
    works: DMatrix<f64>,
}

impl Symmetrization {
    /// Computes the correction terms for the flexibility `entry(i, j)` of the dofs i, j of the nodes of `map`. `areas`
    /// contains the areas of these nodes.
    pub fn new(
        map: &FaceMap,
        frame: &ContactFrame,
        areas: &[f64],
        entry: impl Fn(usize, usize) -> f64,
    ) -> Self {
        let (n, n_cells) = (3 * map.nodes().len(), map.n_cells());
        let size = frame.size();
        let (mut forces, mut tractions): (Vec<Vec<f64>>, Vec<Vec<f64>>) = (Vec::new(), Vec::new());
        for k in 0..9 {
            let mut of_cells = vec![0.0; 3 * n_cells];
            for (cell, centre) in frame.centers.iter().enumerate() {
                let x = frame.axes.to_local(&(centre - frame.origin)) / size;
                of_cells[k / 3 * n_cells + cell] = [1.0, x.x, x.y][k % 3];
            }
            let mut force = vec![0.0; n];
            map.apply_transpose(&of_cells, &mut force);
            let over_areas = |force: &[f64]| -> Vec<f64> {
                force.iter().enumerate().map(|(dof, f)| f / areas[dof / 3]).collect()
            };
            let whole = dot(&force, &over_areas(&force)).sqrt();
            // The second pass removes the rounding errors of the first pass.
            for _ in 0..2 {
                for (v, w) in forces.iter().zip(&tractions) {
                    let along = dot(&force, w);
                    force.iter_mut().zip(v).for_each(|(f, v)| *f -= along * v);
                }
            }
            let norm = dot(&force, &over_areas(&force)).sqrt();
            if norm > DEPENDENCE_TOLERANCE * whole {
                force.iter_mut().for_each(|f| *f /= norm);
                tractions.push(over_areas(&force));
                forces.push(force);
            }
        }
        let product = |force: &Vec<f64>, entry: &dyn Fn(usize, usize) -> f64| -> Vec<f64> {
            (0..n).map(|i| (0..n).map(|j| entry(i, j) * force[j]).sum()).collect()
        };
        let displaced: Vec<Vec<f64>> = forces.iter().map(|force| product(force, &entry)).collect();
        let transposed = |i: usize, j: usize| entry(j, i);
        let antisymmetric = forces.iter().zip(&displaced).map(|(force, displaced)| {
            let other = product(force, &transposed);
            displaced.iter().zip(other).map(|(a, b)| 0.5 * (a - b)).collect()
        });
        let antisymmetric = antisymmetric.collect();
        let works = DMatrix::from_fn(forces.len(), forces.len(), |i, j| dot(&forces[i], &displaced[j]));
        Self { tractions, antisymmetric, works }
    }

    /// Entry of D V Wᵀ + W (D V)ᵀ.
    pub fn correction(&self, i: usize, j: usize) -> f64 {
        let columns = self.tractions.iter().zip(&self.antisymmetric);
        columns.map(|(w, d)| d[i] * w[j] + w[i] * d[j]).sum()
    }

    /// Norm of the antisymmetric part of the works Vᵀ F V, divided by the norm of Vᵀ F V.
    pub fn asymmetry(&self) -> f64 {
        let apart = 0.5 * (&self.works - self.works.transpose()).norm();
        apart / self.works.norm().max(f64::MIN_POSITIVE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Side;
    use crate::mesh::faces::group_faces;
    use crate::mesh::structured::GradedBlock;

    /// Truth: the corrected matrix is symmetric. Its response to uniform tractions changes only by displacements that
    /// are constant or linear over the frame. The asymmetry of a symmetric matrix is 0.
    #[test]
    fn uniform_tractions_keep_their_response() {
        let mesh = GradedBlock::uniform([1.0; 2], 1.0, [4, 4, 2]).mesh().unwrap();
        let frame = ContactFrame::grid([1.0; 2], [4; 2], [0.0; 2], 0.0).unwrap();
        let faces = group_faces(&mesh, "contact").unwrap();
        let map = FaceMap::new(&frame, &mesh, &faces, Side::Lower).unwrap();
        let n = 3 * map.nodes().len();
        let mut areas = vec![0.0; map.nodes().len()];
        map.integrate_to_nodes(&vec![1.0; map.n_cells()], &mut areas);
        let symmetric =
            |i: usize, j: usize| 1.0 / (1.0 + i.abs_diff(j) as f64) + ((i * j) as f64).sin() * 0.01;
        let part = |i: usize| i as f64 / n as f64;
        let entry = |i: usize, j: usize| symmetric(i, j) + 0.5 * part(i) * part(j).powi(3);
        assert!(Symmetrization::new(&map, &frame, &areas, symmetric).asymmetry() < 1e-14);
        let smooth = Symmetrization::new(&map, &frame, &areas, entry);
        let made = |i: usize, j: usize| 0.5 * (entry(i, j) + entry(j, i)) + smooth.correction(i, j);
        let mut force = vec![0.0; n];
        let uniform: Vec<f64> = (0..3 * map.n_cells()).map(|k| [0.3, -0.2, 1.0][k / map.n_cells()]).collect();
        map.apply_transpose(&uniform, &mut force);
        let response = |entry: &dyn Fn(usize, usize) -> f64| -> Vec<f64> {
            (0..n).map(|i| (0..n).map(|j| entry(i, j) * force[j]).sum()).collect()
        };
        let wanted = response(&entry);
        let from_wanted =
            |found: Vec<f64>| -> Vec<f64> { found.iter().zip(&wanted).map(|(a, b)| a - b).collect() };
        let mean = from_wanted(response(&|i, j| 0.5 * (entry(i, j) + entry(j, i))));
        let mut apart = from_wanted(response(&made));
        let forces = smooth
            .tractions
            .iter()
            .map(|w| -> Vec<f64> { w.iter().enumerate().map(|(dof, t)| t * areas[dof / 3]).collect() });
        for (w, v) in smooth.tractions.iter().zip(forces) {
            let along = dot(&v, &apart);
            apart.iter_mut().zip(w).for_each(|(x, w)| *x -= along * w);
        }
        let [left, by_mean] = [&apart, &mean].map(|apart| dot(apart, apart).sqrt());
        assert!(left < 1e-6 * by_mean, "{left} {by_mean}");
        assert!((0..n * n).all(|k| (made(k / n, k % n) - made(k % n, k / n)).abs() < 1e-14));
    }
}
