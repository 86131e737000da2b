//! Sparse Cholesky factorisation K = L L^T in a given order (faer's supernodal one), with its residual checked, and the
//! dense inverse of the trailing Schur complement read off L.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::LltError as PivotError;
use faer::perm::PermRef;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::supernodal::{SupernodalLltRef, SymbolicSupernodalCholesky};
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, MatRef, Par, Side, Spec};

use super::dense::{SymmetricDense, zeroed};
use super::sparse::SymmetricSparse;
use crate::error::{Error, Result};

/// A relative residual above this is not rounding: the factor is wrong.
const RESIDUAL_LIMIT: f64 = 1e-8;
/// A pivot below this share of its diagonal entry is nothing but rounding: the matrix is singular.
const PIVOT_LIMIT: f64 = 1e-14;

/// A factorised symmetric matrix.
pub trait SymmetricFactor: Send + Sync {
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
pub struct SymbolicFactor {
    symbolic: SymbolicCholesky<usize>,
}

/// L with K = L L^T (after permutation).
pub struct CholeskyFactor {
    symbolic: SymbolicCholesky<usize>,
    values: Vec<f64>,
    residual: f64,
}

fn sparse_view(matrix: &SymmetricSparse) -> SparseColMatRef<'_, usize, f64> {
    let (offsets, rows, values) = matrix.lower();
    let n = matrix.n();
    SparseColMatRef::new(SymbolicSparseColMatRef::new_checked(n, n, offsets, None, rows), values)
}

/// Threads for the dense blocks: all, but one inside a parallel region. The bits are the same for any number.
fn parallelism() -> Par {
    if rayon::current_thread_index().is_some() || rayon::current_num_threads() == 1 {
        Par::Seq
    } else {
        Par::rayon(0)
    }
}

fn out_of_memory() -> Error {
    Error::resources("not enough memory to factorise the stiffness matrix; use a coarser mesh")
}

fn workspace(request: faer::dyn_stack::StackReq) -> Result<MemBuffer> {
    MemBuffer::try_new(request).map_err(|_| out_of_memory())
}

impl SymbolicFactor {
    /// Analyses `matrix` taken in `order` (`order[new] = old`, a permutation of its rows).
    ///
    /// # Errors
    /// If memory does not suffice.
    ///
    /// # Panics
    /// If `order` is no permutation of the rows.
    pub fn new(matrix: &SymmetricSparse, order: &[usize]) -> Result<Self> {
        let mut inverse = vec![0; order.len()];
        order.iter().enumerate().for_each(|(new, &old)| inverse[old] = new);
        let symbolic = factorize_symbolic_cholesky(
            sparse_view(matrix).symbolic(),
            Side::Lower,
            SymmetricOrdering::Custom(PermRef::new_checked(order, &inverse, matrix.n())),
            CholeskySymbolicParams {
                supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
                ..Default::default()
            },
        )
        .map_err(|_| out_of_memory())?;
        Ok(Self { symbolic })
    }

    /// Number of stored entries of L.
    pub fn n_stored(&self) -> usize {
        self.symbolic.len_val()
    }

    /// Bytes that the numeric factorisation takes at its peak: L and its workspace.
    pub fn memory_bytes(&self) -> usize {
        let request = self.symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Spec::default());
        8 * self.n_stored() + request.unaligned_bytes_required()
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
        let mut factor = match self.compute(matrix, parallelism())? {
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

impl SymbolicFactor {
    /// L without any check; the inner error is the row of a pivot that is not positive.
    fn compute(
        self,
        matrix: &SymmetricSparse,
        par: Par,
    ) -> Result<std::result::Result<CholeskyFactor, usize>> {
        let mut values = zeroed(self.symbolic.len_val())?;
        let mut memory = workspace(self.symbolic.factorize_numeric_llt_scratch::<f64>(par, Spec::default()))?;
        let outcome = self.symbolic.factorize_numeric_llt(
            &mut values,
            sparse_view(matrix),
            Side::Lower,
            Default::default(),
            par,
            MemStack::new(&mut memory),
            Spec::default(),
        );
        Ok(match outcome.map(|_| ()) {
            Ok(()) => Ok(CholeskyFactor { symbolic: self.symbolic, values, residual: f64::NAN }),
            Err(PivotError::NonPositivePivot { index }) => Err(original_row(&self.symbolic, index)),
        })
    }
}

fn not_positive(row: &str) -> Error {
    Error::input(format!(
        "the stiffness matrix is singular at {row}: the body can move there without any force; look for parts joined \
         by a single node or edge only, for degenerate elements, and for missing supports"
    ))
}

fn original_row(symbolic: &SymbolicCholesky<usize>, permuted: usize) -> usize {
    symbolic.perm().map_or(permuted, |perm| perm.arrays().0[permuted])
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

fn norm(x: &[f64]) -> f64 {
    x.iter().map(|v| v * v).sum::<f64>().sqrt()
}

impl CholeskyFactor {
    /// Relative residual of the check made after the factorisation.
    pub fn residual(&self) -> f64 {
        self.residual
    }

    /// Number of stored entries of L.
    pub fn n_stored(&self) -> usize {
        self.values.len()
    }

    fn supernodes(&self) -> (&SymbolicSupernodalCholesky<usize>, SupernodalLltRef<'_, usize, f64>) {
        match self.symbolic.raw() {
            SymbolicCholeskyRaw::Supernodal(symbolic) => {
                (symbolic, SupernodalLltRef::new(symbolic, &self.values))
            }
            SymbolicCholeskyRaw::Simplicial(_) => unreachable!("the supernodal form is forced"),
        }
    }

    /// Refuses pivots that are rounding only.
    fn check_pivots(&self, matrix: &SymmetricSparse, row_name: impl Fn(usize) -> String) -> Result<()> {
        let diagonal = matrix.diagonal();
        let (symbolic, factor) = self.supernodes();
        for s in 0..symbolic.n_supernodes() {
            let node = factor.supernode(s);
            for j in 0..node.val().ncols() {
                let row = original_row(&self.symbolic, node.start() + j);
                let pivot = node.val()[(j, j)];
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

    /// The lower triangle of L's trailing `m` rows and columns, `[m, m]` column by column, zeros above.
    fn trailing_block(&self, m: usize) -> Result<Vec<f64>> {
        let mut block = zeroed(m.saturating_mul(m))?;
        let from = self.n() - m;
        let (symbolic, factor) = self.supernodes();
        for s in 0..symbolic.n_supernodes() {
            let node = factor.supernode(s);
            let (start, size) = (node.start(), node.val().ncols());
            for j in from.max(start)..start + size {
                let column = &mut block[(j - from) * m..(j - from + 1) * m];
                for i in j..start + size {
                    column[i - from] = node.val()[(i - start, j - start)];
                }
                for (k, &i) in node.pattern().iter().enumerate() {
                    column[i - from] = node.val()[(size + k, j - start)];
                }
            }
        }
        Ok(block)
    }

    /// The trailing `m` x `m` block of K^-1 in the factor's order, (L_cc L_cc^T)^-1: the inverse of the Schur
    /// complement that remains when all other rows are eliminated.
    ///
    /// # Errors
    /// If memory does not suffice.
    ///
    /// # Panics
    /// If `m` is larger than the matrix.
    pub fn trailing_inverse(&self, m: usize) -> Result<SymmetricDense> {
        self.trailing_inverse_with(m, parallelism())
    }

    fn trailing_inverse_with(&self, m: usize, par: Par) -> Result<SymmetricDense> {
        let block = self.trailing_block(m)?;
        let mut inverse = SymmetricDense::zeros(m)?;
        if m == 0 {
            return Ok(inverse);
        }
        let mut memory = workspace(faer::linalg::cholesky::llt::inverse::inverse_scratch::<f64>(m, par))?;
        faer::linalg::cholesky::llt::inverse::inverse(
            MatMut::from_column_major_slice_mut(inverse.values_mut(), m, m),
            MatRef::from_column_major_slice(&block, m, m),
            par,
            MemStack::new(&mut memory),
        );
        mirror_lower(inverse.values_mut(), m);
        Ok(inverse)
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

impl SymmetricFactor for CholeskyFactor {
    fn n(&self) -> usize {
        self.symbolic.nrows()
    }

    fn solve_in_place(&self, rhs: &mut [f64], n_rhs: usize) -> Result<()> {
        let par = Par::Seq;
        let mut memory = workspace(self.symbolic.solve_in_place_scratch::<f64>(n_rhs, par))?;
        LltRef::new(&self.symbolic, &self.values).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(rhs, self.n(), n_rhs),
            par,
            MemStack::new(&mut memory),
        );
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
        let mut triplets = SymmetricTriplets::new(k * k * k, 0);
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

    fn analysed(matrix: &SymmetricSparse, graph: &NodeGraph, last: &[usize]) -> SymbolicFactor {
        let nodes: Vec<usize> = (0..matrix.n()).collect();
        SymbolicFactor::new(matrix, &nested_dissection(graph, &nodes, last).unwrap()).unwrap()
    }

    /// Truth: same bits whatever the number of threads, in the factor and in the inverse of the Schur complement, at a
    /// size (fronts of several hundred) that the dense kernels do split among threads.
    #[test]
    fn same_bits_for_any_number_of_threads() {
        let (matrix, graph) = springs(22);
        let last: Vec<usize> = (0..22 * 22).collect();
        let compute = |par| {
            let factor = analysed(&matrix, &graph, &last).compute(&matrix, par).unwrap().unwrap();
            let inverse = factor.trailing_inverse_with(last.len(), par).unwrap();
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
        let inverse = factor.trailing_inverse(last.len()).unwrap();
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
        let mut triplets = SymmetricTriplets::new(50, 0);
        (0..50).for_each(|i| triplets.add(i, i, if i == 17 { -1.0 } else { 1.0 }));
        let matrix = triplets.build();
        let order: Vec<usize> = (0..50).rev().collect();
        let error = SymbolicFactor::new(&matrix, &order)
            .unwrap()
            .factorise(&matrix, |row| format!("row {row}"))
            .err()
            .expect("a refusal");
        assert!(error.to_string().contains("singular at row 17:"), "{error}");
    }
}
