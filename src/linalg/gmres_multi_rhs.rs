//! Generalised minimal residuals for several right sides side by side, each in a Krylov space of its own, with a preconditioner on the
//! right: the matrix is read once for all of them.
//!
//! # Source
//! Saad and Schultz 1986, "GMRES: a generalized minimal residual algorithm for solving nonsymmetric linear systems".

use super::dense_matrix::DenseMatrix;
use super::gmres::{Hessenberg, KrylovOptions, KrylovReport};
use super::vector::{axpy, dot4};
use crate::cancel;
use crate::error::Result;

/// A linear system by what Krylov methods for several right sides ask of it.
pub trait MultiRhsSystem {
    /// `image = A x` of each column; overwrites.
    fn apply(&mut self, x: &DenseMatrix, image: &mut DenseMatrix);

    /// `x` about A⁻¹ `image` of each column; overwrites.
    fn precondition(&mut self, image: &DenseMatrix, x: &mut DenseMatrix);
}

/// Solves A X = B from X = 0; `columns` are B and become X. What was done for each column.
///
/// # Errors
/// If memory does not suffice, or a stop is wished.
pub fn solve_multi_rhs(
    system: &mut dyn MultiRhsSystem,
    columns: &mut DenseMatrix,
    options: KrylovOptions,
) -> Result<Vec<KrylovReport>> {
    let (n, count) = (columns.n_rows(), columns.n_columns());
    let norms = |columns: &DenseMatrix| -> Vec<f64> {
        (0..count).map(|j| dot4(columns.column(j), columns.column(j)).sqrt()).collect()
    };
    let scales = norms(columns);
    let mut reports = vec![KrylovReport { n_products: 0, residual: 0.0 }; count];
    let mut residual = columns.clone();
    columns.values_mut().fill(0.0);
    let mut basis: Vec<DenseMatrix> = Vec::new();
    let mut work = [DenseMatrix::zeros(n, count)?, DenseMatrix::zeros(n, count)?];
    let mut products = 0;
    loop {
        let starts = norms(&residual);
        let goals: Vec<f64> = scales.iter().map(|scale| options.tolerance * scale).collect();
        for (j, report) in reports.iter_mut().enumerate().filter(|(j, _)| scales[*j] != 0.0) {
            report.residual = starts[j] / scales[j];
        }
        // A column that is not a number is left as it is, and told by its residual.
        let mut open: Vec<bool> = (0..count).map(|j| starts[j] > goals[j]).collect();
        if open.iter().all(|open| !open) || products >= options.max_products {
            return Ok(reports);
        }
        store_basis_vectors(&mut basis, 0, &residual, |j| if open[j] { 1.0 / starts[j] } else { 0.0 })?;
        let mut hessenbergs: Vec<Hessenberg> = starts.iter().map(|start| Hessenberg::new(*start)).collect();
        for k in 0..options.restart.min(options.max_products - products) {
            cancel::check()?;
            let [step, image] = &mut work;
            system.precondition(&basis[k], step);
            system.apply(step, image);
            products += 1;
            let mut lengths = vec![0.0; count];
            for j in 0..count {
                if !open[j] {
                    continue;
                }
                reports[j].n_products += 1;
                let image = image.column_mut(j);
                let mut column = Vec::with_capacity(k + 2);
                for vectors in &basis[..=k] {
                    let product = dot4(vectors.column(j), image);
                    axpy(image, -product, vectors.column(j));
                    column.push(product);
                }
                lengths[j] = dot4(image, image).sqrt();
                column.push(lengths[j]);
                let reached = hessenbergs[j].push(column);
                open[j] = reached > goals[j] && lengths[j] > 0.0;
            }
            if open.iter().all(|open| !open) {
                break;
            }
            store_basis_vectors(&mut basis, k + 1, image, |j| if open[j] { 1.0 / lengths[j] } else { 0.0 })?;
        }
        let [step, image] = &mut work;
        step.values_mut().fill(0.0);
        for (j, hessenberg) in hessenbergs.iter().enumerate() {
            for (coefficient, vectors) in hessenberg.solve().iter().zip(&basis) {
                axpy(step.column_mut(j), *coefficient, vectors.column(j));
            }
        }
        // Right preconditioning: the solution is the preconditioned combination.
        system.precondition(step, image);
        columns.add_scaled(1.0, image);
        // The residual afresh, from which the next cycle starts if one is still too large.
        system.apply(image, step);
        residual.add_scaled(-1.0, step);
    }
}

/// Basis vectors `k` := those `vectors` times `factor`.
fn store_basis_vectors(
    basis: &mut Vec<DenseMatrix>,
    k: usize,
    vectors: &DenseMatrix,
    factor: impl Fn(usize) -> f64,
) -> Result<()> {
    if basis.len() <= k {
        basis.push(DenseMatrix::zeros(vectors.n_rows(), vectors.n_columns())?);
    }
    for j in 0..vectors.n_columns() {
        let factor = factor(j);
        let to = basis[k].column_mut(j).iter_mut();
        // Nothing of a column that is closed, which may not be numbers.
        to.zip(vectors.column(j))
            .for_each(|(to, value)| *to = if factor == 0.0 { 0.0 } else { factor * value });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A tridiagonal matrix that is not symmetric, with its diagonal as preconditioner.
    struct Tridiagonal;

    impl MultiRhsSystem for Tridiagonal {
        fn apply(&mut self, x: &DenseMatrix, image: &mut DenseMatrix) {
            let n = x.n_rows();
            for j in 0..x.n_columns() {
                let x = x.column(j);
                for i in 0..n {
                    let [before, after] = [i.checked_sub(1), Some(i + 1).filter(|i| *i < n)];
                    let other = |i: Option<usize>| i.map_or(0.0, |i| x[i]);
                    image.column_mut(j)[i] =
                        (3.0 + i as f64) * x[i] - 1.5 * other(before) + 0.5 * other(after);
                }
            }
        }

        fn precondition(&mut self, image: &DenseMatrix, x: &mut DenseMatrix) {
            for j in 0..image.n_columns() {
                let pairs = x.column_mut(j).iter_mut().zip(image.column(j)).enumerate();
                pairs.for_each(|(i, (x, b))| *x = b / (3.0 + i as f64));
            }
        }
    }

    /// Truth: the residual by the matrix itself, with and without restarts; a column of zeros has the solution zero, and one that is
    /// not a number is told.
    #[test]
    fn residuals_are_what_the_matrix_says() {
        let n = 40;
        let entry = |k: usize| if k < 2 * n { (k as f64 * (1.0 + (k / n) as f64)).sin() } else { 0.0 };
        let right = DenseMatrix::from_values(n, 3, (0..3 * n).map(entry).collect());
        for restart in [5, 60] {
            let options = KrylovOptions { tolerance: 1e-12, max_products: 400, restart };
            let mut columns = right.clone();
            let reports = solve_multi_rhs(&mut Tridiagonal, &mut columns, options).unwrap();
            let mut image = DenseMatrix::zeros(n, 3).unwrap();
            Tridiagonal.apply(&columns, &mut image);
            image.add_scaled(-1.0, &right);
            for (j, report) in reports.iter().enumerate().take(2) {
                let residual = dot4(image.column(j), image.column(j)).sqrt();
                assert!(
                    residual < 2e-12 * dot4(right.column(j), right.column(j)).sqrt(),
                    "{restart}: {residual}"
                );
                assert!(report.residual <= 1e-12 && report.n_products > 3, "{report:?}");
            }
            assert!(columns.column(2).iter().all(|x| *x == 0.0) && reports[2].n_products == 0);
        }
        let options = KrylovOptions { tolerance: 1e-12, max_products: 400, restart: 10 };
        let mut columns = DenseMatrix::from_values(2, 2, vec![f64::NAN, 1.0, 6.0, 2.5]);
        let reports = solve_multi_rhs(&mut Tridiagonal, &mut columns, options).unwrap();
        assert!(reports[0].residual.is_nan());
        // 3 x + 0.5 y = 6, -1.5 x + 4 y = 2.5.
        let [x, y] = [2.0 - 11.0 / 51.0, 22.0 / 17.0];
        assert!((columns.at(0, 1) - x).abs() < 1e-10 && (columns.at(1, 1) - y).abs() < 1e-10, "{columns:?}");
    }
}
