//! Least-squares solutions by the singular value decomposition of the library faer, for matrices of any rank.
//!
//! The decomposition of nalgebra is not used, because it loses ten decimal digits for some well-conditioned matrices
//! (see issue 1172 of dimforge/nalgebra).

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::linalg::svd::{self, ComputeSvdVectors};
use faer::{Mat, MatMut, MatRef, Par};
use nalgebra::DMatrix;

use crate::error::{Error, Result};

/// Moore-Penrose inverse A⁺ of A, `[n_columns, n_rows]`. A⁺ b is the least-squares solution of A x = b with the
/// smallest norm.
///
/// Singular values up to `tolerance` times the largest singular value count as zero.
///
/// # Errors
/// If the singular values do not converge, for example because an entry of the matrix is not finite.
pub(crate) fn pseudo_inverse(matrix: &DMatrix<f64>, tolerance: f64) -> Result<DMatrix<f64>> {
    let (m, n) = matrix.shape();
    let size = m.min(n);
    let (vectors, par) = (ComputeSvdVectors::Thin, Par::Seq);
    let (mut s, mut u, mut v) = (Mat::zeros(size, size), Mat::zeros(m, size), Mat::zeros(n, size));
    let mut memory = MemBuffer::new(StackReq::any_of(&[
        svd::svd_scratch::<f64>(m, n, vectors, vectors, par, Default::default()),
        svd::pseudoinverse_from_svd_scratch::<f64>(m, n, par),
    ]));
    let stack = MemStack::new(&mut memory);
    svd::svd(
        MatRef::from_column_major_slice(matrix.as_slice(), m, n),
        s.as_mut().diagonal_mut(),
        Some(u.as_mut()),
        Some(v.as_mut()),
        par,
        stack,
        Default::default(),
    )
    .map_err(|_| Error::numerical("the singular values of a least-squares fit do not converge"))?;
    let mut inverse = DMatrix::zeros(n, m);
    svd::pseudoinverse_from_svd_with_tolerance(
        MatMut::from_column_major_slice_mut(inverse.as_mut_slice(), n, m),
        s.as_ref().diagonal(),
        u.as_ref(),
        v.as_ref(),
        0.0,
        tolerance,
        par,
        stack,
    );
    Ok(inverse)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: A A⁺ A = A and A⁺ A A⁺ = A⁺ (Penrose 1955). The cases are tall, wide and singular matrices, some with
    /// equal singular values, and a matrix without rows. The tolerances allow for rounding.
    #[test]
    fn penrose_conditions() {
        let number = |k: usize| (k as f64 * 0.618_033_988_75).fract() - 0.5;
        let full = |m: usize, n: usize| DMatrix::from_fn(m, n, |i, j| number(7 * i + 3 * j + i * j + 1));
        // This matrix has many equal singular values.
        let monomials = DMatrix::from_fn(27, 10, |i, j| {
            let [x, y, z] = [i % 3, i / 3 % 3, i / 9].map(|k| k as f64 - 1.0);
            [1.0, x, y, z, x * x, y * y, z * z, y * z, x * z, x * y][j]
        });
        let singular = full(9, 2) * full(2, 5);
        for a in [full(12, 5), full(4, 7), monomials, singular, DMatrix::zeros(3, 2), DMatrix::zeros(0, 4)] {
            let inverse = pseudo_inverse(&a, 1e-9).unwrap();
            assert!((&a * &inverse * &a - &a).iter().all(|d| d.abs() < 1e-13), "{a}");
            assert!((&inverse * &a * &inverse - &inverse).iter().all(|d| d.abs() < 1e-12), "{a}");
        }
        assert!(pseudo_inverse(&DMatrix::from_element(3, 2, f64::NAN), 1e-9).is_err());
    }
}
