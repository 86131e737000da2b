//! Sparse symmetric matrix in blocks of 3 x 3 entries. Each pair of connected nodes has one block.

use super::super::dense::try_zeroed;
use super::super::ordering::NodeGraph;
use super::super::simd::wide;
use super::super::sparse::SymmetricSparse;
use crate::error::Result;

/// Number of vectors that are multiplied or solved together.
pub(super) const LANES: usize = 8;

/// Entries of [`LANES`] vectors in one row.
pub(super) type Lanes = [f64; LANES];

/// Block of 3 x 3 entries, row by row.
pub(super) type Block3x3 = [f64; 9];

/// Node and component of each matrix row, and positions of the nodes.
#[derive(Debug, Clone)]
pub struct NodalUnknowns {
    /// Node (an index into `points`) and component (0, 1, 2) of each row.
    pub of_row: Vec<(usize, usize)>,
    /// Positions of the nodes, mm.
    pub points: Vec<[f64; 3]>,
}

/// Symmetric block matrix A with nodes in Cuthill-McKee order. If a node lacks a component, the row of this component
/// is a row of the identity.
pub(super) struct NodeMatrix {
    /// Position of each matrix row among the `3 n` rows in Cuthill-McKee order.
    pub position_of_row: Vec<usize>,
    /// Positions of the nodes in Cuthill-McKee order, mm.
    pub points: Vec<[f64; 3]>,
    /// Offset of the first block to the left of the diagonal for each node, `[n + 1]`.
    pub offsets: Vec<usize>,
    /// Column nodes of the blocks to the left of the diagonal, ascending in each row.
    pub columns: Vec<u32>,
    pub lower: Vec<Block3x3>,
    pub diagonal: Vec<Block3x3>,
    pub has_component: Vec<[bool; 3]>,
}

impl NodeMatrix {
    pub fn new(matrix: &SymmetricSparse, unknowns: &NodalUnknowns) -> Result<Self> {
        let n = unknowns.points.len();
        let graph = graph(matrix, unknowns);
        let order = cuthill_mckee(&graph);
        let mut place = vec![0; n];
        order.iter().enumerate().for_each(|(new, &old)| place[old] = new);
        let (mut offsets, mut columns) = (vec![0], Vec::new());
        for (new, &old) in order.iter().enumerate() {
            let from = columns.len();
            let left = graph.neighbours(old).iter().map(|&other| place[other]).filter(|&other| other < new);
            columns.extend(left.map(|other| other as u32));
            columns[from..].sort_unstable();
            offsets.push(columns.len());
        }
        let mut lower = blocks(columns.len())?;
        let mut diagonal = blocks(n)?;
        let mut has_component = vec![[false; 3]; n];
        let position_of_row: Vec<usize> =
            unknowns.of_row.iter().map(|&(node, c)| 3 * place[node] + c).collect();
        position_of_row.iter().for_each(|row| has_component[row / 3][row % 3] = true);
        let (starts, rows, values) = matrix.lower();
        for column in 0..matrix.n() {
            for k in starts[column]..starts[column + 1] {
                let (a, b) = (position_of_row[rows[k]], position_of_row[column]);
                let ((i, r), (j, c)) = ((a.max(b) / 3, a.max(b) % 3), (a.min(b) / 3, a.min(b) % 3));
                if i == j {
                    diagonal[i][3 * r + c] = values[k];
                    diagonal[i][3 * c + r] = values[k];
                } else {
                    let own = &columns[offsets[i]..offsets[i + 1]];
                    let at = offsets[i] + own.partition_point(|&other| (other as usize) < j);
                    lower[at][3 * r + c] = values[k];
                }
            }
        }
        for (block, exists) in diagonal.iter_mut().zip(&has_component) {
            (0..3).filter(|&c| !exists[c]).for_each(|c| block[4 * c] = 1.0);
        }
        let points = order.iter().map(|&old| unknowns.points[old]).collect();
        Ok(Self { position_of_row, points, offsets, columns, lower, diagonal, has_component })
    }

    pub fn n(&self) -> usize {
        self.diagonal.len()
    }

    /// Blocks to the left of the diagonal in the row of `node`, with their column nodes.
    pub fn row(&self, node: usize) -> impl DoubleEndedIterator<Item = (usize, &Block3x3)> {
        let range = self.offsets[node]..self.offsets[node + 1];
        self.columns[range.clone()].iter().map(|&column| column as usize).zip(&self.lower[range])
    }

    /// Computes `y = A x`, both `[3 n]`.
    pub fn multiply(&self, x: &[Lanes], y: &mut [Lanes]) {
        wide!(multiply(self => matrix: &NodeMatrix, x => x: &[Lanes], y => y: &mut [Lanes]));
    }

    pub fn graph(&self) -> NodeGraph {
        let pairs: Vec<(usize, usize)> =
            (0..self.n()).flat_map(|i| self.row(i).map(move |(j, _)| (i, j))).collect();
        NodeGraph::from_edges(self.n(), &pairs)
    }

    /// Coupling strength of two connected nodes: norm of their block, divided by the geometric mean of the norms of
    /// their diagonal blocks. All norms are Frobenius norms.
    pub fn coupling_strength(&self, a: usize, b: usize) -> f64 {
        let size = |block: &Block3x3| block.iter().map(|v| v * v).sum::<f64>().sqrt();
        let (i, j) = (a.max(b), a.min(b));
        let own = &self.columns[self.offsets[i]..self.offsets[i + 1]];
        let at = self.offsets[i] + own.partition_point(|&other| (other as usize) < j);
        size(&self.lower[at]) / (size(&self.diagonal[i]) * size(&self.diagonal[j])).sqrt()
    }
}

#[inline(always)]
fn multiply(matrix: &NodeMatrix, x: &[Lanes], y: &mut [Lanes]) {
    for i in 0..matrix.n() {
        let own = rows_of_node(x, i);
        let mut sum = [[0.0; LANES]; 3];
        add(&mut sum, &matrix.diagonal[i], own);
        for (j, block) in matrix.row(i) {
            add(&mut sum, block, rows_of_node(x, j));
            add_transposed(rows_of_node_mut(y, j), block, own);
        }
        *rows_of_node_mut(y, i) = sum;
    }
}

pub(super) fn blocks(n: usize) -> Result<Vec<Block3x3>> {
    // The first allocation only checks that memory suffices.
    drop(try_zeroed(9 * n)?);
    Ok(vec![[0.0; 9]; n])
}

fn graph(matrix: &SymmetricSparse, unknowns: &NodalUnknowns) -> NodeGraph {
    let (offsets, rows, _) = matrix.lower();
    let mut others: Vec<Vec<usize>> = vec![Vec::new(); unknowns.points.len()];
    for column in 0..matrix.n() {
        let node = unknowns.of_row[column].0;
        for &row in &rows[offsets[column]..offsets[column + 1]] {
            let other = unknowns.of_row[row].0;
            let (from, to) = (node.max(other), node.min(other));
            // The rows of a node are consecutive, so that a repeated neighbour is usually the last one in the list.
            if from != to && others[from].last() != Some(&to) {
                others[from].push(to);
            }
        }
    }
    let mut pairs = Vec::new();
    for (node, mut others) in others.into_iter().enumerate() {
        others.sort_unstable();
        others.dedup();
        pairs.extend(others.into_iter().map(|other| (node, other)));
    }
    NodeGraph::from_edges(unknowns.points.len(), &pairs)
}

/// Cuthill-McKee order: breadth-first order of the nodes, which starts at nodes with few neighbours. Neighbours get
/// close positions.
///
/// # Source
/// Cuthill and McKee (1969), Proc. 24th ACM National Conference.
fn cuthill_mckee(graph: &NodeGraph) -> Vec<usize> {
    let n = graph.n_nodes();
    let degree = |node: usize| graph.neighbours(node).len();
    let mut starts: Vec<usize> = (0..n).collect();
    starts.sort_by_key(|&node| degree(node));
    let (mut order, mut seen) = (Vec::with_capacity(n), vec![false; n]);
    for start in starts {
        if std::mem::replace(&mut seen[start], true) {
            continue;
        }
        let mut next = order.len();
        order.push(start);
        while next < order.len() {
            let from = order.len();
            for &other in graph.neighbours(order[next]) {
                if !std::mem::replace(&mut seen[other], true) {
                    order.push(other);
                }
            }
            order[from..].sort_by_key(|&node| degree(node));
            next += 1;
        }
    }
    order
}

#[inline(always)]
pub(super) fn rows_of_node(x: &[Lanes], node: usize) -> &[Lanes; 3] {
    x[3 * node..3 * node + 3].try_into().expect("three rows")
}

#[inline(always)]
pub(super) fn rows_of_node_mut(x: &mut [Lanes], node: usize) -> &mut [Lanes; 3] {
    (&mut x[3 * node..3 * node + 3]).try_into().expect("three rows")
}

/// Computes `y += block x`.
#[inline(always)]
pub(super) fn add(y: &mut [Lanes; 3], block: &Block3x3, x: &[Lanes; 3]) {
    for r in 0..3 {
        for l in 0..LANES {
            y[r][l] += block[3 * r] * x[0][l] + block[3 * r + 1] * x[1][l] + block[3 * r + 2] * x[2][l];
        }
    }
}

/// Computes `y += blockᵀ x`.
#[inline(always)]
pub(super) fn add_transposed(y: &mut [Lanes; 3], block: &Block3x3, x: &[Lanes; 3]) {
    for r in 0..3 {
        for l in 0..LANES {
            y[r][l] += block[r] * x[0][l] + block[3 + r] * x[1][l] + block[6 + r] * x[2][l];
        }
    }
}
