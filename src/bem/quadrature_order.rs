//! How many Gauss points the kernels of a material need over a patch, seen from a point.
//!
//! On a line x(s) = m + s h, -1 ≤ s ≤ 1, n points err by ρ^(-2n), ρ + 1/ρ = |z - 1| + |z + 1| for the nearest complex z at which the
//! kernel is singular. That of an isotropic material is where (x - y)·(x - y) = 0. In a stiff direction an anisotropic one varies as if that
//! were shorter: its terms behave like 1/√((x - y)·A⁻¹(x - y)) with the forms A_jl = C_kjkl of displacements along the axes k of
//! the material, which this takes for the singularities of the whole. Where shear along other directions is much softer, as along the
//! diagonals of cubic crystals, displacements along these have their forms, too.

use std::f64::consts::PI;

use nalgebra::{Matrix3, SymmetricEigen};

use crate::geometry::Point;
use crate::material::Stiffness;

/// A parallelogram: its middle and half of its sides.
#[derive(Debug, Clone)]
pub(super) struct Parallelogram {
    pub middle: Point,
    pub half_sides: [Point; 2],
}

/// The forms of a material, and what accuracy asks for.
#[derive(Debug)]
pub(super) struct QuadratureOrder {
    /// A⁻¹ of each form.
    metrics: Vec<Matrix3<f64>>,
    /// (|z - 1| + |z + 1|) / 2 from which on 1, 2, ... points suffice.
    reach: Vec<f64>,
}

impl QuadratureOrder {
    /// For errors of about `accuracy` with up to `most` points.
    pub fn new(stiffness: &Stiffness, accuracy: f64, most: usize) -> Self {
        let reach = |n: usize| {
            let rho = accuracy.powf(-0.5 / n as f64);
            0.5 * (rho + 1.0 / rho)
        };
        Self { metrics: metrics(stiffness), reach: (1..=most).map(reach).collect() }
    }

    /// Points along each side of a patch, seen from `y`; `None` if it has to be divided.
    pub fn points(&self, patch: &Parallelogram, y: &Point) -> Option<usize> {
        let away = y - patch.middle;
        let nearest = self.metrics.iter().fold(f64::INFINITY, |nearest, metric| {
            let [a, b] = patch.half_sides.map(|side| metric * side);
            let [aa, ab, bb] =
                [a.dot(&patch.half_sides[0]), a.dot(&patch.half_sides[1]), b.dot(&patch.half_sides[1])];
            let [ca, cb, cc] = [a.dot(&away), b.dot(&away), (metric * away).dot(&away)];
            // Of the lines along one side the one that comes nearest.
            let across = |[aa, ab, bb]: [f64; 3], [ca, cb]: [f64; 2]| {
                let t = (cb / bb).clamp(-1.0, 1.0);
                bernstein_semi_axis(aa, ca - t * ab, cc - 2.0 * t * cb + t * t * bb)
            };
            nearest.min(across([aa, ab, bb], [ca, cb])).min(across([bb, ab, aa], [cb, ca]))
        });
        self.enough(nearest)
    }

    /// Points along a line from `middle` to both sides by `half`, seen from `y`.
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

/// (|z - 1| + |z + 1|) / 2 of the zeros z of cc - 2 z ca + z² aa.
fn bernstein_semi_axis(aa: f64, ca: f64, cc: f64) -> f64 {
    let along = ca / aa;
    let square = (cc / aa - along * along).max(0.0);
    0.5 * (((along - 1.0).powi(2) + square).sqrt() + ((along + 1.0).powi(2) + square).sqrt())
}

/// Directions between the axes of a material that are looked at.
const DIRECTIONS: usize = 200;

/// A direction has a form of its own if the ratio of the form's eigenvalues is so many times that of the axes, and at least this share of the
/// largest of all.
const MIN_RATIO_OVER_AXES: f64 = 1.2;
const MIN_RATIO_SHARE: f64 = 0.5;

/// Cosine of the least angle between such directions, 20 degrees.
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
    // Positive definite as the stiffness is: C_kjml e_k e_m v_j v_l > 0.
    forms.iter().filter_map(|form| form.try_inverse()).collect()
}

/// Directions of half a sphere, evenly: a Fibonacci spiral, and the diagonals between the axes.
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

    /// Truth: 1/(x - 2) over [-1, 1] has its pole at z = 2: (1 + 3)/2; seen from beside, 1/√(s² + d²), at ± i d: √(1 + d²). A fibre κ times
    /// as stiff (κ² in the form) brings a point on its line beside the side across it κ times nearer.
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
