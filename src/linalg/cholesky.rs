//! Sparse Cholesky factorisation K = L L^T in a given order, with its residual checked, solutions, and the dense inverse
//! of the trailing Schur complement read off L.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::{solve_lower_triangular_in_place, solve_upper_triangular_in_place};
use faer::{Accum, MatMut, MatRef, Par};

use super::dense::{SymmetricDense, try_zeroed};
use super::fronts::{Front, FrontTree};
use super::multifrontal::{self, FactorisationFailure};
use super::sparse::SymmetricSparse;
use super::vector::norm;
use crate::cancel;
use crate::error::{Error, Result};

/// A relative residual above this is not rounding: the factor is wrong.
const RESIDUAL_LIMIT: f64 = 1e-8;
/// A pivot below this share of its diagonal entry is nothing but rounding: the matrix is singular.
const PIVOT_LIMIT: f64 = 1e-14;

/// A factorised symmetric matrix.
pub trait SymmetricSolver: Send + Sync {
    /// Number of rows.
    fn n(&self) -> usize;

    /// Solves K x = rhs for `n_rhs` right-hand sides, `[n_rhs, n]` one after the other, in place.
    ///
    /// # Errors
    /// If memory for the workspace does not suffice.
    fn solve_in_place(&self, rhs: &mut [f64], n_rhs: usize) -> Result<()>;
}

/// The structure of L for a matrix taken in some order: known before any number is computed.
#[derive(Debug)]
pub struct SymbolicCholesky {
    tree: FrontTree,
    n_trailing: usize,
}

/// L with K = L L^T (after permutation).
pub struct CholeskyFactor {
    tree: FrontTree,
    n_trailing: usize,
    values: Vec<f64>,
    residual: f64,
}

/// Threads of the current pool for fronts and dense blocks. The bits are the same for any number.
fn parallelism() -> Par {
    if rayon::current_num_threads() == 1 { Par::Seq } else { Par::rayon(0) }
}

fn out_of_memory() -> Error {
    Error::resources("not enough memory to factorise the stiffness matrix; use a coarser mesh")
}

fn workspace(request: faer::dyn_stack::StackReq) -> Result<MemBuffer> {
    MemBuffer::try_new(request).map_err(|_| out_of_memory())
}

impl SymbolicCholesky {
    /// Analyses `matrix` taken in `order` (`order[new] = old`, a permutation of its rows), of which the last
    /// `n_trailing` are kept to the end, in their order; the others may be rearranged among themselves.
    ///
    /// # Errors
    /// If the matrix is too large for the index type.
    ///
    /// # Panics
    /// If `order` is no permutation of the rows.
    pub fn new(matrix: &SymmetricSparse, order: &[usize], n_trailing: usize) -> Result<Self> {
        if u32::try_from(matrix.n()).is_err() {
            return Err(Error::resources(
                "a body of more than 2^32 unknowns is too large; use a coarser mesh",
            ));
        }
        Ok(Self { tree: FrontTree::new(matrix, order, n_trailing), n_trailing })
    }

    /// Number of entries of L.
    pub fn n_factor_entries(&self) -> usize {
        self.tree.n_entries()
    }

    /// Floating-point operations of the factorisation.
    pub fn flops(&self) -> f64 {
        self.tree.flops()
    }

    /// Bytes that the numeric factorisation takes at its peak: L and its workspace.
    pub fn memory_bytes(&self) -> usize {
        self.memory_bytes_for(rayon::current_num_threads())
    }

    /// The same with `n_threads` at work; more than 16 take no more.
    pub fn memory_bytes_for(&self, n_threads: usize) -> usize {
        8 * (self.tree.n_values() + multifrontal::peak_workspace(&self.tree, n_threads))
    }

    /// Computes L and checks it: K (L L^T)^-1 K v must be K v for a fixed vector v of random entries.
    ///
    /// `row_name` says what a row is (node, component, body), for messages.
    ///
    /// # Errors
    /// If K is not positive definite, if the check fails, or if memory does not suffice.
    pub fn factorise(
        self,
        matrix: &SymmetricSparse,
        row_name: impl Fn(usize) -> String,
    ) -> Result<CholeskyFactor> {
        let mut factor = match self.factorise_unchecked(matrix, parallelism())? {
            Ok(factor) => factor,
            Err(row) => return Err(not_positive(&row_name(row))),
        };
        factor.check_pivots(matrix, row_name)?;
        factor.residual = factor.measure_residual(matrix)?;
        if factor.residual < RESIDUAL_LIMIT {
            return Ok(factor);
        }
        Err(Error::numerical(format!(
            "the factorisation of the stiffness matrix is wrong: its relative residual is {:.1e}, allowed is {:.0e}; \
             please report this",
            factor.residual, RESIDUAL_LIMIT
        )))
    }
}

impl SymbolicCholesky {
    /// Number of values that L is stored in.
    pub fn n_values(&self) -> usize {
        self.tree.n_values()
    }

    /// L from its stored values, [`CholeskyFactor::values`], checked as by [`Self::factorise`]; `None` if they do not
    /// pass.
    ///
    /// # Errors
    /// If memory does not suffice.
    ///
    /// # Panics
    /// If their number is not [`Self::n_values`].
    pub fn from_values(self, matrix: &SymmetricSparse, values: Vec<f64>) -> Result<Option<CholeskyFactor>> {
        assert_eq!(values.len(), self.n_values(), "all values of the factor");
        let Self { tree, n_trailing } = self;
        let mut factor = CholeskyFactor { tree, n_trailing, values, residual: f64::NAN };
        factor.residual = factor.measure_residual(matrix)?;
        Ok((factor.residual < RESIDUAL_LIMIT).then_some(factor))
    }

    /// L without any check; the inner error is the row of a pivot that is not positive.
    fn factorise_unchecked(
        self,
        matrix: &SymmetricSparse,
        par: Par,
    ) -> Result<std::result::Result<CholeskyFactor, usize>> {
        match multifrontal::factorise(&self.tree, matrix, par) {
            Ok(values) => {
                let Self { tree, n_trailing } = self;
                Ok(Ok(CholeskyFactor { tree, n_trailing, values, residual: f64::NAN }))
            }
            Err(FactorisationFailure::NonPositivePivot(place)) => Ok(Err(self.tree.order[place])),
            Err(FactorisationFailure::Other(error)) => Err(error),
        }
    }
}

fn not_positive(row: &str) -> Error {
    Error::input(format!(
        "the stiffness matrix is singular at {row}: the body can move there without any force; look for parts joined \
         by a single node or edge only, for degenerate elements, for missing supports, and for materials whose volume \
         cannot change (nu of 0.5)"
    ))
}

/// Entries of a vector that are the same in every run: a linear congruence mapped to [-1, 1).
fn random_vector(n: usize) -> Vec<f64> {
    let mut state = 0x9E37_79B9_7F4A_7C15_u64;
    (0..n)
        .map(|_| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        })
        .collect()
}

impl CholeskyFactor {
    /// Relative residual of the check made after the factorisation.
    pub fn residual(&self) -> f64 {
        self.residual
    }

    /// Number of entries of L.
    pub fn n_factor_entries(&self) -> usize {
        self.tree.n_entries()
    }

    /// The values that L is stored in.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// The columns of L of a front, `[size, n_pivots]`.
    fn panel(&self, front: &Front) -> MatRef<'_, f64> {
        let values = &self.values[front.offset..][..front.n_values()];
        MatRef::from_column_major_slice(values, front.size(), front.n_pivots)
    }

    /// Refuses pivots that are rounding only.
    fn check_pivots(&self, matrix: &SymmetricSparse, row_name: impl Fn(usize) -> String) -> Result<()> {
        let diagonal = matrix.diagonal();
        for front in &self.tree.fronts {
            let panel = self.panel(front);
            for j in 0..front.n_pivots {
                let row = self.tree.order[front.start + j];
                let pivot = panel[(j, j)];
                // NaN must not pass.
                if pivot.is_nan() || pivot * pivot <= PIVOT_LIMIT * diagonal[row] {
                    return Err(not_positive(&row_name(row)));
                }
            }
        }
        Ok(())
    }

    fn measure_residual(&self, matrix: &SymmetricSparse) -> Result<f64> {
        let n = matrix.n();
        let mut rhs = vec![0.0; n];
        matrix.multiply(&random_vector(n), &mut rhs);
        let mut solution = rhs.clone();
        self.solve_in_place(&mut solution, 1)?;
        let mut back = vec![0.0; n];
        matrix.multiply(&solution, &mut back);
        let scale = norm(&rhs);
        back.iter_mut().zip(&rhs).for_each(|(b, r)| *b -= r);
        Ok(if n == 0 { 0.0 } else { norm(&back) / scale })
    }

    /// The block of K^-1 of the trailing rows, in their order, (L_cc L_cc^T)^-1: the inverse of the Schur complement
    /// that remains when all other rows are eliminated.
    ///
    /// # Errors
    /// If memory does not suffice.
    pub fn trailing_inverse(&self) -> Result<SymmetricDense> {
        self.trailing_inverse_with(parallelism())
    }

    fn trailing_inverse_with(&self, par: Par) -> Result<SymmetricDense> {
        cancel::check()?;
        let m = self.n_trailing;
        let mut inverse = SymmetricDense::zeros(m)?;
        let Some(root) = self.tree.fronts.last().filter(|_| m > 0) else { return Ok(inverse) };
        let mut memory = workspace(faer::linalg::cholesky::llt::inverse::inverse_scratch::<f64>(m, par))?;
        faer::linalg::cholesky::llt::inverse::inverse(
            MatMut::from_column_major_slice_mut(inverse.values_mut(), m, m),
            self.panel(root),
            par,
            MemStack::new(&mut memory),
        );
        mirror_lower(inverse.values_mut(), m);
        Ok(inverse)
    }

    /// L y = b in place, b `[n, n_rhs]` in the order of the tree; `work` holds `[n, n_rhs]`.
    fn solve_forward(&self, mut rhs: MatMut<'_, f64>, work: &mut [f64]) {
        let n_rhs = rhs.ncols();
        for front in &self.tree.fronts {
            let (pivots, below) = self.panel(front).split_at_row(front.n_pivots);
            let mut own = rhs.as_mut().subrows_mut(front.start, front.n_pivots);
            solve_lower_triangular_in_place(pivots, own.as_mut(), Par::Seq);
            let r = front.rows.len();
            let mut change = MatMut::from_column_major_slice_mut(&mut work[..r * n_rhs], r, n_rhs);
            matmul(change.as_mut(), Accum::Replace, below, own.as_ref(), 1.0, Par::Seq);
            for c in 0..n_rhs {
                for (i, &row) in front.rows.iter().enumerate() {
                    rhs[(row, c)] -= change[(i, c)];
                }
            }
        }
    }

    /// L^T x = y in place, as [`Self::solve_forward`].
    fn solve_backward(&self, mut rhs: MatMut<'_, f64>, work: &mut [f64]) {
        let n_rhs = rhs.ncols();
        for front in self.tree.fronts.iter().rev() {
            let (pivots, below) = self.panel(front).split_at_row(front.n_pivots);
            let r = front.rows.len();
            let mut known = MatMut::from_column_major_slice_mut(&mut work[..r * n_rhs], r, n_rhs);
            for c in 0..n_rhs {
                for (i, &row) in front.rows.iter().enumerate() {
                    known[(i, c)] = rhs[(row, c)];
                }
            }
            let mut own = rhs.as_mut().subrows_mut(front.start, front.n_pivots);
            matmul(own.as_mut(), Accum::Add, below.transpose(), known.as_ref(), -1.0, Par::Seq);
            solve_upper_triangular_in_place(pivots.transpose(), own, Par::Seq);
        }
    }
}

/// Copies the lower triangle of a column-major matrix onto the upper one, in tiles that stay in the cache.
fn mirror_lower(values: &mut [f64], n: usize) {
    const TILE: usize = 32;
    for first in (0..n).step_by(TILE) {
        for other in (first..n).step_by(TILE) {
            for j in first..(first + TILE).min(n) {
                for i in other.max(j + 1)..(other + TILE).min(n) {
                    values[i * n + j] = values[j * n + i];
                }
            }
        }
    }
}

impl SymmetricSolver for CholeskyFactor {
    fn n(&self) -> usize {
        self.tree.order.len()
    }

    fn solve_in_place(&self, rhs: &mut [f64], n_rhs: usize) -> Result<()> {
        let n = self.n();
        let mut sorted = try_zeroed(n * n_rhs)?;
        let largest = self.tree.fronts.iter().map(|front| front.rows.len()).max().unwrap_or(0);
        let mut work = try_zeroed(largest * n_rhs)?;
        for (sorted, rhs) in sorted.chunks_exact_mut(n.max(1)).zip(rhs.chunks_exact(n.max(1))) {
            sorted.iter_mut().zip(&self.tree.order).for_each(|(s, &row)| *s = rhs[row]);
        }
        self.solve_forward(MatMut::from_column_major_slice_mut(&mut sorted, n, n_rhs), &mut work);
        self.solve_backward(MatMut::from_column_major_slice_mut(&mut sorted, n, n_rhs), &mut work);
        for (sorted, rhs) in sorted.chunks_exact(n.max(1)).zip(rhs.chunks_exact_mut(n.max(1))) {
            sorted.iter().zip(&self.tree.order).for_each(|(&s, &row)| rhs[row] = s);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::ordering::{NodeGraph, nested_dissection};
    use super::super::sparse::SymmetricTriplets;
    use super::*;

    /// Stiffness of springs between the nodes of k x k x k cells, held softly to the ground; and its node graph.
    fn springs(k: usize) -> (SymmetricSparse, NodeGraph) {
        let at = |x: usize, y: usize, z: usize| (x * k + y) * k + z;
        let mut cells: Vec<Vec<usize>> = Vec::new();
        for (x, y, z) in (0..(k - 1).pow(3)).map(|i| (i / (k - 1).pow(2), i / (k - 1) % (k - 1), i % (k - 1)))
        {
            cells.push((0..8).map(|c| at(x + (c >> 2), y + (c >> 1 & 1), z + (c & 1))).collect());
        }
        let mut triplets = SymmetricTriplets::new(k * k * k);
        (0..k * k * k).for_each(|i| triplets.add(i, i, 1e-3));
        for cell in &cells {
            for (p, &i) in cell.iter().enumerate() {
                for &j in &cell[..p] {
                    triplets.add(i, i, 1.0);
                    triplets.add(j, j, 1.0);
                    triplets.add(i, j, -1.0);
                }
            }
        }
        (triplets.build(), NodeGraph::from_elements(k * k * k, cells.iter().map(Vec::as_slice)))
    }

    fn analysed(matrix: &SymmetricSparse, graph: &NodeGraph, last: &[usize]) -> SymbolicCholesky {
        let nodes: Vec<usize> = (0..matrix.n()).collect();
        SymbolicCholesky::new(matrix, &nested_dissection(graph, &nodes, last).unwrap(), last.len()).unwrap()
    }

    /// Truth: same bits whatever the number of threads, in the factor and in the inverse of the Schur complement, at a
    /// size (fronts of several hundred) that the dense kernels do split among threads.
    #[test]
    fn same_bits_for_any_number_of_threads() {
        let (matrix, graph) = springs(22);
        let last: Vec<usize> = (0..22 * 22).collect();
        let compute = |par| {
            let factor = analysed(&matrix, &graph, &last).factorise_unchecked(&matrix, par).unwrap().unwrap();
            let inverse = factor.trailing_inverse_with(par).unwrap();
            let values = factor.values.iter().chain(inverse.values());
            values.map(|v| v.to_bits()).collect::<Vec<u64>>()
        };
        let one = compute(Par::Seq);
        for threads in [1, 2, 3, 8] {
            assert!(one == compute(Par::rayon(threads)), "{threads} threads");
        }
    }

    /// Truth: A (A^-1)_cc from unit right-hand sides. Tolerance: rounding times the condition, 1e4.
    #[test]
    fn trailing_inverse_is_the_block_of_the_inverse() {
        let (matrix, graph) = springs(7);
        let last = [3, 100, 51, 200, 0];
        let factor = analysed(&matrix, &graph, &last).factorise(&matrix, |row| row.to_string()).unwrap();
        let inverse = factor.trailing_inverse().unwrap();
        for (j, &column) in last.iter().enumerate() {
            let mut unit = vec![0.0; matrix.n()];
            unit[column] = 1.0;
            factor.solve_in_place(&mut unit, 1).unwrap();
            for (i, &row) in last.iter().enumerate() {
                assert!((inverse.at(i, j) - unit[row]).abs() < 1e-12 * inverse.at(0, 0));
            }
        }
    }

    /// Truth: a matrix with one negative diagonal entry is not positive definite; the row named is that row's own
    /// number, not its place in the order.
    #[test]
    fn names_the_row_of_a_bad_pivot() {
        let mut triplets = SymmetricTriplets::new(50);
        (0..50).for_each(|i| triplets.add(i, i, if i == 17 { -1.0 } else { 1.0 }));
        let matrix = triplets.build();
        let order: Vec<usize> = (0..50).rev().collect();
        let error = SymbolicCholesky::new(&matrix, &order, 0)
            .unwrap()
            .factorise(&matrix, |row| format!("row {row}"))
            .err()
            .expect("a refusal");
        assert!(error.to_string().contains("singular at row 17:"), "{error}");
    }
}
