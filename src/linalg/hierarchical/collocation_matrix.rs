//! Hierarchical matrices of collocation methods. They are unsymmetric, and multiply several vectors at once.

use std::ops::Range;

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatMut, MatRef, Par};
use rayon::prelude::*;

use super::block_partition::{ClusterPair, MirrorBlocks, partition};
use super::cluster_tree::ClusterTree;
use super::collocation_block::{CollocationBlock, CollocationKernel, ElementNumbering};
use super::cross_approximation::{CROSS_ERROR_SHARE, approximate};
use super::low_rank::LowRank;
use crate::cancel;
use crate::error::Result;
use crate::linalg::dense_matrix::DenseMatrix;

/// Group of nodes with common motions: translations of the displacements, translations of the tractions, and rotations
/// of the displacements.
pub(super) struct RigidGroup {
    pub places: Range<usize>,
    /// Index of the group's first motion among all motions.
    pub first_motion: usize,
    /// Orthonormal motions in the rows `places`, stored one after the other.
    pub motions: Vec<f64>,
}

struct StoredBlock {
    rows: Range<usize>,
    columns: Range<usize>,
    content: BlockContent,
}

enum BlockContent {
    /// Dense entries, column by column.
    Near(Vec<f32>),
    /// Low-rank approximation Σ u vᵀ; each term stores u, then v.
    Far(Vec<f32>),
}

impl StoredBlock {
    fn bytes(&self) -> usize {
        size_of::<Self>()
            + match &self.content {
                BlockContent::Near(values) | BlockContent::Far(values) => size_of_val(values.as_slice()),
            }
    }
}

/// Block structure of a collocation matrix: cluster tree of the elements, numbering of the nodes, and partition into
/// blocks.
pub struct CollocationLayout {
    tree: ClusterTree<3>,
    groups: ElementNumbering,
    blocks: Vec<ClusterPair>,
}

/// Hierarchical collocation matrix A, `[n, n]`, with blocks in single precision.
pub struct CollocationMatrix {
    layout: CollocationLayout,
    blocks: Vec<StoredBlock>,
}

impl CollocationLayout {
    /// Divides the matrix into blocks, which belong to pairs of clusters of `tree`. `tree` is the cluster tree of the
    /// elements.
    ///
    /// See [`partition`] for `admissibility`.
    pub fn new(tree: ClusterTree<3>, groups: ElementNumbering, admissibility: f64) -> Self {
        let blocks = partition(&tree, admissibility, MirrorBlocks::Both);
        Self { tree, groups, blocks }
    }

    /// Cluster tree of the elements.
    pub fn tree(&self) -> &ClusterTree<3> {
        &self.tree
    }

    /// Numbering of the nodes and columns by elements.
    pub fn groups(&self) -> &ElementNumbering {
        &self.groups
    }

    fn elements(&self, block: &ClusterPair) -> [Range<usize>; 2] {
        [block.rows, block.columns].map(|cluster| self.tree.clusters[cluster].range.clone())
    }

    /// Counts for memory estimates: the number of entries of all near blocks, and the sum of rows and columns of all
    /// far blocks.
    pub fn storage_counts(&self) -> [usize; 2] {
        self.blocks.iter().fold([0; 2], |[near, far], block| {
            let [m, n] = self.elements(block).map(|elements| self.groups.dofs(&elements).len());
            if block.is_admissible { [near, far + m + n] } else { [near + m * n, far] }
        })
    }

    /// Computes a block. Also computes the sum of each summed column over the elements of the block,
    /// `[n_sum_columns][row]`. If the run is cancelled, the block is empty.
    fn build_block(
        &self,
        block: &ClusterPair,
        kernel: &impl CollocationKernel,
        error: f64,
    ) -> (StoredBlock, Vec<f64>) {
        let [rows, columns] = self.elements(block);
        let [row_range, column_range] = [&rows, &columns].map(|elements| self.groups.dofs(elements));
        let stored =
            |content| StoredBlock { rows: row_range.clone(), columns: column_range.clone(), content };
        if cancel::requested() {
            return (
                stored(BlockContent::Near(Vec::new())),
                vec![0.0; self.groups.n_sum_columns() * row_range.len()],
            );
        }
        let (m, extra) = (row_range.len(), self.groups.n_sum_columns());
        let mut lines = CollocationBlock::new(kernel, &self.groups, rows, columns);
        let kept = lines.n_matrix_columns();
        if block.is_admissible {
            lines = lines.with_initial_lines();
            let bound = error * ((m * kept) as f64).sqrt();
            let mut terms = approximate(&mut lines, CROSS_ERROR_SHARE * bound);
            let n = terms.v.len() / terms.rank.max(1);
            let mut sums = vec![0.0; extra * m];
            for (u, v) in terms.u.chunks_exact(m).zip(terms.v.chunks_exact(n.max(1))) {
                for (k, value) in v[kept..].iter().enumerate() {
                    let sum = &mut sums[k % extra * m..][..m];
                    sum.iter_mut().zip(u).for_each(|(sum, u)| *sum += value * u);
                }
            }
            terms.v = terms.v.chunks_exact(n.max(1)).flat_map(|v| &v[..kept]).copied().collect();
            let low_rank = LowRank::new(&terms, (m, kept), bound);
            let mut terms: Vec<f32> = low_rank.double.iter().map(|value| *value as f32).collect();
            terms.extend_from_slice(&low_rank.single);
            terms.shrink_to_fit();
            if terms.len() <= m * kept {
                return (stored(BlockContent::Far(terms)), sums);
            }
        }
        let values = lines.everything();
        let mut sums = vec![0.0; extra * m];
        for (k, column) in values[m * kept..].chunks_exact(m).enumerate() {
            let sum = &mut sums[k % extra * m..][..m];
            sum.iter_mut().zip(column).for_each(|(sum, value)| *sum += value);
        }
        let near = values[..m * kept].iter().map(|value| *value as f32).collect();
        (stored(BlockContent::Near(near)), sums)
    }

    /// Computes the matrix and the summed columns, `[n, n_sum_columns]`.
    ///
    /// For each block, the estimated root-mean-square error of the entries is at most `error`. This error excludes the
    /// rounding to single precision.
    ///
    /// # Errors
    /// If memory does not suffice, or the run is cancelled.
    pub fn fill(
        self,
        kernel: &impl CollocationKernel,
        error: f64,
    ) -> Result<(CollocationMatrix, DenseMatrix)> {
        // Each block is a separate task, because large blocks take long.
        let of = |block: &ClusterPair| self.build_block(block, kernel, error);
        let filled: Vec<(StoredBlock, Vec<f64>)> = self.blocks.par_iter().with_max_len(1).map(of).collect();
        cancel::check()?;
        let mut sums = DenseMatrix::zeros(3 * self.groups.n_nodes(), self.groups.n_sum_columns())?;
        let mut blocks = Vec::with_capacity(filled.len());
        for (block, of_block) in filled {
            let m = block.rows.len();
            for (k, values) in of_block.chunks_exact(m).enumerate() {
                let sum = &mut sums.column_mut(k)[block.rows.clone()];
                sum.iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
            }
            blocks.push(block);
        }
        Ok((CollocationMatrix { layout: self, blocks }, sums))
    }
}

impl CollocationMatrix {
    /// Number of rows, which equals the number of columns.
    pub fn n(&self) -> usize {
        3 * self.layout.groups.n_nodes()
    }

    /// Block structure, with the cluster tree and the numbering.
    pub fn layout(&self) -> &CollocationLayout {
        &self.layout
    }

    /// Memory of all blocks, bytes.
    pub fn bytes(&self) -> usize {
        self.blocks.iter().map(StoredBlock::bytes).sum()
    }

    /// Computes y += A x for each column, using the first n rows of `x` and `y`. The product runs in one thread.
    ///
    /// `T` is the precision of the arithmetic. Single precision adds rounding errors as large as the rounding errors of
    /// the stored entries.
    pub fn add_product<T: BlockScalar>(&self, x: MatRef<T>, mut y: MatMut<T>) {
        let (mut wide, mut between) = (Vec::new(), Vec::new());
        for block in &self.blocks {
            let x = x.subrows(block.columns.start, block.columns.len());
            let y = y.as_mut().subrows_mut(block.rows.start, block.rows.len());
            let (m, n, k) = (block.rows.len(), block.columns.len(), x.ncols());
            let (BlockContent::Near(values) | BlockContent::Far(values)) = &block.content;
            let values = T::widen(values, &mut wide);
            match &block.content {
                BlockContent::Near(_) => {
                    matmul(y, Accum::Add, MatRef::from_column_major_slice(values, m, n), x, T::ONE, Par::Seq);
                }
                BlockContent::Far(_) if values.is_empty() => {}
                BlockContent::Far(_) => {
                    let rank = values.len() / (m + n);
                    let both = MatRef::from_column_major_slice(values, m + n, rank);
                    let (u, v) = both.split_at_row(m);
                    between.resize(between.len().max(rank * k), T::ZERO);
                    let mut shares = MatMut::from_column_major_slice_mut(&mut between[..rank * k], rank, k);
                    matmul(shares.as_mut(), Accum::Replace, v.transpose(), x, T::ONE, Par::Seq);
                    matmul(y, Accum::Add, u, shares.as_ref(), T::ONE, Par::Seq);
                }
            }
        }
    }

    /// Adds the diagonal block of A in the rows `places` to `values`. `places` must be the row range of a cluster.
    pub(super) fn add_diagonal_block(&self, places: &Range<usize>, values: &mut DenseMatrix) {
        let inside = |range: &Range<usize>| places.start <= range.start && range.end <= places.end;
        for block in self.blocks.iter().filter(|block| inside(&block.rows) && inside(&block.columns)) {
            let (m, first) = (block.rows.len(), block.rows.start - places.start);
            let at = block.columns.start - places.start;
            let mut add = |j: usize, i: usize, value: f64| values.column_mut(at + j)[first + i] += value;
            match &block.content {
                BlockContent::Near(entries) => {
                    entries.iter().enumerate().for_each(|(k, value)| add(k / m, k % m, (*value).into()));
                }
                BlockContent::Far(terms) => {
                    for term in terms.chunks_exact(m + block.columns.len()) {
                        let (u, v) = term.split_at(m);
                        for (j, v) in v.iter().enumerate() {
                            let v = f64::from(*v);
                            u.iter().enumerate().for_each(|(i, u)| add(j, i, f64::from(*u) * v));
                        }
                    }
                }
            }
        }
    }

    /// Adds the coarse matrix Pᵀ A P to `values`. The columns of P are the motions of `groups`.
    pub(super) fn add_coarse_products(&self, groups: &[RigidGroup], values: &mut DenseMatrix) {
        // Groups are ascending, so that the groups that overlap a range are consecutive.
        let of = |range: &Range<usize>| -> Vec<(usize, Range<usize>)> {
            let first = groups.partition_point(|group| group.places.end <= range.start);
            let there = groups.iter().enumerate().skip(first);
            let there = there.take_while(|(_, group)| group.places.start < range.end);
            let part =
                |group: &RigidGroup| group.places.start.max(range.start)..group.places.end.min(range.end);
            there.map(|(index, group)| (index, part(group))).collect()
        };
        let mut wide = Vec::new();
        for block in &self.blocks {
            let (m, n) = (block.rows.len(), block.columns.len());
            let (BlockContent::Near(entries) | BlockContent::Far(entries)) = &block.content;
            let entries = f64::widen(entries, &mut wide);
            let (left, right): (Mat<f64>, Option<Mat<f64>>) = match &block.content {
                BlockContent::Near(_) => (MatRef::from_column_major_slice(entries, m, n).to_owned(), None),
                BlockContent::Far(_) if entries.is_empty() => continue,
                BlockContent::Far(_) => {
                    let both = MatRef::from_column_major_slice(entries, m + n, entries.len() / (m + n));
                    let (u, v) = both.split_at_row(m);
                    (u.to_owned(), Some(v.to_owned()))
                }
            };
            let rows = of(&block.rows);
            let on_left: Vec<Mat<f64>> = rows
                .iter()
                .map(|(group, part)| {
                    let own = left.subrows(part.start - block.rows.start, part.len());
                    groups[*group].motions_at(part).transpose() * own
                })
                .collect();
            for (column, part) in of(&block.columns) {
                let (at, motions) = (part.start - block.columns.start, groups[column].motions_at(&part));
                let on_right =
                    right.as_ref().map(|right| right.subrows(at, part.len()).transpose() * motions);
                for ((row, _), left) in rows.iter().zip(&on_left) {
                    let to = values.view_mut().submatrix_mut(
                        groups[*row].first_motion,
                        groups[column].first_motion,
                        groups[*row].n_motions(),
                        groups[column].n_motions(),
                    );
                    match &on_right {
                        Some(right) => matmul(to, Accum::Add, left, right, 1.0, Par::Seq),
                        None => matmul(to, Accum::Add, left.subcols(at, part.len()), motions, 1.0, Par::Seq),
                    }
                }
            }
        }
    }
}

/// Scalar type of products, `f32` or `f64`.
pub trait BlockScalar: faer::traits::ComplexField {
    /// The number 0.
    const ZERO: Self;
    /// The number 1.
    const ONE: Self;

    /// Converts the values of a block to this type. If a conversion is necessary, the result is stored in the buffer
    /// `wide`.
    fn widen<'v>(values: &'v [f32], wide: &'v mut Vec<Self>) -> &'v [Self];
}

impl BlockScalar for f32 {
    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;

    fn widen<'v>(values: &'v [f32], _: &'v mut Vec<Self>) -> &'v [Self] {
        values
    }
}

impl BlockScalar for f64 {
    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;

    fn widen<'v>(values: &'v [f32], wide: &'v mut Vec<Self>) -> &'v [Self] {
        wide.clear();
        wide.extend(values.iter().map(|&value| Self::from(value)));
        wide
    }
}

#[cfg(test)]
mod tests {
    use super::super::cluster_tree::BoundingBox;
    use super::*;

    const NODES: usize = 2;

    /// Unsymmetric 3 x 3 kernel of elements on two walls. Each element has two nodes and one summed column. The summed
    /// column is the sum of the matrix columns of the element.
    struct Walls(Vec<[f64; 3]>);

    impl Walls {
        fn entry(&self, node: usize, other: usize, (r, c): (usize, usize)) -> f64 {
            let [a, b] = [node, other].map(|node| {
                let [x, y, z] = self.0[node / NODES];
                [x + 0.2 * (node % NODES) as f64, y, z]
            });
            let d: [f64; 3] = std::array::from_fn(|k| a[k] - b[k]);
            let size = d.iter().map(|d| d * d).sum::<f64>().sqrt().max(0.4);
            (f64::from(u8::from(r == c)) + d[r] * (d[c] + 0.3 * size) / (size * size)) / size
        }
    }

    impl CollocationKernel for Walls {
        fn entries(&self, node: usize, element: usize, values: &mut [f64]) {
            let (kept, sum) = values.split_at_mut(9 * NODES);
            sum.fill(0.0);
            for (k, value) in kept.iter_mut().enumerate() {
                *value = self.entry(node, NODES * element + k / 9, (k % 3, k / 3 % 3));
                sum[k % 3] += *value;
            }
        }
    }

    /// Truth: products and a diagonal block of the dense kernel matrix. The summed column equals the product with a
    /// vector of ones. The tolerances follow from the requested error of the entries.
    #[test]
    fn products_are_sums_over_the_kernel() {
        let at = |k: usize| {
            let [u, v] = [(k % 12) as f64, (k / 12 % 12) as f64];
            if k < 144 { [u, v, 0.0] } else { [12.0, u, 0.5 + v] }
        };
        let points: Vec<[f64; 3]> = (0..288).map(at).collect();
        let extents: Vec<BoundingBox<3>> =
            points.iter().map(|p| [p.map(|x| x - 0.3), p.map(|x| x + 0.5)]).collect();
        let tree = ClusterTree::new(&points, &extents, 6);
        let walls = Walls(tree.order.iter().map(|&k| points[k]).collect());
        let groups = ElementNumbering::new((0..288).map(|_| NODES), 1);
        let error = 1e-5;
        let (matrix, sums) =
            CollocationLayout::new(tree, groups, 1.5).fill(&walls, error).expect("nobody wishes to stop");
        let n = matrix.n();
        let full = DenseMatrix::from_values(
            n,
            n,
            (0..n * n).map(|k| walls.entry(k % n / 3, k / n / 3, (k % n % 3, k / n % 3))).collect(),
        );
        assert!(matrix.bytes() < 4 * n * n * 3 / 4, "{} of {}", matrix.bytes(), 4 * n * n);
        let mut x = DenseMatrix::from_values(n, 2, (0..2 * n).map(|k| (k as f64 * 0.77).sin()).collect());
        x.column_mut(1).fill(1.0);
        let wanted = full.view() * x.view();
        let mut y = DenseMatrix::zeros(n, 2).unwrap();
        matrix.add_product(x.view(), y.view_mut());
        let single: Vec<f32> = x.values().iter().map(|x| *x as f32).collect();
        let mut image = vec![0.0f32; 2 * n];
        let to = MatMut::from_column_major_slice_mut(&mut image[..], n, 2);
        matrix.add_product(MatRef::from_column_major_slice(&single, n, 2), to);
        // Column 0 of x has mixed signs, so that the entry errors of a row add up like random numbers. Column 1
        // consists of ones, and the entry errors may have equal sign.
        for (j, allowed) in [(0, 5.0 * error * (n as f64).sqrt()), (1, 0.3 * error * n as f64)] {
            for i in 0..n {
                let found = [y.at(i, j), f64::from(image[j * n + i])];
                for found in found {
                    assert!((found - wanted[(i, j)]).abs() < allowed, "{i} {j}: {found} {}", wanted[(i, j)]);
                }
                if j == 1 {
                    assert!((sums.at(i, 0) - wanted[(i, 1)]).abs() < allowed);
                }
            }
        }
        let places = 0..n / 2;
        let mut difference = DenseMatrix::zeros(n / 2, n / 2).unwrap();
        matrix.add_diagonal_block(&places, &mut difference);
        for j in places {
            difference.column_mut(j).iter_mut().zip(full.column(j)).for_each(|(value, full)| *value -= full);
        }
        assert!(difference.norm() > 0.0 && difference.norm() < 2.0 * error * (n / 2) as f64);
    }
}
