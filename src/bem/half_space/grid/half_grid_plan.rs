//! Convolution on half of a zero-padded grid whose other half is its mirror image: half the numbers, and no image is stored.
//!
//! Across the mirror an even field is a sum of cosines and an odd one of sines about a line between two cells, both real; what
//! is left are real transforms along it. The common phase of the harmonics cancels, so that the symbol of the whole grid is
//! the one to multiply by, its entries between even and odd components times ±i (see [`fold`]).
//!
//! # Source
//! Makhoul 1980, "A fast cosine transform in one and two dimensions".

use std::f64::consts::PI;
use std::sync::Arc;

use nalgebra::Complex;
use rayon::prelude::*;
use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};

use crate::bem::half_space::grid::fft_plan::{ConvolutionPlan, FftReal, TASKS};

/// Columns, and rows on the way back, gathered at once: their numbers share a cache line.
const BLOCK: usize = 8;

/// The plans for half of a grid.
pub(super) struct HalfGridPlan<T = f64> {
    /// The axis across the mirror; the component along it is odd, the others are even.
    mirror_axis: usize,
    /// Cells of the half, along the mirror and away from it.
    cells_along: usize,
    cells_across: usize,
    /// Padded size along the mirror, and half of that across it.
    padded: usize,
    harmonics: usize,
    /// exp(-iπ k / 2H), k = 0..=H/2.
    half_sample_phases: Vec<Complex<T>>,
    rows: Arc<dyn RealToComplex<T>>,
    rows_back: Arc<dyn ComplexToReal<T>>,
    columns: Arc<dyn RealToComplex<T>>,
    columns_back: Arc<dyn ComplexToReal<T>>,
}

/// Work space of a convolution of up to three components.
pub(super) struct HalfGridBuffers<T> {
    /// `[along][component][harmonic]`
    rows: Vec<T>,
    /// `[harmonic][component][stride]`, cells along the mirror first
    columns: Vec<T>,
    /// `[component][along][away]`, where the cells do not lie so.
    turned: Vec<T>,
    tasks: Vec<Scratch<T>>,
}

/// Work space of one piece.
struct Scratch<T> {
    real: Vec<T>,
    spectrum: Vec<Complex<T>>,
    /// `[BLOCK][harmonic]`
    gathered: Vec<T>,
    /// `[BLOCK][component][padded]`
    columns: Vec<T>,
    /// `[component][padded / 2 + 1]`
    spectra: Vec<Complex<T>>,
    fft: Vec<Complex<T>>,
}

impl<T: FftReal> HalfGridPlan<T> {
    /// Half of a grid of `cells`, their number across the mirror even, `padded` to sizes as a whole one is, even there too.
    pub(super) fn new(cells: [usize; 2], padded: [usize; 2], mirror_axis: usize) -> Self {
        let (padded, harmonics) = (padded[1 - mirror_axis], padded[mirror_axis] / 2);
        let mut planner = RealFftPlanner::new();
        let turn = |k: usize| {
            let (sin, cos) = (-PI * k as f64 / (2 * harmonics) as f64).sin_cos();
            Complex::new(T::from_double(cos), T::from_double(sin))
        };
        Self {
            mirror_axis,
            cells_along: cells[1 - mirror_axis],
            cells_across: cells[mirror_axis] / 2,
            padded,
            harmonics,
            half_sample_phases: (0..=harmonics / 2).map(turn).collect(),
            rows: planner.plan_fft_forward(harmonics),
            rows_back: planner.plan_fft_inverse(harmonics),
            columns: planner.plan_fft_forward(padded),
            columns_back: planner.plan_fft_inverse(padded),
        }
    }

    /// Numbers of a row: harmonics 0..=H, of which even fields lack the last and odd ones the first.
    fn width(&self) -> usize {
        self.harmonics + 1
    }

    /// Length that a column takes: an odd number of cache lines.
    fn stride(&self) -> usize {
        (self.cells_along.div_ceil(BLOCK) | 1) * BLOCK
    }

    /// Cell `j` away from the mirror in row `i` along it, and the step to the next.
    fn first_and_step(&self, i: usize) -> (usize, usize) {
        if self.mirror_axis == 1 { (i * self.cells_across, 1) } else { (i, self.cells_along) }
    }

    /// Cosines (or, of an `odd` field, sines) of row `i` of a plane of cells.
    fn forward_row(
        &self,
        (plane, factor): (&[f64], f64),
        (i, odd): (usize, bool),
        row: &mut [T],
        scratch: &mut Scratch<T>,
    ) {
        let (sign, places) = (if odd { -factor } else { factor }, self.cells_across.div_ceil(2));
        let (first, step) = self.first_and_step(i);
        // Even places forwards, odd ones backwards from the end: cosines by a transform of the same length.
        let (forwards, rest) = scratch.real.split_at_mut(places);
        let values = plane[first..].iter().step_by(2 * step);
        forwards.iter_mut().zip(values).for_each(|(real, value)| *real = T::from_double(factor * value));
        let (between, backwards) = rest.split_at_mut(self.harmonics - self.cells_across);
        between.fill(T::zero());
        let values = plane.get(first + step..).unwrap_or_default().iter().step_by(2 * step);
        backwards.iter_mut().rev().zip(values).for_each(|(real, value)| *real = T::from_double(sign * value));
        self.rows
            .process_with_scratch(&mut scratch.real, &mut scratch.spectrum, &mut scratch.fft)
            .expect("buffers of the planned lengths");
        let (lows, highs) = row.split_at_mut(self.harmonics / 2 + 1);
        let turned =
            || scratch.spectrum.iter().zip(&self.half_sample_phases).map(|(value, turn)| *value * *turn);
        // Sines are the cosines of the field with every second sign changed, backwards.
        for ((low, high), value) in lows.iter_mut().zip(highs.iter_mut().rev()).zip(turned()) {
            (*low, *high) = if odd { (-value.im, value.re) } else { (value.re, -value.im) };
        }
        if let (Some(low), Some(value), true) =
            (lows.last_mut(), turned().next_back(), self.harmonics.is_multiple_of(2))
        {
            *low = value.re;
        }
    }

    /// The inverse of that but for a factor H: a row of cells into `scratch.real`, ordered as there.
    fn backward_row(&self, k: usize, odd: bool, scratch: &mut Scratch<T>) {
        let h = self.harmonics;
        let row = &scratch.gathered[k * self.width()..(k + 1) * self.width()];
        for (((low, high), value), turn) in
            row.iter().zip(row.iter().rev()).zip(&mut scratch.spectrum).zip(&self.half_sample_phases)
        {
            let (cosine, sine) = if odd { (*high, *low) } else { (*low, *high) };
            *value = Complex::new(cosine, -sine) * turn.conj();
        }
        // The harmonic that fields of this parity lack is in the imaginary part of the first.
        real_ends(&mut scratch.spectrum, h);
        self.rows_back
            .process_with_scratch(&mut scratch.spectrum, &mut scratch.real, &mut scratch.fft)
            .expect("buffers of the planned lengths");
    }

    fn through_columns<const C: usize>(
        &self,
        rows: &[T],
        columns: &mut [T],
        tasks: &mut [Scratch<T>],
        multiply: impl Fn(usize, [&mut [Complex<T>]; C]) + Sync,
    ) {
        let (padded, stride) = (self.padded, self.stride());
        let per_task = self.width().div_ceil(TASKS).next_multiple_of(BLOCK);
        columns.par_chunks_mut(per_task * C * stride).zip(tasks).enumerate().for_each(
            |(task, (columns, scratch))| {
                for (block, columns) in columns.chunks_mut(BLOCK * C * stride).enumerate() {
                    let first = task * per_task + block * BLOCK;
                    self.gather::<C>(rows, first, columns.len() / (C * stride), &mut scratch.columns);
                    for (k, columns) in columns.chunks_exact_mut(C * stride).enumerate() {
                        let work = &mut scratch.columns[k * C * padded..(k + 1) * C * padded];
                        let mut spectra = scratch.spectra.chunks_exact_mut(padded / 2 + 1);
                        let spectra: [&mut [Complex<T>]; C] =
                            std::array::from_fn(|_| spectra.next().expect("C columns"));
                        let mut split = spectra;
                        for (column, spectrum) in work.chunks_exact_mut(padded).zip(&mut split) {
                            self.columns
                                .process_with_scratch(column, spectrum, &mut scratch.fft)
                                .expect("buffers of the planned lengths");
                        }
                        multiply(first + k, split.each_mut().map(|spectrum| &mut **spectrum));
                        let into = columns.chunks_exact_mut(stride);
                        for ((column, spectrum), into) in
                            work.chunks_exact_mut(padded).zip(&mut split).zip(into)
                        {
                            real_ends(spectrum, padded);
                            self.columns_back
                                .process_with_scratch(spectrum, column, &mut scratch.fft)
                                .expect("buffers of the planned lengths");
                            into[..self.cells_along].copy_from_slice(&column[..self.cells_along]);
                        }
                    }
                }
            },
        );
    }

    /// Copies the columns of the harmonics first, ..., first + count - 1 from the rows and pads them with zeros.
    fn gather<const C: usize>(&self, rows: &[T], first: usize, count: usize, work: &mut [T]) {
        let (along, width, padded) = (self.cells_along, self.width(), self.padded);
        for i in 0..along {
            for component in 0..C {
                let start = (i * C + component) * width + first;
                for (k, value) in rows[start..start + count].iter().enumerate() {
                    work[(k * C + component) * padded + i] = *value;
                }
            }
        }
        for column in work[..count * C * padded].chunks_exact_mut(padded) {
            column[along..].fill(T::zero());
        }
    }

    /// Inverse transforms of the columns into rows of cells, `[component][along][away]`.
    fn backward_rows<const C: usize>(&self, columns: &[T], into: &mut [T], tasks: &mut [Scratch<T>]) {
        let (width, stride, away) = (self.width(), self.stride(), self.cells_across);
        let per_task = self.cells_along.div_ceil(TASKS).next_multiple_of(BLOCK);
        for (component, plane) in into.chunks_exact_mut(self.cells_along * away).enumerate() {
            let odd = self.is_odd::<C>(component);
            plane.par_chunks_mut(per_task * away).zip(&mut *tasks).enumerate().for_each(
                |(task, (rows, scratch))| {
                    for (block, rows) in rows.chunks_mut(BLOCK * away).enumerate() {
                        let (i, count) = (task * per_task + block * BLOCK, rows.len() / away);
                        for harmonic in 0..width {
                            let start = (harmonic * C + component) * stride + i;
                            for (k, value) in columns[start..start + count].iter().enumerate() {
                                scratch.gathered[k * width + harmonic] = *value;
                            }
                        }
                        for (k, row) in rows.chunks_exact_mut(away).enumerate() {
                            self.backward_row(k, odd, scratch);
                            put_in_order(&scratch.real, odd, row);
                        }
                    }
                },
            );
        }
    }

    /// Whether a component changes its sign in the mirror; pressures alone do not.
    fn is_odd<const C: usize>(&self, component: usize) -> bool {
        C > 1 && component == self.mirror_axis
    }
}

impl<T: FftReal> ConvolutionPlan<T> for HalfGridPlan<T> {
    type Buffers = HalfGridBuffers<T>;

    fn spectrum_shape(&self) -> [usize; 2] {
        [self.width(), self.padded / 2 + 1]
    }

    fn buffers(&self, components: usize) -> HalfGridBuffers<T> {
        let (zero, none) = (Complex::new(T::zero(), T::zero()), T::zero());
        let fft = [
            self.rows.get_scratch_len(),
            self.rows_back.get_scratch_len(),
            self.columns.get_scratch_len(),
            self.columns_back.get_scratch_len(),
        ];
        let scratch = || Scratch {
            real: vec![none; self.harmonics],
            spectrum: vec![zero; self.harmonics / 2 + 1],
            gathered: vec![none; BLOCK * self.width()],
            columns: vec![none; BLOCK * components * self.padded],
            spectra: vec![zero; components * (self.padded / 2 + 1)],
            fft: vec![zero; fft.into_iter().max().unwrap_or(0)],
        };
        HalfGridBuffers {
            rows: vec![none; components * self.cells_along * self.width()],
            columns: vec![none; components * self.stride() * self.width()],
            turned: vec![none; components * self.cells_along * self.cells_across],
            tasks: (0..TASKS).map(|_| scratch()).collect(),
        }
    }

    fn apply_scaled<const C: usize>(
        &self,
        input: &[f64],
        output: &mut [f64],
        (buffers, [before, after]): (&mut HalfGridBuffers<T>, [f64; 2]),
        multiply: impl Fn(usize, [&mut [Complex<T>]; C]) + Sync,
    ) {
        let HalfGridBuffers { rows, columns, turned, tasks } = buffers;
        let (n, width) = (self.cells_along * self.cells_across, self.width());
        let rows = &mut rows[..C * self.cells_along * width];
        let per_task = self.cells_along.div_ceil(TASKS);
        rows.par_chunks_mut(per_task * C * width).zip(&mut *tasks).enumerate().for_each(
            |(task, (rows, scratch))| {
                for (k, row) in rows.chunks_exact_mut(width).enumerate() {
                    let (i, component) = (task * per_task + k / C, k % C);
                    let plane = &input[component * n..(component + 1) * n];
                    self.forward_row((plane, before), (i, self.is_odd::<C>(component)), row, scratch);
                }
            },
        );
        let columns = &mut columns[..C * self.stride() * width];
        self.through_columns::<C>(rows, columns, tasks, multiply);
        let turned = &mut turned[..C * n];
        self.backward_rows::<C>(columns, turned, tasks);
        for (plane, output) in turned.chunks_exact(n).zip(output.chunks_exact_mut(n)) {
            let (line, [from, step]) = if self.mirror_axis == 1 {
                (self.cells_across, [self.cells_across, 1])
            } else {
                (self.cells_along, [1, self.cells_across])
            };
            output.par_chunks_mut(line).enumerate().for_each(|(k, output)| {
                let values = plane[k * from..].iter().step_by(step);
                output.iter_mut().zip(values).for_each(|(value, real)| *value = after * real.to_double());
            });
        }
    }
}

/// Removes the rounding left in the imaginary parts of the real harmonics of a sequence of `length`.
fn real_ends<T: FftReal>(spectrum: &mut [Complex<T>], length: usize) {
    spectrum[0].im = T::zero();
    if length.is_multiple_of(2) {
        spectrum[length / 2].im = T::zero();
    }
}

/// A row of cells away from the mirror, as it is ordered for the transform.
fn put_in_order<T: FftReal>(real: &[T], odd: bool, row: &mut [T]) {
    row.iter_mut().step_by(2).zip(real).for_each(|(value, real)| *value = *real);
    let backwards = row.iter_mut().skip(1).step_by(2).zip(real.iter().rev());
    backwards.for_each(|(value, real)| *value = if odd { -*real } else { *real });
}

/// Where the planes xx, yy, and the real and imaginary parts of xy, xn, yn come from, and their signs: entries between the odd
/// component and the even ones are multiplied by i in its row and by -i in its column. By the axis across the mirror.
const SOURCES: [[(usize, f64); 8]; 2] = [
    [(0, 1.0), (1, 1.0), (3, -1.0), (2, 1.0), (5, -1.0), (4, 1.0), (6, 1.0), (7, 1.0)],
    [(0, 1.0), (1, 1.0), (3, 1.0), (2, -1.0), (4, 1.0), (5, 1.0), (7, -1.0), (6, 1.0)],
];

/// The symbol `[harmonic][planes][wavenumber along]` of a half from that of the whole grid, `[k_y][planes][padded_x]` with
/// 1/(padded size): the planes of a symbol without nn but for the first `own`, which are nn.
pub(super) fn fold(symbol: &[f64], own: usize, padded: [usize; 2], across: usize) -> Vec<f64> {
    let [px, half_y] = [padded[0], padded[1] / 2 + 1];
    let planes = symbol.len() / (px * half_y);
    let length = padded[1 - across] / 2 + 1;
    let mut folded = vec![0.0; (padded[across] / 2 + 1) * planes * length];
    folded.par_chunks_exact_mut(planes * length).enumerate().for_each(|(harmonic, columns)| {
        for (plane, column) in columns.chunks_exact_mut(length).enumerate() {
            let (from, sign) = if plane < own { (plane, 1.0) } else { SOURCES[across][plane - own] };
            let from = if plane < own { from } else { from + own };
            for (along, value) in column.iter_mut().enumerate() {
                let [kx, ky] = if across == 1 { [along, harmonic] } else { [harmonic, along] };
                // Sums of cosines over half of the cells are half of those over all.
                *value = 2.0 * sign * symbol[(ky * planes + from) * px + kx];
            }
        }
    });
    folded
}
