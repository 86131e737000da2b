//! Number of Gauss points for the integrals of a material's kernels over a patch ([`QuadratureOrder`]).
//!
//! On a line x(s) = m + s h, -1 ≤ s ≤ 1, a rule with n Gauss points has a relative error of about ρ^(-2n). Here
//! `ρ + 1/ρ = |z - 1| + |z + 1|`, and z is the complex singularity of the kernel with the smallest ρ. The isotropic
//! kernel of an evaluation point y is singular where r·r = 0 with r = x - y. The terms of an anisotropic kernel behave
//! like 1/√(r·A⁻¹r). For displacements along a unit vector e, the quadratic form is A_jl = C_kjml e_k e_m. The forms of
//! the three material axes are always used. Other directions contribute a form if its eigenvalues differ more. Examples
//! are the diagonals of cubic crystals.

use std::f64::consts::PI;

use nalgebra::{Matrix3, SymmetricEigen};

use crate::geometry::Point;
use crate::material::Stiffness;

#[derive(Debug, Clone)]
pub(super) struct Parallelogram {
    pub middle: Point,
    pub half_sides: [Point; 2],
}

/// Chooses the number of Gauss points from the quadratic forms of a material and the Bernstein ellipses of the Gauss
/// rules.
#[derive(Debug)]
pub(super) struct QuadratureOrder {
    /// Inverse A⁻¹ of each quadratic form A.
    metrics: Vec<Matrix3<f64>>,
    /// Smallest semi-axis (|z - 1| + |z + 1|) / 2 for which rules with 1, 2, ... points suffice.
    reach: Vec<f64>,
}

impl QuadratureOrder {
    /// Rules with up to `most` points per direction and a relative error of about `accuracy`.
    pub fn new(stiffness: &Stiffness, accuracy: f64, most: usize) -> Self {
        let reach = |n: usize| {
            let rho = accuracy.powf(-0.5 / n as f64);
            0.5 * (rho + 1.0 / rho)
        };
        Self { metrics: metrics(stiffness), reach: (1..=most).map(reach).collect() }
    }

    /// Number of points along each side of a patch for the evaluation point `y`; `None` if the patch must be divided.
    pub fn points(&self, patch: &Parallelogram, y: &Point) -> Option<usize> {
        let away = y - patch.middle;
        let nearest = self.metrics.iter().fold(f64::INFINITY, |nearest, metric| {
            let [a, b] = patch.half_sides.map(|side| metric * side);
            let [aa, ab, bb] =
                [a.dot(&patch.half_sides[0]), a.dot(&patch.half_sides[1]), b.dot(&patch.half_sides[1])];
            let [ca, cb, cc] = [a.dot(&away), b.dot(&away), (metric * away).dot(&away)];
            // For each side of the patch, the rule is chosen on one line parallel to this side. This line passes
            // through the projection of `y` onto the centre line along the other side. The projection is limited to the
            // patch.
            let across = |[aa, ab, bb]: [f64; 3], [ca, cb]: [f64; 2]| {
                let t = (cb / bb).clamp(-1.0, 1.0);
                bernstein_semi_axis(aa, ca - t * ab, cc - 2.0 * t * cb + t * t * bb)
            };
            nearest.min(across([aa, ab, bb], [ca, cb])).min(across([bb, ab, aa], [cb, ca]))
        });
        self.enough(nearest)
    }

    /// Number of points along the line from `middle` - `half` to `middle` + `half`; `None` if the line must be divided.
    pub fn points_along(&self, middle: &Point, half: &Point, y: &Point) -> Option<usize> {
        let away = y - middle;
        let nearest = self.metrics.iter().map(|metric| {
            let a = metric * half;
            bernstein_semi_axis(a.dot(half), a.dot(&away), (metric * away).dot(&away))
        });
        self.enough(nearest.fold(f64::INFINITY, f64::min))
    }

    fn enough(&self, nearest: f64) -> Option<usize> {
        self.reach.iter().position(|reach| nearest >= *reach).map(|n| n + 1)
    }
}

/// Semi-axis (|z - 1| + |z + 1|) / 2 of the Bernstein ellipse through the zeros z of cc - 2 z ca + z² aa.
fn bernstein_semi_axis(aa: f64, ca: f64, cc: f64) -> f64 {
    let along = ca / aa;
    let square = (cc / aa - along * along).max(0.0);
    0.5 * (((along - 1.0).powi(2) + square).sqrt() + ((along + 1.0).powi(2) + square).sqrt())
}

/// Number of sampled directions on the Fibonacci spiral, in addition to the diagonals.
const DIRECTIONS: usize = 200;

/// Minimum ratio of the largest to the smallest eigenvalue for the form of an additional direction, divided by the
/// largest such ratio of the material axes.
const MIN_RATIO_OVER_AXES: f64 = 1.2;
/// Minimum eigenvalue ratio as [`MIN_RATIO_OVER_AXES`], but relative to the largest eigenvalue ratio of all sampled
/// directions. The larger of the two minima applies.
const MIN_RATIO_SHARE: f64 = 0.5;

/// Maximum cosine of the angle between two additional directions: the angle is at least about 20 degrees.
const MAX_COSINE: f64 = 0.94;

fn metrics(stiffness: &Stiffness) -> Vec<Matrix3<f64>> {
    if stiffness.isotropic_constants().is_some() {
        return vec![Matrix3::identity()];
    }
    let dilatation = |i: usize, j: usize| -> f64 { (0..3).map(|k| stiffness.component(i, j, k, k)).sum() };
    let axes = SymmetricEigen::new(Matrix3::from_fn(dilatation)).eigenvectors;
    let form = |e: Point| {
        let entry = |j: usize, l: usize| -> f64 {
            let pairs = (0..3).flat_map(|k| (0..3).map(move |m| (k, m)));
            pairs.map(|(k, m)| stiffness.component(k, j, m, l) * e[k] * e[m]).sum()
        };
        Matrix3::from_fn(entry)
    };
    let ratio = |form: &Matrix3<f64>| {
        let eigenvalues = form.symmetric_eigenvalues();
        eigenvalues.max() / eigenvalues.min()
    };
    let mut forms: Vec<Matrix3<f64>> = (0..3).map(|axis| form(axes.column(axis).into())).collect();
    let of_axes = forms.iter().map(ratio).fold(1.0, f64::max);
    let mut others: Vec<(f64, Point)> = directions().map(|e| (ratio(&form(e)), e)).collect();
    others.sort_by(|a, b| b.0.total_cmp(&a.0));
    let least = (MIN_RATIO_SHARE * others[0].0).max(MIN_RATIO_OVER_AXES * of_axes);
    let mut kept: Vec<Point> = Vec::new();
    for (_, e) in others.into_iter().filter(|(ratio, _)| *ratio >= least) {
        if kept.iter().all(|other| other.dot(&e).abs() < MAX_COSINE) {
            kept.push(e);
            forms.push(form(e));
        }
    }
    // Every form is positive definite like the stiffness: C_kjml e_k e_m v_j v_l > 0.
    forms.iter().filter_map(|form| form.try_inverse()).collect()
}

/// Directions of a hemisphere: the diagonals between the coordinate axes, the z axis, and a Fibonacci spiral.
fn directions() -> impl Iterator<Item = Point> {
    let golden_angle = PI * (3.0 - 5f64.sqrt());
    let spiral = (0..DIRECTIONS).map(move |i| {
        let z = (i as f64 + 0.5) / DIRECTIONS as f64;
        let (sin, cos) = (golden_angle * i as f64).sin_cos();
        let radius = (1.0 - z * z).sqrt();
        Point::new(radius * cos, radius * sin, z)
    });
    let steps = [-1.0, 0.0, 1.0];
    let upper = steps.into_iter().flat_map(move |x| steps.into_iter().map(move |y| Point::new(x, y, 1.0)));
    let flat = [1.0, -1.0].map(|y| Point::new(1.0, y, 0.0));
    upper.chain(flat).map(|e| e.normalize()).chain(spiral)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: the semi-axis (|z - 1| + |z + 1|) / 2 is 2 for the pole z = 2 of 1/(s - 2). For the branch points ± i d
    /// of 1/√(s² + d²), the semi-axis is √(1 + d²). Distances along the fibre are divided by κ = √(C_1111 / C_1212).
    #[test]
    fn poles() {
        assert!((bernstein_semi_axis(1.0, 2.0, 4.0) - 2.0).abs() < 1e-15);
        assert!((bernstein_semi_axis(1.0, 0.0, 9.0) - 10f64.sqrt()).abs() < 1e-15);
        let fibres = Stiffness::transversely_isotropic(140e3, 10e3, 5e3, 0.3, 0.4).unwrap();
        let side = Point::new(0.0, 1.0, 0.0);
        let metrics = metrics(&fibres);
        let nearest = metrics.iter().map(|metric| {
            let (a, y) = (metric * side, Point::new(10.0, 0.0, 0.0));
            bernstein_semi_axis(a.dot(&side), a.dot(&y), (metric * y).dot(&y))
        });
        let nearest = nearest.fold(f64::INFINITY, f64::min);
        let kappa = (fibres.component(0, 0, 0, 0) / fibres.component(0, 1, 0, 1)).sqrt();
        assert!((nearest - (1.0 + (10.0 / kappa).powi(2)).sqrt()).abs() < 1e-12, "{nearest} {kappa}");
    }
}
