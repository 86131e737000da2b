//! Thermal strain of a body: its nodal forces, and the state of a body with displacement and temperature.

use nalgebra::{Matrix3, Vector6};

use super::assembly::ElementContext;
use super::element_kernels::forces_of_uniform_stress;
use super::loads::NodalForces;
use crate::error::{Error, Result};
use crate::material::strain_of_gradient;

/// Displacement of all mesh nodes and uniform change of temperature of a body.
#[derive(Debug, Clone, Copy)]
pub struct ThermoelasticState<'a> {
    /// Displacement, global axes, mm, `[n_points]`.
    pub displacement: &'a [[f64; 3]],
    /// Change of temperature, K.
    pub temperature_change: f64,
}

/// State without a change of temperature.
impl<'a, T: AsRef<[[f64; 3]]> + ?Sized> From<&'a T> for ThermoelasticState<'a> {
    fn from(displacement: &'a T) -> Self {
        Self { displacement: displacement.as_ref(), temperature_change: 0.0 }
    }
}

impl ThermoelasticState<'_> {
    /// Thermal strain tensor of the element `i`, global axes.
    pub(super) fn thermal_strain(&self, elements: ElementContext, i: usize) -> Matrix3<f64> {
        if self.temperature_change == 0.0 {
            return Matrix3::zeros();
        }
        elements.regions.expansion(i).map_or_else(Matrix3::zeros, |alpha| alpha * self.temperature_change)
    }

    /// Stress C ε_T of the thermal strain ε_T of the element `i`, Voigt, global axes, MPa.
    pub(super) fn thermal_stress(&self, elements: ElementContext, i: usize) -> Vector6<f64> {
        if self.temperature_change == 0.0 {
            return Vector6::zeros();
        }
        elements.regions.stiffness(i) * strain_of_gradient(&self.thermal_strain(elements, i))
    }
}

/// Adds the nodal forces ∫ Bᵀ C ε_T dV of a uniform change of temperature.
///
/// # Errors
/// If the change is not finite, a material has no coefficient of thermal expansion, or an element is inverted.
pub(super) fn add_thermal_forces(
    elements: ElementContext,
    temperature_change: f64,
    forces: &mut NodalForces,
) -> Result<()> {
    if temperature_change == 0.0 {
        return Ok(());
    }
    if !temperature_change.is_finite() {
        return Err(Error::input(format!(
            "temperature change: the value {temperature_change} must be a finite number"
        )));
    }
    let state = ThermoelasticState { displacement: &[], temperature_change };
    for (i, &cell) in elements.regions.cells.iter().enumerate() {
        if elements.regions.expansion(i).is_none() {
            return Err(Error::input(format!(
                "temperature change: the material `{}` has no coefficient of thermal expansion",
                elements.regions.material(i).name
            )));
        }
        let stress = state.thermal_stress(elements, i);
        let kind = elements.mesh.kind(cell);
        let of_element =
            forces_of_uniform_stress(kind, &elements.node_coordinates(cell), &stress, elements.rules)
                .map_err(|unsound| elements.defect_error(cell, unsound))?;
        for (&node, force) in elements.mesh.cell_nodes(cell).iter().zip(&of_element) {
            (0..3).for_each(|c| forces[node][c] += force[c]);
        }
    }
    Ok(())
}
