//! Sparse symmetric matrices, lower triangle by columns.

use nalgebra_sparse::{CooMatrix, CscMatrix};

/// A sparse symmetric matrix `[n, n]` of which the lower triangle is stored by columns (CSC, rows ascending).
#[derive(Debug, Clone, PartialEq)]
pub struct SymmetricSparse {
    lower: CscMatrix<f64>,
}

/// Entries of a symmetric matrix being summed up.
#[derive(Debug, Clone)]
pub struct SymmetricTriplets {
    coo: CooMatrix<f64>,
}

impl SymmetricTriplets {
    /// No entries yet, room for `capacity`.
    pub fn new(n: usize, capacity: usize) -> Self {
        let mut coo = CooMatrix::new(n, n);
        coo.reserve(capacity);
        Self { coo }
    }

    /// Adds `value` to the entries (i, j) and (j, i), which are one; call once per unordered pair.
    ///
    /// # Panics
    /// If an index is out of range.
    pub fn add(&mut self, i: usize, j: usize, value: f64) {
        self.coo.push(i.max(j), i.min(j), value);
    }

    /// The matrix: equal entries are summed in the order in which they were added.
    pub fn build(&self) -> SymmetricSparse {
        SymmetricSparse { lower: CscMatrix::from(&self.coo) }
    }
}

impl SymmetricSparse {
    /// Number of rows.
    pub fn n(&self) -> usize {
        self.lower.ncols()
    }

    /// Number of stored entries (of the lower triangle).
    pub fn n_stored(&self) -> usize {
        self.lower.nnz()
    }

    /// The lower triangle: column offsets `[n + 1]`, row indices and values `[n_stored]`.
    pub fn lower(&self) -> (&[usize], &[usize], &[f64]) {
        self.lower.csc_data()
    }

    /// All entries (row, column, value) of both triangles, each once.
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

    /// Adds `value` to the diagonal entry of a row, which must be stored.
    ///
    /// # Panics
    /// If it is not.
    pub fn add_to_diagonal(&mut self, row: usize, value: f64) {
        let at = self.lower.col_offsets()[row];
        assert!(self.lower.row_indices().get(at) == Some(&row), "a stored diagonal entry");
        self.lower.values_mut()[at] += value;
    }

    /// `y = A x`, both `[n]`; overwrites `y`. Does not allocate.
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
