//! 8-node hexahedron with mean dilatation ("B-bar").
//!
//! The dilatation tr ε is replaced by its element mean θ̄ in strain and virtual strain: ε̄ = ε + (θ̄ - tr ε) I / 3. Nearly
//! incompressible material does not lock, any anisotropy is allowed, and a constant strain stays exact.
//!
//! # Source
//! Hughes (1980), Int. J. Numer. Meth. Engng 15, 1413-1418.

use nalgebra::{Matrix6, Vector6};

use super::integration_points::{ElementState, MappedPoint, unit_strain};

/// Change of each of the three normal strains due to a unit displacement, `[node][component]`.
type NormalStrainCorrection = [[f64; 3]; 8];

pub(super) struct MeanDilatation {
    corrections: [NormalStrainCorrection; 8],
}

impl MeanDilatation {
    pub fn new(mapped: &[MappedPoint<8>; 8]) -> Self {
        let volume: f64 = mapped.iter().map(|point| point.volume).sum();
        let mut mean = [[0.0; 3]; 8];
        for point in mapped {
            for (sum, gradient) in mean.iter_mut().flatten().zip(point.gradients.iter().flatten()) {
                *sum += gradient * point.volume / volume;
            }
        }
        let corrections = mapped.map(|point| {
            std::array::from_fn(|a| std::array::from_fn(|c| (mean[a][c] - point.gradients[a][c]) / 3.0))
        });
        Self { corrections }
    }

    pub fn correct_strains(&self, u: &[[f64; 3]; 8], strains: &mut [Vector6<f64>; 8]) {
        for (strain, change) in strains.iter_mut().zip(&self.corrections) {
            let sum: f64 = change.iter().flatten().zip(u.iter().flatten()).map(|(c, u)| c * u).sum();
            (0..3).for_each(|row| strain[row] += sum);
        }
    }

    pub fn correct_forces(&self, mapped: &[MappedPoint<8>; 8], state: &mut ElementState) {
        for ((point, found), change) in mapped.iter().zip(&state.points).zip(&self.corrections) {
            let pull = (found.stress[0] + found.stress[1] + found.stress[2]) * point.volume;
            for (force, c) in state.forces.iter_mut().flatten().zip(change.iter().flatten()) {
                *force += c * pull;
            }
        }
    }

    /// Adds ∫ B̄ᵀ C B̄ dV to the packed lower triangle. B̄ maps nodal displacements to the strain ε̄.
    pub fn add_stiffness(&self, mapped: &[MappedPoint<8>; 8], c: &Matrix6<f64>, packed: &mut [f64]) {
        for (point, change) in mapped.iter().zip(&self.corrections) {
            let strains: [Vector6<f64>; 24] = std::array::from_fn(|dof| {
                let (node, component) = (dof / 3, dof % 3);
                let shift = change[node][component];
                let mut strain = Vector6::new(shift, shift, shift, 0.0, 0.0, 0.0);
                for (row, value) in unit_strain(&point.gradients[node], component) {
                    strain[row] += value;
                }
                strain
            });
            let mut k = 0;
            for (i, strain) in strains.iter().enumerate() {
                let stress = c * strain * point.volume;
                for other in &strains[..=i] {
                    packed[k] += stress.dot(other);
                    k += 1;
                }
            }
        }
    }
}
