//! Dense LU factorisation with row exchanges, by the library faer. The caller must check the residuals of solutions.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::lu::partial_pivoting::factor::{lu_in_place, lu_in_place_scratch};
use faer::linalg::lu::partial_pivoting::solve::{solve_in_place, solve_in_place_scratch};
use faer::perm::PermRef;
use faer::{MatMut, MatRef, Par};

use super::dense_matrix::DenseMatrix;
use crate::error::{Error, Result};

/// LU factorisation P A = L U of a square matrix A, with the row permutation P.
pub struct DenseLu {
    /// L below the diagonal (unit diagonal not stored), U on and above the diagonal.
    factors: DenseMatrix,
    forward: Vec<usize>,
    backward: Vec<usize>,
}

/// Estimate of the buffer memory, bytes, that matrix products use while a matrix of `bytes` bytes is factorised.
///
/// faer requests 67 MB for large matrices, but products were measured to use only 15 to 17 MB (docs/memory.md).
pub(crate) fn product_buffer_bytes(bytes: u128) -> u128 {
    (bytes / 4).min(16_000_000)
}

fn out_of_memory() -> Error {
    Error::resources("not enough memory for a dense factorisation")
}

impl DenseLu {
    /// Factorises a matrix. The factors are stored in the memory of the matrix.
    ///
    /// The caller must scale rows and columns so that the entries have similar size. The matrix counts as singular if
    /// its smallest pivot is at most the machine epsilon times its largest pivot, or if a pivot is NaN.
    ///
    /// # Errors
    /// If memory does not suffice, or the matrix is singular.
    pub fn new(mut matrix: DenseMatrix, par: Par) -> Result<Self> {
        let n = matrix.n_rows();
        let (mut forward, mut backward) = (vec![0; n], vec![0; n]);
        let request = lu_in_place_scratch::<usize, f64>(n, n, par, Default::default());
        let mut memory = MemBuffer::try_new(request).map_err(|_| out_of_memory())?;
        lu_in_place(
            MatMut::from_column_major_slice_mut(matrix.values_mut(), n, n),
            &mut forward,
            &mut backward,
            par,
            MemStack::new(&mut memory),
            Default::default(),
        );
        let pivots = || (0..n).map(|k| matrix.at(k, k).abs());
        let (least, most) = pivots().fold((f64::INFINITY, 0.0_f64), |(l, m), p| (l.min(p), m.max(p)));
        if pivots().any(f64::is_nan) || least <= f64::EPSILON * most {
            return Err(Error::numerical("the equations are singular: a body is not fixed"));
        }
        Ok(Self { factors: matrix, forward, backward })
    }

    /// Solves A X = B in place. `columns` is B on entry and X on return. For a single column, the last bits of X depend
    /// on the number of threads in `par`.
    ///
    /// # Errors
    /// If memory does not suffice.
    pub fn solve_in_place(&self, columns: &mut DenseMatrix, par: Par) -> Result<()> {
        let n = self.factors.n_rows();
        let count = columns.n_columns();
        let request = solve_in_place_scratch::<usize, f64>(n, count, par);
        let mut memory = MemBuffer::try_new(request).map_err(|_| out_of_memory())?;
        let factors = MatRef::from_column_major_slice(self.factors.values(), n, n);
        solve_in_place(
            factors,
            factors,
            PermRef::new_checked(&self.forward, &self.backward, n),
            MatMut::from_column_major_slice_mut(columns.values_mut(), n, count),
            par,
            MemStack::new(&mut memory),
        );
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: columns that were multiplied by the matrix are the solutions. A matrix of rank one and a matrix of NaN
    /// are refused. The tolerance 1e-11 of the solution allows for rounding.
    #[test]
    fn known_columns() {
        let n = 40;
        let entry =
            |i: usize, j: usize| ((i * 7 + j * 13) % 11) as f64 - 5.0 + if i == j { 9.0 } else { 0.0 };
        let values = (0..n * n).map(|k| entry(k % n, k / n)).collect();
        let matrix = DenseMatrix::from_values(n, n, values);
        let known = |k: usize| (k as f64 * 0.37).sin();
        let mut columns = DenseMatrix::zeros(n, 2).unwrap();
        for c in 0..2 {
            for i in 0..n {
                columns.values_mut()[c * n + i] = (0..n).map(|j| entry(i, j) * known(j + 100 * c)).sum();
            }
        }
        let lu = DenseLu::new(matrix, Par::Seq).unwrap();
        lu.solve_in_place(&mut columns, Par::Seq).unwrap();
        for (k, value) in columns.values().iter().enumerate() {
            assert!((value - known(k % n + 100 * (k / n))).abs() < 1e-11, "{k}");
        }
        let single = DenseMatrix::from_values(n, n, (0..n * n).map(|k| (1 + k % n) as f64).collect());
        assert!(DenseLu::new(single, Par::Seq).is_err());
        assert!(DenseLu::new(DenseMatrix::from_values(n, n, vec![f64::NAN; n * n]), Par::Seq).is_err());
    }
}
