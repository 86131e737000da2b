//! Sparse symmetric matrices.

use nalgebra_sparse::CscMatrix;

/// Sparse symmetric matrix `[n, n]`. The lower triangle is stored by columns (compressed sparse columns, ascending
/// rows).
#[derive(Debug, Clone, PartialEq)]
pub struct SymmetricSparse {
    lower: CscMatrix<f64>,
}

/// Triplets (column, row, value) of a small symmetric matrix. [`Self::build`] sums triplets with equal indices.
///
/// For a large matrix, [`SymmetricSparse::from_pattern`] needs at most about a third of the memory.
#[derive(Debug, Clone)]
pub struct SymmetricTriplets {
    n: usize,
    entries: Vec<(usize, usize, f64)>,
}

impl SymmetricTriplets {
    /// Creates an empty list for a matrix `[n, n]`.
    pub fn new(n: usize) -> Self {
        Self { n, entries: Vec::new() }
    }

    /// Adds `value` to the entry (i, j) and to its mirror image (j, i). Add each contribution only once, as (i, j) or
    /// as (j, i).
    ///
    /// # Panics
    /// If an index is out of range.
    pub fn add(&mut self, i: usize, j: usize, value: f64) {
        assert!(i < self.n && j < self.n, "indices within the matrix");
        self.entries.push((i.min(j), i.max(j), value));
    }

    /// Builds the matrix. Values of the same entry are summed in the order in which they were added.
    pub fn build(mut self) -> SymmetricSparse {
        // The sort is stable, which keeps the order of equal entries.
        self.entries.sort_by_key(|&(column, row, _)| (column, row));
        let mut pattern: Vec<(usize, usize)> = self.entries.iter().map(|&(j, i, _)| (j, i)).collect();
        pattern.dedup();
        let mut offsets = vec![0; self.n + 1];
        pattern.iter().for_each(|&(column, _)| offsets[column + 1] += 1);
        (0..self.n).for_each(|column| offsets[column + 1] += offsets[column]);
        let mut matrix =
            SymmetricSparse::from_pattern(offsets, pattern.into_iter().map(|entry| entry.1).collect());
        self.entries.iter().for_each(|&(column, row, value)| matrix.add(row, column, value));
        matrix
    }
}

impl SymmetricSparse {
    /// Creates a zero matrix with a given pattern of its lower triangle: column offsets `[n + 1]`, and ascending row indices of
    /// each column.
    ///
    /// # Panics
    /// If rows are not ascending or out of range, or if the offsets do not match the rows.
    pub fn from_pattern(offsets: Vec<usize>, rows: Vec<usize>) -> Self {
        let (n, values) = (offsets.len() - 1, vec![0.0; rows.len()]);
        let lower = CscMatrix::try_from_csc_data(n, n, offsets, rows, values);
        Self { lower: lower.expect("a pattern by ascending rows") }
    }

    /// Adds `value` to the entry (i, j) and its mirror image (j, i).
    ///
    /// # Panics
    /// If the pattern does not contain the entry.
    pub fn add(&mut self, i: usize, j: usize, value: f64) {
        let (offsets, rows, values) = self.lower.csc_data_mut();
        let column = offsets[i.min(j)]..offsets[i.min(j) + 1];
        let at = rows[column.clone()].binary_search(&i.max(j)).expect("a stored entry");
        values[column.start + at] += value;
    }

    /// Number of rows.
    pub fn n(&self) -> usize {
        self.lower.ncols()
    }

    /// Number of stored entries, which belong to the lower triangle.
    pub fn n_stored(&self) -> usize {
        self.lower.nnz()
    }

    /// The lower triangle: column offsets `[n + 1]`, row indices and values `[n_stored]`.
    pub fn lower(&self) -> (&[usize], &[usize], &[f64]) {
        self.lower.csc_data()
    }

    /// Iterates over the entries (row, column, value) of both triangles. Each entry occurs once.
    pub fn entries(&self) -> impl Iterator<Item = (usize, usize, f64)> + '_ {
        self.lower.triplet_iter().flat_map(|(i, j, &v)| {
            let mirrored = (i != j).then_some((j, i, v));
            std::iter::once((i, j, v)).chain(mirrored)
        })
    }

    /// The diagonal, `[n]`.
    pub fn diagonal(&self) -> Vec<f64> {
        let (offsets, rows, values) = self.lower();
        (0..self.n())
            .map(
                |j| {
                    if offsets[j] < offsets[j + 1] && rows[offsets[j]] == j {
                        values[offsets[j]]
                    } else {
                        0.0
                    }
                },
            )
            .collect()
    }

    /// Computes `y = A x`, both `[n]`; overwrites `y`.
    ///
    /// # Panics
    /// If the lengths differ from n.
    pub fn multiply(&self, x: &[f64], y: &mut [f64]) {
        assert!(x.len() == self.n() && y.len() == self.n(), "vectors of the matrix's size");
        let (offsets, rows, values) = self.lower();
        y.fill(0.0);
        for j in 0..self.n() {
            let mut sum = 0.0;
            for k in offsets[j]..offsets[j + 1] {
                let i = rows[k];
                sum += values[k] * x[i];
                if i != j {
                    y[i] += values[k] * x[j];
                }
            }
            y[j] += sum;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: 1 + 1 + 1e16 - 1e16 = 2 if the sum follows the order of addition. Rounding removes a 1 that is added
    /// after 1e16.
    #[test]
    fn equal_entries_are_summed_in_their_order() {
        let n = 60;
        let mut triplets = SymmetricTriplets::new(n);
        for value in [1.0, 1.0, 1e16, -1e16] {
            for i in 0..n {
                (0..=i).rev().for_each(|j| triplets.add(j, i, value));
            }
        }
        let matrix = triplets.build();
        assert_eq!(matrix.n_stored(), n * (n + 1) / 2);
        assert!(matrix.lower().2.iter().all(|&value| value == 2.0));
        assert_eq!(matrix.diagonal(), vec![2.0; n]);
    }

    /// Truth: the product of [[2, 0, 3], [0, 0, 0], [3, 0, 5]] and (1, 10, 100), computed by hand. The second column of the matrix
    /// has no stored entries.
    #[test]
    fn entries_of_a_pattern() {
        let mut matrix = SymmetricSparse::from_pattern(vec![0, 2, 2, 3], vec![0, 2, 2]);
        for (i, j, value) in [(0, 0, 2.0), (0, 2, 1.0), (2, 0, 2.0), (2, 2, 5.0)] {
            matrix.add(i, j, value);
        }
        let mut y = [0.0; 3];
        matrix.multiply(&[1.0, 10.0, 100.0], &mut y);
        assert_eq!(y, [302.0, 0.0, 503.0]);
    }
}
