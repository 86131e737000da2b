//! Postprocessing of a displacement field: stress, strain energy, reactions.

mod estimate;
mod exposure;
mod patch;
mod points;
mod refinement;
mod samples;
mod superconvergent;
mod surface_stress;

use rayon::prelude::*;

use super::assembly::ElementContext;
use super::element_kernels::element_state;
use super::integration_points::ElementState;
use super::model::FeModel;
use crate::error::Result;

pub use estimate::{ErrorEstimate, MIN_RELATIVE_ERROR};
pub use exposure::ExposureField;
pub(crate) use exposure::exposures;
pub use points::RecoveryPoints;
pub use refinement::{SIZE_RATIO_BOUNDS, size_ratios};
pub use superconvergent::StressRecovery;
pub use surface_stress::SurfaceStressPoint;
pub(crate) use surface_stress::{FaceAverages, FaceContribution, surface_stress_points};

const ELEMENTS_PER_BATCH: usize = 4096;

impl FeModel {
    /// Strain energy 1/2 ∫ ε : C : ε dV, N mm, for a displacement of all mesh nodes, `[n_points]`.
    ///
    /// # Errors
    /// If an element is inverted ([`FeModel`] already refuses such meshes).
    pub fn strain_energy(&self, displacement: &[[f64; 3]]) -> Result<f64> {
        let mut energy = 0.0;
        for_each_state(self.elements(), displacement, |_, state| energy += state.energy)?;
        Ok(energy)
    }

    /// Nodal forces of the stresses, ∫ Bᵀ σ dV, global axes, N, `[n_points]`.
    ///
    /// # Errors
    /// As [`Self::strain_energy`].
    pub fn internal_forces(&self, displacement: &[[f64; 3]]) -> Result<Vec<[f64; 3]>> {
        let mut forces = vec![[0.0; 3]; self.mesh().n_points()];
        for_each_state(self.elements(), displacement, |nodes, state| {
            for (&node, force) in nodes.iter().zip(&state.forces) {
                (0..3).for_each(|c| forces[node][c] += force[c]);
            }
        })?;
        Ok(forces)
    }

    /// Forces of the supports on the body, global axes, N, `[n_points]`; zero at free dofs. Forces of contact and foundations at
    /// prescribed dofs are included.
    ///
    /// # Errors
    /// As [`Self::strain_energy`].
    pub fn reactions(&self, displacement: &[[f64; 3]]) -> Result<Vec<[f64; 3]>> {
        let mut forces = self.internal_forces(displacement)?;
        for (node, (force, external)) in forces.iter_mut().zip(&self.loads().forces).enumerate() {
            for c in 0..3 {
                force[c] = if self.prescribed_displacement(node, c).is_some() {
                    force[c] - external[c]
                } else {
                    0.0
                };
            }
        }
        Ok(forces)
    }
}

fn for_each_state(
    elements: ElementContext,
    displacement: &[[f64; 3]],
    mut visit: impl FnMut(&[usize], &ElementState),
) -> Result<()> {
    for start in (0..elements.n_elements()).step_by(ELEMENTS_PER_BATCH) {
        let end = (start + ELEMENTS_PER_BATCH).min(elements.n_elements());
        let batch: Vec<Result<ElementState>> =
            (start..end).into_par_iter().map(|i| evaluate_element(elements, i, displacement)).collect();
        for (i, state) in (start..end).zip(batch) {
            visit(elements.mesh.cell_nodes(elements.regions.cells[i]), &state?);
        }
    }
    Ok(())
}

fn evaluate_element(elements: ElementContext, i: usize, displacement: &[[f64; 3]]) -> Result<ElementState> {
    let cell = elements.regions.cells[i];
    let u: Vec<[f64; 3]> = elements.mesh.cell_nodes(cell).iter().map(|&node| displacement[node]).collect();
    let kind = elements.mesh.kind(cell);
    element_state(
        kind,
        &elements.node_coordinates(cell),
        &u,
        &elements.regions.stiffness(i),
        elements.formulation,
        elements.rules,
    )
    .map_err(|unsound| elements.defect_error(cell, unsound))
}
