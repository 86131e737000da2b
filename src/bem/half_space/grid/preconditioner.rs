//! Approximate inverses of the flexibility of half-spaces on a grid, as preconditioners.
//!
//! At the wavenumber κ, the flexibility of the half-spaces is W / κ with the surface admittance W. The symbol of the
//! inverse is therefore κ W⁻¹. The inverse treats the grid as periodic. The far fields of the periodic images therefore
//! cause an error.
//!
//! # Source
//! Vollebregt 2014, "A new solver for the elastic normal contact problem using conjugate gradients, deflation, and an FFT-based
//! preconditioner".

use std::f64::consts::PI;

use nalgebra::{Complex, Matrix3};
use rayon::prelude::*;

use crate::bem::half_space::green::admittance::{Admittance, Hermitian, hermitian};
use crate::bem::half_space::grid::fft_plan::PaddedGridPlan;
use crate::bem::half_space::grid::spectral_filter::{ComponentSet, SpectralFilter};

/// Wavenumber that replaces the zero wavenumber, divided by the lowest wavenumber.
const ZERO_WAVENUMBER_SHARE: f64 = 0.5;

struct Wavenumbers {
    padded: [usize; 2],
    lowest: [f64; 2],
}

impl Wavenumbers {
    fn new(padded: [usize; 2], spacing: [f64; 2]) -> Self {
        let lowest = [0, 1].map(|axis| 2.0 * PI / (padded[axis] as f64 * spacing[axis]));
        Self { padded, lowest }
    }

    fn at(&self, kx: usize, ky: usize) -> [f64; 2] {
        if (kx, ky) == (0, 0) {
            return if self.lowest[0] < self.lowest[1] {
                [ZERO_WAVENUMBER_SHARE * self.lowest[0], 0.0]
            } else {
                [0.0, ZERO_WAVENUMBER_SHARE * self.lowest[1]]
            };
        }
        let px = self.padded[0];
        let signed = if 2 * kx <= px { kx as f64 } else { kx as f64 - px as f64 };
        [signed * self.lowest[0], ky as f64 * self.lowest[1]]
    }
}

/// Filter that multiplies normal gaps by κ / W_nn. For other sets of components, it multiplies gaps by their block of κ
/// W⁻¹. `spacing`: sides of the cells, mm.
pub(in crate::bem::half_space) fn inverse_filter(
    parts: ComponentSet,
    convolution: PaddedGridPlan<f32>,
    spacing: [f64; 2],
    admittance: &Admittance,
) -> SpectralFilter {
    let (wavenumbers, [px, py]) = (Wavenumbers::new(convolution.padded, spacing), convolution.padded);
    let weight = 1.0 / (px * py) as f64;
    let first = usize::from(parts == ComponentSet::Tangential);
    let count = parts.n_planes();
    let mut symbol = vec![0.0; count * px * (py / 2 + 1)];
    symbol.par_chunks_exact_mut(count * px).enumerate().for_each(|(ky, planes)| {
        for kx in 0..px {
            let rows = admittance.at(wavenumbers.at(kx, ky));
            if parts == ComponentSet::Normal {
                planes[kx] = weight / rows[8];
                continue;
            }
            let w = inverse(&hermitian(&rows)) * Complex::from(weight);
            let (xy, xn, yn) = (w[(0, 1)], w[(0, 2)], w[(1, 2)]);
            let diagonal = [2, 0, 1].map(|k| w[(k, k)].re);
            let values = diagonal.into_iter().chain([xy, xn, yn].into_iter().flat_map(|z| [z.re, z.im]));
            values
                .skip(first)
                .take(count)
                .enumerate()
                .for_each(|(plane, value)| planes[plane * px + kx] = value);
        }
    });
    SpectralFilter::new(convolution, parts, &[&symbol])
}

/// Inverse of a Hermitian matrix; zero if the matrix is singular.
fn inverse([xx, yy, nn, xy, xy_im, xn, xn_im, yn, yn_im]: &Hermitian) -> Matrix3<Complex<f64>> {
    let real = |value: &f64| Complex::from(*value);
    let (xy, xn, yn) = (Complex::new(*xy, *xy_im), Complex::new(*xn, *xn_im), Complex::new(*yn, *yn_im));
    let matrix = Matrix3::new(real(xx), xy, xn, xy.conj(), real(yy), yn, xn.conj(), yn.conj(), real(nn));
    matrix.try_inverse().unwrap_or_else(Matrix3::zeros)
}
