//! Symbol of half-spaces on a frame that is periodic in one direction and open in the other direction.
//!
//! The traction on a cell varies as exp(i k s) along the periodic direction s. It is constant over the width h of the
//! cell in the open direction. At the centre of a cell at distance d, this traction causes the displacement
//!
//! `K(d) = 1/2π ∫ W(κ, k) / |(κ, k)| h sinc(κ h / 2) exp(i κ d) dκ`,
//!
//! where W is the surface admittance. K(-d) is the conjugate transpose of K(d). The symbol is the discrete Fourier
//! transform of K over the cell offsets. The symbol equals the sum of W(κ, k) / |(κ, k)| sinc(κ h / 2) over the aliases
//! κ + 2π p / h, with all integers p. This alternating series is summed by Euler's transformation. For k = 0 (plane
//! strain), the integral does not exist. K then contains a logarithm that vanishes at a given distance.

use std::f64::consts::PI;

use nalgebra::Complex;
use rustfft::FftPlanner;

use crate::bem::half_space::green::admittance::{Admittance, Hermitian, Rows, hermitian};
use crate::bem::half_space::grid::fft_plan::{PaddedGridPlan, fast_size};
use crate::cancel;

/// Number of aliases on each side that are summed directly, without Euler's transformation.
const ALIASES: usize = 10;
const N_EULER_TERMS: usize = 18;

/// Additional number of directly summed aliases, divided by k h / (2π δ). Here k is the wavenumber in the periodic
/// direction, h the cell width, and δ the singularity distance.
const EXTRA_ALIASES_PER_KH: f64 = 4.0;

/// Negative natural logarithm of the admissible wraparound error of K, relative to K (1e-15).
const LN_MAX_WRAPAROUND: f64 = 35.0;

/// Maximum number of cells of the auxiliary periodic line on which a kernel is computed. Each cell takes some 300 bytes
/// per thread.
const MAX_LINE_POINTS: usize = 1 << 19;

/// Largest ratio of the period to the cell width in the open direction for which [`MAX_LINE_POINTS`] suffices. The
/// ratio ignores the number of cells of the frame in the open direction.
pub(super) fn max_period_over_cell(singularity_distance: f64) -> f64 {
    2.0 * PI * singularity_distance * MAX_LINE_POINTS as f64 / LN_MAX_WRAPAROUND
}

/// Upper triangle xx, yy, nn, xy, xn, yn of K at one offset.
type Upper = [Complex<f64>; 6];

pub(super) struct OpenDirection<'a> {
    pub admittance: &'a Admittance,
    /// Axis of the open direction, 0 or 1.
    pub axis: usize,
    pub cells: usize,
    pub padded: usize,
    /// Cell sides along the frame's x and y, mm.
    pub spacing: [f64; 2],
    /// Distance from a line load along the periodic direction at which the logarithmic part of the displacement is zero, mm.
    pub datum: f64,
    /// Decay rate δ of K(d) ∝ exp(-δ k d): the distance of the nearest singularity of W(κ, 1) from the real κ axis.
    pub singularity_distance: f64,
}

impl<'a> OpenDirection<'a> {
    /// Open direction along `axis` of the frame with the cells of `convolution` and the cell sides `spacing`, mm. `admittance` is
    /// W / |(κ, k)|. `singularity_distance` is the distance δ of the nearest singularity of W(κ, 1) from the real κ axis.
    pub(super) fn new(
        axis: usize,
        convolution: &PaddedGridPlan,
        spacing: [f64; 2],
        admittance: &'a Admittance,
        singularity_distance: f64,
    ) -> Self {
        let (cells, padded) = (convolution.cells[axis], convolution.padded[axis]);
        let datum = 0.5 * cells as f64 * spacing[axis];
        Self { admittance, axis, cells, padded, spacing, datum, singularity_distance }
    }

    /// Transform of K over the padded cells for the harmonic `index` of the `count` cells in the periodic direction.
    pub(super) fn symbol(&self, index: usize, count: usize) -> Vec<Hermitian> {
        if index == 0 {
            return self.transformed(|d| self.plane_strain(d));
        }
        let k = self.wavenumber(index, count);
        let paired = 2 * index == count;
        let period = self.wraparound_free_period(k);
        if period <= self.padded {
            return (0..self.padded).map(|j| self.sum_over_aliases(j, self.padded, k, paired)).collect();
        }
        // After a cancellation the values are not used, so zeros suffice.
        let sum = |j| match cancel::requested() {
            true => [0.0; 9],
            false => self.sum_over_aliases(j, period, k, paired),
        };
        let wide: Vec<Hermitian> = (0..period).map(sum).collect();
        let kernel = kernel_from_symbol(&wide);
        self.transformed(|d| kernel[d.rem_euclid(period as isize) as usize])
    }

    pub(super) fn wavenumber(&self, index: usize, count: usize) -> f64 {
        2.0 * PI * index as f64 / (count as f64 * self.spacing[1 - self.axis])
    }

    /// Number of cells of a periodic line on which the wraparound error of K is negligible, for `k` > 0.
    pub(super) fn wraparound_free_period(&self, k: f64) -> usize {
        fast_size(
            (self.cells as f64
                + LN_MAX_WRAPAROUND / (self.singularity_distance * k * self.spacing[self.axis]))
                .ceil() as usize,
        )
    }

    /// Sum over the aliases of the wavenumber with index `j` on a line of `period` cells. If `paired`, k and -k
    /// coincide on the grid. The result is then the mean of the sums at k and -k.
    pub(super) fn sum_over_aliases(&self, j: usize, period: usize, k: f64, paired: bool) -> Hermitian {
        let h = self.spacing[self.axis];
        let signed = if 2 * j <= period { j as f64 } else { j as f64 - period as f64 };
        let kappa = 2.0 * PI * signed / (period as f64 * h);
        let mut sum = [0.0; 9];
        let half = 0.5 * kappa * h;
        self.add(kappa, k, paired, if half == 0.0 { 1.0 } else { half.sin() / half }, &mut sum);
        if half != 0.0 {
            let plain = ALIASES
                + (EXTRA_ALIASES_PER_KH * k * h / (2.0 * PI * self.singularity_distance)).ceil() as usize;
            let mut weight = 2.0 / h * half.sin();
            // Euler's transformation gives the last J terms the weights 2^-J Σ_{m >= j} C(J, m), j = 1, ..., J.
            let (mut tail, mut binomial) = (1.0, 0.5_f64.powi(N_EULER_TERMS as i32));
            for i in 1..=plain + N_EULER_TERMS {
                weight = -weight;
                if i > plain {
                    let m = (i - plain - 1) as f64;
                    tail -= binomial;
                    binomial *= (N_EULER_TERMS as f64 - m) / (m + 1.0);
                }
                for shift in [i as f64, -(i as f64)] {
                    let alias = kappa + 2.0 * PI * shift / h;
                    self.add(alias, k, paired, tail * weight / alias, &mut sum);
                }
            }
        }
        hermitian(&sum)
    }

    /// Adds `factor` W / |(κ, k)| at κ = `kappa` to `sum`. If `paired`, the mean of W / |(κ, k)| at k and -k is used
    /// instead.
    fn add(&self, kappa: f64, k: f64, paired: bool, factor: f64, sum: &mut Rows) {
        let at = |k: f64| if self.axis == 0 { [kappa, k] } else { [k, kappa] };
        if paired {
            self.admittance.add(at(k), 0.5 * factor, sum);
            self.admittance.add(at(-k), 0.5 * factor, sum);
        } else {
            self.admittance.add(at(k), factor, sum);
        }
    }

    /// K for k = 0: the integral of -A/π ln(|x| / datum) - B/2 sgn(x) over the cell, where W = A ± i B at κ = ±1.
    pub(super) fn plane_strain(&self, d: isize) -> Upper {
        let along = if self.axis == 0 { [1.0, 0.0] } else { [0.0, 1.0] };
        let h = self.spacing[self.axis];
        let [xx, yy, nn, xy, xy_im, xn, xn_im, yn, yn_im] = hermitian(&self.admittance.at(along));
        let ends = [d as f64 + 0.5, d as f64 - 0.5].map(|x| x * h);
        let [upper, lower] = ends.map(|x| x * ((x / self.datum).abs().ln() - 1.0));
        let (even, odd) = (-(upper - lower) / PI, -0.5 * h * (d as f64).signum() * f64::from(d != 0));
        [
            xx * even,
            yy * even,
            nn * even,
            xy * even + xy_im * odd,
            xn * even + xn_im * odd,
            yn * even + yn_im * odd,
        ]
        .map(|entry| Complex::new(entry, 0.0))
    }

    /// Discrete Fourier transform of a kernel over the padded cells. `kernel` gives the values at each cell offset.
    fn transformed(&self, kernel: impl Fn(isize) -> Upper) -> Vec<Hermitian> {
        let reach = self.cells as isize - 1;
        let mut planes: [Vec<Complex<f64>>; 6] =
            std::array::from_fn(|_| vec![Complex::new(0.0, 0.0); self.padded]);
        for d in -reach..=reach {
            let at = d.rem_euclid(self.padded as isize) as usize;
            planes.iter_mut().zip(kernel(d)).for_each(|(plane, value)| plane[at] = value);
        }
        let fft = FftPlanner::new().plan_fft_forward(self.padded);
        planes.iter_mut().for_each(|plane| fft.process(plane));
        let [xx, yy, nn, xy, xn, yn] = planes;
        (0..self.padded)
            .map(|j| {
                let [a, b, c] = [xy[j], xn[j], yn[j]];
                [xx[j].re, yy[j].re, nn[j].re, a.re, a.im, b.re, b.im, c.re, c.im]
            })
            .collect()
    }
}

fn kernel_from_symbol(symbol: &[Hermitian]) -> Vec<Upper> {
    let period = symbol.len();
    let fft = FftPlanner::new().plan_fft_inverse(period);
    let planes: [Vec<Complex<f64>>; 6] = std::array::from_fn(|c| {
        let entry = |s: &Hermitian| match c {
            0..3 => Complex::new(s[c], 0.0),
            _ => Complex::new(s[2 * c - 3], s[2 * c - 2]),
        };
        let mut plane: Vec<Complex<f64>> = symbol.iter().map(entry).collect();
        fft.process(&mut plane);
        plane
    });
    (0..period).map(|d| std::array::from_fn(|c| planes[c][d] / period as f64)).collect()
}
