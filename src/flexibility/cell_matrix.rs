//! Dense matrix of a flexibility between some cells of a frame.

use nalgebra::Matrix3;
use rayon::prelude::*;

use crate::error::Result;
use crate::linalg::dense::try_zeroed;

/// Flexibility S between m cells, as blocks S_ik: gap of cell i (x, y, n) per traction on cell k, mm/MPa.
pub struct CellMatrix {
    m: usize,
    /// Blocks of one column after the other, `[m, 3, 3, m]`: cell k, component of the traction, component of the gap, cell i.
    values: Vec<f64>,
}

impl CellMatrix {
    /// Zero matrix between `m` cells.
    ///
    /// # Errors
    /// If memory does not suffice.
    pub fn zeros(m: usize) -> Result<Self> {
        Ok(Self { m, values: try_zeroed(m.saturating_mul(m).saturating_mul(9))? })
    }

    /// Block S_ik.
    pub fn block(&self, i: usize, k: usize) -> Matrix3<f64> {
        Matrix3::from_fn(|a, b| self.values[((3 * k + b) * 3 + a) * self.m + i])
    }

    /// Writes the gap of all cells, `[3, m]`, due to a traction on cell `k`.
    pub fn gap_of(&self, k: usize, traction: [f64; 3], gap: &mut [f64]) {
        let [x, y, n] =
            [0, 1, 2].map(|b| &self.values[(3 * k + b) * 3 * self.m..(3 * k + b + 1) * 3 * self.m]);
        for (((gap, x), y), n) in gap.iter_mut().zip(x).zip(y).zip(n) {
            *gap = traction[0] * x + traction[1] * y + traction[2] * n;
        }
    }

    /// Adds a matrix, given by columns of blocks: `column(k)` returns a function from i to the block S_ik.
    pub fn add_columns<F: Fn(usize) -> Matrix3<f64>>(&mut self, column: impl Fn(usize) -> F + Sync) {
        let m = self.m;
        self.values.par_chunks_exact_mut(9 * m.max(1)).enumerate().for_each(|(k, values)| {
            let block = column(k);
            for i in 0..m {
                for (place, entry) in block(i).iter().enumerate() {
                    values[place * m + i] += entry;
                }
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: sums of the blocks that were added, and their products with a traction.
    #[test]
    fn columns_are_added() {
        let entry = |a: usize, i: usize, b: usize, k: usize| (1000 * a + 100 * i + 10 * b + k) as f64;
        let mut matrix = CellMatrix::zeros(2).expect("memory");
        for _ in 0..2 {
            matrix.add_columns(|k| move |i| Matrix3::from_fn(|a, b| entry(a, i, b, k)));
        }
        assert_eq!(matrix.block(0, 1)[(2, 1)], 2.0 * entry(2, 0, 1, 1));
        let mut gap = [0.0; 6];
        matrix.gap_of(1, [1.0, 10.0, 100.0], &mut gap);
        let of = |a, i| 2.0 * (entry(a, i, 0, 1) + 10.0 * entry(a, i, 1, 1) + 100.0 * entry(a, i, 2, 1));
        assert_eq!(gap, [of(0, 0), of(0, 1), of(1, 0), of(1, 1), of(2, 0), of(2, 1)]);
    }
}
