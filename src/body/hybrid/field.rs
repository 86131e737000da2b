//! Displacement field of a half-space under tractions on its surface.

use nalgebra::{Matrix3, Vector3};

use crate::bem::half_space::{PatchIntegrator, PointForceField, SurfaceGreen};
use crate::error::{Error, Result};
use crate::material::Stiffness;

/// Displacement field inside and on the surface of a half-space under surface tractions, axes of the patch.
pub(super) struct HalfSpaceField {
    pub point_force: PointForceField,
    /// Integrates the surface displacement due to uniform tractions on polygons.
    pub patch_integrals: PatchIntegrator,
    /// Matrices C(e3, e_a)_ik = C_i3ka of the stiffness C for a = x, y, MPa.
    tangential: [Matrix3<f64>; 2],
    /// T⁻¹ = C(e3, e3)⁻¹, 1/MPa.
    inverse_normal: Matrix3<f64>,
}

impl HalfSpaceField {
    /// Combines the field of a point force with the surface Green's function `green` of the same material.
    pub fn new(stiffness: &Stiffness, point_force: PointForceField, green: &SurfaceGreen) -> Result<Self> {
        let contract = |l: usize| Matrix3::from_fn(|i, k| stiffness.component(i, 2, k, l));
        let inverse_normal = contract(2).try_inverse();
        Ok(Self {
            point_force,
            patch_integrals: PatchIntegrator::new(green),
            tangential: [contract(0), contract(1)],
            inverse_normal: inverse_normal
                .ok_or_else(|| Error::numerical("the stiffness of the half-space is singular"))?,
        })
    }

    /// Normal derivative ∂u/∂z = T⁻¹ t at the surface traction t, for a displacement u that does not vary along the
    /// surface.
    pub fn normal_derivative(&self, traction: &Vector3<f64>) -> Vector3<f64> {
        self.inverse_normal * traction
    }

    /// Displacement gradient on the surface from the tangential derivatives `along` = ∂u/∂a and the traction t: T
    /// ∂u/∂z = t - Σ C(e3, e_a) ∂u/∂a.
    pub fn gradient_from_traction(&self, along: [Vector3<f64>; 2], traction: &Vector3<f64>) -> Matrix3<f64> {
        let [x, y] = along;
        let rest = traction - self.tangential[0] * x - self.tangential[1] * y;
        Matrix3::from_columns(&[x, y, self.normal_derivative(&rest)])
    }
}
