//! The entries of a flexibility between some cells of a frame, for methods that change one cell at a time.

use std::ops::Range;

use nalgebra::Matrix3;
use rayon::prelude::*;

use crate::error::Result;
use crate::linalg::dense::try_zeroed;

/// S between m cells. The column of the traction component b on cell k is the column 3 k + b; the gap component a of cell i
/// is its row a m + i (by planes).
pub struct CellMatrix {
    m: usize,
    values: Vec<f64>,
}

impl CellMatrix {
    /// Zeros between `m` cells.
    ///
    /// # Errors
    /// If memory does not suffice.
    pub fn zeros(m: usize) -> Result<Self> {
        Ok(Self { m, values: try_zeroed(Self::bytes(m) / size_of::<f64>())? })
    }

    /// Bytes of a matrix between `m` cells.
    pub fn bytes(m: usize) -> usize {
        m.saturating_mul(m).saturating_mul(9 * size_of::<f64>())
    }

    /// Number of cells m.
    pub fn n_cells(&self) -> usize {
        self.m
    }

    /// Gaps of all cells by unit tractions (x, y, n) on cell `k`, in the rows `rows`.
    pub fn columns(&self, k: usize, rows: &Range<usize>) -> [&[f64]; 3] {
        [0, 1, 2].map(|b| {
            let start = (3 * k + b) * 3 * self.m;
            &self.values[start + rows.start..start + rows.end]
        })
    }

    /// Gap of cell `i` by unit tractions on cell `k`.
    pub fn block(&self, i: usize, k: usize) -> Matrix3<f64> {
        Matrix3::from_fn(|a, b| self.values[(3 * k + b) * 3 * self.m + a * self.m + i])
    }

    /// Changes every block: `with(i, k, block)` is the new gap of cell i by tractions on cell k.
    pub fn map_blocks(&mut self, with: impl Fn(usize, usize, Matrix3<f64>) -> Matrix3<f64> + Sync) {
        self.map_columns(0..self.m, with);
    }

    /// As [`Self::map_blocks`], in the columns of the cells `of` alone.
    fn map_columns(
        &mut self,
        of: Range<usize>,
        with: impl Fn(usize, usize, Matrix3<f64>) -> Matrix3<f64> + Sync,
    ) {
        let m = self.m;
        if m == 0 {
            return;
        }
        let columns = self.values[9 * m * of.start..9 * m * of.end].par_chunks_exact_mut(9 * m);
        columns.enumerate().for_each(|(k, columns)| {
            let k = of.start + k;
            for i in 0..m {
                let old = Matrix3::from_fn(|a, b| columns[b * 3 * m + a * m + i]);
                let new = with(i, k, old);
                for b in 0..3 {
                    (0..3).for_each(|a| columns[b * 3 * m + a * m + i] = new[(a, b)]);
                }
            }
        });
    }

    /// Adds to every block: `of(i, k)` is the gap of cell i by tractions on cell k.
    pub fn add_blocks(&mut self, of: impl Fn(usize, usize) -> Matrix3<f64> + Sync) {
        self.add_columns(0..self.m, of);
    }

    /// As [`Self::add_blocks`], in the columns of the cells `cells` alone.
    pub fn add_columns(&mut self, cells: Range<usize>, of: impl Fn(usize, usize) -> Matrix3<f64> + Sync) {
        self.map_columns(cells, |i, k, old| old + of(i, k));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: the layout as it is documented.
    #[test]
    fn columns_hold_blocks() {
        let mut matrix = CellMatrix::zeros(2).expect("memory");
        let entry = |a: usize, i: usize, b: usize, k: usize| (1000 * a + 100 * i + 10 * b + k) as f64;
        matrix.add_blocks(|i, k| Matrix3::from_fn(|a, b| entry(a, i, b, k)));
        assert_eq!(matrix.block(0, 1)[(2, 1)], entry(2, 0, 1, 1));
        let [_, y, n] = matrix.columns(1, &(4..6));
        assert_eq!(y, [entry(2, 0, 1, 1), entry(2, 1, 1, 1)]);
        assert_eq!(n[0], entry(2, 0, 2, 1));
        matrix.map_blocks(|_, _, block| 2.0 * block);
        assert_eq!(matrix.block(1, 0)[(0, 2)], 2.0 * entry(0, 1, 2, 0));
        assert_eq!(CellMatrix::bytes(2), 36 * 8);
    }
}
