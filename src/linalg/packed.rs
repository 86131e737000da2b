//! Dense symmetric matrices in packed storage (one triangle).

use std::ops::Range;
use std::sync::Mutex;

use nalgebra::Matrix3;
use rayon::prelude::*;

use super::memory::handling_allocation_failure;
use crate::error::{Error, Result};

/// Number of row ranges (stripes) of a parallel product. It is fixed, so that results have the same bits for any number
/// of threads.
const N_STRIPES: usize = 16;
const ROWS_PER_BLOCK: usize = 4;
const COLUMNS_PER_BLOCK: usize = 4;
/// Length of the chunks of x that are tested for zeros; a multiple of [`COLUMNS_PER_BLOCK`].
const ZERO_SCAN_LEN: usize = 16;

/// Dense symmetric matrix `[n, n]` in packed storage: the lower triangle, row by row.
pub struct PackedSymmetric {
    n: usize,
    lower: Vec<f64>,
    stripes: Vec<Range<usize>>,
    scratch: Mutex<Scratch>,
}

struct Scratch {
    /// Partial results, one vector per stripe.
    parts: Vec<f64>,
    /// Ascending ranges of x that may contain non-zeros, in whole chunks.
    filled: Vec<Range<usize>>,
}

/// Index of the first entry of row `i` in the packed triangle.
fn start(i: usize) -> usize {
    i * (i + 1) / 2
}

impl PackedSymmetric {
    /// Packs the lower triangle of a matrix with the entries `at(i, j)`, i >= j.
    ///
    /// # Errors
    /// If memory does not suffice.
    pub fn from_lower(n: usize, at: impl Fn(usize, usize) -> f64) -> Result<Self> {
        let mut lower = Vec::new();
        handling_allocation_failure(|| lower.try_reserve_exact(start(n))).map_err(|_| {
            Error::resources(format!(
                "not enough memory for a flexibility of {n} contact unknowns ({:.2} GiB); use a coarser mesh, or a \
                 smaller frame",
                start(n) as f64 * 8.0 / f64::from(1 << 30)
            ))
        })?;
        for i in 0..n {
            lower.extend((0..=i).map(|j| at(i, j)));
        }
        let filled = Vec::with_capacity(n / ZERO_SCAN_LEN + 1);
        let scratch = Mutex::new(Scratch { parts: vec![0.0; N_STRIPES * n], filled });
        Ok(Self { n, lower, stripes: stripes(n), scratch })
    }

    /// Number of rows.
    pub fn n(&self) -> usize {
        self.n
    }

    /// Entry (i, j).
    pub fn at(&self, i: usize, j: usize) -> f64 {
        self.lower[start(i.max(j)) + i.min(j)]
    }

    /// Block of three rows and columns: entries (3 i + a, 3 j + b).
    pub fn block(&self, i: usize, j: usize) -> Matrix3<f64> {
        if i == j {
            return Matrix3::from_fn(|a, b| self.at(3 * i + a, 3 * i + b));
        }
        let (below, right) = (i.max(j), 3 * i.min(j));
        let block = Matrix3::from_fn(|a, b| self.lower[start(3 * below + a) + right + b]);
        if i > j { block } else { block.transpose() }
    }

    /// Computes `y = A x`; overwrites `y`. The bits are the same for any number of threads. The product does not
    /// allocate memory.
    ///
    /// A block of the matrix is skipped if x vanishes on its rows and on its columns.
    pub fn multiply(&self, x: &[f64], y: &mut [f64]) {
        if self.n == 0 {
            return;
        }
        let mut scratch = self.scratch.lock().expect("no panic while the scratch is held");
        let Scratch { parts, filled } = &mut *scratch;
        find_filled(x, filled);
        parts
            .par_chunks_exact_mut(self.n)
            .zip(&self.stripes)
            .for_each(|(part, rows)| self.multiply_stripe(rows.clone(), x, filled, part));
        y.copy_from_slice(&parts[(N_STRIPES - 1) * self.n..]);
        for (part, rows) in parts.chunks_exact(self.n).zip(&self.stripes).take(N_STRIPES - 1) {
            y[..rows.end].iter_mut().zip(part).for_each(|(sum, value)| *sum += value);
        }
    }

    /// Writes the contribution of the stored rows `rows` and of the mirrored columns to `part[..rows.end]`.
    fn multiply_stripe(&self, rows: Range<usize>, x: &[f64], filled: &[Range<usize>], part: &mut [f64]) {
        part[..rows.end].fill(0.0);
        let mut i = rows.start;
        while i + ROWS_PER_BLOCK <= rows.end {
            if x[i..i + ROWS_PER_BLOCK].iter().all(|value| *value == 0.0) {
                self.dot_rows(i, x, filled, part);
            } else {
                self.multiply_rows(i, x, part);
            }
            i += ROWS_PER_BLOCK;
        }
        for i in i..rows.end {
            self.multiply_tail(i, 0, x, part);
        }
    }

    /// Adds the products of rows i..i + [`ROWS_PER_BLOCK`] and of the mirrored columns to `part`.
    fn multiply_rows(&self, i: usize, x: &[f64], part: &mut [f64]) {
        let common = i / COLUMNS_PER_BLOCK * COLUMNS_PER_BLOCK;
        let row: [&[f64]; ROWS_PER_BLOCK] = std::array::from_fn(|r| &self.lower[start(i + r)..][..common]);
        let factor: [f64; ROWS_PER_BLOCK] = std::array::from_fn(|r| x[i + r]);
        let mut sums = [[0.0; COLUMNS_PER_BLOCK]; ROWS_PER_BLOCK];
        for (block, (x, y)) in x[..common]
            .chunks_exact(COLUMNS_PER_BLOCK)
            .zip(part[..common].chunks_exact_mut(COLUMNS_PER_BLOCK))
            .enumerate()
        {
            let at = block * COLUMNS_PER_BLOCK;
            let piece: [&[f64]; ROWS_PER_BLOCK] =
                std::array::from_fn(|r| &row[r][at..at + COLUMNS_PER_BLOCK]);
            for lane in 0..COLUMNS_PER_BLOCK {
                let mut mirrored = 0.0;
                for r in 0..ROWS_PER_BLOCK {
                    sums[r][lane] += piece[r][lane] * x[lane];
                    mirrored += piece[r][lane] * factor[r];
                }
                y[lane] += mirrored;
            }
        }
        for (r, sum) in sums.iter().enumerate() {
            part[i + r] += sum.iter().sum::<f64>();
            self.multiply_tail(i + r, common, x, part);
        }
    }

    /// Does the same as [`Self::multiply_rows`] if x vanishes on these rows. The mirrored columns then contribute
    /// nothing. The order of summation is the same, so the bits are the same.
    fn dot_rows(&self, i: usize, x: &[f64], filled: &[Range<usize>], part: &mut [f64]) {
        let common = i / COLUMNS_PER_BLOCK * COLUMNS_PER_BLOCK;
        let row: [&[f64]; ROWS_PER_BLOCK] = std::array::from_fn(|r| &self.lower[start(i + r)..][..common]);
        let mut sums = [[0.0; COLUMNS_PER_BLOCK]; ROWS_PER_BLOCK];
        for range in filled {
            let (from, to) = (range.start.min(common), range.end.min(common));
            for (block, x) in x[from..to].chunks_exact(COLUMNS_PER_BLOCK).enumerate() {
                let at = from + block * COLUMNS_PER_BLOCK;
                for r in 0..ROWS_PER_BLOCK {
                    let piece = &row[r][at..at + COLUMNS_PER_BLOCK];
                    for lane in 0..COLUMNS_PER_BLOCK {
                        sums[r][lane] += piece[lane] * x[lane];
                    }
                }
            }
        }
        for (r, sum) in sums.iter().enumerate() {
            part[i + r] += sum.iter().sum::<f64>();
            self.multiply_tail(i + r, common, x, part);
        }
    }

    /// Adds the products of columns `from`..=i of row i and of the mirrored column to `part`.
    fn multiply_tail(&self, i: usize, from: usize, x: &[f64], part: &mut [f64]) {
        let row = &self.lower[start(i)..start(i + 1)];
        let mut sum = row[i] * x[i];
        for j in from..i {
            sum += row[j] * x[j];
            part[j] += row[j] * x[i];
        }
        part[i] += sum;
    }
}

fn find_filled(x: &[f64], filled: &mut Vec<Range<usize>>) {
    filled.clear();
    for (chunk, values) in x.chunks(ZERO_SCAN_LEN).enumerate() {
        if values.iter().all(|value| *value == 0.0) {
            continue;
        }
        let (from, to) = (chunk * ZERO_SCAN_LEN, chunk * ZERO_SCAN_LEN + values.len());
        match filled.last_mut() {
            Some(last) if last.end == from => last.end = to,
            _ => filled.push(from..to),
        }
    }
}

/// Divides the rows into stripes with about equal numbers of entries.
fn stripes(n: usize) -> Vec<Range<usize>> {
    let end = |s: usize| {
        let share = (s as f64 / N_STRIPES as f64).sqrt();
        if s == N_STRIPES { n } else { ((n as f64 * share) as usize).min(n) }
    };
    (0..N_STRIPES).map(|s| end(s)..end(s + 1)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: y_i = Σ_j a_ij x_j, summed row by row. Tolerance 1e-13 for the rounding of sums of up to 150 terms of
    /// order 1.
    #[test]
    fn product_is_the_sum_over_columns() {
        for n in [0, 1, 2, 5, 17, 64, 150] {
            let entry = |i: usize, j: usize| ((i * j + 3 * (i + j)) as f64).sin();
            let matrix = PackedSymmetric::from_lower(n, entry).expect("memory");
            let x: Vec<f64> = (0..n).map(|i| (i as f64 * 1.7).cos()).collect();
            let mut y = vec![f64::NAN; n];
            matrix.multiply(&x, &mut y);
            for (i, value) in y.iter().enumerate() {
                let expected: f64 = (0..n).map(|j| entry(i.max(j), i.min(j)) * x[j]).sum();
                assert!((value - expected).abs() < 1e-13, "n = {n}, row {i}");
                assert_eq!(matrix.at(0, i), entry(i, 0));
            }
        }
    }

    /// Truth: y_i = Σ_j a_ij x_j. The product of a block of rows has the same bits whether or not it skips the zeros of
    /// x.
    #[test]
    fn zeros_are_left_out() {
        let n = 150;
        let entry = |i: usize, j: usize| ((i * j + 3 * (i + j)) as f64).sin();
        let matrix = PackedSymmetric::from_lower(n, entry).expect("memory");
        for kept in [0..0, 0..150, 37..41, 64..131, 149..150, 0..3] {
            let x: Vec<f64> = (0..n)
                .map(|i| if kept.contains(&i) || i == 20 { (i as f64 * 1.7).cos() } else { 0.0 })
                .collect();
            let mut y = vec![f64::NAN; n];
            matrix.multiply(&x, &mut y);
            for (i, value) in y.iter().enumerate() {
                let expected: f64 = (0..n).map(|j| entry(i.max(j), i.min(j)) * x[j]).sum();
                assert!((value - expected).abs() < 1e-13, "{kept:?}, row {i}");
            }
            let mut filled = Vec::new();
            find_filled(&x, &mut filled);
            let empty = |i: &usize| x[*i..*i + ROWS_PER_BLOCK].iter().all(|value| *value == 0.0);
            for i in (0..n - ROWS_PER_BLOCK).filter(empty) {
                let (mut fast, mut whole) = (vec![0.0; n], vec![0.0; n]);
                matrix.dot_rows(i, &x, &filled, &mut fast);
                matrix.multiply_rows(i, &x, &mut whole);
                assert_eq!(fast, whole, "{kept:?}, rows from {i}");
            }
        }
    }

    /// Truth: a product has the same bits with one, two, three and seven threads.
    #[test]
    fn threads_do_not_change_bits() {
        let matrix = PackedSymmetric::from_lower(333, |i, j| ((i + 7 * j) as f64).cos()).expect("memory");
        let x: Vec<f64> = (0..333).map(|i| (i as f64).sin()).collect();
        let product = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
            let mut y = vec![0.0; 333];
            pool.install(|| matrix.multiply(&x, &mut y));
            y
        };
        let one = product(1);
        assert!(product(2) == one && product(3) == one && product(7) == one);
    }
}
