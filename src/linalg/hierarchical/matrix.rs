//! Hierarchical matrices of kernels with several components: block structure, memory estimates and computation of the
//! blocks.

use std::ops::Range;
use std::sync::Mutex;

use rayon::prelude::*;

use super::block_partition::{ClusterPair, MirrorBlocks, partition};
use super::cluster_tree::ClusterTree;
use super::cross_approximation::{
    CROSS_ERROR_SHARE, ComponentLines, KernelBlock, KernelEntries, approximate,
};
use super::low_rank::LowRank;
use crate::cancel;
use crate::error::Result;

/// Smallest tolerance of a block. A smaller requested tolerance replaces this limit.
const MIN_BLOCK_TOLERANCE: f64 = 1e-13;

const SAMPLED_BLOCKS_PER_SIZE: usize = 3;

/// Number of block ranges of a parallel product. It is fixed, so that results have the same bits for any number of
/// threads.
pub(super) const N_PRODUCT_PARTS: usize = 16;

pub(super) struct StoredBlock {
    pub rows: Range<usize>,
    pub columns: Range<usize>,
    pub content: BlockContent,
}

pub(super) enum BlockContent {
    /// Dense entries, `[component][row][column]`.
    Near(Vec<f64>),
    /// Low-rank approximations, one per component.
    Far(Vec<LowRank>),
}

impl BlockContent {
    fn bytes(&self) -> usize {
        match self {
            Self::Near(values) => size_of_val(values.as_slice()),
            Self::Far(components) => {
                components.iter().map(|component| component.bytes() + size_of::<LowRank>()).sum()
            }
        }
    }
}

impl BlockContent {
    /// Calls `with(row, column, value)` for every term of a component. An entry is the sum of its terms. Entries of
    /// near blocks have one term, entries of far blocks have one term per rank.
    fn for_each_term(&self, component: usize, [m, n]: [usize; 2], mut with: impl FnMut(usize, usize, f64)) {
        match self {
            Self::Near(values) => {
                let own = &values[component * m * n..(component + 1) * m * n];
                own.iter().enumerate().for_each(|(k, value)| with(k / n, k % n, *value));
            }
            Self::Far(components) => {
                let terms = &components[component];
                let single: Vec<f64> = terms.single.iter().map(|&value| value.into()).collect();
                for term in terms.double.chunks_exact(m + n).chain(single.chunks_exact(m + n)) {
                    let (u, v) = term.split_at(m);
                    for (i, u) in u.iter().enumerate() {
                        v.iter().enumerate().for_each(|(j, v)| with(i, j, u * v));
                    }
                }
            }
        }
    }
}

impl StoredBlock {
    pub fn is_diagonal(&self) -> bool {
        self.rows == self.columns
    }
}

/// Block structure of hierarchical matrices: the cluster tree of the points and the partition into blocks.
pub struct BlockLayout {
    tree: ClusterTree,
    blocks: Vec<ClusterPair>,
    /// Factor of the tolerance for the blocks of each cluster.
    tolerance_shares: Vec<f64>,
}

impl BlockLayout {
    /// Divides the matrix into blocks. See [`partition`] for `admissibility`.
    pub fn new(tree: ClusterTree, admissibility: f64) -> Self {
        let blocks = partition(&tree, admissibility, MirrorBlocks::One);
        let tolerance_shares = vec![1.0; tree.clusters.len()];
        Self { tree, blocks, tolerance_shares }
    }

    /// Sets a factor of the tolerance for each point, `[N]` in the original order of the points. A block uses the
    /// smallest factor of its rows and columns.
    pub fn with_tolerance_shares(self, shares: &[f64]) -> Self {
        let of = |range: Range<usize>| {
            self.tree.order[range].iter().map(|&point| shares[point]).fold(f64::INFINITY, f64::min)
        };
        let tolerance_shares = self.tree.clusters.iter().map(|cluster| of(cluster.range.clone())).collect();
        Self { tolerance_shares, ..self }
    }

    fn tolerance_of(&self, block: &ClusterPair, tolerance: f64) -> f64 {
        (tolerance * self.tolerance_shares[block.rows].min(self.tolerance_shares[block.columns]))
            .max(MIN_BLOCK_TOLERANCE.min(tolerance))
    }

    /// Cluster tree of the points.
    pub fn tree(&self) -> &ClusterTree {
        &self.tree
    }

    fn ranges(&self, block: &ClusterPair) -> [Range<usize>; 2] {
        [block.rows, block.columns].map(|cluster| self.tree.clusters[cluster].range.clone())
    }

    /// Number of entries of all near blocks, per component.
    pub fn near_entries(&self) -> usize {
        let near = self.blocks.iter().filter(|block| !block.is_admissible).map(|block| self.ranges(block));
        near.map(|[rows, columns]| rows.len() * columns.len()).sum()
    }

    /// Estimates the memory of the matrix that [`Self::fill`] computes, bytes, without evaluating the kernel.
    ///
    /// The entries of near blocks are counted. For each component, the assumed memory of a far block `[m, n]` is
    /// `per_line` d² (m + n) bytes. It is at most the memory of a dense block. d is -log10 of the block's tolerance.
    pub fn estimated_bytes(&self, components: usize, tolerance: f64, per_line: f64) -> usize {
        let far = self.blocks.iter().filter(|block| block.is_admissible).map(|block| {
            let [m, n] = self.ranges(block).map(|range| range.len());
            let digits = self.tolerance_of(block, tolerance).log10();
            (per_line * digits * digits * (m + n) as f64).min((size_of::<f64>() * m * n) as f64)
        });
        components * (far.sum::<f64>() as usize + size_of::<f64>() * self.near_entries())
    }

    /// Estimates the memory of the matrix that [`Self::fill`] computes, bytes. It computes a few far blocks of each
    /// size and extrapolates their memory.
    pub fn sampled_bytes(&self, entries: &impl KernelEntries, components: usize, tolerance: f64) -> usize {
        let mut of_size: Vec<Vec<&ClusterPair>> = Vec::new();
        for block in self.blocks.iter().filter(|block| block.is_admissible) {
            let [rows, columns] = self.ranges(block);
            let size = (rows.len() + columns.len()).ilog2() as usize;
            if of_size.len() <= size {
                of_size.resize(size + 1, Vec::new());
            }
            of_size[size].push(block);
        }
        let sampled = |blocks: &Vec<&ClusterPair>| {
            let lines =
                |block: &ClusterPair| self.ranges(block).map(|range| range.len()).iter().sum::<usize>();
            let count = SAMPLED_BLOCKS_PER_SIZE.min(blocks.len());
            let (mut bytes, mut seen) = (0, 0);
            for k in 0..count {
                let block = blocks[(2 * k + 1) * blocks.len() / (2 * count)];
                bytes += self.build_block(block, entries, components, tolerance).content.bytes();
                seen += lines(block);
            }
            let all: usize = blocks.iter().map(|block| lines(block)).sum();
            if seen == 0 { 0.0 } else { bytes as f64 * all as f64 / seen as f64 }
        };
        let far: Vec<f64> = of_size.par_iter().map(sampled).collect();
        far.iter().sum::<f64>() as usize + size_of::<f64>() * components * self.near_entries()
    }

    fn build_block(
        &self,
        block: &ClusterPair,
        entries: &impl KernelEntries,
        components: usize,
        tolerance: f64,
    ) -> StoredBlock {
        let [rows, columns] = self.ranges(block);
        if cancel::requested() {
            return StoredBlock { rows, columns, content: BlockContent::Near(Vec::new()) };
        }
        let (m, n) = (rows.len(), columns.len());
        if block.is_admissible {
            let mut lines = KernelBlock::new(entries, rows.clone(), columns.clone(), components);
            let bound = self.tolerance_of(block, tolerance) * lines.norm() / (components as f64).sqrt();
            let of = |component| {
                let crosses = ComponentLines { lines: &mut lines, component };
                LowRank::new(&approximate(crosses, CROSS_ERROR_SHARE * bound), (m, n), bound)
            };
            let content = BlockContent::Far((0..components).map(of).collect());
            if content.bytes() <= size_of::<f64>() * components * m * n {
                return StoredBlock { rows, columns, content };
            }
        }
        let mut values = vec![0.0; components * m * n];
        let mut entry = vec![0.0; components];
        for (i, j) in (0..m).flat_map(|i| (0..n).map(move |j| (i, j))) {
            entries(rows.start + i, columns.start + j, &mut entry);
            (0..components).for_each(|c| values[(c * m + i) * n + j] = entry[c]);
        }
        StoredBlock { rows, columns, content: BlockContent::Near(values) }
    }

    /// Computes the matrices of a kernel. `signs` contains 1 for each symmetric component and -1 for each antisymmetric
    /// component.
    ///
    /// The relative error of a far block is at most `tolerance` times the factor of the block. This error is an
    /// estimate in the Frobenius norm of all components together.
    ///
    /// # Errors
    /// If the run is cancelled.
    pub fn fill(
        self,
        entries: &impl KernelEntries,
        signs: Vec<f64>,
        tolerance: f64,
    ) -> Result<HierarchicalMatrix> {
        let of = |block: &ClusterPair| self.build_block(block, entries, signs.len(), tolerance);
        // Each block is a separate task, because large blocks take long.
        let blocks: Vec<StoredBlock> = self.blocks.par_iter().with_max_len(1).map(of).collect();
        cancel::check()?;
        let parts = parts(&blocks);
        Ok(HierarchicalMatrix { tree: self.tree, blocks, signs, parts, scratch: Mutex::new(Vec::new()) })
    }
}

/// Divides the blocks into [`N_PRODUCT_PARTS`] ranges with about equal memory.
fn parts(blocks: &[StoredBlock]) -> Vec<Range<usize>> {
    let all: usize = blocks.iter().map(|block| block.content.bytes()).sum();
    let (mut ends, mut seen) = (vec![0], 0);
    for (index, block) in blocks.iter().enumerate() {
        seen += block.content.bytes();
        while ends.len() < N_PRODUCT_PARTS && seen * N_PRODUCT_PARTS >= all * ends.len() {
            ends.push(index + 1);
        }
    }
    ends.resize(N_PRODUCT_PARTS, blocks.len());
    ends.push(blocks.len());
    ends.windows(2).map(|pair| pair[0]..pair[1]).collect()
}

/// Hierarchical matrices `[N, N]`, one for each component of a kernel. Rows and columns belong to the points of a
/// cluster tree.
pub struct HierarchicalMatrix {
    pub(super) tree: ClusterTree,
    pub(super) blocks: Vec<StoredBlock>,
    /// Factor between a stored entry and its mirrored entry for each component: 1 if symmetric, -1 if antisymmetric.
    pub(super) signs: Vec<f64>,
    pub(super) parts: Vec<Range<usize>>,
    /// Partial results of a product, one vector per part.
    pub(super) scratch: Mutex<Vec<f64>>,
}

impl HierarchicalMatrix {
    /// Number of points N.
    pub fn n(&self) -> usize {
        self.tree.order.len()
    }

    /// Cluster tree of the points.
    pub fn tree(&self) -> &ClusterTree {
        &self.tree
    }

    /// Memory of all blocks, bytes.
    pub fn bytes(&self) -> usize {
        self.blocks.iter().map(|block| block.content.bytes() + size_of::<StoredBlock>()).sum()
    }

    /// Diagonal blocks of groups of points, `[group][component][place][place]`. Each group must be a cluster of the
    /// tree.
    pub fn diagonal_blocks(&self, groups: &[Range<usize>]) -> Vec<Vec<Vec<f64>>> {
        let mut of = vec![0; self.n()];
        groups.iter().enumerate().for_each(|(group, places)| of[places.clone()].fill(group));
        let mut values: Vec<Vec<Vec<f64>>> =
            groups.iter().map(|places| vec![vec![0.0; places.len().pow(2)]; self.signs.len()]).collect();
        for block in &self.blocks {
            let [rows, columns] = [&block.rows, &block.columns];
            let places = &groups[of[rows.start]];
            if places.start > rows.start || places.end < rows.end.max(columns.end) {
                continue;
            }
            let (count, first) = (places.len(), places.start);
            for (component, values) in values[of[rows.start]].iter_mut().enumerate() {
                block.content.for_each_term(component, [rows.len(), columns.len()], |i, j, value| {
                    let [i, j] = [rows.start + i - first, columns.start + j - first];
                    values[i * count + j] += value;
                    if !block.is_diagonal() {
                        values[j * count + i] += self.signs[component] * value;
                    }
                });
            }
        }
        values
    }

    /// Weighted sums Σ w_i w_j a_ij over the points i of one group and j of a second group,
    /// `[component][group][group]`.
    ///
    /// `groups` contains ascending ranges that cover all points. `weights`, `[N]`, contains w in tree order. a_ij are
    /// the matrix entries.
    pub fn group_sums(&self, groups: &[Range<usize>], weights: &[f64]) -> Vec<Vec<f64>> {
        let count = groups.len();
        let of: Vec<usize> = groups
            .iter()
            .enumerate()
            .flat_map(|(group, places)| places.clone().map(move |_| group))
            .collect();
        let mut sums = vec![vec![0.0; count * count]; self.signs.len()];
        for block in &self.blocks {
            let [rows, columns] = [&block.rows, &block.columns];
            for (component, sum) in sums.iter_mut().enumerate() {
                let mut add = |g: usize, h: usize, value: f64| {
                    sum[g * count + h] += value;
                    if !block.is_diagonal() {
                        sum[h * count + g] += self.signs[component] * value;
                    }
                };
                match &block.content {
                    near @ BlockContent::Near(_) => {
                        near.for_each_term(component, [rows.len(), columns.len()], |i, j, value| {
                            let [i, j] = [rows.start + i, columns.start + j];
                            add(of[i], of[j], weights[i] * weights[j] * value);
                        })
                    }
                    BlockContent::Far(components) => {
                        let single: Vec<f64> =
                            components[component].single.iter().map(|&value| value.into()).collect();
                        for terms in [&components[component].double, &single] {
                            for term in terms.chunks_exact(rows.len() + columns.len()) {
                                let (u, v) = term.split_at(rows.len());
                                let u = grouped(u, rows, &of, weights);
                                let v = grouped(v, columns, &of, weights);
                                for (g, u) in &u {
                                    v.iter().for_each(|(h, v)| add(*g, *h, u * v));
                                }
                            }
                        }
                    }
                }
            }
        }
        sums
    }
}

/// Weighted sums of `values` over the points of each group in `places`. Each item contains the group and its sum.
fn grouped(values: &[f64], places: &Range<usize>, of: &[usize], weights: &[f64]) -> Vec<(usize, f64)> {
    let mut sums: Vec<(usize, f64)> = Vec::new();
    for (value, place) in values.iter().zip(places.clone()) {
        let share = weights[place] * value;
        match sums.last_mut() {
            Some((group, sum)) if *group == of[place] => *sum += share,
            _ => sums.push((of[place], share)),
        }
    }
    sums
}
