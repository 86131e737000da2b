//! Generalised minimal residuals with a preconditioner on the right.
//!
//! # Source
//! Saad and Schultz 1986, "GMRES: a generalized minimal residual algorithm for solving nonsymmetric linear systems".

use super::vector::{axpy, dot4};

/// A linear system by what a Krylov method asks of it.
pub trait LinearSystem {
    /// `image = A x`; overwrites.
    fn apply(&mut self, x: &[f64], image: &mut [f64]);

    /// `x` about A⁻¹ `image`; overwrites.
    fn precondition(&mut self, image: &[f64], x: &mut [f64]);
}

/// When to stop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KrylovOptions {
    /// Residual over that of x = 0.
    pub tolerance: f64,
    /// Products with A at most.
    pub max_products: usize,
    /// Vectors kept before a restart.
    pub restart: usize,
}

/// What a solve did.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KrylovReport {
    /// Products with A.
    pub n_products: usize,
    /// Residual over that of x = 0, by the recurrence.
    pub residual: f64,
}

/// Vectors of a solve, kept from one to the next.
#[derive(Debug, Default)]
pub struct Gmres {
    /// Orthonormal basis of the Krylov space.
    basis: Vec<Vec<f64>>,
    work: Vec<f64>,
}

/// The rotated Hessenberg matrix of one cycle.
pub(super) struct Hessenberg {
    /// Columns of the triangle.
    columns: Vec<Vec<f64>>,
    rotations: Vec<[f64; 2]>,
    /// Rotated right-hand side.
    rhs: Vec<f64>,
}

impl Hessenberg {
    pub fn new(norm: f64) -> Self {
        Self { columns: Vec::new(), rotations: Vec::new(), rhs: vec![norm] }
    }

    /// Adds a column of length k + 2; the residual norm after it.
    pub fn push(&mut self, mut column: Vec<f64>) -> f64 {
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

    /// Coefficients of the basis that minimise the residual.
    pub fn solve(&self) -> Vec<f64> {
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

impl Gmres {
    /// Solves A x = `rhs` from x = 0; `x` is overwritten.
    pub fn solve(
        &mut self,
        system: &mut dyn LinearSystem,
        rhs: &[f64],
        x: &mut [f64],
        options: KrylovOptions,
    ) -> KrylovReport {
        let n = rhs.len();
        x.fill(0.0);
        let scale = dot4(rhs, rhs).sqrt();
        let mut report = KrylovReport { n_products: 0, residual: 1.0 };
        if scale == 0.0 || !scale.is_finite() {
            report.residual = if scale == 0.0 { 0.0 } else { f64::NAN };
            return report;
        }
        self.work.resize(n, 0.0);
        let mut residual = rhs.to_vec();
        while report.n_products < options.max_products {
            let norm = dot4(&residual, &residual).sqrt();
            let goal = options.tolerance * scale;
            if norm <= goal || !norm.is_finite() {
                break;
            }
            self.store_basis_vector(0, &residual, norm);
            let most = options.restart.min(options.max_products - report.n_products);
            let (hessenberg, reached) = self.cycle(system, norm, goal, most);
            report.n_products += hessenberg.columns.len();
            report.residual = reached / scale;
            self.work.fill(0.0);
            for (coefficient, vector) in hessenberg.solve().iter().zip(&self.basis) {
                axpy(&mut self.work, *coefficient, vector);
            }
            // Right preconditioning: the solution is the preconditioned combination.
            let mut step = std::mem::take(&mut residual);
            system.precondition(&self.work, &mut step);
            axpy(x, 1.0, &step);
            residual = step;
            if reached <= goal || report.n_products >= options.max_products || !reached.is_finite() {
                break;
            }
            system.apply(x, &mut residual);
            report.n_products += 1;
            residual.iter_mut().zip(rhs).for_each(|(r, b)| *r = b - *r);
        }
        report
    }

    /// Basis vector `k` := `vector` / `norm`.
    fn store_basis_vector(&mut self, k: usize, vector: &[f64], norm: f64) {
        if self.basis.len() <= k {
            self.basis.push(Vec::new());
        }
        let scaled = vector.iter().map(|value| value / norm);
        self.basis[k].clear();
        self.basis[k].extend(scaled);
    }

    /// Arnoldi steps from the first basis vector until the residual is below `goal`; the residual's norm.
    fn cycle(
        &mut self,
        system: &mut dyn LinearSystem,
        norm: f64,
        goal: f64,
        most: usize,
    ) -> (Hessenberg, f64) {
        let mut hessenberg = Hessenberg::new(norm);
        let mut image = vec![0.0; self.work.len()];
        let mut reached = norm;
        for k in 0..most {
            system.precondition(&self.basis[k], &mut self.work);
            system.apply(&self.work, &mut image);
            let mut column = Vec::with_capacity(k + 2);
            for vector in &self.basis[..=k] {
                let product = dot4(vector, &image);
                axpy(&mut image, -product, vector);
                column.push(product);
            }
            let length = dot4(&image, &image).sqrt();
            column.push(length);
            reached = hessenberg.push(column);
            if reached <= goal || !reached.is_finite() || length == 0.0 {
                break;
            }
            self.store_basis_vector(k + 1, &image, length);
        }
        (hessenberg, reached)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A tridiagonal matrix that is not symmetric, with its diagonal as preconditioner.
    struct Tridiagonal;

    impl LinearSystem for Tridiagonal {
        fn apply(&mut self, x: &[f64], image: &mut [f64]) {
            for i in 0..x.len() {
                let before = if i > 0 { x[i - 1] } else { 0.0 };
                let after = if i + 1 < x.len() { x[i + 1] } else { 0.0 };
                image[i] = (3.0 + i as f64) * x[i] - 1.5 * before + 0.5 * after;
            }
        }

        fn precondition(&mut self, image: &[f64], x: &mut [f64]) {
            x.iter_mut().zip(image).enumerate().for_each(|(i, (x, b))| *x = b / (3.0 + i as f64));
        }
    }

    /// Truth: the residual by the matrix itself, with and without restarts.
    #[test]
    fn residual_is_what_the_matrix_says() {
        let rhs: Vec<f64> = (0..40).map(|i| (i as f64).sin()).collect();
        for restart in [5, 60] {
            let options = KrylovOptions { tolerance: 1e-12, max_products: 400, restart };
            let (mut x, mut image) = (vec![1.0; 40], vec![0.0; 40]);
            let report = Gmres::default().solve(&mut Tridiagonal, &rhs, &mut x, options);
            Tridiagonal.apply(&x, &mut image);
            image.iter_mut().zip(&rhs).for_each(|(i, b)| *i -= b);
            let residual = dot4(&image, &image).sqrt() / dot4(&rhs, &rhs).sqrt();
            assert!(residual < 2e-12 && report.residual < 1e-12, "{restart}: {residual} {report:?}");
        }
    }

    /// Truth: x = 0 solves A x = 0; a right-hand side that is not a number is told.
    #[test]
    fn nothing_and_nonsense() {
        let options = KrylovOptions { tolerance: 1e-12, max_products: 40, restart: 10 };
        let mut x = vec![1.0; 4];
        let report = Gmres::default().solve(&mut Tridiagonal, &[0.0; 4], &mut x, options);
        assert_eq!((report.n_products, x), (0, vec![0.0; 4]));
        let report = Gmres::default().solve(&mut Tridiagonal, &[f64::NAN; 4], &mut [0.0; 4], options);
        assert!(report.residual.is_nan());
    }
}
