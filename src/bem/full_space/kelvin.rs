//! Closed form of the field of a point force in an isotropic full space.

use std::f64::consts::PI;

use nalgebra::{Matrix3, Vector3};

use crate::bem::green_tensor::GreenTensor;
use crate::material::Stiffness;

/// Kelvin's solution for a unit force at the origin.
///
/// # Source
/// U = [(3 - 4ν) 1 + T Tᵀ] / (16π μ (1 - ν) r) with T = x / r, the unit matrix 1 and the shear modulus μ.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Kelvin {
    /// 1 / (16π μ (1 - ν)), 1/MPa.
    factor: f64,
    same: f64,
}

impl Kelvin {
    /// Closed form for `stiffness`; `None` unless the material is isotropic.
    pub(super) fn from_stiffness(stiffness: &Stiffness) -> Option<Self> {
        let [mu, nu] = stiffness.isotropic_constants()?;
        Some(Self { factor: 1.0 / (16.0 * PI * mu * (1.0 - nu)), same: 3.0 - 4.0 * nu })
    }

    pub(super) fn at(&self, x: &Vector3<f64>) -> GreenTensor {
        let r = x.norm();
        let t = x / r;
        let product = t * t.transpose();
        let value = Matrix3::identity() * self.same + product;
        // The derivative of the unit vector T is ∂_s T_i = (δ_is - T_i T_s) / r.
        let gradient = [0, 1, 2].map(|s| {
            let mut slope = -(value + product * 2.0) * t[s];
            for i in 0..3 {
                slope[(s, i)] += t[i];
                slope[(i, s)] += t[i];
            }
            slope * (self.factor / (r * r))
        });
        GreenTensor { value: value * (self.factor / r), gradient }
    }
}
