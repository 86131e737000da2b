//! Flexibility of half-spaces on a uniform grid frame: block Toeplitz, applied by fast Fourier transforms.

use std::sync::{Mutex, OnceLock};

use nalgebra::{Complex, Matrix3};
use rayon::prelude::*;

use super::fft_plan::{Buffers, Convolution};
use super::green::SurfaceGreen;
use super::kernel_table::KernelTable;
use super::normal_inverse::{NormalInverse, normal_compliance};
use super::patch::PatchIntegrator;
use crate::error::{Error, Result};
use crate::interrupt;
use crate::linalg::memory;
use crate::linalg::operator::Flexibility;

/// What happens to the blocks between normal and tangential components when they vanish within rounding.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CrossBlocks {
    /// They are multiplied like the others; the operator counts as coupled.
    Keep,
    /// They are left out if they vanish; the operator then counts as uncoupled.
    SkipVanishing,
}

/// Planes of the symbol: real xx, yy, nn, then real and imaginary parts of xy, xn, yn.
const PLANES: usize = 9;

/// The operator S of half-spaces on a uniform grid of cells with constant tractions, collocated at the centres.
///
/// Symmetric, since K(-d) = K(d)^T on a uniform grid; the transform of K (the symbol) is then Hermitian in each
/// wavevector and nine real planes hold it. Cell (ix, iy) has the index `ix * cells[1] + iy`.
///
/// # Source
/// Formulation 8.4.
pub struct FftFlexibility {
    convolution: Convolution,
    /// `[k_y][PLANES][padded_x]`, 1/(padded size) included.
    symbol: Vec<f64>,
    own: Matrix3<f64>,
    coupled: bool,
    buffers: Mutex<Buffers>,
    spacing: [f64; 2],
    /// W_nn in directions over half a turn.
    compliance: Vec<f64>,
    inverse: OnceLock<NormalInverse>,
}

impl FftFlexibility {
    /// Tabulates the influence of a cell on the grid and transforms it.
    ///
    /// `cells`: number along x and y; `spacing`: sides of a cell, mm; `green`: of one half-space or of a pair.
    ///
    /// # Errors
    /// If the grid is empty, the spacing is not positive and finite, or the tables do not fit into the memory.
    pub fn new(
        cells: [usize; 2],
        spacing: [f64; 2],
        green: &SurfaceGreen,
        cross: CrossBlocks,
    ) -> Result<Self> {
        check(cells, spacing)?;
        let table = KernelTable::new(cells, spacing, &PatchIntegrator::new(green));
        interrupt::check()?;
        let convolution = Convolution::new(cells);
        let symbol = symbol(&convolution, &table);
        let buffers = Mutex::new(convolution.buffers(3));
        let coupled = cross == CrossBlocks::Keep || green.couples_normal_tangential();
        let (compliance, inverse) = (normal_compliance(green), OnceLock::new());
        Ok(Self { convolution, symbol, own: table.own(), coupled, buffers, spacing, compliance, inverse })
    }

    /// An upper bound of the largest eigenvalue of S, mm/MPa: the largest row sum of the symbol.
    pub fn spectral_bound(&self) -> f64 {
        let columns = (0..self.convolution.half_spectrum()).map(|ky| largest_row_sum(self.planes(ky)));
        let [px, py] = self.convolution.padded;
        columns.fold(0.0, f64::max) * (px * py) as f64
    }

    /// The planes of one k_y.
    fn planes(&self, ky: usize) -> [&[f64]; PLANES] {
        let px = self.convolution.padded[0];
        let mut planes = self.symbol[ky * PLANES * px..(ky + 1) * PLANES * px].chunks_exact(px);
        std::array::from_fn(|_| planes.next().expect("as many planes as the layout has"))
    }
}

impl Flexibility for FftFlexibility {
    fn n_cells(&self) -> usize {
        self.convolution.cells[0] * self.convolution.cells[1]
    }

    fn apply(&self, tractions: &[f64], gap: &mut [f64]) {
        let mut buffers = self.buffers.lock().expect("no panic while the buffers are held");
        self.convolution.apply::<3>(tractions, gap, &mut buffers, |ky, columns| {
            if self.coupled {
                multiply_coupled(self.planes(ky), columns);
            } else {
                multiply_uncoupled(self.planes(ky), columns);
            }
        });
    }

    fn apply_normal(&self, pressure: &[f64], normal_gap: &mut [f64]) {
        let mut buffers = self.buffers.lock().expect("no panic while the buffers are held");
        self.convolution.apply::<1>(pressure, normal_gap, &mut buffers, |ky, [normal]| {
            normal.iter_mut().zip(self.planes(ky)[2]).for_each(|(value, s)| *value *= *s);
        });
    }

    fn diagonal_blocks(&self) -> Vec<Matrix3<f64>> {
        vec![self.own; self.n_cells()]
    }

    fn couples_normal_tangential(&self) -> bool {
        self.coupled
    }

    fn precondition_normal(&self, normal_gap: &[f64], pressure: &mut [f64]) -> bool {
        let make = || NormalInverse::new(self.convolution.cells, self.spacing, &self.compliance);
        self.inverse.get_or_init(make).apply(normal_gap, pressure);
        true
    }
}

/// Largest sum of magnitudes in a row of the 3 x 3 matrices of a column.
fn largest_row_sum([xx, yy, nn, xy_re, xy_im, xn_re, xn_im, yn_re, yn_im]: [&[f64]; PLANES]) -> f64 {
    let at = |i: usize| {
        let (xy, xn, yn) = (xy_re[i].hypot(xy_im[i]), xn_re[i].hypot(xn_im[i]), yn_re[i].hypot(yn_im[i]));
        (xx[i].abs() + xy + xn).max(yy[i].abs() + xy + yn).max(nn[i].abs() + xn + yn)
    };
    (0..xx.len()).map(at).fold(0.0, f64::max)
}

/// The 3 x 3 Hermitian product at every wavevector of a column.
fn multiply_coupled(planes: [&[f64]; PLANES], [x, y, n]: [&mut [Complex<f64>]; 3]) {
    let [xx, yy, nn, xy_re, xy_im, xn_re, xn_im, yn_re, yn_im] = planes;
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

/// The same with vanishing xn and yn.
fn multiply_uncoupled(planes: [&[f64]; PLANES], [x, y, n]: [&mut [Complex<f64>]; 3]) {
    let [xx, yy, nn, xy_re, xy_im, ..] = planes;
    for i in 0..x.len() {
        let (a, b) = (x[i], y[i]);
        let xy = Complex::new(xy_re[i], xy_im[i]);
        x[i] = a * xx[i] + xy * b;
        y[i] = xy.conj() * a + b * yy[i];
        n[i] *= nn[i];
    }
}

/// The transform of the kernel, periodic with the padded size and zero where no pair of cells lies.
fn symbol(convolution: &Convolution, table: &KernelTable) -> Vec<f64> {
    let [px, py] = convolution.padded;
    let mut symbol = vec![0.0; PLANES * px * convolution.half_spectrum()];
    let weight = 1.0 / (px * py) as f64;
    for (k, (i, j)) in [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)].into_iter().enumerate() {
        let transformed = convolution.transform(|ix, iy| {
            let dx = wrapped_offset(ix, px, convolution.cells[0]);
            let dy = wrapped_offset(iy, py, convolution.cells[1]);
            dx.zip(dy).map_or(0.0, |(dx, dy)| table.entry(dx, dy, i, j))
        });
        symbol.par_chunks_exact_mut(PLANES * px).zip(transformed.par_chunks_exact(px)).for_each(
            |(planes, column)| {
                for (ix, value) in column.iter().enumerate() {
                    if k < 3 {
                        planes[k * px + ix] = value.re * weight;
                    } else {
                        planes[(2 * k - 3) * px + ix] = value.re * weight;
                        planes[(2 * k - 2) * px + ix] = value.im * weight;
                    }
                }
            },
        );
    }
    symbol
}

/// The offset that the index of a periodic table stands for; `None` between the two ends.
fn wrapped_offset(index: usize, period: usize, cells: usize) -> Option<isize> {
    if index < cells {
        Some(index as isize)
    } else if index + cells > period {
        Some(index as isize - period as isize)
    } else {
        None
    }
}

pub(super) fn check(cells: [usize; 2], spacing: [f64; 2]) -> Result<()> {
    if cells.contains(&0) {
        return Err(Error::input(format!(
            "the contact frame has {} x {} cells; each direction needs at least one",
            cells[0], cells[1]
        )));
    }
    if !spacing.iter().all(|h| h.is_finite() && *h > 0.0) {
        return Err(Error::input(format!(
            "the cells of the contact frame have the sides {} x {}; both must be positive and finite",
            spacing[0], spacing[1]
        )));
    }
    // Symbol, kernel table, one transform on its way (two planes) and the work space, about 2n per direction.
    let padded: u128 = cells.iter().map(|&n| 2 * n as u128).product();
    let bytes = padded * 8 * (5 + 5 + 4 + 6);
    memory::ensure(bytes, &format!("the operator on {} x {} cells", cells[0], cells[1]), "use fewer cells")
}
