//! Influence of distant polygons, from the moments of the polygons.
//!
//! With z = x + i y, a harmonic of the Green's function is exp(i n φ) / r = z^((n-1)/2) z̄^(-(n+1)/2). Therefore
//!
//! `∂_z^a ∂_z̄^b Γ(φ) / r = D_ab(φ) / r^(1+a+b)`, `D_ab = Σ γ_n P_a((n-1)/2) P_b(-(n+1)/2) exp(i (n-a+b) φ)`,
//!
//! with the harmonics γ_n of Γ and P_a(x) = x (x-1) ... (x-a+1). The integral over a polygon is the Taylor sum of these
//! derivatives times the moments of the polygon. The functions D_ab are tabulated over half a turn, because only signs
//! differ in the opposite direction.

use std::f64::consts::PI;

use nalgebra::Complex;

use crate::bem::half_space::green::SurfaceGreen;
use crate::bem::half_space::green::angular_table::evaluate_series;
use crate::bem::half_space::green::kernel_component::KernelComponent;
use crate::bem::half_space::integrals::polygon_moments::{n_moments, powers};
use crate::linalg::simd::wide;

pub(super) const MAX_ORDER: usize = 12;

const MAX_TABLE_LEN: usize = 1 << 22;

/// Number of nodes of the local interpolation in the table.
const NODES: usize = 6;
/// Minimum number of tabulated angles in a full turn.
const ANGLES: usize = 1024;

/// Number of tabulated angles per period of the highest harmonic.
const PER_PERIOD: usize = 16;

const LAGRANGE: [f64; NODES] = [-1.0 / 120.0, 1.0 / 24.0, -1.0 / 12.0, 1.0 / 12.0, -1.0 / 24.0, 1.0 / 120.0];

pub(super) struct PolygonMultipole {
    /// `[angle][function][component]`, functions in the order of the moments.
    table: Vec<f64>,
    n_components: usize,
    per_radian: f64,
    stride: usize,
    /// `[decade][order]`: minimum ratio of distance to polygon radius for which moments up to this order suffice. Each decade
    /// divides the error by ten.
    min_ratio: Vec<Vec<f64>>,
}

impl PolygonMultipole {
    /// Expansion with an error of `accuracy` relative to the largest component. [`Self::order_at`] can require errors that are up
    /// to `decades` decades smaller.
    pub fn new(green: &SurfaceGreen, components: &[KernelComponent], accuracy: f64, decades: usize) -> Self {
        let angles = (PER_PERIOD * (green.order() + MAX_ORDER + 1)).next_power_of_two().max(ANGLES);
        let fits =
            |order: &usize| n_moments(*order) * components.len() * (angles / 2 + NODES) <= MAX_TABLE_LEN;
        let order = (1..=MAX_ORDER).rev().find(fits).unwrap_or(0);
        let stride = n_moments(order) * components.len();
        let mut table = vec![0.0; stride * (angles / 2 + NODES)];
        // The first two omitted orders determine the minimum distances, because one of them may vanish.
        let mut sizes = vec![0.0_f64; order + 3];
        let mut function = 0;
        for (k, size) in sizes.iter_mut().enumerate() {
            let mut of_order = vec![0.0_f64; angles];
            for (a, b) in powers(k) {
                for (c, component) in components.iter().enumerate() {
                    let parts = derivative_harmonics(*component, green, [a, b])
                        .map(|harmonics| evaluate_series(angles, harmonics.into_iter().enumerate()));
                    let weight = if a == b { 1.0 } else { 2.0 } / (factorial(a) * factorial(b));
                    for (sum, (re, im)) in of_order.iter_mut().zip(parts[0].iter().zip(&parts[1])) {
                        *sum += weight * re.hypot(*im) / components.len() as f64;
                    }
                    if k <= order {
                        for (part, values) in parts.iter().enumerate().take(if a == b { 1 } else { 2 }) {
                            // Node j lies at the angle (j - 2) times the angular step.
                            for (j, row) in table.chunks_exact_mut(stride).enumerate() {
                                row[(function + part) * components.len() + c] =
                                    values[(j + angles - 2) % angles];
                            }
                        }
                    }
                }
                function += if a == b { 1 } else { 2 };
            }
            *size = of_order.into_iter().fold(0.0, f64::max);
        }
        // Moments of order k are estimated by the bound for a disc: 2 / (k + 2) × area × radius^k.
        let suffices = |k: usize, accuracy: f64| {
            let term = 2.0 / (k + 2) as f64 * sizes[k] / (accuracy * sizes[0].max(f64::MIN_POSITIVE));
            term.powf(1.0 / k as f64)
        };
        let from = (0..=decades).map(|decade| {
            let accuracy = accuracy * 0.1f64.powi(decade as i32);
            let of = |k: usize| suffices(k + 1, accuracy).max(suffices(k + 2, accuracy));
            let mut from: Vec<f64> = (0..=order).map(of).collect();
            (1..from.len()).for_each(|k| from[k] = from[k].min(from[k - 1]));
            from
        });
        let min_ratio = from.collect();
        Self {
            table,
            n_components: components.len(),
            per_radian: angles as f64 / (2.0 * PI),
            stride,
            min_ratio,
        }
    }

    pub fn order(&self) -> usize {
        self.min_ratio[0].len() - 1
    }

    /// Sufficient order at a `ratio` of distance to radius, for `decade` more decades of accuracy; `None` if no order suffices.
    pub fn order_at(&self, ratio: f64, decade: usize) -> Option<usize> {
        self.min_ratio[decade].iter().position(|&from| ratio >= from)
    }

    #[cfg(test)]
    pub fn from(&self) -> &[f64] {
        &self.min_ratio[0]
    }

    pub fn bytes(&self) -> usize {
        size_of_val(self.table.as_slice())
    }

    /// Adds the sum of `weights` times the functions in the direction of (x, y) to `values`, for y >= 0. The `weights`,
    /// `[n_moments]`, include the powers of 1 / r.
    pub fn add(&self, [x, y]: [f64; 2], order: usize, weights: &[f64], values: &mut [f64]) {
        let position = y.atan2(x) * self.per_radian;
        let last = self.table.len() / self.stride - NODES;
        let base = (position as usize).min(last);
        let nodes = lagrange(position - base as f64);
        let used = n_moments(order) * self.n_components;
        let rows: [&[f64]; NODES] =
            std::array::from_fn(|j| &self.table[(base + j) * self.stride..(base + j) * self.stride + used]);
        interpolate(rows, nodes, self.n_components, weights, values);
    }
}

const CHUNK: usize = 16;

fn interpolate(
    rows: [&[f64]; NODES],
    nodes: [f64; NODES],
    components: usize,
    weights: &[f64],
    values: &mut [f64],
) {
    wide!(interpolate_in(
        rows => rows: [&[f64]; NODES],
        nodes => nodes: [f64; NODES],
        components => components: usize,
        weights => weights: &[f64],
        values => values: &mut [f64]
    ));
}

#[inline(always)]
fn interpolate_in(
    rows: [&[f64]; NODES],
    nodes: [f64; NODES],
    components: usize,
    weights: &[f64],
    values: &mut [f64],
) {
    let mut between = [0.0; CHUNK * 9];
    let size = CHUNK * components;
    let used = rows[0].len();
    for (chunk, weights) in weights.chunks(CHUNK).enumerate() {
        let start = (chunk * size).min(used);
        let end = (start + size).min(used);
        let own: [&[f64]; NODES] = rows.map(|row| &row[start..end]);
        let between = &mut between[..end - start];
        for (q, value) in between.iter_mut().enumerate() {
            *value = nodes[0] * own[0][q]
                + nodes[1] * own[1][q]
                + nodes[2] * own[2][q]
                + nodes[3] * own[3][q]
                + nodes[4] * own[4][q]
                + nodes[5] * own[5][q];
        }
        for (weight, functions) in weights.iter().zip(between.chunks_exact(components)) {
            values.iter_mut().zip(functions).for_each(|(value, f)| *value += weight * f);
        }
    }
}

/// Lagrange weights of the nodes -2, ..., 3 at `t` in [0, 1].
fn lagrange(t: f64) -> [f64; NODES] {
    let mut weights = LAGRANGE;
    let (mut before, mut after) = (1.0, 1.0);
    for j in 0..NODES {
        weights[j] *= before;
        before *= t + 2.0 - j as f64;
        weights[NODES - 1 - j] *= after;
        after *= t - 3.0 + j as f64;
    }
    weights
}

fn factorial(n: usize) -> f64 {
    (1..=n).map(|k| k as f64).product()
}

/// Falling factorial x (x - 1) ... (x - count + 1).
fn falling(x: f64, count: usize) -> f64 {
    (0..count).map(|k| x - k as f64).product()
}

/// Fourier coefficients of orders 0, 1, ... of two real functions of the angle: the real and the imaginary part of D_ab
/// for a component.
pub(super) fn derivative_harmonics(
    component: KernelComponent,
    green: &SurfaceGreen,
    [a, b]: [usize; 2],
) -> [Vec<Complex<f64>>; 2] {
    let reach = (green.order() + a + b) as isize;
    let mut terms = vec![Complex::new(0.0, 0.0); 2 * reach as usize + 1];
    let mut put = |n: isize, harmonic: Complex<f64>| {
        let x = n as f64;
        let factor = falling((x - 1.0) / 2.0, a) * falling(-(x + 1.0) / 2.0, b);
        terms[(n - a as isize + b as isize + reach) as usize] += harmonic * factor;
    };
    let harmonics: Vec<(isize, Complex<f64>)> = match component {
        KernelComponent::Even(c) => {
            green.even().iter().enumerate().map(|(k, h)| (2 * k as isize, h[c])).collect()
        }
        KernelComponent::Odd(c) => {
            green.odd().iter().enumerate().map(|(k, h)| (2 * k as isize + 1, h[c])).collect()
        }
    };
    for (n, harmonic) in harmonics {
        put(n, harmonic);
        if n > 0 {
            put(-n, harmonic.conj());
        }
    }
    let at = |m: isize| terms[(m + reach) as usize];
    let half = |sign: f64| (0..=reach).map(move |m| (at(m) + at(-m).conj() * sign) * 0.5);
    [half(1.0).collect(), half(-1.0).map(|value| Complex::new(value.im, -value.re)).collect()]
}
