//! Two-level additive Schwarz preconditioner for a symmetric positive definite matrix A.
//!
//! `B = Σ_g R_gᵀ A_g⁻¹ R_g + Wᵀ A_c⁻¹ W` with `A_c = W A Wᵀ`. R_g selects the rows of a group g of neighbouring points,
//! and A_g is the diagonal block of A for this group. A row of W contains the weights of the points of one coarse
//! group. The first term approximates A⁻¹ for vectors of short wavelength, the second term for vectors of long
//! wavelength.
//!
//! # Source
//! Mund, Stephan and Weiße 1998, "Two-level methods for the single layer potential in R³".

use std::ops::Range;
use std::sync::Mutex;

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::linalg::cholesky::llt::factor::{cholesky_in_place, cholesky_in_place_scratch};
use faer::linalg::cholesky::llt::inverse::{inverse, inverse_scratch};
use faer::{MatMut, MatRef, Par, Spec};
use rayon::prelude::*;

use super::hierarchical::{ComponentProduct, HierarchicalMatrix};
use super::vector::dot8;

const MAX_BLOCK_CELLS: usize = 64;

/// Limit of the number of coarse groups. A coarse group is a cluster with at most max([`MAX_BLOCK_CELLS`], N /
/// `MAX_COARSE_GROUPS`) of the N points, as large as possible. A leaf of the tree may have more points.
const MAX_COARSE_GROUPS: usize = 384;

const ROWS_PER_TASK: usize = 64;

/// The preconditioner B of [`AdditiveSchwarz::apply`].
pub struct AdditiveSchwarz {
    n: usize,
    planes: usize,
    groups: Vec<LocalBlock>,
    coarse_groups: Vec<Range<usize>>,
    /// A_c⁻¹, a square matrix. Its rows and columns have the order `[planes, coarse groups]`.
    coarse_inverse: Vec<f64>,
    /// Weights of the points in the coarse groups, `[N]`.
    weights: Vec<f64>,
    scratch: Mutex<[Vec<f64>; 2]>,
}

struct LocalBlock {
    places: Range<usize>,
    /// Inverse of the diagonal block, a square matrix. Its rows and columns have the order `[planes, places]`.
    inverse: Vec<f64>,
}

impl AdditiveSchwarz {
    /// Builds the preconditioner for a matrix A. Each term of `uses` adds a component of `matrix`, times a sign, to a
    /// block of A.
    ///
    /// A acts on vectors `[planes, N]`; a plane contains one direction of a vector field at the N points. `weights`,
    /// `[N]`, is the vector of a constant field.
    pub fn new(
        matrix: &HierarchicalMatrix,
        uses: &[ComponentProduct],
        planes: usize,
        weights: &[f64],
    ) -> Self {
        let ranges = matrix.tree().clusters_of_size(MAX_BLOCK_CELLS);
        let coarse_groups =
            matrix.tree().clusters_of_size(MAX_BLOCK_CELLS.max(matrix.n() / MAX_COARSE_GROUPS));
        let within = matrix.diagonal_blocks(&ranges);
        let groups: Vec<LocalBlock> = ranges
            .into_par_iter()
            .zip(within)
            .map(|(places, components)| LocalBlock {
                inverse: inverse_or_diagonal(
                    assembled(&components, places.len(), uses, planes),
                    planes * places.len(),
                ),
                places,
            })
            .collect();
        let sums = assembled(&matrix.group_sums(&coarse_groups, weights), coarse_groups.len(), uses, planes);
        let coarse_inverse = inverse_or_diagonal(sums, planes * coarse_groups.len());
        let coarse = vec![0.0; planes * coarse_groups.len()];
        let weights = weights.to_vec();
        let scratch = Mutex::new([coarse.clone(), coarse]);
        Self { n: matrix.n(), planes, groups, coarse_groups, coarse_inverse, weights, scratch }
    }

    /// Upper estimate of the memory for `n` points, bytes.
    pub fn expected_bytes(n: usize, planes: usize) -> usize {
        let larger = MAX_COARSE_GROUPS.min(n / (MAX_BLOCK_CELLS / 2) + 1);
        size_of::<f64>() * planes * planes * (MAX_BLOCK_CELLS * n + 4 * larger * larger)
    }

    /// Memory of the stored inverses and weights, bytes.
    pub fn bytes(&self) -> usize {
        let of_groups: usize = self.groups.iter().map(|group| size_of_val(group.inverse.as_slice())).sum();
        of_groups + size_of_val(self.coarse_inverse.as_slice()) + size_of_val(self.weights.as_slice())
    }

    /// Computes `y = B x ≈ A⁻¹ x`, both `[planes, N]`; overwrites `y`.
    pub fn apply(&self, x: &[f64], y: &mut [f64]) {
        let (n, planes) = (self.n, self.planes);
        for group in &self.groups {
            let size = group.places.len();
            for (row, values) in group.inverse.chunks_exact(planes * size).enumerate() {
                let (plane, place) = (row / size, group.places.start + row % size);
                y[plane * n + place] = (0..planes)
                    .map(|k| dot8(&values[k * size..(k + 1) * size], &x[k * n..][group.places.clone()]))
                    .sum();
            }
        }
        let mut scratch = self.scratch.lock().expect("no panic while the scratch is held");
        let [sums, answers] = &mut *scratch;
        let count = self.coarse_groups.len();
        for plane in 0..planes {
            for (g, places) in self.coarse_groups.iter().enumerate() {
                let own = &x[plane * n..][places.clone()];
                sums[plane * count + g] = dot8(&self.weights[places.clone()], own);
            }
        }
        let rows = self
            .coarse_inverse
            .par_chunks(planes * count * ROWS_PER_TASK)
            .zip(answers.par_chunks_mut(ROWS_PER_TASK));
        rows.for_each(|(rows, answers)| {
            for (row, answer) in rows.chunks_exact(planes * count).zip(answers) {
                *answer = dot8(row, sums);
            }
        });
        for plane in 0..planes {
            for (g, places) in self.coarse_groups.iter().enumerate() {
                let answer = answers[plane * count + g];
                for place in places.clone() {
                    y[plane * n + place] += self.weights[place] * answer;
                }
            }
        }
    }
}

/// Assembles a square matrix with rows and columns in the order `[planes, m]`. Each term of `uses` adds one of
/// `components` `[m, m]`, times a sign, to a block.
fn assembled(components: &[Vec<f64>], m: usize, uses: &[ComponentProduct], planes: usize) -> Vec<f64> {
    let mut matrix = vec![0.0; (planes * m).pow(2)];
    for one in uses {
        for (i, row) in components[one.component].chunks_exact(m).enumerate() {
            let from = ((one.target_plane * m + i) * planes + one.source_plane) * m;
            let own = &mut matrix[from..from + m];
            own.iter_mut().zip(row).for_each(|(sum, value)| *sum += one.sign * value);
        }
    }
    matrix
}

/// Inverse of a symmetric matrix. If the matrix is not positive definite, the inverse of its diagonal.
fn inverse_or_diagonal(mut matrix: Vec<f64>, n: usize) -> Vec<f64> {
    let diagonal: Vec<f64> = (0..n).map(|i| matrix[i * (n + 1)]).collect();
    let request: StackReq = cholesky_in_place_scratch::<f64>(n, Par::Seq, Spec::default())
        .or(inverse_scratch::<f64>(n, Par::Seq));
    let mut memory = MemBuffer::new(request);
    let factor = MatMut::from_column_major_slice_mut(&mut matrix, n, n);
    let stack = MemStack::new(&mut memory);
    let mut result = vec![0.0; n * n];
    if cholesky_in_place(factor, Default::default(), Par::Seq, stack, Spec::default()).is_err() {
        diagonal.iter().enumerate().for_each(|(i, value)| result[i * (n + 1)] = 1.0 / value);
        return result;
    }
    let factor = MatRef::from_column_major_slice(&matrix, n, n);
    let stack = MemStack::new(&mut memory);
    inverse(MatMut::from_column_major_slice_mut(&mut result, n, n), factor, Par::Seq, stack);
    for i in 0..n {
        for j in i + 1..n {
            result[j * n + i] = result[i * n + j];
        }
    }
    result
}
