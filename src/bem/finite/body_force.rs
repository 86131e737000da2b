//! Particular displacement field of a uniform body force and a uniform thermal strain. The remaining problem has
//! surface loads only.

use nalgebra::Matrix3;

use crate::geometry::Point;
use crate::material::Stiffness;

/// Particular displacement u_p = -½ ((x - x0)·n)² T⁻¹ b for a uniform force per volume b with the unit direction n.
/// Here T_ik = C_ijkl n_j n_l and x0 is any point. The stress σ_p of u_p satisfies div σ_p + b = 0. A uniform thermal
/// strain ε_T adds the displacement ε_T (x - x0), which causes no stress.
///
/// # Source
/// By substitution: σ_ij = -C_ijkl n_l ((x - x0)·n) (T⁻¹ b)_k, and ∂_j σ_ij = -b_i.
#[derive(Debug, Clone, PartialEq)]
pub struct BodyForceSolution {
    origin: Point,
    direction: Point,
    /// T⁻¹ b.
    curvature: Point,
    /// Stress σ_p divided by (x - x0)·n.
    stress: Matrix3<f64>,
    thermal_strain: Matrix3<f64>,
}

/// Inverse of the acoustic tensor T_ik = C_ijkl n_j n_l.
pub(super) fn inverse_acoustic_tensor(stiffness: &Stiffness, n: &Point) -> Matrix3<f64> {
    let acoustic: Matrix3<f64> = Matrix3::from_fn(|i, k| {
        let pairs = (0..3).flat_map(|j| (0..3).map(move |l| (j, l)));
        pairs.map(|(j, l)| stiffness.component(i, j, k, l) * n[j] * n[l]).sum()
    });
    // The division by the largest entry prevents overflow and underflow of the determinant.
    let size = acoustic.amax();
    Matrix3::try_inverse(acoustic / size).expect("a stiffness is positive definite") / size
}

impl BodyForceSolution {
    /// Solution for the force per volume `force` (N/mm³) and the tensor `thermal_strain`, with x0 = `origin`.
    pub fn new(stiffness: &Stiffness, force: &Point, thermal_strain: Matrix3<f64>, origin: Point) -> Self {
        // The division by the largest component prevents overflow and underflow of the square of the force.
        let direction =
            (force / force.amax().max(f64::MIN_POSITIVE)).try_normalize(0.0).unwrap_or_else(Point::z);
        let curvature = inverse_acoustic_tensor(stiffness, &direction) * force;
        let stress = Matrix3::from_fn(|i, j| {
            let pairs = (0..3).flat_map(|k| (0..3).map(move |l| (k, l)));
            -pairs.map(|(k, l)| stiffness.component(i, j, k, l) * curvature[k] * direction[l]).sum::<f64>()
        });
        Self { origin, direction, curvature, stress, thermal_strain }
    }

    fn height(&self, x: &Point) -> f64 {
        (x - self.origin).dot(&self.direction)
    }

    /// Displacement u_p, mm.
    pub fn displacement(&self, x: &Point) -> Point {
        -0.5 * self.height(x).powi(2) * self.curvature + self.thermal_strain * (x - self.origin)
    }

    /// Gradient of u_p without the thermal strain; rows are components, columns are directions.
    pub fn gradient(&self, x: &Point) -> Matrix3<f64> {
        -self.height(x) * self.curvature * self.direction.transpose()
    }

    /// Stress σ_p, MPa.
    pub fn stress(&self, x: &Point) -> Matrix3<f64> {
        self.stress * self.height(x)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: a laterally constrained column under a weight b per volume along z has u_z = -z² b / (2 C33) and σ_zz = -b z.
    #[test]
    fn columns_under_their_weight() {
        let stiffness = Stiffness::isotropic(210e3, 0.3).unwrap();
        let c33 = stiffness.voigt()[(2, 2)];
        for b in [-2.0, 1e-300, 1e300] {
            let weight = BodyForceSolution::new(
                &stiffness,
                &Point::new(0.0, 0.0, b),
                Matrix3::zeros(),
                Point::zeros(),
            );
            let x = Point::new(0.3, -0.2, 1.5);
            let (u, stress) = (weight.displacement(&x), weight.stress(&x));
            assert!((u.z / (-1.5 * 1.5 * b / (2.0 * c33)) - 1.0).abs() < 1e-12, "{b:e}: {u}");
            assert!((stress[(2, 2)] / (-1.5 * b) - 1.0).abs() < 1e-12, "{b:e}: {stress}");
            assert!(u.x.abs().max(u.y.abs()) < 1e-12 * u.z.abs());
        }
    }
}
