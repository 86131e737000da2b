//! Boundary-element bodies: half-spaces ([`half_space`]) and finite bodies ([`finite`]), discretised on their surface only.

mod cube_table;
pub mod finite;
pub mod full_space;
pub mod green_tensor;
pub mod half_space;
mod quadrature_order;

use nalgebra::Matrix3;

use crate::geometry::Point;
use crate::material::tensor_to_voigt;

/// Displacement u at a point, and its gradient `gradient[(i, j)]` = ∂u_i/∂x_j.
#[derive(Debug, Clone, Copy, Default)]
struct DisplacementGradient {
    displacement: Point,
    gradient: Matrix3<f64>,
}

/// Displacement and stress at a point of a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointState {
    /// Displacement, mm.
    pub displacement: Point,
    /// Stress, MPa.
    pub stress: Matrix3<f64>,
}

impl PointState {
    /// The stress in Voigt order 11 22 33 23 13 12, MPa.
    pub fn voigt(&self) -> [f64; 6] {
        tensor_to_voigt(&self.stress)
    }

    /// Transforms the state to new axes. The columns of `axes` are the current axes, in components of the new axes.
    pub fn rotated(&self, axes: &Matrix3<f64>) -> Self {
        Self { displacement: axes * self.displacement, stress: axes * self.stress * axes.transpose() }
    }
}
