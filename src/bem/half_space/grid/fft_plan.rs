//! Convolution on a zero-padded grid by planned real fast Fourier transforms.
//!
//! Each row and each column is computed independently, so the result does not depend on the number of threads.

use std::sync::Arc;

use nalgebra::Complex;
use rayon::prelude::*;
use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};
use rustfft::{Fft, FftNum, FftPlanner};

const TASKS: usize = 16;

/// Number of columns that are gathered from the rows at once, because the complex numbers of four columns share a cache
/// line. The inverse transform gathers as many rows.
const BLOCK: usize = 4;

pub(in crate::bem::half_space) trait FftReal: FftNum + Into<f64> {
    fn from_double(value: f64) -> Self {
        Self::from_f64(value).expect("single and double precision take any number")
    }
}

impl<T: FftNum + Into<f64>> FftReal for T {}

/// Plans for a grid of `cells` padded with zeros to `padded`.
pub(in crate::bem::half_space) struct PaddedGridPlan<T = f64> {
    pub(in crate::bem::half_space) cells: [usize; 2],
    /// Padded size: at least 2 cells - 1 along an open direction, at least the number of cells along a periodic direction.
    pub(in crate::bem::half_space) padded: [usize; 2],
    rows: Arc<dyn RealToComplex<T>>,
    rows_back: Arc<dyn ComplexToReal<T>>,
    columns: Arc<dyn Fft<T>>,
    columns_back: Arc<dyn Fft<T>>,
}

pub(in crate::bem::half_space) struct PaddedGridBuffers<T = f64> {
    /// `[ix][component][k_y]`
    rows: Vec<Complex<T>>,
    /// `[k_y][component][column_stride]`; only the first `cells[0]` values of a column are used.
    columns: Vec<Complex<T>>,
    tasks: Vec<Scratch<T>>,
}

struct Scratch<T> {
    real: Vec<T>,
    /// `[BLOCK][k_y]`
    spectra: Vec<Complex<T>>,
    /// `[BLOCK][component][padded_x]`
    columns: Vec<Complex<T>>,
    fft: Vec<Complex<T>>,
}

impl<T: FftReal> PaddedGridPlan<T> {
    pub(super) fn new(cells: [usize; 2]) -> Self {
        Self::padded(cells, cells.map(|n| fast_size(2 * n - 1)))
    }

    pub(super) fn periodic(cells: [usize; 2]) -> Self {
        Self::padded(cells, cells.map(fast_size))
    }

    pub(in crate::bem::half_space) fn padded(cells: [usize; 2], padded: [usize; 2]) -> Self {
        let mut planner = FftPlanner::new();
        let mut real_planner = RealFftPlanner::new();
        Self {
            cells,
            padded,
            rows: real_planner.plan_fft_forward(padded[1]),
            rows_back: real_planner.plan_fft_inverse(padded[1]),
            columns: planner.plan_fft_forward(padded[0]),
            columns_back: planner.plan_fft_inverse(padded[0]),
        }
    }

    pub(in crate::bem::half_space) fn half_spectrum(&self) -> usize {
        self.padded[1] / 2 + 1
    }

    /// Distance of columns in memory: an odd number of cache lines. With a power of two, columns would compete for the
    /// same cache sets.
    fn column_stride(&self) -> usize {
        (self.cells[0].div_ceil(BLOCK) | 1) * BLOCK
    }

    fn forward_rows<const C: usize>(
        &self,
        input: &[f64],
        factor: f64,
        rows: &mut [Complex<T>],
        tasks: &mut [Scratch<T>],
    ) {
        let [nx, ny] = self.cells;
        let half = self.half_spectrum();
        let per_task = nx.div_ceil(TASKS);
        rows.par_chunks_mut(per_task * C * half).zip(tasks).enumerate().for_each(
            |(task, (rows, scratch))| {
                for (k, spectrum) in rows.chunks_exact_mut(half).enumerate() {
                    let (ix, component) = (task * per_task + k / C, k % C);
                    let start = component * nx * ny + ix * ny;
                    let row = scratch.real.iter_mut().zip(&input[start..start + ny]);
                    row.for_each(|(real, value)| *real = T::from_double(factor * value));
                    scratch.real[ny..].fill(T::zero());
                    self.rows
                        .process_with_scratch(&mut scratch.real, spectrum, &mut scratch.fft)
                        .expect("buffers of the planned lengths");
                }
            },
        );
    }

    fn through_columns<const C: usize>(
        &self,
        rows: &[Complex<T>],
        columns: &mut [Complex<T>],
        tasks: &mut [Scratch<T>],
        multiply: impl Fn(usize, [&mut [Complex<T>]; C]) + Sync,
    ) {
        let (nx, stride) = (self.cells[0], self.column_stride());
        let per_task = self.half_spectrum().div_ceil(TASKS);
        columns.par_chunks_mut(per_task * C * stride).zip(tasks).enumerate().for_each(
            |(task, (columns, scratch))| {
                for (block, columns) in columns.chunks_mut(BLOCK * C * stride).enumerate() {
                    let first = task * per_task + block * BLOCK;
                    let count = columns.len() / (C * stride);
                    self.gather::<C>(rows, first, count, &mut scratch.columns);
                    for (k, columns) in columns.chunks_exact_mut(C * stride).enumerate() {
                        let work = &mut scratch.columns[k * C * self.padded[0]..(k + 1) * C * self.padded[0]];
                        self.columns.process_with_scratch(work, &mut scratch.fft);
                        let mut split = work.chunks_exact_mut(self.padded[0]);
                        multiply(first + k, std::array::from_fn(|_| split.next().expect("C columns")));
                        self.columns_back.process_with_scratch(work, &mut scratch.fft);
                        for (column, padded) in
                            columns.chunks_exact_mut(stride).zip(work.chunks_exact(self.padded[0]))
                        {
                            column[..nx].copy_from_slice(&padded[..nx]);
                        }
                    }
                }
            },
        );
    }

    fn gather<const C: usize>(
        &self,
        rows: &[Complex<T>],
        first: usize,
        count: usize,
        work: &mut [Complex<T>],
    ) {
        let (nx, half, length) = (self.cells[0], self.half_spectrum(), self.padded[0]);
        for ix in 0..nx {
            for component in 0..C {
                let start = (ix * C + component) * half + first;
                for (k, value) in rows[start..start + count].iter().enumerate() {
                    work[(k * C + component) * length + ix] = *value;
                }
            }
        }
        for column in work[..count * C * length].chunks_exact_mut(length) {
            column[nx..].fill(Complex::new(T::zero(), T::zero()));
        }
    }

    fn backward_rows<const C: usize>(
        &self,
        columns: &[Complex<T>],
        output: &mut [f64],
        factor: f64,
        tasks: &mut [Scratch<T>],
    ) {
        let [nx, ny] = self.cells;
        let (half, stride) = (self.half_spectrum(), self.column_stride());
        let per_task = nx.div_ceil(TASKS).next_multiple_of(BLOCK);
        for (component, plane) in output.chunks_exact_mut(nx * ny).enumerate() {
            plane.par_chunks_mut(per_task * ny).zip(&mut *tasks).enumerate().for_each(
                |(task, (rows, scratch))| {
                    for (block, rows) in rows.chunks_mut(BLOCK * ny).enumerate() {
                        let (ix, count) = (task * per_task + block * BLOCK, rows.len() / ny);
                        for ky in 0..half {
                            let start = (ky * C + component) * stride + ix;
                            for (k, value) in columns[start..start + count].iter().enumerate() {
                                scratch.spectra[k * half + ky] = *value;
                            }
                        }
                        for (k, row) in rows.chunks_exact_mut(ny).enumerate() {
                            self.real_row(k, scratch);
                            row.iter_mut()
                                .zip(&scratch.real)
                                .for_each(|(value, real)| *value = factor * Into::<f64>::into(*real));
                        }
                    }
                },
            );
        }
    }

    /// Inverse transform of spectrum `k`. The harmonics 0 and, for even sizes, Nyquist are real. Their imaginary parts
    /// are rounding errors and are set to zero.
    fn real_row(&self, k: usize, scratch: &mut Scratch<T>) {
        let half = self.half_spectrum();
        let spectrum = &mut scratch.spectra[k * half..(k + 1) * half];
        spectrum[0].im = T::zero();
        if self.padded[1].is_multiple_of(2) {
            spectrum[self.padded[1] / 2].im = T::zero();
        }
        self.rows_back
            .process_with_scratch(spectrum, &mut scratch.real, &mut scratch.fft)
            .expect("buffers of the planned lengths");
    }

    /// Transform of a real plane over the padded grid, `[k_y][padded_x]`. `fill(ix, row)` adds the values of row `ix`
    /// to `row`, which contains zeros.
    pub(super) fn transform(&self, fill: impl Fn(usize, &mut [T]) + Sync) -> Vec<Complex<T>> {
        let (half, [px, py]) = (self.half_spectrum(), self.padded);
        let zero = Complex::new(T::zero(), T::zero());
        let mut rows = vec![zero; px * half];
        rows.par_chunks_mut(half).enumerate().for_each(|(ix, spectrum)| {
            let mut real = vec![T::zero(); py];
            fill(ix, &mut real);
            self.rows.process(&mut real, spectrum).expect("buffers of the planned lengths");
        });
        let mut columns = vec![zero; px * half];
        columns.par_chunks_mut(BLOCK * px).enumerate().for_each(|(block, columns)| {
            let (first, count) = (block * BLOCK, columns.len() / px);
            for ix in 0..px {
                let start = ix * half + first;
                for (k, value) in rows[start..start + count].iter().enumerate() {
                    columns[k * px + ix] = *value;
                }
            }
            columns.chunks_exact_mut(px).for_each(|column| self.columns.process(column));
        });
        columns
    }

    pub(in crate::bem::half_space) fn buffers(&self, components: usize) -> PaddedGridBuffers<T> {
        let zero = Complex::new(T::zero(), T::zero());
        let half = self.half_spectrum();
        let fft = [
            self.rows.get_scratch_len(),
            self.rows_back.get_scratch_len(),
            self.columns.get_inplace_scratch_len(),
            self.columns_back.get_inplace_scratch_len(),
        ];
        let scratch = || Scratch {
            real: vec![T::zero(); self.padded[1]],
            spectra: vec![zero; BLOCK * half],
            columns: vec![zero; BLOCK * components * self.padded[0]],
            fft: vec![zero; fft.into_iter().max().unwrap_or(0)],
        };
        PaddedGridBuffers {
            rows: vec![zero; components * self.cells[0] * half],
            columns: vec![zero; components * self.column_stride() * half],
            tasks: (0..TASKS).map(|_| scratch()).collect(),
        }
    }

    /// Transforms `input` (C components), applies `multiply(k_y, columns)` to the C columns of each k_y, and writes the inverse
    /// transform to `output`. The transforms are not normalised.
    pub(in crate::bem::half_space) fn apply<const C: usize>(
        &self,
        input: &[f64],
        output: &mut [f64],
        buffers: &mut PaddedGridBuffers<T>,
        multiply: impl Fn(usize, [&mut [Complex<T>]; C]) + Sync,
    ) {
        self.apply_scaled::<C>(input, output, buffers, [1.0; 2], multiply);
    }

    /// As [`Self::apply`], with factors for input and output.
    pub(super) fn apply_scaled<const C: usize>(
        &self,
        input: &[f64],
        output: &mut [f64],
        buffers: &mut PaddedGridBuffers<T>,
        [before, after]: [f64; 2],
        multiply: impl Fn(usize, [&mut [Complex<T>]; C]) + Sync,
    ) {
        let PaddedGridBuffers { rows, columns, tasks } = buffers;
        let rows = &mut rows[..C * self.cells[0] * self.half_spectrum()];
        let columns = &mut columns[..C * self.column_stride() * self.half_spectrum()];
        self.forward_rows::<C>(input, before, rows, tasks);
        self.through_columns::<C>(rows, columns, tasks, multiply);
        self.backward_rows::<C>(columns, output, after, tasks);
    }
}

const MAX_UNALIGNED_SIZE: usize = 64;

const SIMD_LANES: usize = 8;

/// Smallest size >= `least` with a fast transform. Fast sizes are 1, and even numbers with the prime factors 2, 3 and
/// at most one 5. Above 64, they are multiples of eight.
pub(in crate::bem::half_space) fn fast_size(least: usize) -> usize {
    let smooth = |mut n: usize| {
        for prime in [2, 3] {
            while n.is_multiple_of(prime) {
                n /= prime;
            }
        }
        n == 1 || n == 5
    };
    let whole = |n: usize| n == 1 || n.is_multiple_of(if n > MAX_UNALIGNED_SIZE { SIMD_LANES } else { 2 });
    (least..).find(|&n| smooth(n) && whole(n)).expect("powers of two have no bound")
}
