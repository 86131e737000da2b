//! Sparse Cholesky factorisation K = L Lᵀ in a given order, with a check of its residual. The library faer works on
//! supernodes, groups of adjacent columns of L with equal pattern.
//!
//! The trailing block of L also gives the dense block (K⁻¹)_cc of the trailing rows c. This block is the inverse of the
//! Schur complement of these rows.

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::linalg::cholesky::llt::factor::LltError;
use faer::perm::PermRef;
use faer::sparse::linalg::cholesky::supernodal::{SupernodalLltRef, SymbolicSupernodalCholesky};
use faer::sparse::linalg::cholesky::{
    self, CholeskySymbolicParams, LltRef, SymbolicCholeskyRaw, SymmetricOrdering, factorize_symbolic_cholesky,
};
use faer::sparse::linalg::{SupernodalThreshold, SymbolicSupernodalParams};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, MatRef, Par, Side, Spec};

use super::dense::{SymmetricDense, try_zeroed};
use super::sparse::SymmetricSparse;
use super::vector::norm;
use crate::cancel;
use crate::error::{Error, Result};

/// Largest relative residual at which a factor counts as correct.
const RESIDUAL_LIMIT: f64 = 1e-8;
/// Smallest L_jj² / K_jj of a regular matrix K. Smaller ratios consist of rounding errors only.
const PIVOT_LIMIT: f64 = 1e-14;

/// Limits for merging adjacent supernodes: largest number of merged columns, and largest share of zeros in the merged
/// block.
///
/// Merging saves time, because the overhead of small supernodes costs more time than the additional zeros.
const RELAXATION_LIMITS: [(usize, f64); 4] = [(12, 0.8), (36, 0.25), (144, 0.05), (usize::MAX, 0.01)];

/// Solver for systems with a symmetric positive definite matrix K: a factorisation or an iterative method.
pub trait SymmetricSolver: Send + Sync {
    /// Number of rows.
    fn n(&self) -> usize;

    /// Solves K x = rhs in place for `n_rhs` right-hand sides `[n_rhs, n]`, stored one after the other.
    ///
    /// # Errors
    /// If memory for the workspace does not suffice. If an iterative method does not converge (kind `NotConverged`) or is
    /// cancelled.
    fn solve_in_place(&self, rhs: &mut [f64], n_rhs: usize) -> Result<()>;
}

/// Pattern of L for a matrix in a given order.
#[derive(Debug)]
pub struct SymbolicCholesky {
    structure: Structure,
    n_trailing: usize,
}

/// Cholesky factor L of the permuted matrix, P K Pᵀ = L Lᵀ.
pub struct CholeskyFactor {
    structure: Structure,
    n_trailing: usize,
    values: Vec<f64>,
    residual: f64,
}

#[derive(Debug)]
struct Structure {
    symbolic: cholesky::SymbolicCholesky<usize>,
}

impl Structure {
    fn supernodes(&self) -> &SymbolicSupernodalCholesky<usize> {
        match self.symbolic.raw() {
            SymbolicCholeskyRaw::Supernodal(supernodes) => supernodes,
            SymbolicCholeskyRaw::Simplicial(_) => unreachable!("the supernodal form is forced"),
        }
    }

    /// Row of K at the position `place` of the elimination order.
    fn row_at(&self, place: usize) -> usize {
        self.symbolic.perm().map_or(place, |order| order.arrays().0[place])
    }

    fn n_entries(&self) -> usize {
        let entries = |(n_columns, n_rows): (usize, usize)| {
            n_columns * n_rows - n_columns * n_columns.saturating_sub(1) / 2
        };
        self.shapes().map(entries).sum()
    }

    /// Numbers of columns and rows of the dense block of each supernode.
    fn shapes(&self) -> impl Iterator<Item = (usize, usize)> {
        let supernodes = self.supernodes();
        (0..supernodes.n_supernodes()).map(|s| {
            let n_columns = supernodes.supernode_end()[s] - supernodes.supernode_begin()[s];
            (n_columns, n_columns + supernodes.supernode(s).pattern().len())
        })
    }
}

fn sparse_view(matrix: &SymmetricSparse) -> SparseColMatRef<'_, usize, f64> {
    let (offsets, rows, values) = matrix.lower();
    let n = matrix.n();
    SparseColMatRef::new(SymbolicSparseColMatRef::new_checked(n, n, offsets, None, rows), values)
}

/// Parallelism of the dense operations. The results have the same bits for any number of threads.
fn parallelism() -> Par {
    if rayon::current_num_threads() == 1 { Par::Seq } else { Par::rayon(0) }
}

fn out_of_memory() -> Error {
    Error::resources("not enough memory to factorise the stiffness matrix; use a coarser mesh")
}

fn workspace(request: StackReq) -> Result<MemBuffer> {
    MemBuffer::try_new(request).map_err(|_| out_of_memory())
}

impl SymbolicCholesky {
    /// Analyses the pattern of `matrix` in the elimination order `order` (`order[new] = old`, a permutation of the
    /// rows).
    ///
    /// The last `n_trailing` rows of the order are the rows of [`CholeskyFactor::trailing_inverse`].
    ///
    /// # Errors
    /// If the matrix has no rows, or if memory does not suffice.
    ///
    /// # Panics
    /// If `order` is not a permutation of the rows, or if it is shorter than `n_trailing`.
    pub fn new(matrix: &SymmetricSparse, order: &[usize], n_trailing: usize) -> Result<Self> {
        assert!(order.len() == matrix.n() && n_trailing <= order.len(), "an order of all rows");
        if order.is_empty() {
            return Err(Error::input("a stiffness matrix has no rows: nothing is free to move"));
        }
        let mut place_of_row = vec![0; order.len()];
        order.iter().enumerate().for_each(|(place, &row)| place_of_row[row] = place);
        let symbolic = factorize_symbolic_cholesky(
            sparse_view(matrix).symbolic(),
            Side::Lower,
            SymmetricOrdering::Custom(PermRef::new_checked(order, &place_of_row, matrix.n())),
            CholeskySymbolicParams {
                supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
                supernodal_params: SymbolicSupernodalParams { relax: Some(&RELAXATION_LIMITS) },
                ..Default::default()
            },
        )
        .map_err(|_| out_of_memory())?;
        Ok(Self { structure: Structure { symbolic }, n_trailing })
    }

    /// Number of entries of L, including the zeros inside supernodes.
    pub fn n_factor_entries(&self) -> usize {
        self.structure.n_entries()
    }

    /// Number of floating-point operations of the numeric factorisation.
    pub fn flops(&self) -> f64 {
        // Terms of the sum: dense factorisation, triangular solve, symmetric update.
        let flops = |(n_columns, n_rows): (usize, usize)| {
            let (k, r) = (n_columns as f64, (n_rows - n_columns) as f64);
            k * k * k / 3.0 + r * k * k + r * (r + 1.0) * k
        };
        self.structure.shapes().map(flops).sum()
    }

    /// Peak memory of the numeric factorisation (L and the workspace), bytes.
    pub fn memory_bytes(&self) -> usize {
        8 * self.n_values() + self.scratch(Par::Seq).unaligned_bytes_required()
    }

    /// Peak memory of [`CholeskyFactor::trailing_inverse`], bytes. Two matrices `[n_trailing, n_trailing]` are needed,
    /// or three if several supernodes contain the trailing rows.
    pub fn trailing_inverse_bytes(&self) -> usize {
        let supernodes = self.structure.supernodes();
        let is_within_last = supernodes
            .supernode_begin()
            .last()
            .is_some_and(|&start| start + self.n_trailing <= supernodes.nrows());
        let n_matrices = if is_within_last { 2 } else { 3 };
        8 * n_matrices * self.n_trailing * self.n_trailing
    }

    fn scratch(&self, par: Par) -> StackReq {
        self.structure.symbolic.factorize_numeric_llt_scratch::<f64>(par, Spec::default())
    }

    /// Computes L and checks it. The pivots must be larger than rounding errors. `K (L Lᵀ)⁻¹ K v` must equal `K v` for
    /// a fixed pseudo-random vector v.
    ///
    /// `row_name` describes a row (node, component, body) for messages.
    ///
    /// # Errors
    /// If K is not positive definite, if the check fails, if memory does not suffice, or if the run is cancelled.
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
            "the factorisation of the stiffness matrix is wrong: its relative residual is {:.1e}, but at most {:.0e} is allowed; please report this",
            factor.residual, RESIDUAL_LIMIT
        )))
    }
}

impl SymbolicCholesky {
    /// Number of values in which L is stored.
    pub fn n_values(&self) -> usize {
        self.structure.symbolic.len_val()
    }

    /// Restores L from stored values ([`CholeskyFactor::values`]). `None` if the residual check of [`Self::factorise`]
    /// fails.
    ///
    /// # Errors
    /// If memory does not suffice.
    ///
    /// # Panics
    /// If the number of values differs from [`Self::n_values`].
    pub fn from_values(self, matrix: &SymmetricSparse, values: Vec<f64>) -> Result<Option<CholeskyFactor>> {
        assert_eq!(values.len(), self.n_values(), "all values of the factor");
        let Self { structure, n_trailing } = self;
        let mut factor = CholeskyFactor { structure, n_trailing, values, residual: f64::NAN };
        factor.residual = factor.measure_residual(matrix)?;
        Ok((factor.residual < RESIDUAL_LIMIT).then_some(factor))
    }

    /// Computes L without checks. If a pivot is not positive, the inner error is the row of this pivot.
    fn factorise_unchecked(
        self,
        matrix: &SymmetricSparse,
        par: Par,
    ) -> Result<std::result::Result<CholeskyFactor, usize>> {
        cancel::check()?;
        let mut values = try_zeroed(self.n_values())?;
        let mut memory = workspace(self.scratch(par))?;
        let outcome = self.structure.symbolic.factorize_numeric_llt(
            &mut values,
            sparse_view(matrix),
            Side::Lower,
            Default::default(),
            par,
            MemStack::new(&mut memory),
            Spec::default(),
        );
        if let Err(LltError::NonPositivePivot { index }) = outcome {
            return Ok(Err(self.structure.row_at(index)));
        }
        let Self { structure, n_trailing } = self;
        Ok(Ok(CholeskyFactor { structure, n_trailing, values, residual: f64::NAN }))
    }
}

fn not_positive(row: &str) -> Error {
    Error::input(format!(
        "the stiffness matrix is singular at {row}: the body can move there without any force. Look for parts joined only by a single node or edge, degenerate elements, missing supports, and incompressible materials (nu of 0.5)"
    ))
}

/// Pseudo-random vector with entries in [-1, 1), identical in every run.
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
    /// Relative residual that the check of L found.
    pub fn residual(&self) -> f64 {
        self.residual
    }

    /// As [`SymbolicCholesky::n_factor_entries`].
    pub fn n_factor_entries(&self) -> usize {
        self.structure.n_entries()
    }

    /// Values in which L is stored.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    fn supernodes(&self) -> SupernodalLltRef<'_, usize, f64> {
        SupernodalLltRef::new(self.structure.supernodes(), &self.values)
    }

    fn check_pivots(&self, matrix: &SymmetricSparse, row_name: impl Fn(usize) -> String) -> Result<()> {
        let diagonal = matrix.diagonal();
        let factor = self.supernodes();
        for s in 0..factor.symbolic().n_supernodes() {
            let supernode = factor.supernode(s);
            for j in 0..supernode.val().ncols() {
                let row = self.structure.row_at(supernode.start() + j);
                let pivot = supernode.val()[(j, j)];
                // A comparison with NaN is false, so NaN needs its own test.
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
        Ok(norm(&back) / scale)
    }

    /// Block of K⁻¹ for the trailing rows c in their order, `[n_trailing, n_trailing]`: (L_cc L_ccᵀ)⁻¹. The block is
    /// the inverse of the Schur complement that remains after elimination of all other rows.
    ///
    /// # Errors
    /// If memory does not suffice, or the run is cancelled.
    pub fn trailing_inverse(&self) -> Result<SymmetricDense> {
        self.trailing_inverse_with(parallelism())
    }

    fn trailing_inverse_with(&self, par: Par) -> Result<SymmetricDense> {
        cancel::check()?;
        let m = self.n_trailing;
        let mut inverse = SymmetricDense::zeros(m)?;
        if m == 0 {
            return Ok(inverse);
        }
        let mut gathered = Vec::new();
        let trailing = self.trailing_block(&mut gathered)?;
        let mut memory = workspace(faer::linalg::cholesky::llt::inverse::inverse_scratch::<f64>(m, par))?;
        faer::linalg::cholesky::llt::inverse::inverse(
            MatMut::from_column_major_slice_mut(inverse.values_mut(), m, m),
            trailing,
            par,
            MemStack::new(&mut memory),
        );
        mirror_lower(inverse.values_mut(), m);
        Ok(inverse)
    }

    /// Trailing rows and columns of L, `[m, m]`; only the lower triangle is valid. If several supernodes contain the
    /// trailing rows, the entries are copied to `gathered`.
    fn trailing_block<'a>(&'a self, gathered: &'a mut Vec<f64>) -> Result<MatRef<'a, f64>> {
        let m = self.n_trailing;
        let from = self.n() - m;
        let factor = self.supernodes();
        let n_supernodes = factor.symbolic().n_supernodes();
        let last = factor.supernode(n_supernodes - 1);
        if last.start() <= from {
            let skipped = from - last.start();
            return Ok(last.val().submatrix(skipped, skipped, m, m));
        }
        *gathered = try_zeroed(m.saturating_mul(m))?;
        for s in 0..n_supernodes {
            let supernode = factor.supernode(s);
            let (start, size) = (supernode.start(), supernode.val().ncols());
            for j in from.max(start)..start + size {
                let column = &mut gathered[(j - from) * m..(j - from + 1) * m];
                for i in j..start + size {
                    column[i - from] = supernode.val()[(i - start, j - start)];
                }
                for (k, &i) in supernode.pattern().iter().enumerate() {
                    column[i - from] = supernode.val()[(size + k, j - start)];
                }
            }
        }
        Ok(MatRef::from_column_major_slice(gathered, m, m))
    }
}

/// Copies the lower triangle of a matrix to the upper triangle, in tiles that fit into the processor cache.
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
        self.structure.symbolic.nrows()
    }

    fn solve_in_place(&self, rhs: &mut [f64], n_rhs: usize) -> Result<()> {
        let symbolic = &self.structure.symbolic;
        let mut memory = workspace(symbolic.solve_in_place_scratch::<f64>(n_rhs, Par::Seq))?;
        LltRef::new(symbolic, &self.values).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(rhs, self.n(), n_rhs),
            Par::Seq,
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

    /// Stiffness matrix of springs on a k x k x k node grid. Springs connect the nodes of each cell. Weak springs
    /// connect all nodes to the ground.
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

    /// Truth: the factor and the trailing inverse have the same bits for any number of threads. The last supernode has
    /// several hundred columns, so that dense operations use several threads.
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

    /// Truth: solutions of K x = e for unit vectors e give the columns of (K⁻¹)_cc. The tolerance is 1e-12 relative to
    /// the first entry: rounding times the condition number 1e4.
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

    /// Truth: columns of the trailing inverse are solutions for unit right-hand sides. For a row with only the diagonal
    /// entry d, the inverse is 1 / d. Trailing rows of unconnected parts lie in several supernodes, which needs a third
    /// matrix.
    #[test]
    fn trailing_inverse_of_separate_parts() {
        let mut triplets = SymmetricTriplets::new(50);
        (0..50).for_each(|i| triplets.add(i, i, 2.0 + i as f64));
        triplets.add(40, 3, -0.5);
        let (matrix, last) = (triplets.build(), [17, 40, 3]);
        let order: Vec<usize> = (0..50).filter(|i| !last.contains(i)).chain(last).collect();
        let symbolic = SymbolicCholesky::new(&matrix, &order, last.len()).unwrap();
        assert_eq!(symbolic.trailing_inverse_bytes(), 3 * 8 * 9);
        let factor = symbolic.factorise(&matrix, |row| row.to_string()).unwrap();
        let inverse = factor.trailing_inverse().unwrap();
        assert!((inverse.at(0, 0) - 1.0 / 19.0).abs() < 1e-15);
        for (j, &column) in last.iter().enumerate() {
            let mut unit = vec![0.0; matrix.n()];
            unit[column] = 1.0;
            factor.solve_in_place(&mut unit, 1).unwrap();
            for (i, &row) in last.iter().enumerate() {
                assert!((inverse.at(i, j) - unit[row]).abs() < 1e-15);
            }
        }
    }

    /// Truth: a matrix with a negative diagonal entry is not positive definite. The message names the row of the matrix, not its
    /// position in the elimination order.
    #[test]
    fn names_the_row_of_a_bad_pivot() {
        let mut triplets = SymmetricTriplets::new(50);
        (0..50).for_each(|i| triplets.add(i, i, if i == 17 { -1.0 } else { 1.0 }));
        let matrix = triplets.build();
        let order: Vec<usize> = (20..50).chain(0..20).collect();
        let error = SymbolicCholesky::new(&matrix, &order, 0)
            .unwrap()
            .factorise(&matrix, |row| format!("row {row}"))
            .err()
            .expect("a refusal");
        assert!(error.to_string().contains("singular at row 17:"), "{error}");
    }
}
