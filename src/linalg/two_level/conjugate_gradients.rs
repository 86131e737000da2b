//! Preconditioned conjugate gradients for several right-hand sides at once. Each right-hand side has its own step
//! lengths.

use super::coarse::CoarseVectors;
use super::node_matrix::{LANES, Lanes};
use super::system::{MAX_ENERGY_ERROR, SLOW_OR_SINGULAR, TwoLevelSolver};
use crate::cancel;
use crate::error::{Error, Result};
use crate::linalg::vector::nan_max;

const MAX_ITERATIONS: usize = 2000;

/// Number of latest steps from which the error is estimated.
const ERROR_ESTIMATE_STEPS: usize = 5;

/// Vectors of the iteration, `[3 n]` each, for [`LANES`] right-hand sides.
pub(super) struct CgVectors {
    /// Right-hand sides before [`Self::solve`], residuals afterwards.
    pub residual: Vec<Lanes>,
    pub solution: Vec<Lanes>,
    direction: Vec<Lanes>,
    image: Vec<Lanes>,
    preconditioned: Vec<Lanes>,
    coarse: CoarseVectors,
}

/// Convergence of the iteration.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Convergence {
    /// Number of iterations. For several systems, the largest number.
    pub iterations: usize,
    /// Estimated relative error in the energy norm. For several systems, the largest error.
    pub error: f64,
}

impl CgVectors {
    pub fn bytes(n: usize, n_coarse: usize) -> usize {
        8 * LANES * (5 * 3 * n + 2 * n_coarse)
    }

    pub fn new(solver: &TwoLevelSolver) -> Self {
        let zeros = || vec![[0.0; LANES]; 3 * solver.matrix.n()];
        Self {
            residual: zeros(),
            solution: zeros(),
            direction: zeros(),
            image: zeros(),
            preconditioned: zeros(),
            coarse: CoarseVectors::new(&solver.coarse),
        }
    }

    /// Solves A x = b for the right-hand sides in `residual`. The iteration stops at an estimated relative error of
    /// `MAX_ENERGY_ERROR` in the energy norm.
    ///
    /// The estimate of the squared error is the energy gained in the last steps, divided by the energy of the solution.
    ///
    /// # Source
    /// Hestenes and Stiefel (1952), J. Res. Nat. Bur. Standards 49; Strakoš and Tichý (2002), ETNA 13.
    pub fn solve(&mut self, solver: &TwoLevelSolver) -> Result<Convergence> {
        let mut energy = self.begin(solver)?;
        let mut products = [0.0; LANES];
        let mut taken = [[0.0; LANES]; ERROR_ESTIMATE_STEPS];
        let mut error = f64::INFINITY;
        for iteration in 0..MAX_ITERATIONS {
            cancel::check()?;
            self.precondition(solver)?;
            let new = dot(&self.residual, &self.preconditioned);
            let ratio: Lanes = std::array::from_fn(|l| quotient(new[l], products[l]));
            combine(&mut self.direction, &self.preconditioned, &ratio);
            products = new;
            solver.matrix.multiply(&self.direction, &mut self.image);
            let curvature = dot(&self.direction, &self.image);
            let step: Lanes = std::array::from_fn(|l| quotient(products[l], curvature[l]));
            advance(&mut self.solution, &self.direction, &step);
            advance(&mut self.residual, &self.image, &step.map(|s| -s));
            let gain: Lanes = std::array::from_fn(|l| step[l] * products[l]);
            (0..LANES).for_each(|l| energy[l] += gain[l]);
            taken[iteration % ERROR_ESTIMATE_STEPS] = gain;
            let left = |l: usize| taken.iter().map(|gain| gain[l]).sum::<f64>();
            error = (0..LANES).map(|l| quotient(left(l), energy[l])).fold(0.0, nan_max).sqrt();
            if !error.is_finite() {
                return Err(not_converged(iteration + 1, error));
            }
            if iteration + 1 >= ERROR_ESTIMATE_STEPS && error <= MAX_ENERGY_ERROR {
                return Ok(Convergence { iterations: iteration + 1, error });
            }
        }
        Err(not_converged(MAX_ITERATIONS, error))
    }

    /// Largest relative residual |A x - b| / |b| of the solutions, recomputed with A. The closure `subtract` subtracts
    /// the right-hand sides b.
    pub fn true_residual(&mut self, solver: &TwoLevelSolver, subtract: impl Fn(&mut [Lanes])) -> f64 {
        solver.matrix.multiply(&self.solution, &mut self.image);
        subtract(&mut self.image);
        self.residual.fill([0.0; LANES]);
        subtract(&mut self.residual);
        let (left, whole) = (dot(&self.image, &self.image), dot(&self.residual, &self.residual));
        (0..LANES).map(|l| quotient(left[l], whole[l])).fold(0.0, nan_max).sqrt()
    }

    /// Computes the best solution in the coarse space as the initial solution, which the preconditioner requires.
    /// Returns the energy of this solution.
    fn begin(&mut self, solver: &TwoLevelSolver) -> Result<Lanes> {
        self.solution.fill([0.0; LANES]);
        self.direction.fill([0.0; LANES]);
        solver.coarse.add_correction(&self.residual, &mut self.solution, &mut self.coarse)?;
        let energy = dot(&self.residual, &self.solution);
        solver.matrix.multiply(&self.solution, &mut self.image);
        advance(&mut self.residual, &self.image, &[-1.0; LANES]);
        Ok(energy)
    }

    fn precondition(&mut self, solver: &TwoLevelSolver) -> Result<()> {
        let Self { residual, preconditioned, image, coarse, .. } = self;
        solver.smoother.apply(&solver.matrix, residual, preconditioned, image);
        solver.coarse.add_correction(residual, preconditioned, coarse)
    }
}

fn not_converged(iterations: usize, error: f64) -> Error {
    Error::not_converged(format!(
        "conjugate gradients did not converge in {iterations} iterations (relative error {error:.1e}, required {MAX_ENERGY_ERROR:.0e}): {SLOW_OR_SINGULAR}"
    ))
}

/// `a / b`, or 0 if `a` or `b` is 0. A zero means that this vector has no right-hand side, or that its solution is
/// already found.
fn quotient(a: f64, b: f64) -> f64 {
    if a == 0.0 || b == 0.0 { 0.0 } else { a / b }
}

fn dot(a: &[Lanes], b: &[Lanes]) -> Lanes {
    let mut sum = [0.0; LANES];
    for (a, b) in a.iter().zip(b) {
        (0..LANES).for_each(|l| sum[l] += a[l] * b[l]);
    }
    sum
}

/// Computes `p = z + ratio p`.
fn combine(p: &mut [Lanes], z: &[Lanes], ratio: &Lanes) {
    for (p, z) in p.iter_mut().zip(z) {
        (0..LANES).for_each(|l| p[l] = z[l] + ratio[l] * p[l]);
    }
}

/// Computes `x += step p`.
fn advance(x: &mut [Lanes], p: &[Lanes], step: &Lanes) {
    for (x, p) in x.iter_mut().zip(p) {
        (0..LANES).for_each(|l| x[l] += step[l] * p[l]);
    }
}
