//! Displacement inside a half-space under a point force on its surface, and its gradient.

use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::{Matrix3, Vector3};

use super::green::SurfaceGreen;
use crate::error::{Error, Result};
use crate::geometry::Side;
use crate::material::Stiffness;

/// First and largest number of points of the angular rule.
const POINTS: [usize; 2] = [32, 1 << 13];

/// Change between a rule and the doubled one, over the largest value, at which the latter is accepted.
const CHANGE: f64 = 1e-11;

/// Field of a unit force at the origin of the surface of the half-space z < 0, whose outward normal is +z.
///
/// # Source
/// G(x) = −1/(4π²z) ∫₀^2π D⁻¹ [1 − (R + τT) A] dθ with m = (cos θ, sin θ, 0), τ = −(m·x)/z, D = Q + τ(R + Rᵀ) + τ²T,
/// Q = C(m, m), R = C(m, e3), T = C(e3, e3), A = S L⁻¹ of the Barnett-Lothe tensors: the resolvent of the Stroh matrix, which needs no
/// eigenvectors and is real.
pub struct InteriorField {
    stiffness: Stiffness,
    green: SurfaceGreen,
    /// C(e_a, e_b) for a, b = x, y, and C(e_a, e3), C(e3, e3).
    plane: [[Matrix3<f64>; 2]; 2],
    mixed: [Matrix3<f64>; 2],
    normal: Matrix3<f64>,
}

/// Displacement (rows) per unit force (columns), and its derivatives along x, y, z.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointField {
    /// 1/(MPa mm).
    pub value: Matrix3<f64>,
    /// 1/(MPa mm²).
    pub gradient: [Matrix3<f64>; 3],
}

impl InteriorField {
    /// The field of a material in the axes of the surface.
    ///
    /// # Errors
    /// As [`SurfaceGreen::new`].
    pub fn new(stiffness: &Stiffness) -> Result<Self> {
        let contract = |j: usize, l: usize| Matrix3::from_fn(|i, k| stiffness.component(i, j, k, l));
        Ok(Self {
            stiffness: stiffness.clone(),
            green: SurfaceGreen::new(stiffness, Side::Lower)?,
            plane: [0, 1].map(|j| [0, 1].map(|l| contract(j, l))),
            mixed: [0, 1].map(|j| contract(j, 2)),
            normal: contract(2, 2),
        })
    }

    /// The field at a point below the surface, mm.
    ///
    /// # Errors
    /// If the point is not below the surface, or lies so near to it that the rule does not converge.
    pub fn at(&self, x: &Vector3<f64>) -> Result<PointField> {
        let distance = x.norm();
        if !distance.is_finite() || x.z >= 0.0 {
            return Err(Error::input(format!("the point {:?} does not lie below the surface", x.as_slice())));
        }
        let direction = x / distance;
        let mut points = POINTS[0];
        let mut coarse = self.rule(&direction, points);
        while points < POINTS[1] {
            points *= 2;
            let fine = self.rule(&direction, points);
            if fine.differs_from(&coarse) <= CHANGE {
                return Ok(fine.scaled(distance));
            }
            coarse = fine;
        }
        Err(Error::numerical(format!(
            "the field at {:?} does not converge: it lies {:.1e} of its distance from the force below the surface",
            x.as_slice(),
            -direction.z
        )))
    }

    /// The field in a direction at distance 1, by the trapezoidal rule in s, tan ψ = ε tan s, θ = φ + π/2 + ψ, with the points where
    /// the poles are near the real line.
    fn rule(&self, x: &Vector3<f64>, points: usize) -> PointField {
        let (r, z) = (x.x.hypot(x.y), x.z);
        let phi = x.y.atan2(x.x);
        let cluster = if r > 0.0 { (-z / r).sqrt().min(1.0) } else { 1.0 };
        let (mut value, mut gradient) = (Matrix3::zeros(), [Matrix3::zeros(); 3]);
        for k in 0..points {
            let t = ((k as f64 + 0.5) * PI / points as f64 - FRAC_PI_2).tan();
            let psi = (cluster * t).atan();
            let weight = cluster * (1.0 + t * t) / (1.0 + cluster * cluster * t * t);
            let theta = phi + FRAC_PI_2 + psi;
            let m = [theta.cos(), theta.sin()];
            let tau = psi.sin() * r / z;
            let mut q = Matrix3::zeros();
            for a in 0..2 {
                for b in 0..2 {
                    q += self.plane[a][b] * (m[a] * m[b]);
                }
            }
            let mixed = self.mixed[0] * m[0] + self.mixed[1] * m[1];
            let (both, t) = (mixed + mixed.transpose(), self.normal);
            let coupling = self.green.symbol(theta).map(|value| value.im);
            let inverse =
                (q + both * tau + t * (tau * tau)).cholesky().expect("C(n, n) is positive definite");
            let f = inverse.solve(&(Matrix3::identity() - (mixed + t * tau) * coupling));
            let slope = -inverse.solve(&((both + t * (2.0 * tau)) * f + t * coupling));
            value += f * weight;
            (0..2).for_each(|a| gradient[a] += slope * (weight * m[a]));
            gradient[2] += (f + slope * tau) * weight;
        }
        let factor = 1.0 / (2.0 * PI * points as f64);
        PointField { value: value * (-factor / z), gradient: gradient.map(|part| part * (factor / (z * z))) }
    }

    /// Traction on a surface with the unit normal `normal` under a unit force (columns), 1/mm².
    pub fn traction(&self, field: &PointField, normal: &Vector3<f64>) -> Matrix3<f64> {
        Matrix3::from_fn(|i, force| {
            let mut sum = 0.0;
            for j in 0..3 {
                for k in 0..3 {
                    for l in 0..3 {
                        let c = self.stiffness.component(i, j, k, l);
                        sum += c * normal[j] * field.gradient[l][(k, force)];
                    }
                }
            }
            sum
        })
    }
}

impl PointField {
    /// That at distance 1 at another distance in the same direction.
    fn scaled(self, distance: f64) -> Self {
        Self {
            value: self.value / distance,
            gradient: self.gradient.map(|part| part / (distance * distance)),
        }
    }

    /// Largest difference over the largest value, of field and gradient.
    fn differs_from(&self, other: &Self) -> f64 {
        let largest = |parts: &[Matrix3<f64>; 3]| parts.iter().map(Matrix3::amax).fold(0.0, f64::max);
        let apart = [0, 1, 2].map(|k| self.gradient[k] - other.gradient[k]);
        let value = (self.value - other.value).amax() / self.value.amax();
        value.max(largest(&apart) / largest(&self.gradient))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cfrp(tilt: f64) -> Stiffness {
        let fibre = Stiffness::transversely_isotropic(167_230.0, 9544.0, 5292.0, 0.272, 0.369).unwrap();
        fibre.rotated(nalgebra::Rotation3::from_axis_angle(&Vector3::y_axis(), -tilt.to_radians()).matrix())
    }

    /// Truth: Boussinesq and Cerruti, in the body z < 0.
    #[test]
    fn isotropic_bodies() {
        let (e, nu) = (210e3, 0.3);
        let field = InteriorField::new(&Stiffness::isotropic(e, nu).unwrap()).unwrap();
        let mu = e / (2.0 * (1.0 + nu));
        for x in [[0.3, -0.4, -0.7], [0.0, 0.0, -1.3], [2.0, 1.0, -0.2], [1.0, 0.5, -0.01]] {
            let found = field.at(&Vector3::from(x)).unwrap().value * (4.0 * PI * mu);
            let [x, y, depth] = [x[0], x[1], -x[2]];
            let s = 1.0 / (x * x + y * y + depth * depth).sqrt();
            let (s3, k) = (s * s * s, 1.0 - 2.0 * nu);
            let near = 1.0 / (1.0 / s + depth);
            let (a, b) = (k * s * near, k * s * near * near);
            let wanted = Matrix3::new(
                s + x * x * s3 + k * near - b * x * x,
                x * y * (s3 - b),
                -(x * depth * s3 - a * x),
                x * y * (s3 - b),
                s + y * y * s3 + k * near - b * y * y,
                -(y * depth * s3 - a * y),
                -(x * depth * s3 + a * x),
                -(y * depth * s3 + a * y),
                depth * depth * s3 + 2.0 * (1.0 - nu) * s,
            );
            assert!((found - wanted).amax() < 1e-11 * wanted.amax(), "{found} {wanted}");
        }
    }

    /// Truth: the derivative is the limit of differences; the field falls like 1 / distance; at the surface it is Γ(φ) / r.
    #[test]
    fn derivatives_scale_and_surface() {
        let stiffness = cfrp(30.0);
        let field = InteriorField::new(&stiffness).unwrap();
        let x = Vector3::new(0.5, 0.3, -0.4);
        let at = field.at(&x).unwrap();
        for k in 0..3 {
            let mut step = Vector3::zeros();
            step[k] = 1e-4;
            let difference =
                (field.at(&(x + step)).unwrap().value - field.at(&(x - step)).unwrap().value) / 2e-4;
            assert!((at.gradient[k] - difference).amax() < 1e-6 * at.gradient[k].amax(), "along {k}");
        }
        let far = field.at(&(x * 7.0)).unwrap();
        assert!((far.value * 7.0 - at.value).amax() < 1e-12 * at.value.amax());
        let green = SurfaceGreen::new(&stiffness, Side::Lower).unwrap();
        let apart = |depth: f64| {
            let near = field.at(&Vector3::new(0.6, 0.8, -depth)).unwrap().value;
            let surface = green.gamma(0.8_f64.atan2(0.6));
            (near - surface).amax() / surface.amax()
        };
        let [coarse, fine] = [4e-3, 2e-3].map(apart);
        assert!(fine < 1e-2 && (coarse / fine - 2.0).abs() < 0.1, "{coarse} {fine}");
    }

    /// Truth: the tractions on a hemisphere about the force balance it.
    #[test]
    fn tractions_balance_the_force() {
        let field = InteriorField::new(&cfrp(30.0)).unwrap();
        let mut sum = Matrix3::zeros();
        let (around, down) = (48, 24);
        for i in 0..down {
            // Midpoints in cos β after a substitution that is flat at the surface.
            let u = (i as f64 + 0.5) / down as f64;
            let (cos, slope) = (u * u * (3.0 - 2.0 * u), 6.0 * u * (1.0 - u));
            let sin = (1.0 - cos * cos).sqrt();
            for k in 0..around {
                let phi = 2.0 * PI * k as f64 / around as f64;
                let n = Vector3::new(sin * phi.cos(), sin * phi.sin(), -cos);
                let weight = 2.0 * PI / around as f64 * slope / down as f64;
                sum += field.traction(&field.at(&n).unwrap(), &n) * weight;
            }
        }
        assert!((sum + Matrix3::identity()).amax() < 2e-3, "{sum}");
    }
}
