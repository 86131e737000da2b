//! Dense symmetric matrices of which one triangle is stored, for products that are bound by memory traffic.

use std::ops::Range;
use std::sync::Mutex;

use rayon::prelude::*;

use crate::error::{Error, Result};

/// Stripes a matrix is worked on in; their number is fixed so that the bits do not depend on the threads.
const STRIPES: usize = 16;
/// Rows taken together.
const ROWS: usize = 4;

/// A dense symmetric matrix `[n, n]`, lower triangle row by row.
pub struct PackedSymmetric {
    n: usize,
    lower: Vec<f64>,
    stripes: Vec<Range<usize>>,
    /// One vector per stripe.
    scratch: Mutex<Vec<f64>>,
}

/// Position of row `i` in the packed triangle.
fn start(i: usize) -> usize {
    i * (i + 1) / 2
}

impl PackedSymmetric {
    /// Packs the lower triangle of the matrix whose entries are `at(i, j)`, i >= j.
    ///
    /// # Errors
    /// If memory does not suffice.
    pub fn from_lower(n: usize, at: impl Fn(usize, usize) -> f64) -> Result<Self> {
        let mut lower = Vec::new();
        lower.try_reserve_exact(start(n)).map_err(|_| {
            Error::resources(format!(
                "not enough memory for a flexibility of {n} contact unknowns ({:.2} GiB); use a coarser mesh, or a \
                 smaller frame",
                start(n) as f64 * 8.0 / f64::from(1 << 30)
            ))
        })?;
        for i in 0..n {
            lower.extend((0..=i).map(|j| at(i, j)));
        }
        Ok(Self { n, lower, stripes: stripes(n), scratch: Mutex::new(vec![0.0; STRIPES * n]) })
    }

    /// Number of rows.
    pub fn n(&self) -> usize {
        self.n
    }

    /// Entry (i, j).
    pub fn at(&self, i: usize, j: usize) -> f64 {
        self.lower[start(i.max(j)) + i.min(j)]
    }

    /// `y = self x`; overwrites. The same bits for any number of threads; does not allocate.
    pub fn multiply(&self, x: &[f64], y: &mut [f64]) {
        if self.n == 0 {
            return;
        }
        let mut scratch = self.scratch.lock().expect("no panic while the scratch is held");
        scratch
            .par_chunks_exact_mut(self.n)
            .zip(&self.stripes)
            .for_each(|(part, rows)| self.multiply_stripe(rows.clone(), x, part));
        y.copy_from_slice(&scratch[(STRIPES - 1) * self.n..]);
        for (part, rows) in scratch.chunks_exact(self.n).zip(&self.stripes).take(STRIPES - 1) {
            y[..rows.end].iter_mut().zip(part).for_each(|(sum, value)| *sum += value);
        }
    }

    /// The share of the stored rows `rows` (and of their mirror images) in the product, in `part[..rows.end]`.
    fn multiply_stripe(&self, rows: Range<usize>, x: &[f64], part: &mut [f64]) {
        part[..rows.end].fill(0.0);
        let mut i = rows.start;
        while i + ROWS <= rows.end {
            self.multiply_rows(i, x, part);
            i += ROWS;
        }
        for i in i..rows.end {
            self.multiply_tail(i, 0, x, part);
        }
    }

    /// Rows i..i + ROWS: the common columns together, so that x and y are read once, then the corner.
    fn multiply_rows(&self, i: usize, x: &[f64], part: &mut [f64]) {
        const LANES: usize = 4;
        let common = i / LANES * LANES;
        let row: [&[f64]; ROWS] = std::array::from_fn(|r| &self.lower[start(i + r)..][..common]);
        let factor: [f64; ROWS] = std::array::from_fn(|r| x[i + r]);
        let mut sums = [[0.0; LANES]; ROWS];
        for (block, (x, y)) in
            x[..common].chunks_exact(LANES).zip(part[..common].chunks_exact_mut(LANES)).enumerate()
        {
            let at = block * LANES;
            let piece: [&[f64]; ROWS] = std::array::from_fn(|r| &row[r][at..at + LANES]);
            for lane in 0..LANES {
                let mut mirrored = 0.0;
                for r in 0..ROWS {
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

    /// Columns `from`..=i of row i, and their mirror images.
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

/// Row ranges of about equal numbers of entries.
fn stripes(n: usize) -> Vec<Range<usize>> {
    let end = |s: usize| {
        let share = (s as f64 / STRIPES as f64).sqrt();
        if s == STRIPES { n } else { ((n as f64 * share) as usize).min(n) }
    };
    (0..STRIPES).map(|s| end(s)..end(s + 1)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: the definition of the product, row by row; 1e-13: rounding of sums of up to 150 terms of order 1.
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

    /// Truth: the same bits with one thread and with several.
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
