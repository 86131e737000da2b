//! Tables for the fast evaluation of functions of the direction, such as Γ(φ) of the surface Green's function Γ(φ) / r.

use std::f64::consts::PI;

use nalgebra::{Complex, Matrix3};
use realfft::RealFftPlanner;

use crate::bem::half_space::green::{SurfaceGreen, assemble};

/// Number of nodes of the local Lagrange interpolation.
const NODES: usize = 8;

const ONE: Complex<f64> = Complex::new(1.0, 0.0);

const LAGRANGE: [f64; NODES] = [
    -1.0 / 5040.0,
    1.0 / 720.0,
    -1.0 / 240.0,
    1.0 / 144.0,
    -1.0 / 144.0,
    1.0 / 240.0,
    -1.0 / 720.0,
    1.0 / 5040.0,
];

/// Functions of the direction at equidistant angles, interpolated by polynomials of degree 7.
///
/// [`Self::count`] gives at least 16 angles per period of the highest harmonic, and at least 512 angles.
#[derive(Debug, Clone)]
pub(in crate::bem::half_space) struct AngularTable {
    /// `[angle][function]`
    entries: Vec<f64>,
    functions: usize,
    per_radian: f64,
    count: f64,
}

impl AngularTable {
    pub(in crate::bem::half_space) fn count(order: usize) -> usize {
        (16 * (order + 1)).next_power_of_two().max(512)
    }

    /// Builds a table from the values of each function. `planes` holds these values at an even number of equidistant
    /// angles over a full turn, from the angle 0.
    pub(in crate::bem::half_space) fn new(planes: &[Vec<f64>]) -> Self {
        let count = planes[0].len();
        // Node j of the table lies at the angle -π + (j - 3) step, so that no index wraps around.
        let entries = (0..count + NODES)
            .flat_map(|j| {
                let angle = (j + count / 2 + count - 3) % count;
                planes.iter().map(move |plane| plane[angle])
            })
            .collect();
        let per_radian = count as f64 / (2.0 * PI);
        Self { entries, functions: planes.len(), per_radian, count: count as f64 }
    }

    pub(in crate::bem::half_space) fn from_green(green: &SurfaceGreen) -> Self {
        Self::new(&planes(green, Self::count(green.order()), |_| ONE))
    }

    /// Table of Γ and its derivative Γ', all entries of Γ first.
    pub(in crate::bem::half_space) fn from_green_with_derivative(green: &SurfaceGreen) -> Self {
        let count = Self::count(green.order());
        let mut functions = planes(green, count, |_| ONE);
        functions.extend(planes(green, count, |order| Complex::new(0.0, order as f64)));
        Self::new(&functions)
    }

    /// Interpolation weights of the angles near the direction of (x, y), and the values of all functions at these angles,
    /// `[angle][function]`.
    pub(in crate::bem::half_space) fn stencil(&self, x: f64, y: f64) -> ([f64; NODES], &[f64]) {
        self.around_angle(y.atan2(x))
    }

    /// As [`Self::stencil`] for an `angle` from −π to π.
    fn around_angle(&self, angle: f64) -> ([f64; NODES], &[f64]) {
        let position = ((angle + PI) * self.per_radian).clamp(0.0, self.count);
        let base = position as usize;
        let rows = &self.entries[base * self.functions..(base + NODES) * self.functions];
        (lagrange(position - base as f64), rows)
    }

    /// Adds the values of all functions to `sum`. `angle` lies between −π and 3π.
    pub(in crate::bem::half_space) fn add_at<const N: usize>(&self, angle: f64, sum: &mut [f64; N]) {
        let (weights, rows) = self.around_angle(if angle > PI { angle - 2.0 * PI } else { angle });
        for (weight, row) in weights.iter().zip(rows.chunks_exact(N)) {
            sum.iter_mut().zip(row).for_each(|(s, e)| *s += weight * e);
        }
    }

    /// Adds `factor` times the functions in the direction of (x, y) to `sum`.
    pub(in crate::bem::half_space) fn add<const N: usize>(
        &self,
        x: f64,
        y: f64,
        factor: f64,
        sum: &mut [f64; N],
    ) {
        let (weights, rows) = self.stencil(x, y);
        for (weight, row) in weights.iter().zip(rows.chunks_exact(N)) {
            let weight = weight * factor;
            sum.iter_mut().zip(row).for_each(|(s, e)| *s += weight * e);
        }
    }
}

/// Lagrange weights of the nodes -3, ..., 4 at the position `t`. The interpolation is most accurate for `t` in [0, 1].
fn lagrange(t: f64) -> [f64; NODES] {
    let distances: [f64; NODES] = std::array::from_fn(|j| t + 3.0 - j as f64);
    let mut weights = LAGRANGE;
    let (mut before, mut after) = (1.0, 1.0);
    for j in 0..NODES {
        weights[j] *= before;
        before *= distances[j];
        weights[NODES - 1 - j] *= after;
        after *= distances[NODES - 1 - j];
    }
    weights
}

/// Entries of Γ, row by row, at `count` equidistant angles. Each harmonic of order n is first multiplied by
/// `factor(n)`.
fn planes(green: &SurfaceGreen, count: usize, factor: impl Fn(usize) -> Complex<f64>) -> Vec<Vec<f64>> {
    let harmonic = |order: usize, coefficient: Complex<f64>| (order, coefficient * factor(order));
    let symmetric = std::array::from_fn::<_, 6, _>(|c| {
        evaluate_series(count, green.even().iter().enumerate().map(|(k, h)| harmonic(2 * k, h[c])))
    });
    let antisymmetric = std::array::from_fn::<_, 3, _>(|c| {
        evaluate_series(count, green.odd().iter().enumerate().map(|(k, h)| harmonic(2 * k + 1, h[c])))
    });
    let mut planes = vec![vec![0.0; count]; 9];
    for angle in 0..count {
        let matrix = assemble(
            &symmetric.each_ref().map(|plane| plane[angle]),
            &antisymmetric.each_ref().map(|plane| plane[angle]),
        );
        planes.iter_mut().enumerate().for_each(|(k, plane)| plane[angle] = matrix[(k / 3, k % 3)]);
    }
    planes
}

/// Values at `count` equidistant angles of the real series with the given harmonics.
pub(in crate::bem::half_space) fn evaluate_series(
    count: usize,
    harmonics: impl Iterator<Item = (usize, Complex<f64>)>,
) -> Vec<f64> {
    let fft = RealFftPlanner::new().plan_fft_inverse(count);
    let (mut spectrum, mut values) = (fft.make_input_vec(), fft.make_output_vec());
    for (order, harmonic) in harmonics {
        spectrum[order] = harmonic;
    }
    spectrum[0].im = 0.0;
    fft.process(&mut spectrum, &mut values).expect("buffers made by the plan, real mean value");
    values
}

pub(in crate::bem::half_space) fn matrix(entries: &[f64; 9]) -> Matrix3<f64> {
    Matrix3::from_row_slice(entries)
}
