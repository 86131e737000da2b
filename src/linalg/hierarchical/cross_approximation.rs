//! Adaptive cross approximation with partial pivoting. It approximates a block by outer products u vᵀ of some of its
//! rows and columns, called crosses.
//!
//! A kernel evaluates several components at once, and each component is a separate matrix. Rows and columns that were
//! computed for one component are stored and reused for the other components.
//!
//! # Source
//! Bebendorf 2000, "Approximation of boundary element matrices".

use std::ops::Range;

use crate::linalg::vector::{axpy, norm};

/// Entries of all components of a kernel in tree order. `entries(i, j, values)` writes entry (i, j) of each component
/// to `values`.
pub trait KernelEntries: Fn(usize, usize, &mut [f64]) + Sync {}

impl<F: Fn(usize, usize, &mut [f64]) + Sync> KernelEntries for F {}

/// Error bound of the cross approximation, divided by the error bound of the block. The rest of the bound is left for
/// the subsequent truncation.
pub(super) const CROSS_ERROR_SHARE: f64 = 0.3;

/// Number of consecutive rows after which only the check rows remain. A row counts if its cross is at most as large as
/// the bound, or if it gives no cross.
const SMALL_CROSSES_TO_STOP: usize = 2;

/// Factor for check rows: a cross through a check row is added only if a residual entry of the row exceeds this factor
/// times bound / √(m n). The block has the shape `[m, n]`. bound / √(m n) is the root-mean-square error that the bound
/// allows for the entries.
const INCOMPLETE_ROW_FACTOR: f64 = 4.0;

/// Factor for rows that are selected by the last column: a cross is added only if a residual entry of the row exceeds
/// this factor times bound / √(m n).
const MIN_PIVOT_SHARE: f64 = 0.01;

/// Position of the first row and of the first column in a block, as a fraction of the largest index.
const FIRST_LINE_SHARE: f64 = 0.5;
/// Positions of the other initial rows, and of the check rows, as fractions of the largest index.
const INITIAL_ROW_SHARES: [f64; 2] = [0.0, 1.0];
const FINAL_CHECK_ROW_SHARES: [f64; 3] = [0.25, 0.75, 0.1];

/// Matrix whose rows and columns are computed on first use.
pub(super) trait LazyMatrix {
    /// Smallest ratio of two residual entries of a row at which a known column becomes the pivot column. They are the
    /// largest entry in a known column and the largest entry of the row.
    const KNOWN_COLUMN_SHARE: f64 = 0.3;

    /// Numbers of rows and columns.
    fn size(&self) -> (usize, usize);

    /// Indices of the rows that are already computed, in the order of their computation.
    fn known_rows(&self) -> &[usize];

    fn known_columns(&self) -> &[usize];

    fn row(&mut self, i: usize) -> &[f64];

    fn column(&mut self, j: usize) -> &[f64];
}

pub(super) struct ComponentLines<'l, 'k, K> {
    pub lines: &'l mut KernelBlock<'k, K>,
    pub component: usize,
}

impl<K: KernelEntries> LazyMatrix for ComponentLines<'_, '_, K> {
    fn size(&self) -> (usize, usize) {
        self.lines.size()
    }

    fn known_rows(&self) -> &[usize] {
        &self.lines.row_places
    }

    fn known_columns(&self) -> &[usize] {
        &self.lines.column_places
    }

    fn row(&mut self, i: usize) -> &[f64] {
        let n = self.size().1;
        let from = (self.lines.row(i) * self.lines.components + self.component) * n;
        &self.lines.row_values[from..from + n]
    }

    fn column(&mut self, j: usize) -> &[f64] {
        let m = self.size().0;
        let from = (self.lines.column(j) * self.lines.components + self.component) * m;
        &self.lines.column_values[from..from + m]
    }
}

/// Block of a kernel whose rows and columns are computed on first use, for all components together.
pub(super) struct KernelBlock<'k, K> {
    entries: &'k K,
    rows: Range<usize>,
    columns: Range<usize>,
    components: usize,
    row_places: Vec<usize>,
    /// Entries of the known rows, `[row][component][column]`.
    row_values: Vec<f64>,
    column_places: Vec<usize>,
    /// Entries of the known columns, `[column][component][row]`.
    column_values: Vec<f64>,
}

pub(super) fn index_at_share(share: f64, count: usize) -> usize {
    ((count - 1) as f64 * share) as usize
}

impl<'k, K: KernelEntries> KernelBlock<'k, K> {
    pub fn new(entries: &'k K, rows: Range<usize>, columns: Range<usize>, components: usize) -> Self {
        let mut lines = Self {
            entries,
            rows,
            columns,
            components,
            row_places: Vec::new(),
            row_values: Vec::new(),
            column_places: Vec::new(),
            column_values: Vec::new(),
        };
        let (m, n) = lines.size();
        lines.column(index_at_share(FIRST_LINE_SHARE, n));
        for share in [FIRST_LINE_SHARE, INITIAL_ROW_SHARES[0], INITIAL_ROW_SHARES[1]] {
            lines.row(index_at_share(share, m));
        }
        lines
    }

    fn size(&self) -> (usize, usize) {
        (self.rows.len(), self.columns.len())
    }

    /// Estimated Frobenius norm of all components together, from the known rows and columns.
    pub fn norm(&self) -> f64 {
        let (m, n) = self.size();
        let squares = |values: &[f64]| values.iter().map(|value| value * value).sum::<f64>();
        let known = self.row_places.len() * n + self.column_places.len() * m;
        ((squares(&self.row_values) + squares(&self.column_values)) / known as f64 * (m * n) as f64).sqrt()
    }

    /// Position of row `i` of the block among the known rows; computes the row if it is unknown.
    fn row(&mut self, i: usize) -> usize {
        if let Some(known) = self.row_places.iter().position(|&place| place == i) {
            return known;
        }
        let (n, components) = (self.columns.len(), self.components);
        let from = self.row_values.len();
        self.row_values.resize(from + components * n, 0.0);
        let mut values = [0.0; MAX_COMPONENTS];
        for (j, column) in self.columns.clone().enumerate() {
            (self.entries)(self.rows.start + i, column, &mut values[..components]);
            (0..components).for_each(|c| self.row_values[from + c * n + j] = values[c]);
        }
        self.row_places.push(i);
        self.row_places.len() - 1
    }

    /// Position of column `j` of the block among the known columns; computes the column if it is unknown.
    fn column(&mut self, j: usize) -> usize {
        if let Some(known) = self.column_places.iter().position(|&place| place == j) {
            return known;
        }
        let (m, components) = (self.rows.len(), self.components);
        let from = self.column_values.len();
        self.column_values.resize(from + components * m, 0.0);
        let mut values = [0.0; MAX_COMPONENTS];
        for (i, row) in self.rows.clone().enumerate() {
            (self.entries)(row, self.columns.start + j, &mut values[..components]);
            (0..components).for_each(|c| self.column_values[from + c * m + i] = values[c]);
        }
        self.column_places.push(j);
        self.column_places.len() - 1
    }
}

/// Maximum number of components of a kernel.
pub const MAX_COMPONENTS: usize = 9;

/// Low-rank matrix Σ u vᵀ `[m, n]`.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct OuterProducts {
    /// Vectors u, `[rank][m]`.
    pub u: Vec<f64>,
    /// Vectors v, `[rank][n]`.
    pub v: Vec<f64>,
    pub rank: usize,
}

struct CrossApproximation<L> {
    lines: L,
    terms: OuterProducts,
    used: Vec<bool>,
    row: Vec<f64>,
    /// Residual entries of the pivot column of the last cross, divided by the pivot.
    column: Vec<f64>,
}

/// Approximates a matrix by Σ u vᵀ. The estimated Frobenius norm of the remainder is at most `bound`.
pub(super) fn approximate(lines: impl LazyMatrix, bound: f64) -> OuterProducts {
    let (m, n) = lines.size();
    let (row, column) = (vec![0.0; n], vec![0.0; m]);
    let mut cross =
        CrossApproximation { lines, terms: OuterProducts::default(), used: vec![false; m], row, column };
    let mean = bound / ((m * n) as f64).sqrt();
    let (mut known, mut late, mut quiet) = (0, 0, 0);
    while cross.terms.rank < m.min(n) {
        // Order of the rows: first the known rows, then rows chosen by the largest entry of the last column, finally
        // the check rows.
        let (i, least) = if known < cross.lines.known_rows().len() {
            known += 1;
            (cross.lines.known_rows()[known - 1], mean)
        } else if quiet < SMALL_CROSSES_TO_STOP {
            match cross.largest_unused_row() {
                Some(i) => (i, MIN_PIVOT_SHARE * mean),
                None => break,
            }
        } else if late < FINAL_CHECK_ROW_SHARES.len() {
            late += 1;
            (index_at_share(FINAL_CHECK_ROW_SHARES[late - 1], m), INCOMPLETE_ROW_FACTOR * mean)
        } else {
            break;
        };
        if cross.used[i] {
            continue;
        }
        match cross.add(i, least) {
            Some(size) if size > bound => quiet = 0,
            _ => quiet += 1,
        }
    }
    cross.terms
}

impl<L: LazyMatrix> CrossApproximation<L> {
    fn largest_unused_row(&self) -> Option<usize> {
        let free = (0..self.used.len()).filter(|&i| !self.used[i]);
        free.max_by(|&a, &b| self.column[a].abs().total_cmp(&self.column[b].abs()))
    }

    /// Adds the cross through row `i` and returns its Frobenius norm. `None` if no residual entry of the row exceeds `least`.
    fn add(&mut self, i: usize, least: f64) -> Option<f64> {
        let (m, n) = self.lines.size();
        self.used[i] = true;
        self.row.copy_from_slice(self.lines.row(i));
        let terms = self.terms.u.chunks_exact(m).zip(self.terms.v.chunks_exact(n));
        terms.for_each(|(u, v)| axpy(&mut self.row, -u[i], v));
        let (mut j, mut pivot) = largest(&self.row, 0..n);
        if pivot.abs() <= least || pivot == 0.0 {
            return None;
        }
        let (at, entry) = largest(&self.row, self.lines.known_columns().iter().copied());
        if entry.abs() >= L::KNOWN_COLUMN_SHARE * pivot.abs() {
            (j, pivot) = (at, entry);
        }
        self.column.copy_from_slice(self.lines.column(j));
        let terms = self.terms.u.chunks_exact(m).zip(self.terms.v.chunks_exact(n));
        terms.for_each(|(u, v)| axpy(&mut self.column, -v[j], u));
        self.column.iter_mut().for_each(|value| *value /= pivot);
        self.terms.u.extend_from_slice(&self.column);
        self.terms.v.extend_from_slice(&self.row);
        self.terms.rank += 1;
        Some(norm(&self.column) * norm(&self.row))
    }
}

/// Index and value of the entry with the largest magnitude among `places`. (0, 0) if all these entries are zero.
fn largest(values: &[f64], places: impl Iterator<Item = usize>) -> (usize, f64) {
    places
        .map(|place| (place, values[place]))
        .fold((0, 0.0), |most: (usize, f64), next| if next.1.abs() > most.1.abs() { next } else { most })
}
