//! Symbols of half-spaces on periodic grids: Fourier transforms of the flexibility.

use std::f64::consts::PI;

use rayon::prelude::*;

use crate::bem::half_space::green::admittance::{Admittance, Hermitian, Rows, hermitian};
use crate::bem::half_space::grid::fft_plan::PaddedGridPlan;
use crate::bem::half_space::periodic::open_direction::OpenDirection;
use crate::cancel;

/// Number of real arrays (planes) of the symbol: xx, yy, nn, then real and imaginary parts of xy, xn, yn.
pub(super) const PLANES: usize = 9;

/// Symbol of a frame with two periodic directions, times 1/(padded size): W(m) / κ at every wavevector κ m of the grid.
/// The symbol is zero at the zero wavevector.
pub(super) fn doubly_periodic_symbol(
    convolution: &PaddedGridPlan,
    spacing: [f64; 2],
    admittance: &Admittance,
) -> Vec<f64> {
    let [nx, ny] = convolution.padded;
    let lowest = [2.0 * PI / (nx as f64 * spacing[0]), 2.0 * PI / (ny as f64 * spacing[1])];
    filled(convolution, |kx, ky| {
        let signed = if 2 * kx <= nx { kx as f64 } else { kx as f64 - nx as f64 };
        let (x, y) = (signed * lowest[0], ky as f64 * lowest[1]);
        // At the Nyquist wavenumber of an axis, k and -k coincide on the grid. The symbol is the mean of the values at
        // k and -k.
        let [both_x, both_y] = [2 * kx == nx, 2 * ky == ny];
        let mut sum: Rows = [0.0; 9];
        let mut count = 0.0;
        for sign_x in [1.0, -1.0].into_iter().take(1 + usize::from(both_x)) {
            for sign_y in [1.0, -1.0].into_iter().take(1 + usize::from(both_y)) {
                let rows = admittance.at([sign_x * x, sign_y * y]);
                sum.iter_mut().zip(rows).for_each(|(s, r)| *s += r);
                count += 1.0;
            }
        }
        hermitian(&sum.map(|s| s / count))
    })
}

/// Symbol of a frame that is open along `axis` and periodic along the other axis, times 1/(padded size).
pub(super) fn singly_periodic_symbol(
    convolution: &PaddedGridPlan,
    spacing: [f64; 2],
    axis: usize,
    admittance: &Admittance,
    singularity_distance: f64,
) -> Vec<f64> {
    let line = OpenDirection::new(axis, convolution, spacing, admittance, singularity_distance);
    let count = convolution.padded[1 - axis];
    let harmonics: Vec<Vec<Hermitian>> = (0..count / 2 + 1)
        .into_par_iter()
        .map(|index| symbol_unless_cancelled(&line, index, count))
        .collect();
    if axis == 0 {
        return filled(convolution, |kx, ky| harmonics[ky][kx]);
    }
    let back = convolution.padded[1];
    filled(convolution, |kx, ky| match harmonics.get(kx) {
        Some(harmonic) => harmonic[ky],
        None => conjugate(harmonics[count - kx][(back - ky) % back]),
    })
}

/// Symbol of the harmonic `index`; zeros after a cancellation.
fn symbol_unless_cancelled(line: &OpenDirection, index: usize, count: usize) -> Vec<Hermitian> {
    if cancel::requested() { vec![[0.0; 9]; line.padded] } else { line.symbol(index, count) }
}

fn conjugate([xx, yy, nn, xy, xy_im, xn, xn_im, yn, yn_im]: Hermitian) -> Hermitian {
    [xx, yy, nn, xy, -xy_im, xn, -xn_im, yn, -yn_im]
}

/// Planes `[k_y][PLANES][padded_x]` of the symbol `at(k_x, k_y)`, times 1/(padded size).
fn filled(convolution: &PaddedGridPlan, at: impl Fn(usize, usize) -> Hermitian + Sync) -> Vec<f64> {
    let [px, py] = convolution.padded;
    let weight = 1.0 / (px * py) as f64;
    let mut symbol = vec![0.0; PLANES * px * convolution.half_spectrum()];
    symbol.par_chunks_exact_mut(PLANES * px).enumerate().for_each(|(ky, planes)| {
        for kx in 0..px {
            at(kx, ky).into_iter().enumerate().for_each(|(k, value)| planes[k * px + kx] = value * weight);
        }
    });
    symbol
}
