//! Estimated error of the stress in the energy norm.
//!
//! The recovered stress σ* converges faster than the element stress σ_h. Their difference estimates the error in each element K,
//! e_K² = ∫_K (σ* - σ_h) : C⁻¹ : (σ* - σ_h) dV.
//!
//! # Source
//! Zienkiewicz and Zhu (1987), Int. J. Numer. Meth. Engng 24, 337-357, eqs. 10-15; (1992) 33, 1365-1382.

use nalgebra::{Matrix6, Vector6};
use rayon::prelude::*;

use super::samples::energy_points;
use super::superconvergent::StressRecovery;
use crate::error::Result;
use crate::fem::FeModel;
use crate::fem::thermal::ThermoelasticState;

/// Estimated error of the stress of a body. Norms are energy norms: the squared norm is ∫ σ : C⁻¹ : σ dV, twice the strain energy.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ErrorEstimate {
    /// Norm of the error in each solid cell, `[n_cells]`.
    pub cell_errors: Vec<f64>,
    /// Volume of each solid cell, mm3, `[n_cells]`.
    pub cell_volumes: Vec<f64>,
    /// Centre of each solid cell, `[n_cells]`.
    pub cell_centres: Vec<[f64; 3]>,
    /// Norm of the element stress over the body.
    pub stress_norm: f64,
}

/// Relative error below which rounding and the contact tolerance dominate, on any mesh.
pub const MIN_RELATIVE_ERROR: f64 = 1e-8;

impl ErrorEstimate {
    /// Norm of the error over the body.
    pub fn error_norm(&self) -> f64 {
        self.cell_errors.iter().map(|e| e * e).sum::<f64>().sqrt()
    }

    /// Estimated squared norm of the true stress: squared norm of the element stress plus squared norm of the error.
    pub fn norm_squared(&self) -> f64 {
        self.stress_norm * self.stress_norm + self.error_norm().powi(2)
    }

    /// Norm of the error relative to the estimated norm of the true stress; 0 if the stress is zero.
    pub fn relative_error(&self) -> f64 {
        let whole = self.norm_squared().sqrt();
        if whole > 0.0 { self.error_norm() / whole } else { 0.0 }
    }

    /// Squared error per volume of each cell, relative to the mean squared norm per volume of the body, `[n_cells]`; 0 if the
    /// stress is zero.
    pub fn error_density(&self) -> Vec<f64> {
        let mean = self.norm_squared() / self.cell_volumes.iter().sum::<f64>();
        let density = |(e, v): (&f64, &f64)| if mean > 0.0 { e * e / (v * mean) } else { 0.0 };
        self.cell_errors.iter().zip(&self.cell_volumes).map(density).collect()
    }

    /// Smallest set of cells that contain at least the fraction `share` (0..1) of the squared error, worst first.
    pub fn worst_cells(&self, share: f64) -> Vec<usize> {
        let mut order: Vec<usize> =
            (0..self.cell_errors.len()).filter(|&i| self.cell_errors[i] > 0.0).collect();
        order.sort_by(|&a, &b| self.cell_errors[b].total_cmp(&self.cell_errors[a]).then(a.cmp(&b)));
        let wanted = share * self.error_norm().powi(2);
        let mut sum = 0.0;
        let below = |i: &usize| {
            let before = sum;
            sum += self.cell_errors[*i].powi(2);
            before < wanted
        };
        order.into_iter().take_while(below).collect()
    }
}

impl StressRecovery {
    /// Estimates the error of the element stress, for a displacement of all mesh nodes, a change of temperature, and the recovered
    /// `stress`.
    ///
    /// # Errors
    /// If the Jacobian of an element is not positive at a point where the stress is evaluated.
    pub fn estimate_error<'a>(
        &self,
        model: &FeModel,
        state: impl Into<ThermoelasticState<'a>>,
        stress: &[[f64; 6]],
    ) -> Result<ErrorEstimate> {
        let state = state.into();
        let n = model.elements().n_elements();
        let cells: Vec<CellError> = (0..n)
            .into_par_iter()
            .map(|i| self.cell_error(model, i, state, stress))
            .collect::<Result<_>>()?;
        Ok(ErrorEstimate {
            stress_norm: cells.iter().map(|cell| cell.norm).sum::<f64>().sqrt(),
            cell_errors: cells.iter().map(|cell| cell.error.max(0.0).sqrt()).collect(),
            cell_volumes: cells.iter().map(|cell| cell.volume).collect(),
            cell_centres: cells.iter().map(|cell| cell.centre).collect(),
        })
    }

    fn cell_error(
        &self,
        model: &FeModel,
        i: usize,
        state: ThermoelasticState,
        stress: &[[f64; 6]],
    ) -> Result<CellError> {
        let elements = model.elements();
        let compliance = compliance(&elements.regions.stiffness(i));
        let points = self.points().points_of_cell(i);
        let mut cell = CellError::default();
        for point in energy_points(elements, i, state, self.rules())? {
            let mut difference = -point.stress;
            for (&node, &value) in points.iter().zip(&point.values) {
                difference += Vector6::from(stress[node]) * value;
                let x = elements.mesh.points[self.points().mesh_nodes[node]];
                (0..3).for_each(|c| cell.centre[c] += value * point.volume * x[c]);
            }
            cell.error += point.volume * difference.dot(&(compliance * difference));
            cell.norm += point.volume * point.stress.dot(&(compliance * point.stress));
            cell.volume += point.volume;
        }
        cell.centre = cell.centre.map(|x| x / cell.volume);
        Ok(cell)
    }
}

#[derive(Default)]
struct CellError {
    error: f64,
    norm: f64,
    volume: f64,
    centre: [f64; 3],
}

fn compliance(stiffness: &Matrix6<f64>) -> Matrix6<f64> {
    stiffness.cholesky().expect("a stiffness is positive definite").inverse()
}
