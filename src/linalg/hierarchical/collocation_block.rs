//! Blocks of collocation matrices whose rows and columns are computed on first use.

use std::ops::Range;

use super::cross_approximation::{LazyMatrix, index_at_share};

/// Number of rows per node: one per direction.
pub const ROWS_PER_NODE: usize = 3;

/// First rows and first column of a cross approximation. The numbers are positions of nodes (`FIRST_ROWS`) and of an
/// element (`FIRST_COLUMN`), as fractions of the largest index in the block.
const FIRST_ROWS: [f64; 4] = [0.0, 1.0, 0.34, 0.67];
const FIRST_COLUMN: f64 = 0.5;

const NOT_COMPUTED: u32 = u32::MAX;

/// Kernel of a collocation matrix. Rows belong to nodes, columns to elements. Nodes and elements have the order of a
/// cluster tree.
pub trait CollocationKernel: Sync {
    /// Writes the three rows of `node` in all columns of `element` to `values`, column by column.
    ///
    /// The matrix columns of the element come first. The summed columns of the element follow
    /// ([`ElementNumbering::n_sum_columns`]).
    fn entries(&self, node: usize, element: usize, values: &mut [f64]);
}

/// Numbering of the nodes and of their matrix rows and columns. The numbers increase element by element in the order of
/// the cluster tree.
#[derive(Debug, Clone)]
pub struct ElementNumbering {
    /// First node of each element in tree order. The last entry is the total number of nodes.
    first: Vec<usize>,
    element_of: Vec<u32>,
    n_sum_columns: usize,
}

impl ElementNumbering {
    /// Creates the numbering. `nodes` yields the number of nodes of each element in tree order. Each node has three
    /// matrix columns.
    ///
    /// Each element has `n_sum_columns` additional columns, the summed columns. The matrix keeps only their sums over
    /// all elements.
    pub fn new(nodes: impl Iterator<Item = usize>, n_sum_columns: usize) -> Self {
        let (mut first, mut element_of) = (vec![0], Vec::new());
        for (element, count) in nodes.enumerate() {
            element_of.resize(element_of.len() + count, element as u32);
            first.push(element_of.len());
        }
        Self { first, element_of, n_sum_columns }
    }

    /// Number of nodes.
    pub fn n_nodes(&self) -> usize {
        self.element_of.len()
    }

    /// Number of summed columns of each element.
    pub fn n_sum_columns(&self) -> usize {
        self.n_sum_columns
    }

    /// Range of the nodes of the elements in the range `elements`.
    pub fn nodes(&self, elements: &Range<usize>) -> Range<usize> {
        self.first[elements.start]..self.first[elements.end]
    }

    /// Range of the matrix rows of a range of elements. The matrix columns of these elements have the same indices.
    pub fn dofs(&self, elements: &Range<usize>) -> Range<usize> {
        let nodes = self.nodes(elements);
        ROWS_PER_NODE * nodes.start..ROWS_PER_NODE * nodes.end
    }

    fn n_columns(&self, element: usize) -> usize {
        ROWS_PER_NODE * (self.first[element + 1] - self.first[element]) + self.n_sum_columns
    }
}

/// Block of a collocation matrix whose rows and columns are computed on first use. All rows of a node are computed
/// together, and all columns of an element. The summed columns follow the matrix columns.
pub(super) struct CollocationBlock<'k, K> {
    kernel: &'k K,
    groups: &'k ElementNumbering,
    nodes: Range<usize>,
    elements: Range<usize>,
    /// Number of matrix columns. `n_columns` is the number of matrix columns and summed columns.
    n_matrix_columns: usize,
    n_columns: usize,
    values: Vec<f64>,
    /// Index in `row_places` of the first row of each node, or [`NOT_COMPUTED`].
    first_row_of_node: Vec<u32>,
    first_column_of_element: Vec<u32>,
    row_places: Vec<usize>,
    row_values: Vec<f64>,
    column_places: Vec<usize>,
    column_values: Vec<f64>,
}

impl<'k, K: CollocationKernel> CollocationBlock<'k, K> {
    pub fn new(
        kernel: &'k K,
        groups: &'k ElementNumbering,
        rows: Range<usize>,
        elements: Range<usize>,
    ) -> Self {
        let nodes = groups.nodes(&rows);
        let n_matrix_columns = ROWS_PER_NODE * groups.nodes(&elements).len();
        Self {
            kernel,
            groups,
            n_matrix_columns,
            n_columns: n_matrix_columns + groups.n_sum_columns * elements.len(),
            values: Vec::new(),
            first_row_of_node: vec![NOT_COMPUTED; nodes.len()],
            first_column_of_element: vec![NOT_COMPUTED; elements.len()],
            row_places: Vec::new(),
            row_values: Vec::new(),
            column_places: Vec::new(),
            column_values: Vec::new(),
            nodes,
            elements,
        }
    }

    pub fn with_initial_lines(mut self) -> Self {
        let (nodes, elements) = (self.nodes.len(), self.elements.len());
        for share in FIRST_ROWS {
            self.compute_node_rows(index_at_share(share, nodes));
        }
        self.compute_element_columns(index_at_share(FIRST_COLUMN, elements));
        self
    }

    pub fn n_matrix_columns(&self) -> usize {
        self.n_matrix_columns
    }

    /// Evaluates the kernel for an element at a node. Yields the position of each column in the block and its three
    /// entries.
    fn evaluate(&mut self, node: usize, element: usize) -> impl Iterator<Item = (usize, &[f64])> {
        let (groups, place) = (self.groups, self.elements.start + element);
        self.values.resize(ROWS_PER_NODE * groups.n_columns(place), 0.0);
        self.kernel.entries(self.nodes.start + node, place, &mut self.values);
        let count = groups.n_columns(place) - groups.n_sum_columns;
        let (first, kept) = (
            ROWS_PER_NODE * (groups.first[place] - groups.first[self.elements.start]),
            self.n_matrix_columns,
        );
        let at = move |c: usize| {
            if c < count { first + c } else { kept + groups.n_sum_columns * element + c - count }
        };
        self.values.chunks_exact(ROWS_PER_NODE).enumerate().map(move |(c, rows)| (at(c), rows))
    }

    fn compute_node_rows(&mut self, node: usize) -> usize {
        if self.first_row_of_node[node] == NOT_COMPUTED {
            let (n, from) = (self.n_columns, self.row_values.len());
            let mut rows = std::mem::take(&mut self.row_values);
            rows.resize(from + ROWS_PER_NODE * n, 0.0);
            for element in 0..self.elements.len() {
                for (j, values) in self.evaluate(node, element) {
                    values.iter().enumerate().for_each(|(r, value)| rows[from + r * n + j] = *value);
                }
            }
            self.row_values = rows;
            self.first_row_of_node[node] = self.row_places.len() as u32;
            self.row_places.extend((0..ROWS_PER_NODE).map(|r| ROWS_PER_NODE * node + r));
        }
        self.first_row_of_node[node] as usize
    }

    fn compute_element_columns(&mut self, element: usize) {
        if self.first_column_of_element[element] != NOT_COMPUTED {
            return;
        }
        let (m, from) = (ROWS_PER_NODE * self.nodes.len(), self.column_values.len());
        let width = self.groups.n_columns(self.elements.start + element);
        let mut columns = std::mem::take(&mut self.column_values);
        columns.resize(from + width * m, 0.0);
        self.first_column_of_element[element] = self.column_places.len() as u32;
        for node in 0..self.nodes.len() {
            for (c, (_, values)) in self.evaluate(node, element).enumerate() {
                columns[from + c * m + ROWS_PER_NODE * node..][..ROWS_PER_NODE].copy_from_slice(values);
            }
        }
        self.column_values = columns;
        let (groups, place) = (self.groups, self.elements.start + element);
        let first = ROWS_PER_NODE * (groups.first[place] - groups.first[self.elements.start]);
        self.column_places.extend(first..first + width - groups.n_sum_columns);
        let others = self.n_matrix_columns + groups.n_sum_columns * element;
        self.column_places.extend(others..others + groups.n_sum_columns);
    }

    /// Computes all entries including the summed columns, column by column.
    pub fn everything(&mut self) -> Vec<f64> {
        let m = ROWS_PER_NODE * self.nodes.len();
        let mut values = vec![0.0; m * self.n_columns];
        for node in 0..self.nodes.len() {
            for element in 0..self.elements.len() {
                for (j, rows) in self.evaluate(node, element) {
                    values[j * m + ROWS_PER_NODE * node..][..ROWS_PER_NODE].copy_from_slice(rows);
                }
            }
        }
        values
    }
}

impl<K: CollocationKernel> LazyMatrix for &mut CollocationBlock<'_, K> {
    /// The share is small, because one new column requires the computation of all columns of its element.
    const KNOWN_COLUMN_SHARE: f64 = 0.1;

    fn size(&self) -> (usize, usize) {
        (ROWS_PER_NODE * self.nodes.len(), self.n_columns)
    }

    fn known_rows(&self) -> &[usize] {
        &self.row_places
    }

    fn known_columns(&self) -> &[usize] {
        &self.column_places
    }

    fn row(&mut self, i: usize) -> &[f64] {
        let at = self.compute_node_rows(i / ROWS_PER_NODE) + i % ROWS_PER_NODE;
        &self.row_values[at * self.n_columns..(at + 1) * self.n_columns]
    }

    fn column(&mut self, j: usize) -> &[f64] {
        let (groups, start) = (self.groups, self.elements.start);
        let (element, c) = if j < self.n_matrix_columns {
            let node = groups.first[start] + j / ROWS_PER_NODE;
            let place = groups.element_of[node] as usize;
            (place - start, ROWS_PER_NODE * (node - groups.first[place]) + j % ROWS_PER_NODE)
        } else {
            let (element, extra) = (
                (j - self.n_matrix_columns) / groups.n_sum_columns,
                (j - self.n_matrix_columns) % groups.n_sum_columns,
            );
            (element, groups.n_columns(start + element) - groups.n_sum_columns + extra)
        };
        self.compute_element_columns(element);
        let (m, at) = (ROWS_PER_NODE * self.nodes.len(), self.first_column_of_element[element] as usize + c);
        &self.column_values[at * m..(at + 1) * m]
    }
}
