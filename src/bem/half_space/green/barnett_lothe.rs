//! Barnett-Lothe tensors of a half-space for a surface direction, by the integral formalism.
//!
//! The method uses no eigenvectors. Isotropic and other degenerate materials therefore need no special case.

use std::f64::consts::PI;

use nalgebra::{Matrix3, Vector3};

use crate::error::{Error, Result};
use crate::geometry::Side;
use crate::linalg::vector::nan_max;
use crate::material::Stiffness;

/// Initial and maximum number of points of the trapezoidal rule over half a turn.
const POINTS: [usize; 2] = [32, 1 << 15];

/// Maximum relative change of the tensors when the number of points doubles. The error after doubling is about the
/// square of this change.
const MAX_CHANGE: f64 = 1e-10;

/// The tensors S, H, L for the plane of a surface direction m and the outward normal.
///
/// # Source
/// D.M. Barnett, J. Lothe (1973); docs/theory-half-space.md.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BarnettLothe {
    /// S, dimensionless.
    pub s: Matrix3<f64>,
    /// H, 1/MPa.
    pub h: Matrix3<f64>,
    /// L, MPa.
    pub l: Matrix3<f64>,
}

/// Contractions of the stiffness in the integrands: Q = C(m, m), R = C(m, ν), T = C(ν, ν). Here C(u, v)_ik = C_ijkl u_j
/// v_l, m is the surface direction and ν the outward normal.
#[derive(Debug, Clone, Copy)]
struct Contractions {
    q: Matrix3<f64>,
    r: Matrix3<f64>,
    t: Matrix3<f64>,
}

#[derive(Debug, Clone, Copy)]
struct QuadratureSums {
    count: usize,
    n1: Matrix3<f64>,
    t_inverse: Matrix3<f64>,
    minus_n3: Matrix3<f64>,
}

impl BarnettLothe {
    /// Tensors for the surface direction (cos `angle`, sin `angle`, 0).
    ///
    /// # Errors
    /// If the stiffness is nearly singular, or if the rule does not converge with the maximum number of points
    /// (stiffness ratios above about 10^6).
    pub fn new(stiffness: &Stiffness, side: Side, angle: f64) -> Result<Self> {
        let m = Vector3::new(angle.cos(), angle.sin(), 0.0);
        let contractions = Contractions::new(stiffness, &m, &Vector3::new(0.0, 0.0, side.outward()));
        let mut sums = QuadratureSums::zero();
        let singular = || {
            let ratio = condition(stiffness);
            Error::input(format!(
                "the stiffness of the half-space is nearly singular: its eigenvalues differ by a factor of {ratio:.1e}"
            ))
        };
        sums.add(&contractions, POINTS[0], 0.0).ok_or_else(singular)?;
        let mut coarse = sums.means();
        while sums.count < POINTS[1] {
            sums.add(&contractions, sums.count, 0.5).ok_or_else(singular)?;
            let fine = sums.means();
            if fine.differs_from(&coarse) <= MAX_CHANGE {
                return Ok(fine);
            }
            coarse = fine;
        }
        Err(Error::input(format!(
            "the Barnett-Lothe integrals of the half-space do not converge with {} points: the ratio of the largest to the smallest stiffness is {:.3e}. Ratios up to about 1e6 are supported; use a material with a smaller ratio",
            POINTS[1],
            condition(stiffness)
        )))
    }

    /// Re W = L^-1 (symmetric) and Im W = S L^-1 (antisymmetric) of the surface admittance W, 1/MPa. A traction t exp(i
    /// κ m·x) on the surface causes the displacement W t exp(i κ m·x) / κ.
    ///
    /// # Source
    /// docs/theory-half-space.md, harmonic tractions.
    pub fn admittance(&self) -> [Matrix3<f64>; 2] {
        // L is positive definite like the stiffness. If rounding makes L singular, the NaN entries prevent convergence.
        let l_inverse = self.l.try_inverse().unwrap_or_else(|| Matrix3::repeat(f64::NAN));
        let coupling = self.s * l_inverse;
        [(l_inverse + l_inverse.transpose()) * 0.5, (coupling - coupling.transpose()) * 0.5]
    }

    /// Largest relative difference of H, L, Re W and Im W. The difference of Im W is relative to Re W.
    fn differs_from(&self, other: &Self) -> f64 {
        let relative = |a: &Matrix3<f64>, b: &Matrix3<f64>, scale: f64| (a - b).amax() / scale;
        let ([re, im], [re_other, im_other]) = (self.admittance(), other.admittance());
        [
            relative(&self.h, &other.h, self.h.amax()),
            relative(&self.l, &other.l, self.l.amax()),
            relative(&re, &re_other, re.amax()),
            relative(&im, &im_other, re.amax()),
        ]
        .into_iter()
        .fold(0.0, nan_max)
    }
}

impl Contractions {
    fn new(stiffness: &Stiffness, m: &Vector3<f64>, normal: &Vector3<f64>) -> Self {
        let contract = |a: &Vector3<f64>, b: &Vector3<f64>| {
            Matrix3::from_fn(|i, k| {
                (0..3)
                    .map(|j| (0..3).map(|l| stiffness.component(i, j, k, l) * a[j] * b[l]).sum::<f64>())
                    .sum()
            })
        };
        Self { q: contract(m, m), r: contract(m, normal), t: contract(normal, normal) }
    }

    /// Contractions for (m, ν) rotated by ω within their plane.
    fn turned(&self, omega: f64) -> Self {
        let (s, c) = omega.sin_cos();
        let (cc, cs, ss) = (c * c, c * s, s * s);
        let mixed = self.r + self.r.transpose();
        Self {
            q: self.q * cc + mixed * cs + self.t * ss,
            r: (self.t - self.q) * cs + self.r * cc - self.r.transpose() * ss,
            t: self.q * ss - mixed * cs + self.t * cc,
        }
    }
}

impl QuadratureSums {
    fn zero() -> Self {
        let zero = Matrix3::zeros();
        Self { count: 0, n1: zero, t_inverse: zero, minus_n3: zero }
    }

    /// Adds the integrands at `count` equidistant angles over half a turn, shifted by `offset` spacings. Returns `None`
    /// if T at an angle is not positive definite within rounding.
    fn add(&mut self, contractions: &Contractions, count: usize, offset: f64) -> Option<()> {
        for j in 0..count {
            let at = contractions.turned(PI * (j as f64 + offset) / count as f64);
            // The Cholesky factor of T replaces T⁻¹ in Q - R T⁻¹ Rᵀ. For Lamé constants λ ≫ μ, Q and R T⁻¹ Rᵀ are of
            // order λ, but their difference is of order μ. This difference amplifies rounding errors of T⁻¹ by (λ /
            // μ)³. It amplifies rounding errors of the Cholesky factor only by λ / μ.
            let factor = at.t.cholesky()?;
            let lower = factor.l();
            let y = lower.solve_lower_triangular(&at.r.transpose())?;
            self.n1 -= lower.tr_solve_lower_triangular(&y)?;
            self.t_inverse += factor.inverse();
            self.minus_n3 += at.q - y.tr_mul(&y);
        }
        self.count += count;
        Some(())
    }

    fn means(&self) -> BarnettLothe {
        let weight = 1.0 / self.count as f64;
        BarnettLothe { s: self.n1 * weight, h: self.t_inverse * weight, l: self.minus_n3 * weight }
    }
}

pub(in crate::bem::half_space) fn condition(stiffness: &Stiffness) -> f64 {
    let eigenvalues = stiffness.voigt().symmetric_eigenvalues();
    eigenvalues.max() / eigenvalues.min()
}
