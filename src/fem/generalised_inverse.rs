//! Generalised inverse of the singular stiffness of an unconstrained body.
//!
//! R are the rigid-body modes at the free dofs, and M is diagonal with the nodal volume fractions. With Rᵀ M R = 1 and Π = 1 - R Rᵀ
//! M, the solution is u = Π K⁺ Πᵀ f. The mean rigid-body motion Rᵀ M u is zero, and the forces Πᵀ f = f - M R Rᵀ f are in
//! equilibrium. K⁺ is the inverse of K with grounding springs at as many dofs as there are modes. The springs carry no force under
//! Πᵀ f, so u does not depend on them.

use nalgebra::Vector3;

use super::dof_map::DofMap;
use super::rigid_body_modes::RigidBodyModes;
use crate::error::{Error, Result};
use crate::linalg::dense::SymmetricDense;
use crate::linalg::sparse::SymmetricSparse;
use crate::linalg::vector::dot;

#[derive(Debug, Clone)]
pub(super) struct GeneralisedInverse {
    /// Rigid-body modes, with mean square displacement 1 over the body.
    pub modes: RigidBodyModes,
    /// R: each mode at the free dofs, `[n_free]`.
    modes_on_dofs: Vec<Vec<f64>>,
    /// Columns of M R, `[n_free]` each.
    weighted_modes: Vec<Vec<f64>>,
}

impl GeneralisedInverse {
    /// Generalised inverse for the rigid-body modes `motions` and the nodal volumes `volumes`, `[n_points]`, mm3.
    ///
    /// # Errors
    /// If the volumes do not determine the modes, because the nodes lie on a line.
    pub fn new(motions: RigidBodyModes, points: &[[f64; 3]], volumes: &[f64], dofs: &DofMap) -> Result<Self> {
        let total: f64 = volumes.iter().sum();
        let modes = motions.orthonormal(points, |node| volumes[node] / total).ok_or_else(|| {
            Error::input(
                "the rigid-body modes of the body cannot be determined, because its nodes lie on a line",
            )
        })?;
        let at = |dof: usize, j: usize| modes.displacement(&Vector3::from(points[dof / 3]), j)[dof % 3];
        let rows = dofs.dofs_of_rows();
        let modes_on_dofs: Vec<Vec<f64>> =
            (0..modes.n_modes()).map(|j| rows.iter().map(|&dof| at(dof, j)).collect()).collect();
        let weighted_modes = modes_on_dofs
            .iter()
            .map(|mode| mode.iter().zip(rows).map(|(r, &dof)| r * volumes[dof / 3] / total).collect())
            .collect();
        Ok(Self { modes, modes_on_dofs, weighted_modes })
    }

    /// Adds grounding springs at as many dofs as there are modes. Each step chooses the dof that moves most in the modes that the
    /// previous springs leave free.
    pub fn add_grounding_springs(&self, stiffness: &mut SymmetricSparse) {
        let n = stiffness.n();
        let diagonal = stiffness.diagonal();
        let mut rows: Vec<Vec<f64>> =
            (0..n).map(|row| self.modes_on_dofs.iter().map(|mode| mode[row]).collect()).collect();
        for _ in 0..self.modes_on_dofs.len() {
            let size = |row: &Vec<f64>| row.iter().map(|v| v * v).sum::<f64>();
            let mut best = 0;
            for row in 1..n {
                if size(&rows[row]) > size(&rows[best]) {
                    best = row;
                }
            }
            stiffness.add(best, best, diagonal[best]);
            let length = size(&rows[best]).sqrt();
            let unit: Vec<f64> = rows[best].iter().map(|v| v / length).collect();
            for row in &mut rows {
                let along: f64 = row.iter().zip(&unit).map(|(a, b)| a * b).sum();
                row.iter_mut().zip(&unit).for_each(|(a, b)| *a -= along * b);
            }
        }
    }

    /// Work of forces on the free dofs, `[n_free]`, for unit amplitude of each mode.
    pub fn work(&self, forces: &[f64]) -> Vec<f64> {
        self.modes_on_dofs.iter().map(|mode| dot(mode, forces)).collect()
    }

    /// Applies the generalised inverse to forces, `[n_free]`, in place. `inverse` applies K⁺.
    pub fn solve(&self, forces: &mut [f64], inverse: impl FnOnce(&mut [f64]) -> Result<()>) -> Result<()> {
        let work = self.work(forces);
        for (column, work) in self.weighted_modes.iter().zip(work) {
            forces.iter_mut().zip(column).for_each(|(f, c)| *f -= work * c);
        }
        inverse(forces)?;
        for (mode, mean) in self.modes_on_dofs.iter().zip(self.mean_motions(forces)) {
            forces.iter_mut().zip(mode).for_each(|(u, r)| *u -= mean * r);
        }
        Ok(())
    }

    /// Adds the mean rigid-body motion of the displacement `of` to `displacement`, `[n_free]` each.
    pub fn add_mean_motion(&self, of: &[f64], displacement: &mut [f64]) {
        for (mode, mean) in self.modes_on_dofs.iter().zip(self.mean_motions(of)) {
            displacement.iter_mut().zip(mode).for_each(|(u, r)| *u += mean * r);
        }
    }

    /// Replaces `flexibility`, a block of K⁺, by the corresponding block of Π K⁺ Πᵀ. `rows` are the rows of the dofs of the block
    /// in the system, `None` for prescribed dofs. `inverse` applies K⁺.
    pub fn project_flexibility(
        &self,
        flexibility: &mut SymmetricDense,
        rows: &[Option<usize>],
        inverse: impl Fn(&mut [f64]) -> Result<()>,
    ) -> Result<()> {
        let m = self.modes_on_dofs.len();
        let mut images = Vec::with_capacity(m);
        for column in &self.weighted_modes {
            let mut image = column.clone();
            inverse(&mut image)?;
            images.push(image);
        }
        // Π K⁺ Πᵀ = K⁺ - X Rᵀ - R Xᵀ + R (Rᵀ M X) Rᵀ with X = K⁺ M R. `halves` are the rows of X - ½ R (Rᵀ M X), so that each of
        // the two middle terms takes half of the last term.
        let moved: Vec<Vec<f64>> = images.iter().map(|image| self.mean_motions(image)).collect();
        let row = |columns: &[Vec<f64>], row: Option<usize>| -> Vec<f64> {
            columns.iter().map(|column| row.map_or(0.0, |row| column[row])).collect()
        };
        let modes: Vec<Vec<f64>> = rows.iter().map(|&r| row(&self.modes_on_dofs, r)).collect();
        let halves: Vec<Vec<f64>> = rows
            .iter()
            .zip(&modes)
            .map(|(&r, modes)| {
                let mut x = row(&images, r);
                (0..m).for_each(|j| x[j] -= 0.5 * (0..m).map(|k| moved[j][k] * modes[k]).sum::<f64>());
                x
            })
            .collect();
        let n = rows.len();
        for i in 0..n {
            for j in 0..=i {
                let change = dot(&halves[i], &modes[j]) + dot(&modes[i], &halves[j]);
                let value = flexibility.at(i, j) - change;
                flexibility.values_mut()[i * n + j] = value;
                flexibility.values_mut()[j * n + i] = value;
            }
        }
        Ok(())
    }

    /// Mean rigid-body motions Rᵀ M u, one per mode.
    fn mean_motions(&self, displacement: &[f64]) -> Vec<f64> {
        self.weighted_modes.iter().map(|column| dot(column, displacement)).collect()
    }
}
