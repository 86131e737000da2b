//! Generalised minimal residual method (GMRES) with right preconditioning, for one or several right-hand sides: A X =
//! B.
//!
//! Each right-hand side has its own Krylov space. Each iteration applies A once to all columns.
//!
//! # Source
//! Saad and Schultz 1986, "GMRES: a generalized minimal residual algorithm for solving nonsymmetric linear systems".

use std::ops::Range;

use super::dense::try_zeroed;
use super::vector::{axpy, dot4};
use crate::cancel;
use crate::error::Result;

/// Linear system A x = b for a Krylov method. Vectors are `[n_columns, n]`, stored column by column.
pub trait LinearSystem {
    /// Computes `image = A x` for each column; overwrites `image`.
    fn apply(&mut self, x: &[f64], image: &mut [f64]);

    /// Computes `x ≈ A⁻¹ image` for each column; overwrites `x`.
    fn precondition(&mut self, image: &[f64], x: &mut [f64]);
}

/// Stopping criteria and restart length for [`Gmres::solve`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KrylovOptions {
    /// Relative residual |b - A x| / |b| to reach.
    pub tolerance: f64,
    /// Maximum number of products with A.
    pub max_products: usize,
    /// Number of basis vectors after which the iteration restarts.
    pub restart: usize,
}

/// Result of a solve for one column.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KrylovReport {
    /// Number of products with A for this column.
    pub n_products: usize,
    /// Relative residual |b - A x| / |b| from the recurrence; NaN if the right-hand side is not finite.
    pub residual: f64,
}

/// GMRES solver. It keeps the memory of the basis vectors for the next solve.
#[derive(Debug, Default)]
pub struct Gmres {
    /// Orthonormal bases of the Krylov spaces; `basis[k]` stores the k-th vectors of all columns.
    basis: Vec<Vec<f64>>,
}

/// Hessenberg matrix of one restart cycle, reduced to triangular form by Givens rotations.
struct Hessenberg {
    columns: Vec<Vec<f64>>,
    rotations: Vec<[f64; 2]>,
    /// Rotated right-hand side of the least-squares problem.
    rhs: Vec<f64>,
}

impl Hessenberg {
    fn new(norm: f64) -> Self {
        Self { columns: Vec::new(), rotations: Vec::new(), rhs: vec![norm] }
    }

    /// Appends a column and returns the new residual norm. The column has k + 2 entries, where k is the number of
    /// earlier columns.
    fn push(&mut self, mut column: Vec<f64>) -> f64 {
        let k = self.columns.len();
        for (i, [c, s]) in self.rotations.iter().enumerate() {
            let (a, b) = (column[i], column[i + 1]);
            (column[i], column[i + 1]) = (c * a + s * b, c * b - s * a);
        }
        let norm = column[k].hypot(column[k + 1]);
        let [c, s] = if norm > 0.0 { [column[k] / norm, column[k + 1] / norm] } else { [1.0, 0.0] };
        column[k] = norm;
        column.truncate(k + 1);
        let last = self.rhs[k];
        self.rhs[k] = c * last;
        self.rhs.push(-s * last);
        self.rotations.push([c, s]);
        self.columns.push(column);
        (s * last).abs()
    }

    /// Coefficients of the basis vectors that minimise the residual norm.
    fn solve(&self) -> Vec<f64> {
        let n = self.columns.len();
        let mut y = self.rhs[..n].to_vec();
        for i in (0..n).rev() {
            let diagonal = self.columns[i][i];
            y[i] = if diagonal == 0.0 { 0.0 } else { y[i] / diagonal };
            for j in 0..i {
                y[j] -= self.columns[i][j] * y[i];
            }
        }
        y
    }
}

struct Column {
    range: Range<usize>,
    /// Norm of the right-hand side.
    scale: f64,
    /// Residual norm at which the iteration of this column ends.
    goal: f64,
    report: KrylovReport,
    hessenberg: Hessenberg,
    /// Norm of the next basis vector before normalisation.
    length: f64,
    /// Whether the restart cycle adds further basis vectors to this column.
    open: bool,
    /// Whether the residual exceeds the goal at the end of the restart cycle.
    unsolved: bool,
}

impl Column {
    fn new(range: Range<usize>, rhs: &[f64], tolerance: f64) -> Self {
        let scale = norm4(&rhs[range.clone()]);
        let residual = match scale {
            0.0 => 0.0,
            scale if scale.is_finite() => 1.0,
            _ => f64::NAN,
        };
        Self {
            range,
            scale,
            goal: tolerance * scale,
            report: KrylovReport { n_products: 0, residual },
            hessenberg: Hessenberg::new(scale),
            length: scale,
            open: false,
            unsolved: false,
        }
    }

    fn start_cycle(&mut self, residual: &[f64]) {
        self.length = norm4(&residual[self.range.clone()]);
        self.hessenberg = Hessenberg::new(self.length);
        // A column is skipped if its residual is not finite.
        self.open = self.length.is_finite() && self.length > self.goal;
        self.unsolved = false;
    }

    /// Orthogonalises `image` against `basis`, and updates the residual. `image` is A times the preconditioned last
    /// vector of `basis`.
    fn orthogonalise(&mut self, basis: &[Vec<f64>], image: &mut [f64]) {
        let image = &mut image[self.range.clone()];
        let mut entries = Vec::with_capacity(basis.len() + 1);
        for vectors in basis {
            let vector = &vectors[self.range.clone()];
            let product = dot4(vector, image);
            axpy(image, -product, vector);
            entries.push(product);
        }
        self.length = norm4(image);
        entries.push(self.length);
        let reached = self.hessenberg.push(entries);
        self.report.n_products += 1;
        self.report.residual = reached / self.scale;
        self.unsolved = reached.is_finite() && reached > self.goal;
        self.open = self.unsolved && self.length != 0.0;
    }
}

fn norm4(values: &[f64]) -> f64 {
    dot4(values, values).sqrt()
}

impl Gmres {
    /// Solves A X = `rhs` for `n_columns` columns, starting from X = 0; overwrites `x`. Returns one report per column.
    ///
    /// # Errors
    /// If memory does not suffice, or the run is cancelled.
    pub fn solve(
        &mut self,
        system: &mut dyn LinearSystem,
        rhs: &[f64],
        x: &mut [f64],
        n_columns: usize,
        options: KrylovOptions,
    ) -> Result<Vec<KrylovReport>> {
        let n = rhs.len() / n_columns;
        x.fill(0.0);
        let mut columns: Vec<Column> =
            (0..n_columns).map(|j| Column::new(j * n..(j + 1) * n, rhs, options.tolerance)).collect();
        let [mut residual, mut step, mut image] =
            [try_zeroed(rhs.len())?, try_zeroed(rhs.len())?, try_zeroed(rhs.len())?];
        residual.copy_from_slice(rhs);
        let mut products = 0;
        while products < options.max_products {
            columns.iter_mut().for_each(|column| column.start_cycle(&residual));
            if !columns.iter().any(|column| column.open) {
                break;
            }
            self.store_basis_vectors(0, &residual, &columns)?;
            let length = options.restart.min(options.max_products - products);
            products += self.expand_bases(system, &mut columns, length, [&mut step, &mut image])?;
            self.combine_bases(&columns, &mut step);
            // Right preconditioning: the preconditioner acts on the linear combination of the basis vectors.
            system.precondition(&step, &mut image);
            axpy(x, 1.0, &image);
            if !columns.iter().any(|column| column.unsolved) || products >= options.max_products {
                break;
            }
            system.apply(x, &mut residual);
            products += 1;
            residual.iter_mut().zip(rhs).for_each(|(r, b)| *r = b - *r);
            for column in columns.iter_mut().filter(|column| column.unsolved) {
                column.report.n_products += 1;
            }
        }
        Ok(columns.into_iter().map(|column| column.report).collect())
    }

    /// Expands the bases of the open columns to at most `length` vectors. `step` and `image` are buffers. Returns the
    /// number of products with A.
    fn expand_bases(
        &mut self,
        system: &mut dyn LinearSystem,
        columns: &mut [Column],
        length: usize,
        [step, image]: [&mut [f64]; 2],
    ) -> Result<usize> {
        for k in 0..length {
            cancel::check()?;
            system.precondition(&self.basis[k], step);
            system.apply(step, image);
            for column in columns.iter_mut().filter(|column| column.open) {
                column.orthogonalise(&self.basis[..=k], image);
            }
            if !columns.iter().any(|column| column.open) {
                return Ok(k + 1);
            }
            self.store_basis_vectors(k + 1, image, columns)?;
        }
        Ok(length)
    }

    fn combine_bases(&self, columns: &[Column], combination: &mut [f64]) {
        combination.fill(0.0);
        for Column { range, hessenberg, .. } in columns {
            for (coefficient, vectors) in hessenberg.solve().iter().zip(&self.basis) {
                axpy(&mut combination[range.clone()], *coefficient, &vectors[range.clone()]);
            }
        }
    }

    /// Stores `vectors`, divided by the lengths of the columns, as basis vector `k` of the open columns. Columns that
    /// are not open get zeros.
    fn store_basis_vectors(&mut self, k: usize, vectors: &[f64], columns: &[Column]) -> Result<()> {
        if self.basis.len() <= k {
            self.basis.push(Vec::new());
        }
        let basis = &mut self.basis[k];
        if basis.capacity() < vectors.len() {
            *basis = try_zeroed(vectors.len())?;
        }
        basis.clear();
        for Column { range, length, open, .. } in columns {
            let scaled = |value: &f64| if *open { value / length } else { 0.0 };
            basis.extend(vectors[range.clone()].iter().map(scaled));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Unsymmetric tridiagonal matrix with the given number of rows. The preconditioner divides by the diagonal of the matrix.
    struct Tridiagonal(usize);

    impl LinearSystem for Tridiagonal {
        fn apply(&mut self, x: &[f64], image: &mut [f64]) {
            for (x, image) in x.chunks_exact(self.0).zip(image.chunks_exact_mut(self.0)) {
                for i in 0..x.len() {
                    let before = if i > 0 { x[i - 1] } else { 0.0 };
                    let after = if i + 1 < x.len() { x[i + 1] } else { 0.0 };
                    image[i] = (3.0 + i as f64) * x[i] - 1.5 * before + 0.5 * after;
                }
            }
        }

        fn precondition(&mut self, image: &[f64], x: &mut [f64]) {
            x.iter_mut().zip(image).enumerate().for_each(|(i, (x, b))| *x = b / (3.0 + (i % self.0) as f64));
        }
    }

    /// Truth: residuals that are computed with the matrix itself are at most twice the tolerance, with and without
    /// restarts. A zero right-hand side has the solution zero. A column that is solved alone has the same solution.
    #[test]
    fn residuals_are_what_the_matrix_says() {
        let n = 40;
        let entry = |k: usize| if k < 2 * n { (k as f64 * (1.0 + (k / n) as f64)).sin() } else { 0.0 };
        let rhs: Vec<f64> = (0..3 * n).map(entry).collect();
        for restart in [5, 60] {
            let options = KrylovOptions { tolerance: 1e-12, max_products: 400, restart };
            let (mut x, mut image) = (vec![1.0; 3 * n], vec![0.0; 3 * n]);
            let reports = Gmres::default().solve(&mut Tridiagonal(n), &rhs, &mut x, 3, options).unwrap();
            Tridiagonal(n).apply(&x, &mut image);
            image.iter_mut().zip(&rhs).for_each(|(i, b)| *i -= b);
            for (j, report) in reports.iter().enumerate().take(2) {
                let of = |values: &[f64]| dot4(&values[j * n..][..n], &values[j * n..][..n]).sqrt();
                let residual = of(&image) / of(&rhs);
                assert!(residual < 2e-12, "{restart}: {residual}");
                assert!(report.residual <= 1e-12 && report.n_products > 3, "{report:?}");
            }
            assert!(x[2 * n..].iter().all(|x| *x == 0.0) && reports[2].n_products == 0);
            let mut alone = vec![0.0; n];
            let report =
                Gmres::default().solve(&mut Tridiagonal(n), &rhs[..n], &mut alone, 1, options).unwrap()[0];
            assert!(report.residual <= 1e-12 && alone.iter().zip(&x).all(|(a, b)| (a - b).abs() < 1e-11));
        }
    }

    /// Truth: a column with NaN reports the residual NaN. The second column is still solved. Its exact solution follows
    /// from the equations 3 x + 0.5 y = 6 and -1.5 x + 4 y = 2.5.
    #[test]
    fn nonsense_is_told() {
        let options = KrylovOptions { tolerance: 1e-12, max_products: 400, restart: 10 };
        let mut x = [1.0; 4];
        let rhs = [f64::NAN, 1.0, 6.0, 2.5];
        let reports = Gmres::default().solve(&mut Tridiagonal(2), &rhs, &mut x, 2, options).unwrap();
        assert!(reports[0].residual.is_nan());
        let [y, z] = [2.0 - 11.0 / 51.0, 22.0 / 17.0];
        assert!((x[2] - y).abs() < 1e-10 && (x[3] - z).abs() < 1e-10, "{x:?}");
    }
}
