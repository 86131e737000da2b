//! The tree of fronts of a sparse Cholesky factorisation: which unknowns are eliminated together, and which others
//! each elimination touches.
//!
//! Rows with the same pattern (the components of a node) are one *group*; all of the analysis is done on groups. The
//! last `n_trailing` rows of the order are never eliminated on their own: they are the root of the tree.

use std::ops::Range;

use super::amalgamation::{Amalgamation, trapezoid};
use super::column_counts::column_counts;
use super::lower_blocks;
use super::ordering::{NodeGraph, elimination_tree, postorder};
use super::sparse::SymmetricSparse;

/// No parent.
pub(super) const NO_PARENT: usize = usize::MAX;

/// Unknowns eliminated together in one dense matrix.
#[derive(Debug, Clone)]
pub(super) struct Front {
    /// Place of its first pivot in the order.
    pub start: usize,
    /// Number of pivots.
    pub n_pivots: usize,
    /// Places after the pivots that their elimination touches, ascending.
    pub rows: Vec<usize>,
    /// The front that takes what remains; [`NO_PARENT`] at a root.
    pub parent: usize,
    /// Where its columns of L begin among the stored values.
    pub offset: usize,
}

impl Front {
    /// Rows of its dense matrix.
    pub fn size(&self) -> usize {
        self.n_pivots + self.rows.len()
    }

    /// Stored values of its columns of L, `[size, n_pivots]` by columns.
    pub fn n_values(&self) -> usize {
        self.size() * self.n_pivots
    }

    /// Values of what it leaves to its parent.
    pub fn contribution_len(&self) -> usize {
        lower_blocks::n_values(self.rows.len())
    }

    /// Operations of its elimination: factor, triangular solve, symmetric update.
    pub fn flops(&self) -> f64 {
        let (k, r) = (self.n_pivots as f64, self.rows.len() as f64);
        k * k * k / 3.0 + r * k * k + r * (r + 1.0) * k
    }
}

/// The fronts in an order in which every subtree is contiguous and precedes its root.
#[derive(Debug, Clone)]
pub(super) struct FrontTree {
    /// The fronts.
    pub fronts: Vec<Front>,
    /// Row at each place of the final order.
    pub order: Vec<usize>,
    /// Place of each row.
    pub place_of_row: Vec<usize>,
    /// First front of each front's subtree.
    pub first_in_subtree: Vec<usize>,
    children: Vec<Vec<usize>>,
}

/// Rows that have the same pattern and stand side by side in the order.
struct Supervariables {
    /// First place of each group, and the number of rows at the end, `[n_groups + 1]`.
    start: Vec<usize>,
    /// Group of each row.
    of_row: Vec<usize>,
}

impl Supervariables {
    fn new(matrix: &SymmetricSparse, order: &[usize], n_trailing: usize) -> Self {
        let n = order.len();
        let pattern = pattern_hashes(matrix);
        let (mut start, mut of_row) = (Vec::new(), vec![0; n]);
        for (place, &row) in order.iter().enumerate() {
            let new = place == 0 || place == n - n_trailing || pattern[row] != pattern[order[place - 1]];
            if new {
                start.push(place);
            }
            of_row[row] = start.len() - 1;
        }
        start.push(n);
        Self { start, of_row }
    }

    fn n(&self) -> usize {
        self.start.len() - 1
    }

    fn n_rows(&self, group: usize) -> usize {
        self.start[group + 1] - self.start[group]
    }

    /// The groups that share an entry of the matrix.
    fn graph(&self, matrix: &SymmetricSparse, order: &[usize]) -> NodeGraph {
        let (offsets, rows, _) = matrix.lower();
        let mut seen_from = vec![NO_PARENT; self.n()];
        let mut pairs = Vec::new();
        for group in 0..self.n() {
            seen_from[group] = group;
            for &column in &order[self.start[group]..self.start[group + 1]] {
                for &row in &rows[offsets[column]..offsets[column + 1]] {
                    let other = self.of_row[row];
                    if seen_from[other] != group {
                        seen_from[other] = group;
                        pairs.push((group, other));
                    }
                }
            }
        }
        NodeGraph::from_edges(self.n(), &pairs)
    }
}

/// A number per row that is the same for rows with the same pattern (different patterns may share one by chance, which
/// costs a few zeros and no more).
fn pattern_hashes(matrix: &SymmetricSparse) -> Vec<u64> {
    let mix = |row: usize| {
        let x = (row as u64 ^ 0x9E37_79B9_7F4A_7C15).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        (x ^ (x >> 29)).wrapping_mul(0x94D0_49BB_1331_11EB)
    };
    let (offsets, rows, _) = matrix.lower();
    let mut sums: Vec<u64> = (0..matrix.n()).map(mix).collect();
    for column in 0..matrix.n() {
        let own = mix(column);
        let mut sum = 0u64;
        for &row in rows[offsets[column]..offsets[column + 1]].iter().filter(|&&row| row != column) {
            sum = sum.wrapping_add(mix(row));
            sums[row] = sums[row].wrapping_add(own);
        }
        sums[column] = sums[column].wrapping_add(sum);
    }
    sums
}

impl FrontTree {
    /// Analyses `matrix` taken in `order` (`order[new] = old`), whose last `n_trailing` rows become the root.
    ///
    /// # Panics
    /// If `order` is no permutation of the rows, or shorter than `n_trailing`.
    pub fn new(matrix: &SymmetricSparse, order: &[usize], n_trailing: usize) -> Self {
        assert!(order.len() == matrix.n() && n_trailing <= order.len(), "an order of all rows");
        let groups = Supervariables::new(matrix, order, n_trailing);
        let graph = groups.graph(matrix, order);
        let n_inner = groups.start.partition_point(|&place| place < order.len() - n_trailing);
        let n_inner = n_inner.min(groups.n());
        let inside = graph.subgraph(&(0..n_inner).collect::<Vec<_>>());
        let mut sequence = postorder(&inside, (0..n_inner).collect());
        sequence.extend(n_inner..groups.n());
        let graph = graph.subgraph(&sequence);
        let weights: Vec<usize> = sequence.iter().map(|&g| groups.n_rows(g)).collect();
        let natural: Vec<usize> = (0..n_inner).collect();
        let mut parent = elimination_tree(&graph.subgraph(&natural), &natural);
        if n_trailing > 0 {
            parent.iter_mut().for_each(|p| *p = (*p).min(n_inner));
        }
        let counts = column_counts(&graph, &parent, &weights);
        let mut merging = Amalgamation::new(&parent, &counts, &weights);
        merging.amalgamate();
        let rows_of = |g: usize| {
            let group = sequence[g];
            order[groups.start[group]..groups.start[group + 1]].iter().copied()
        };
        Self::build(&merging, &graph, rows_of)
    }

    /// Numbers the fronts and their pivots, and finds the rows that each front touches.
    fn build<I: Iterator<Item = usize>>(
        merging: &Amalgamation,
        graph: &NodeGraph,
        rows_of: impl Fn(usize) -> I,
    ) -> Self {
        let sequence = merging.memory_saving_postorder();
        let mut tree = Self {
            fronts: Vec::new(),
            order: Vec::new(),
            place_of_row: Vec::new(),
            first_in_subtree: Vec::new(),
            children: Vec::new(),
        };
        let mut number = vec![NO_PARENT; merging.parent.len()];
        sequence.iter().enumerate().for_each(|(new, &old)| number[old] = new);
        // Places of the groups' rows, and the sequence of the groups themselves.
        let mut span = vec![0..0; graph.n_nodes()];
        for &old in &sequence {
            let start = tree.order.len();
            for &group in &merging.pivots[old] {
                let from = tree.order.len();
                tree.order.extend(rows_of(group));
                span[group] = from..tree.order.len();
            }
            let n_pivots = tree.order.len() - start;
            let parent =
                if merging.parent[old] == NO_PARENT { NO_PARENT } else { number[merging.parent[old]] };
            tree.fronts.push(Front { start, n_pivots, rows: Vec::new(), parent, offset: 0 });
        }
        let touched = front_patterns(merging, graph, &sequence, &span);
        let mut offset = 0;
        for (front, groups) in tree.fronts.iter_mut().zip(touched) {
            front.rows.extend(groups.into_iter().flat_map(|group| span[group].clone()));
            front.offset = offset;
            offset += front.n_values();
        }
        tree.place_of_row = vec![0; tree.order.len()];
        tree.order.iter().enumerate().for_each(|(place, &row)| tree.place_of_row[row] = place);
        tree.first_in_subtree = (0..tree.fronts.len()).collect();
        tree.children = vec![Vec::new(); tree.fronts.len()];
        for front in 0..tree.fronts.len() {
            let parent = tree.fronts[front].parent;
            if parent != NO_PARENT {
                tree.children[parent].push(front);
                tree.first_in_subtree[parent] =
                    tree.first_in_subtree[parent].min(tree.first_in_subtree[front]);
            }
        }
        tree
    }

    /// Number of stored values of L.
    pub fn n_values(&self) -> usize {
        self.fronts.last().map_or(0, |front| front.offset + front.n_values())
    }

    /// Number of entries of L, the zeros that merging added included.
    pub fn n_entries(&self) -> usize {
        let entries = |front: &Front| trapezoid(front.n_pivots, front.size()) as usize;
        self.fronts.iter().map(entries).sum()
    }

    /// Floating-point operations of the factorisation.
    pub fn flops(&self) -> f64 {
        self.fronts.iter().map(Front::flops).sum()
    }
}

impl FrontTree {
    /// The children of a front, ascending.
    pub fn children(&self, front: usize) -> impl Iterator<Item = usize> + Clone {
        self.children[front].iter().copied()
    }

    /// Where the columns of L of neighbouring fronts are among the stored values.
    pub fn values_of(&self, fronts: Range<usize>) -> Range<usize> {
        let end = self.fronts.get(fronts.end).map_or(self.n_values(), |front| front.offset);
        self.fronts.get(fronts.start).map_or(end, |front| front.offset)..end
    }
}

/// Groups after its pivots that each front touches, in the final order.
fn front_patterns(
    merging: &Amalgamation,
    graph: &NodeGraph,
    sequence: &[usize],
    span: &[Range<usize>],
) -> Vec<Vec<usize>> {
    let mut number = vec![NO_PARENT; merging.parent.len()];
    sequence.iter().enumerate().for_each(|(new, &old)| number[old] = new);
    let mut touched: Vec<Vec<usize>> = vec![Vec::new(); sequence.len()];
    let mut children: Vec<Vec<usize>> = vec![Vec::new(); sequence.len()];
    let mut seen_from = vec![NO_PARENT; graph.n_nodes()];
    for (front, &old) in sequence.iter().enumerate() {
        let pivots = &merging.pivots[old];
        let end = pivots.last().map_or(0, |&group| span[group].end);
        let mut own = Vec::new();
        let mut visit = |group: usize| {
            if span[group].start >= end && std::mem::replace(&mut seen_from[group], front) != front {
                own.push(group);
            }
        };
        pivots.iter().for_each(|&pivot| graph.neighbours(pivot).iter().for_each(|&group| visit(group)));
        children[front].iter().for_each(|&child| touched[child].iter().for_each(|&group| visit(group)));
        own.sort_unstable_by_key(|&group| span[group].start);
        touched[front] = own;
        if merging.parent[old] != NO_PARENT {
            children[number[merging.parent[old]]].push(front);
        }
    }
    touched
}
