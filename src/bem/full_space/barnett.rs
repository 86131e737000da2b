//! Field of a point force in an anisotropic full space, by integrals over directions.

use std::f64::consts::PI;

use nalgebra::{Matrix3, Vector3};

use crate::bem::green_tensor::GreenTensor;
use crate::error::{Error, Result};
use crate::material::Stiffness;

/// Initial and maximum number of directions over half a turn.
const DIRECTIONS: [usize; 2] = [32, 16384];

/// Convergence limit: change of the field when the number of directions doubles, relative to the largest value. The
/// remaining error is about the square of this change.
const MAX_CHANGE: f64 = 1e-7;

/// Field of a unit force at the origin of an anisotropic full space.
///
/// # Source
/// D.M. Barnett (1972): U = <Q⁻¹> / 4πr and ∂_s U = <-T_s Q⁻¹ + z_s F> / 4πr². The means <> are taken over the unit
/// vectors z normal to T = x / r. Here Q = C(z, z) and F = Q⁻¹ (C(z, T) + C(T, z)) Q⁻¹, with C(u, v)_ik = C_ijkl u_j
/// v_l.
#[derive(Debug, Clone)]
pub struct BarnettField {
    stiffness: Stiffness,
}

/// Contractions C(u, v)_ik = C_ijkl u_j v_l for a direction T and the vectors a and b normal to it.
struct Contractions {
    /// C(a, a), C(a, b) + C(b, a), C(b, b).
    across: [Matrix3<f64>; 3],
    /// C(a, T) + C(T, a), C(b, T) + C(T, b).
    along: [Matrix3<f64>; 2],
}

#[derive(Clone, Copy)]
struct Sums {
    /// Mean of Q⁻¹.
    value: Matrix3<f64>,
    /// Means of F times the components of z along a and b.
    slopes: [Matrix3<f64>; 2],
}

impl BarnettField {
    /// Field for a material.
    pub fn new(stiffness: &Stiffness) -> Self {
        Self { stiffness: stiffness.clone() }
    }

    /// Field at the point `x` (mm), which must not be the origin.
    ///
    /// # Errors
    /// If the sums do not converge with 16384 directions (stiffness ratios too large).
    pub fn at(&self, x: &Vector3<f64>) -> Result<GreenTensor> {
        let r = x.norm();
        let t = x / r;
        let a = t.cross(&Vector3::ith(t.iamin(), 1.0)).normalize();
        let b = t.cross(&a);
        let contractions = Contractions::new(&self.stiffness, &a, &b, &t);
        let mut n = DIRECTIONS[0];
        let mut sums = contractions.sums(n, 0.0);
        loop {
            let between = contractions.sums(n, 0.5);
            let finer = sums.mean(&between);
            let change = finer.apart(&sums);
            (sums, n) = (finer, 2 * n);
            if change <= MAX_CHANGE {
                break;
            }
            if n >= DIRECTIONS[1] {
                return Err(Error::numerical(
                    "the field of a point force does not converge: the stiffness differs too much between the material axes",
                ));
            }
        }
        let factor = 1.0 / (4.0 * PI * r);
        let gradient = [0, 1, 2]
            .map(|s| (sums.slopes[0] * a[s] + sums.slopes[1] * b[s] - sums.value * t[s]) * (factor / r));
        Ok(GreenTensor { value: sums.value * factor, gradient })
    }
}

impl Contractions {
    fn new(stiffness: &Stiffness, a: &Vector3<f64>, b: &Vector3<f64>, t: &Vector3<f64>) -> Self {
        let contract = |u: &Vector3<f64>, v: &Vector3<f64>| {
            Matrix3::from_fn(|i, k| {
                let pairs = (0..3).flat_map(|j| (0..3).map(move |l| (j, l)));
                pairs.map(|(j, l)| stiffness.component(i, j, k, l) * u[j] * v[l]).sum()
            })
        };
        let both = |u, v| contract(u, v) + contract(v, u);
        Self { across: [contract(a, a), both(a, b), contract(b, b)], along: [both(a, t), both(b, t)] }
    }

    /// Means over `n` directions in the plane of a and b. The first direction is `offset` steps from the vector a.
    fn sums(&self, n: usize, offset: f64) -> Sums {
        let mut sums = Sums { value: Matrix3::zeros(), slopes: [Matrix3::zeros(); 2] };
        for k in 0..n {
            let (s, c) = (PI * (k as f64 + offset) / n as f64).sin_cos();
            let q = self.across[0] * (c * c) + self.across[1] * (c * s) + self.across[2] * (s * s);
            let inverse = inverse(&q);
            let slope = inverse * (self.along[0] * c + self.along[1] * s) * inverse;
            sums.value += inverse;
            sums.slopes[0] += slope * c;
            sums.slopes[1] += slope * s;
        }
        let share = 1.0 / n as f64;
        Sums { value: sums.value * share, slopes: sums.slopes.map(|slope| slope * share) }
    }
}

fn inverse(q: &Matrix3<f64>) -> Matrix3<f64> {
    let (x, y, z) = (q.column(0), q.column(1), q.column(2));
    let rows = [y.cross(&z), z.cross(&x), x.cross(&y)];
    Matrix3::from_rows(&rows.map(|row| row.transpose())) / x.dot(&rows[0])
}

impl Sums {
    fn mean(&self, other: &Self) -> Self {
        let slopes = [0, 1].map(|k| (self.slopes[k] + other.slopes[k]) * 0.5);
        Self { value: (self.value + other.value) * 0.5, slopes }
    }

    fn apart(&self, other: &Self) -> f64 {
        let parts = |sums: &Self| [sums.value, sums.slopes[0], sums.slopes[1]];
        let (own, others) = (parts(self), parts(other));
        let size = own.iter().map(Matrix3::amax).fold(0.0, f64::max);
        own.iter().zip(&others).map(|(a, b)| (a - b).amax()).fold(0.0, f64::max) / size
    }
}
