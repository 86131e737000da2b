//! Displacement field of a point force, and the traction that follows from it.

use nalgebra::{Matrix3, Vector3};

use crate::material::Stiffness;

/// Displacement (rows) per unit force (columns), and its derivatives along x, y, z.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GreenTensor {
    /// Displacement per force, 1/(MPa mm).
    pub value: Matrix3<f64>,
    /// Derivatives along x, y, z, 1/(MPa mm²).
    pub gradient: [Matrix3<f64>; 3],
}

/// Traction t_i = C_ijkl n_j ∂_l u_k on planes with the unit normal n, as an operator on the displacement gradient. The
/// operator stores the matrix C_ijkl n_j for each l.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TractionOperator([Matrix3<f64>; 3]);

impl TractionOperator {
    /// Operator for the unit normal `normal` in the axes of `stiffness`.
    pub fn new(stiffness: &Stiffness, normal: &Vector3<f64>) -> Self {
        Self([0, 1, 2].map(|l| {
            Matrix3::from_fn(|i, k| (0..3).map(|j| stiffness.component(i, j, k, l) * normal[j]).sum())
        }))
    }

    /// Traction (rows) under a unit force (columns), 1/mm².
    pub fn apply(&self, field: &GreenTensor) -> Matrix3<f64> {
        let [x, y, z] = &field.gradient;
        self.0[0] * x + self.0[1] * y + self.0[2] * z
    }
}

impl GreenTensor {
    /// Returns the field at `distance` from the force, if `self` is the field at distance 1 in the same direction.
    pub(super) fn at_distance(self, distance: f64) -> Self {
        let inverse = 1.0 / distance;
        Self { value: self.value * inverse, gradient: self.gradient.map(|part| part * (inverse * inverse)) }
    }

    /// Largest absolute entry of the gradient.
    pub(crate) fn max_gradient(&self) -> f64 {
        self.gradient.iter().map(Matrix3::amax).fold(0.0, f64::max)
    }

    /// Largest absolute difference of the gradients' entries.
    pub(crate) fn max_gradient_difference(&self, other: &Self) -> f64 {
        let apart = |k: usize| (self.gradient[k] - other.gradient[k]).amax();
        apart(0).max(apart(1)).max(apart(2))
    }
}
