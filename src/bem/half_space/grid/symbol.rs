//! Products with the symbol of an operator: a Hermitian 3 x 3 matrix at every wavevector, stored in planes.

use nalgebra::Complex;

use crate::bem::half_space::grid::fft_plan::FftReal;

/// Number of planes of a coupled symbol in addition to nn: real xx, yy, then real and imaginary parts of xy, xn, yn.
pub(super) const COUPLED: usize = 8;

/// Number of planes of an uncoupled symbol in addition to nn: xx, yy, real and imaginary part of xy.
pub(super) const UNCOUPLED: usize = 4;

/// Multiplies the components x, y, n by the symbol at every wavevector of a column.
pub(in crate::bem::half_space) fn multiply_coupled<T: FftReal>(
    nn: &[T],
    rest: [&[T]; COUPLED],
    [x, y, n]: [&mut [Complex<T>]; 3],
) {
    let [xx, yy, xy_re, xy_im, xn_re, xn_im, yn_re, yn_im] = rest;
    for i in 0..x.len() {
        let (a, b, c) = (x[i], y[i], n[i]);
        let xy = Complex::new(xy_re[i], xy_im[i]);
        let xn = Complex::new(xn_re[i], xn_im[i]);
        let yn = Complex::new(yn_re[i], yn_im[i]);
        x[i] = a * xx[i] + xy * b + xn * c;
        y[i] = xy.conj() * a + b * yy[i] + yn * c;
        n[i] = xn.conj() * a + yn.conj() * b + c * nn[i];
    }
}

/// Same product as [`multiply_coupled`] for a symbol with xn = yn = 0.
pub(in crate::bem::half_space) fn multiply_uncoupled<T: FftReal>(
    nn: &[T],
    rest: [&[T]; UNCOUPLED],
    [x, y, n]: [&mut [Complex<T>]; 3],
) {
    multiply_tangential(rest, [x, y]);
    n.iter_mut().zip(nn).for_each(|(value, factor)| *value = *value * *factor);
}

pub(super) fn multiply_tangential<T: FftReal>(
    [xx, yy, xy_re, xy_im]: [&[T]; UNCOUPLED],
    [x, y]: [&mut [Complex<T>]; 2],
) {
    for i in 0..x.len() {
        let (a, b) = (x[i], y[i]);
        let xy = Complex::new(xy_re[i], xy_im[i]);
        x[i] = a * xx[i] + xy * b;
        y[i] = xy.conj() * a + b * yy[i];
    }
}
