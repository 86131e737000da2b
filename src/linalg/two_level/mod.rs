//! Preconditioned conjugate gradients ([`TwoLevelSolver`]) for a stiffness matrix A that is too large to be factorised.
//!
//! The preconditioner is `M⁻¹ + Z E⁻¹ Zᵀ (1 - A M⁻¹)` with E = Zᵀ A Z (adapted deflation, A-DEF2). The mesh is divided
//! into many small parts, and the columns of Z are the rigid motions of these parts. M⁻¹ is a symmetric Gauss-Seidel
//! sweep. M⁻¹ reduces errors that vary inside a part. Z E⁻¹ Zᵀ reduces errors that extend over many parts.
//!
//! # Source
//! Nicolaides (1987), SIAM J. Numer. Anal. 24 (deflation); Tang, Nabben, Vuik and Erlangga (2009), J. Sci. Comput. 39
//! (A-DEF2); Jönsthövel, van Gijzen, MacLachlan, Vuik and Scarpas (2012), Comput. Mech. 50 (rigid motions of parts).

mod coarse;
mod conjugate_gradients;
mod node_matrix;
mod smoother;
mod system;

use rayon::prelude::*;

use self::system::SLOW_OR_SINGULAR;
use super::cholesky::SymmetricSolver;
use super::dense::SymmetricDense;
use super::sparse::SymmetricSparse;
use crate::error::{Error, Result};
use crate::linalg::vector::nan_max;

use coarse::CoarseSpace;
use conjugate_gradients::CgVectors;
use node_matrix::{LANES, NodeMatrix};
use smoother::GaussSeidel;

pub use conjugate_gradients::Convergence;
pub use node_matrix::NodalUnknowns;
pub use system::TwoLevelSolver;

/// Maximum relative residual of a solution.
const RESIDUAL_LIMIT: f64 = 1e-7;

/// Memory per stored entry of the matrix, bytes, including the neighbour lists during construction.
const BYTES_PER_ENTRY: usize = 15;

/// Memory per node, bytes, including the motions and their forces.
const BYTES_PER_NODE: usize = 2200;

/// Estimated memory of the coarse factor and its workspace: this factor times n^(4/3) bytes for n coarse unknowns.
const COARSE_BYTES_FACTOR: f64 = 500.0;

/// Block of the inverse of A, and the convergence of its computation.
pub struct InverseBlock {
    /// (A⁻¹)_cc for the requested rows c, `[n_c, n_c]`.
    pub values: SymmetricDense,
    /// Number of iterations and estimated error.
    pub convergence: Convergence,
    /// Largest relative residual of a column. It is recomputed from the solution.
    pub residual: f64,
}

/// Approximate number of nodes of a part. Smaller parts need fewer iterations, but a larger coarse factor.
fn nodes_per_part(n_nodes: usize) -> usize {
    (1.2 * (n_nodes as f64).cbrt()).max(32.0) as usize
}

impl TwoLevelSolver {
    /// Upper estimate of the peak memory, bytes, including solves with `n_batches` batches of eight right-hand sides.
    /// `n_stored` is the number of entries in one triangle of the matrix.
    pub fn memory_bytes(n_stored: usize, n_nodes: usize, n_batches: usize) -> usize {
        let n_coarse = 6 * n_nodes.div_ceil(nodes_per_part(n_nodes));
        let side_by_side = n_batches.clamp(1, rayon::current_num_threads());
        BYTES_PER_ENTRY * n_stored
            + BYTES_PER_NODE * n_nodes
            + (COARSE_BYTES_FACTOR * (n_coarse as f64).powf(4.0 / 3.0)) as usize
            + side_by_side * CgVectors::bytes(n_nodes, n_coarse)
    }

    /// Builds the solver for `matrix`. `unknowns` gives the node and the displacement component of each row.
    ///
    /// # Errors
    /// If memory does not suffice, METIS fails, or the run is cancelled. Also if a diagonal block of a node or the
    /// coarse matrix is not positive definite.
    ///
    /// # Panics
    /// If the numbers of rows of `unknowns` and `matrix` differ.
    pub fn new(matrix: &SymmetricSparse, unknowns: &NodalUnknowns) -> Result<Self> {
        assert_eq!(matrix.n(), unknowns.of_row.len(), "a node for every row");
        let matrix = NodeMatrix::new(matrix, unknowns)?;
        let smoother = GaussSeidel::new(&matrix)?;
        let coarse = CoarseSpace::new(&matrix, nodes_per_part(matrix.n()))?;
        Ok(Self { matrix, smoother, coarse })
    }

    /// Block (A⁻¹)_cc of the inverse for the rows c in `rows`.
    ///
    /// The bits are the same for any number of threads.
    ///
    /// # Errors
    /// If memory does not suffice, the iteration does not converge (kind `NotConverged`), or the run is cancelled.
    pub fn inverse_block(&self, rows: &[usize]) -> Result<InverseBlock> {
        let n = rows.len();
        let mut values = SymmetricDense::zeros(n)?;
        let batches = values.values_mut().par_chunks_mut((LANES * n).max(1)).zip(rows.par_chunks(LANES));
        let reports: Result<Vec<(Convergence, f64)>> = batches
            .map_init(
                || CgVectors::new(self),
                |vectors, (columns, batch)| {
                    vectors.residual.fill([0.0; LANES]);
                    for (lane, &row) in batch.iter().enumerate() {
                        vectors.residual[self.matrix.position_of_row[row]][lane] = 1.0;
                    }
                    let convergence = vectors.solve(self)?;
                    for (lane, column) in columns.chunks_exact_mut(n).enumerate() {
                        for (value, &row) in column.iter_mut().zip(rows) {
                            *value = vectors.solution[self.matrix.position_of_row[row]][lane];
                        }
                    }
                    let residual = vectors.true_residual(self, |vectors| {
                        for (lane, &row) in batch.iter().enumerate() {
                            vectors[self.matrix.position_of_row[row]][lane] -= 1.0;
                        }
                    });
                    Ok((convergence, residual))
                },
            )
            .collect();
        let reports = reports?;
        let residual = reports.iter().fold(0.0, |most, (_, residual)| nan_max(most, *residual));
        let convergence = Convergence {
            iterations: reports.iter().map(|(c, _)| c.iterations).max().unwrap_or(0),
            error: reports.iter().fold(0.0, |most, (c, _)| nan_max(most, c.error)),
        };
        check(residual)?;
        symmetrise(values.values_mut(), n);
        Ok(InverseBlock { values, convergence, residual })
    }

    /// Number of right-hand sides per batch.
    pub const fn rhs_per_batch() -> usize {
        LANES
    }

    /// Number of coarse unknowns: six rigid motions per part.
    pub fn n_coarse(&self) -> usize {
        self.coarse.n()
    }
}

fn check(residual: f64) -> Result<()> {
    if residual < RESIDUAL_LIMIT {
        return Ok(());
    }
    Err(Error::not_converged(format!(
        "conjugate gradients ended with a relative residual of {residual:.1e}, but at most {RESIDUAL_LIMIT:.0e} is allowed: {SLOW_OR_SINGULAR}"
    )))
}

fn symmetrise(values: &mut [f64], n: usize) {
    for i in 0..n {
        for j in 0..i {
            let mean = 0.5 * (values[i * n + j] + values[j * n + i]);
            (values[i * n + j], values[j * n + i]) = (mean, mean);
        }
    }
}

impl SymmetricSolver for TwoLevelSolver {
    fn n(&self) -> usize {
        self.matrix.position_of_row.len()
    }

    fn solve_in_place(&self, rhs: &mut [f64], _n_rhs: usize) -> Result<()> {
        let places = &self.matrix.position_of_row;
        rhs.par_chunks_mut((LANES * self.n()).max(1)).try_for_each_init(
            || CgVectors::new(self),
            |vectors, batch| {
                vectors.residual.fill([0.0; LANES]);
                for (lane, column) in batch.chunks_exact(self.n()).enumerate() {
                    column.iter().zip(places).for_each(|(b, &at)| vectors.residual[at][lane] = *b);
                }
                vectors.solve(self)?;
                let residual = vectors.true_residual(self, |vectors| {
                    for (lane, column) in batch.chunks_exact(self.n()).enumerate() {
                        column.iter().zip(places).for_each(|(b, &at)| vectors[at][lane] -= b);
                    }
                });
                check(residual)?;
                for (lane, column) in batch.chunks_exact_mut(self.n()).enumerate() {
                    column.iter_mut().zip(places).for_each(|(x, &at)| *x = vectors.solution[at][lane]);
                }
                Ok(())
            },
        )
    }
}
