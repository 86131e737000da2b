//! Scales of a flexibility operator: local stiffnesses for the natural residual, and largest eigenvalues for step
//! sizes.
//!
//! S_nn and S_tt are the normal and the tangential diagonal block of the operator in a cell. Ŝ = M Rᵀ S_tt R M is S_tt
//! in scaled components, with the matrices R and M of `FrictionScaling`.

use std::sync::OnceLock;

use nalgebra::{Matrix2, Matrix3, Vector2};

use crate::contact::friction_scaling::FrictionScaling;
use crate::flexibility::Flexibility;
use crate::laws::friction::FrictionEllipse;

/// Local stiffnesses and largest eigenvalues for one flexibility operator and one friction ellipse.
#[derive(Debug, Clone)]
pub struct ContactScales {
    /// Local normal stiffness of each cell, c_n = 1 / S_nn, MPa/mm (docs/theory-contact.md).
    pub c_normal: Vec<f64>,
    /// Local tangential stiffness of each cell, c_t = 1 / sqrt(Ŝ11 Ŝ22), MPa/mm. Empty without friction.
    pub c_tangential: Vec<f64>,
    /// Orthogonal projector of each cell on the scaled tangential directions in which supports fix the bodies, `[N]`.
    /// Empty if no cell has a fixed direction.
    pub fixed_directions: Vec<Matrix2<f64>>,
    normal: OnceLock<f64>,
    tangential: OnceLock<f64>,
}

const POWER_ITERATIONS: usize = 12;

/// Largest compliance of a fixed tangential direction, relative to the largest compliance of the cell.
const MAX_FIXED_COMPLIANCE_SHARE: f64 = 1e-10;

/// Lower bound on Ŝ11 and Ŝ22 of a cell, relative to the largest of Ŝ11, Ŝ22 and μ1 μ2 S_nn.
const MIN_COMPLIANCE_SHARE: f64 = 1e-2;

impl ContactScales {
    /// Computes the local stiffnesses from the diagonal of the operator.
    pub fn new(operator: &dyn Flexibility, friction: Option<&FrictionEllipse>) -> Self {
        let blocks = operator.diagonal_blocks();
        let c_normal = blocks.map(|s| 1.0 / s[(2, 2)]).into_vec();
        let Some(ellipse) = friction else {
            return Self::of_cells(c_normal, Vec::new(), Vec::new());
        };
        let hat = FrictionScaling::new(ellipse);
        let c_tangential = blocks
            .map(|s| {
                // In plane strain, for example, supports fix a direction, which then has no compliance. The bound
                // `least` replaces small compliances.
                let (first, second) = (compliance(s, &hat, [1.0, 0.0]), compliance(s, &hat, [0.0, 1.0]));
                let least = MIN_COMPLIANCE_SHARE * first.max(second).max(hat.mu[0] * hat.mu[1] * s[(2, 2)]);
                1.0 / mean(first.max(least), second.max(least))
            })
            .into_vec();
        let mut fixed_directions = Vec::new();
        if operator.is_condensed() {
            fixed_directions = blocks.map(|s| projector_on_fixed(s, &hat)).into_vec();
        }
        if fixed_directions.iter().all(|fixed| *fixed == Matrix2::zeros()) {
            fixed_directions.clear();
        }
        Self::of_cells(c_normal, c_tangential, fixed_directions)
    }

    fn of_cells(c_normal: Vec<f64>, c_tangential: Vec<f64>, fixed_directions: Vec<Matrix2<f64>>) -> Self {
        Self {
            c_normal,
            c_tangential,
            fixed_directions,
            normal: OnceLock::new(),
            tangential: OnceLock::new(),
        }
    }

    /// Largest eigenvalue of S_nn, mm/MPa, from a few power iterations on the first call.
    pub(super) fn max_normal_eigenvalue(&self, operator: &dyn Flexibility, areas: &[f64]) -> f64 {
        *self.normal.get_or_init(|| power_iterations(areas, 1, |p, gap| operator.apply_normal(p, gap)))
    }

    /// Largest eigenvalue of M Rᵀ S_tt R M, mm/MPa, from a few power iterations on the first call.
    pub(super) fn max_tangential_eigenvalue(
        &self,
        operator: &dyn Flexibility,
        areas: &[f64],
        hat: &FrictionScaling,
    ) -> f64 {
        *self.tangential.get_or_init(|| largest_tangential(operator, areas, hat))
    }
}

/// Compliance êᵀ Ŝ ê of a cell along the scaled direction `axis` (ê). `s` is the diagonal block of S.
fn compliance(s: &Matrix3<f64>, hat: &FrictionScaling, axis: [f64; 2]) -> f64 {
    let q = hat.physical_traction(axis);
    q[0] * q[0] * s[(0, 0)] + q[0] * q[1] * (s[(0, 1)] + s[(1, 0)]) + q[1] * q[1] * s[(1, 1)]
}

/// Projector on the scaled tangential directions along which the diagonal block `s` of S has no compliance.
fn projector_on_fixed(s: &Matrix3<f64>, hat: &FrictionScaling) -> Matrix2<f64> {
    let eigen = s.fixed_view::<2, 2>(0, 0).into_owned().symmetric_eigen();
    let most = MAX_FIXED_COMPLIANCE_SHARE * eigen.eigenvalues.max().max(s[(2, 2)]);
    let fixed: Vec<usize> = (0..2).filter(|&i| eigen.eigenvalues[i] <= most).collect();
    match fixed[..] {
        [] => Matrix2::zeros(),
        [i] => {
            let v = eigen.eigenvectors.column(i);
            let v = Vector2::from(hat.scaled_traction([v[0], v[1]])).normalize();
            v * v.transpose()
        }
        _ => Matrix2::identity(),
    }
}

/// Start vector of the power iterations: ones plus reproducible pseudo-random numbers within ±0.1. It is close to the
/// smooth eigenvector of the largest eigenvalue.
fn start(n: usize) -> Vec<f64> {
    let mut seed = 0x9e37_79b9_7f4a_7c15_u64;
    (0..n)
        .map(|_| {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            1.0 + 0.2 * ((seed >> 33) as f64 / f64::from(1_u32 << 31) - 0.5)
        })
        .collect()
}

/// Geometric mean of two positive numbers. Avoids overflow and underflow of their product.
fn mean(first: f64, second: f64) -> f64 {
    let product = first * second;
    if product.is_normal() { product.sqrt() } else { first.sqrt() * second.sqrt() }
}

fn weighted_norm(areas: &[f64], v: &[f64]) -> f64 {
    let squares = |unit: f64| -> f64 {
        let planes = v.chunks(areas.len());
        planes
            .map(|plane| plane.iter().zip(areas).map(|(x, a)| a * (x / unit) * (x / unit)).sum::<f64>())
            .sum()
    };
    let sum = squares(1.0);
    if sum.is_normal() {
        return sum.sqrt();
    }
    // Squares of very small numbers underflow, and squares of very large ones overflow.
    let unit = v.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    if unit > 0.0 && unit.is_finite() { unit * squares(unit).sqrt() } else { sum.sqrt() }
}

/// Estimates the largest eigenvalue of an operator on fields of `planes` components by a few power iterations.
fn power_iterations(areas: &[f64], planes: usize, mut apply: impl FnMut(&[f64], &mut [f64])) -> f64 {
    let mut v = start(planes * areas.len());
    let mut image = vec![0.0; v.len()];
    let mut lambda = 0.0;
    for _ in 0..POWER_ITERATIONS {
        let norm = weighted_norm(areas, &v);
        v.iter_mut().for_each(|x| *x /= norm);
        apply(&v, &mut image);
        lambda = weighted_norm(areas, &image);
        std::mem::swap(&mut v, &mut image);
    }
    lambda
}

fn largest_tangential(operator: &dyn Flexibility, areas: &[f64], hat: &FrictionScaling) -> f64 {
    let n = areas.len();
    let part = operator.tangential();
    let mut physical = vec![0.0; 3 * n];
    let mut gap = vec![0.0; 3 * n];
    power_iterations(areas, 2, |hatted, slip| {
        for i in 0..n {
            let q = hat.physical_traction([hatted[i], hatted[n + i]]);
            (physical[i], physical[n + i]) = (q[0], q[1]);
        }
        match part {
            Some(part) => part.apply_tangential(&physical[..2 * n], &mut gap[..2 * n]),
            None => operator.apply(&physical, &mut gap),
        }
        for i in 0..n {
            let s = hat.scaled_slip([gap[i], gap[n + i]]);
            (slip[i], slip[n + i]) = (s[0], s[1]);
        }
    })
}
