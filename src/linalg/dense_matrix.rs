//! Dense rectangular matrices in column-major order.

use faer::linalg::matmul::matmul;
use faer::{Accum, MatMut, MatRef, Par};

use super::dense::try_zeroed;
use crate::error::Result;

/// Dense matrix `[n_rows, n_columns]`, stored column by column.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct DenseMatrix {
    n_rows: usize,
    n_columns: usize,
    values: Vec<f64>,
}

impl DenseMatrix {
    /// Creates a zero matrix.
    ///
    /// # Errors
    /// If memory does not suffice.
    pub fn zeros(n_rows: usize, n_columns: usize) -> Result<Self> {
        Ok(Self { n_rows, n_columns, values: try_zeroed(n_rows.saturating_mul(n_columns))? })
    }

    /// Creates a matrix from its entries in column-major order.
    ///
    /// # Panics
    /// If the length of `values` is not `n_rows * n_columns`.
    pub fn from_values(n_rows: usize, n_columns: usize, values: Vec<f64>) -> Self {
        assert_eq!(values.len(), n_rows * n_columns, "the entries of a matrix");
        Self { n_rows, n_columns, values }
    }

    /// Number of rows.
    pub fn n_rows(&self) -> usize {
        self.n_rows
    }

    /// Number of columns.
    pub fn n_columns(&self) -> usize {
        self.n_columns
    }

    /// All entries in column-major order.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// All entries in column-major order, mutable.
    pub fn values_mut(&mut self) -> &mut [f64] {
        &mut self.values
    }

    /// Column `j`.
    pub fn column(&self, j: usize) -> &[f64] {
        &self.values[j * self.n_rows..(j + 1) * self.n_rows]
    }

    /// Column `j`, mutable.
    pub fn column_mut(&mut self, j: usize) -> &mut [f64] {
        &mut self.values[j * self.n_rows..(j + 1) * self.n_rows]
    }

    /// Entry (i, j).
    pub fn at(&self, i: usize, j: usize) -> f64 {
        self.values[j * self.n_rows + i]
    }

    /// Adds `factor` aᵀ b to this matrix, in one thread.
    ///
    /// # Panics
    /// If the shapes do not match.
    pub fn add_transposed_product(&mut self, factor: f64, a: &Self, b: &Self) {
        assert_eq!(
            (a.n_rows, self.n_rows, self.n_columns),
            (b.n_rows, a.n_columns, b.n_columns),
            "a product of matrices"
        );
        let (n_rows, n_columns) = (self.n_rows, self.n_columns);
        let sum = MatMut::from_column_major_slice_mut(&mut self.values, n_rows, n_columns);
        matmul(sum, Accum::Add, a.view().transpose(), b.view(), factor, Par::Seq);
    }

    /// Adds `factor` times another matrix.
    ///
    /// # Panics
    /// If the shapes differ.
    pub fn add_scaled(&mut self, factor: f64, other: &Self) {
        assert_eq!((self.n_rows, self.n_columns), (other.n_rows, other.n_columns), "a sum of matrices");
        self.values.iter_mut().zip(&other.values).for_each(|(sum, value)| *sum += factor * value);
    }

    /// Returns the transposed matrix.
    pub fn transposed(&self) -> Self {
        let (n_rows, n_columns) = (self.n_columns, self.n_rows);
        let entry = |k: usize| self.at(k / n_rows, k % n_rows);
        Self { n_rows, n_columns, values: (0..self.values.len()).map(entry).collect() }
    }

    /// Frobenius norm.
    pub fn norm(&self) -> f64 {
        self.values.iter().map(|value| value * value).sum::<f64>().sqrt()
    }

    /// View as a faer matrix.
    pub(crate) fn view(&self) -> MatRef<'_, f64> {
        MatRef::from_column_major_slice(&self.values, self.n_rows, self.n_columns)
    }

    /// Mutable view as a faer matrix.
    pub(crate) fn view_mut(&mut self) -> MatMut<'_, f64> {
        MatMut::from_column_major_slice_mut(&mut self.values, self.n_rows, self.n_columns)
    }
}
