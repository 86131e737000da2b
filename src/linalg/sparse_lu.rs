//! Sparse LU factorisation of unsymmetric matrices by the library faer, with a check of its residual. The columns are
//! ordered by COLAMD (column approximate minimum degree).

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::linalg::LuError;
use faer::sparse::linalg::lu::{LuRef, NumericLu, SymbolicLu, factorize_symbolic_lu};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par};
use nalgebra_sparse::{CooMatrix, CscMatrix};

use super::vector::norm;
use crate::error::{Error, Result};

/// Largest relative residual at which a factorisation counts as correct.
const RESIDUAL_LIMIT: f64 = 1e-8;
/// Largest number of right-hand sides per solve.
pub const MAX_RHS: usize = 32;

/// LU factorisation A = Pᵀ L U Qᵀ of a square sparse matrix with row and column permutations P and Q.
pub struct SparseLu {
    symbolic: SymbolicLu<usize>,
    numeric: NumericLu<usize, f64>,
}

/// Workspace of [`SparseLu::solve_in_place`], allocated once.
pub struct LuWorkspace(MemBuffer);

fn factorisation_error(error: LuError) -> Error {
    match error {
        LuError::Generic(_) => out_of_memory(),
        LuError::SymbolicSingular { index } => Error::numerical(format!(
            "the block system is singular: its columns are linearly dependent (found at column {} of its elimination). Use solver.coupling = \"schur\", which reports what moves freely",
            index + 1
        )),
    }
}

fn out_of_memory() -> Error {
    Error::resources("not enough memory to factorise the block system: use solver.coupling = \"schur\"")
}

impl SparseLu {
    /// Factorises the matrix with the entries (row, column, value). Repeated entries are summed.
    ///
    /// The matrix must be regular, because faer terminates the program at a pivot of exactly zero.
    ///
    /// # Errors
    /// If memory does not suffice, if the pattern makes the matrix singular, or if the check of the residual fails.
    ///
    /// # Panics
    /// If an entry is out of range.
    pub fn new(n: usize, entries: impl Iterator<Item = (usize, usize, f64)>) -> Result<Self> {
        let mut coo = CooMatrix::new(n, n);
        entries.for_each(|(row, column, value)| coo.push(row, column, value));
        let matrix = CscMatrix::from(&coo);
        let (starts, rows, values) = matrix.csc_data();
        let structure = SymbolicSparseColMatRef::new_checked(n, n, starts, None, rows);
        let symbolic = factorize_symbolic_lu(structure, Default::default()).map_err(|_| out_of_memory())?;
        let mut numeric = NumericLu::new();
        let request = symbolic.factorize_numeric_lu_scratch::<f64>(Par::Seq, Default::default());
        let mut memory = MemBuffer::try_new(request).map_err(|_| out_of_memory())?;
        symbolic
            .factorize_numeric_lu(
                &mut numeric,
                SparseColMatRef::new(structure, values),
                Par::Seq,
                MemStack::new(&mut memory),
                Default::default(),
            )
            .map_err(factorisation_error)?;
        let factors = Self { symbolic, numeric };
        factors.check(&matrix)?;
        Ok(factors)
    }

    /// Number of rows.
    pub fn n(&self) -> usize {
        self.symbolic.nrows()
    }

    /// Allocates the workspace for solves with up to [`MAX_RHS`] right-hand sides.
    ///
    /// # Errors
    /// If memory does not suffice.
    pub fn workspace(&self) -> Result<LuWorkspace> {
        let request = self.symbolic.solve_in_place_scratch::<f64>(MAX_RHS, Par::Seq);
        MemBuffer::try_new(request).map(LuWorkspace).map_err(|_| out_of_memory())
    }

    /// Solves A x = rhs in place for up to [`MAX_RHS`] right-hand sides `[n_rhs, n]`.
    ///
    /// # Panics
    /// If the length of `rhs` is not a multiple of n, or if there are more than [`MAX_RHS`] right-hand sides.
    pub fn solve_in_place(&self, rhs: &mut [f64], workspace: &mut LuWorkspace) {
        let n = self.n();
        let count = rhs.len() / n;
        assert!(count * n == rhs.len() && count <= MAX_RHS, "up to {MAX_RHS} right-hand sides of {n} rows");
        LuRef::new_unchecked(&self.symbolic, &self.numeric).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(rhs, n, count),
            Par::Seq,
            MemStack::new(&mut workspace.0),
        );
    }

    /// Checks the relative residual of the solution x of A x = A v, where v is a fixed vector with irregular entries.
    fn check(&self, matrix: &CscMatrix<f64>) -> Result<()> {
        let n = self.n();
        let known: Vec<f64> = (0..n).map(|i| (i as f64 * 12.9898 + 1.0).sin()).collect();
        let multiply = |x: &[f64]| {
            let mut y = vec![0.0; n];
            matrix.triplet_iter().for_each(|(row, column, value)| y[row] += value * x[column]);
            y
        };
        let rhs = multiply(&known);
        let mut solution = rhs.clone();
        self.solve_in_place(&mut solution, &mut self.workspace()?);
        let apart: Vec<f64> = multiply(&solution).iter().zip(&rhs).map(|(a, b)| a - b).collect();
        let residual = norm(&apart) / norm(&rhs);
        if residual < RESIDUAL_LIMIT {
            return Ok(());
        }
        Err(Error::numerical(format!(
            "the factorisation of the block system is wrong: its relative residual is {residual:.1e}, but at most {RESIDUAL_LIMIT:.0e} is allowed; use solver.coupling = \"schur\""
        )))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: a matrix of 20 rows with an empty row or column is singular. The error has the kind `Numerical`, not
    /// `Resources`.
    #[test]
    fn empty_rows_are_no_lack_of_memory() {
        let n = 20_usize;
        for empty in [0, 7, 19] {
            let tridiagonal = || {
                (0..n).flat_map(|i| {
                    (i.saturating_sub(1)..(i + 2).min(n)).map(move |j| (i, j, 3.0 - (i + j) as f64 % 2.0))
                })
            };
            let rows = SparseLu::new(n, tridiagonal().filter(|entry| entry.0 != empty));
            let columns = SparseLu::new(n, tridiagonal().filter(|entry| entry.1 != empty));
            for singular in [rows, columns] {
                let error = singular.err().expect("a singular matrix");
                assert_eq!(error.kind(), crate::error::ErrorKind::Numerical, "{error}");
            }
        }
    }

    /// Truth: the solutions x of an unsymmetric band matrix A satisfy A x = b. The tolerance 1e-12 allows for rounding.
    #[test]
    fn solutions_satisfy_the_equations() {
        let n = 70_usize;
        let entry = |i: usize, j: usize| -> f64 { if i == j { 4.0 } else { ((3 * i + j) as f64).sin() } };
        let band = || (0..n).flat_map(|i| (i.saturating_sub(2)..(i + 4).min(n)).map(move |j| (i, j)));
        let lu = SparseLu::new(n, band().map(|(i, j)| (i, j, entry(i, j)))).expect("a regular matrix");
        let rhs: Vec<f64> = (0..3 * n).map(|i| (i as f64).cos()).collect();
        let mut solutions = rhs.clone();
        lu.solve_in_place(&mut solutions, &mut lu.workspace().expect("memory"));
        for (x, b) in solutions.chunks_exact(n).zip(rhs.chunks_exact(n)) {
            let mut left = vec![0.0; n];
            band().for_each(|(i, j)| left[i] += entry(i, j) * x[j]);
            assert!(left.iter().zip(b).all(|(l, b)| (l - b).abs() < 1e-12));
        }
    }
}
