//! Boundary-element bodies: what is known of a body from its surface alone.

mod cube_table;
pub mod finite;
pub mod full_space;
pub mod green_tensor;
pub mod half_space;
mod quadrature_order;

use nalgebra::Matrix3;

use crate::geometry::Point;
use crate::material::tensor_to_voigt;

/// Displacement at a point, and its gradient: rows the components, columns the directions.
#[derive(Debug, Clone, Copy, Default)]
struct DisplacementGradient {
    displacement: Point,
    gradient: Matrix3<f64>,
}

/// Displacement and stress at a point of a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointState {
    /// mm.
    pub displacement: Point,
    /// MPa.
    pub stress: Matrix3<f64>,
}

impl PointState {
    /// The stress in Voigt order 11 22 33 23 13 12, MPa.
    pub fn voigt(&self) -> [f64; 6] {
        tensor_to_voigt(&self.stress)
    }

    /// In axes that those of this are the columns of `axes` in.
    pub fn rotated(&self, axes: &Matrix3<f64>) -> Self {
        Self { displacement: axes * self.displacement, stress: axes * self.stress * axes.transpose() }
    }
}
