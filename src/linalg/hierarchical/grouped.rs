//! Blocks of matrices whose entries come together: three rows of a node and the columns of an element.

use std::ops::Range;

use super::cross::{Lines, place};

/// Rows of a node.
pub const ROWS: usize = 3;

/// Places, as shares of the rows and columns, of those that are computed to begin with.
const FIRST_ROWS: [f64; 4] = [0.0, 1.0, 0.34, 0.67];
const FIRST_COLUMN: f64 = 0.5;

const UNKNOWN: u32 = u32::MAX;

/// A matrix of a collocation method: its rows belong to nodes, its columns to elements, the places of a cluster tree.
pub trait Collocation: Sync {
    /// Writes what element `element` does at node `node`: its columns one after the other, three rows each; after those of the matrix
    /// the ones that are only summed up.
    fn entries(&self, node: usize, element: usize, values: &mut [f64]);
}

/// How rows and columns are grouped.
#[derive(Debug, Clone)]
pub struct Groups {
    /// First node of each element in the order of the tree, and their number.
    first: Vec<usize>,
    element_of: Vec<u32>,
    extra: usize,
}

impl Groups {
    /// `nodes` of each element in the order of the tree, three columns for each, and `extra` columns of each element that are only
    /// summed up.
    pub fn new(nodes: impl Iterator<Item = usize>, extra: usize) -> Self {
        let (mut first, mut element_of) = (vec![0], Vec::new());
        for (element, count) in nodes.enumerate() {
            element_of.resize(element_of.len() + count, element as u32);
            first.push(element_of.len());
        }
        Self { first, element_of, extra }
    }

    /// Number of nodes.
    pub fn n_nodes(&self) -> usize {
        self.element_of.len()
    }

    /// Columns of each element that are only summed up.
    pub fn extra(&self) -> usize {
        self.extra
    }

    /// Nodes of some elements.
    pub fn nodes(&self, elements: &Range<usize>) -> Range<usize> {
        self.first[elements.start]..self.first[elements.end]
    }

    /// Rows, or columns of the matrix, of some elements.
    pub fn unknowns(&self, elements: &Range<usize>) -> Range<usize> {
        let nodes = self.nodes(elements);
        ROWS * nodes.start..ROWS * nodes.end
    }

    /// Columns of an element with the others.
    fn width(&self, element: usize) -> usize {
        ROWS * (self.first[element + 1] - self.first[element]) + self.extra
    }
}

/// A block whose lines are computed when they are first asked for, those of a node or element together. The columns that are only summed
/// up come last.
pub(super) struct GroupedLines<'k, K> {
    kernel: &'k K,
    groups: &'k Groups,
    nodes: Range<usize>,
    elements: Range<usize>,
    /// Columns of the matrix, and all.
    kept: usize,
    all: usize,
    values: Vec<f64>,
    /// Where among the known lines those of a node or an element begin.
    known_nodes: Vec<u32>,
    known_elements: Vec<u32>,
    row_places: Vec<usize>,
    row_values: Vec<f64>,
    column_places: Vec<usize>,
    column_values: Vec<f64>,
}

impl<'k, K: Collocation> GroupedLines<'k, K> {
    pub fn new(kernel: &'k K, groups: &'k Groups, rows: Range<usize>, elements: Range<usize>) -> Self {
        let nodes = groups.nodes(&rows);
        let kept = ROWS * groups.nodes(&elements).len();
        Self {
            kernel,
            groups,
            kept,
            all: kept + groups.extra * elements.len(),
            values: Vec::new(),
            known_nodes: vec![UNKNOWN; nodes.len()],
            known_elements: vec![UNKNOWN; elements.len()],
            row_places: Vec::new(),
            row_values: Vec::new(),
            column_places: Vec::new(),
            column_values: Vec::new(),
            nodes,
            elements,
        }
    }

    /// With the lines that crosses begin with.
    pub fn begun(mut self) -> Self {
        let (nodes, elements) = (self.nodes.len(), self.elements.len());
        for share in FIRST_ROWS {
            self.know_node(place(share, nodes));
        }
        self.know_element(place(FIRST_COLUMN, elements));
        self
    }

    /// Columns of the matrix.
    pub fn kept(&self) -> usize {
        self.kept
    }

    /// The columns of an element, each its place in the block and its three rows at a node.
    fn evaluate(&mut self, node: usize, element: usize) -> impl Iterator<Item = (usize, &[f64])> {
        let (groups, place) = (self.groups, self.elements.start + element);
        self.values.resize(ROWS * groups.width(place), 0.0);
        self.kernel.entries(self.nodes.start + node, place, &mut self.values);
        let count = groups.width(place) - groups.extra;
        let (first, kept) = (ROWS * (groups.first[place] - groups.first[self.elements.start]), self.kept);
        let at = move |c: usize| {
            if c < count { first + c } else { kept + groups.extra * element + c - count }
        };
        self.values.chunks_exact(ROWS).enumerate().map(move |(c, rows)| (at(c), rows))
    }

    fn know_node(&mut self, node: usize) -> usize {
        if self.known_nodes[node] == UNKNOWN {
            let (n, from) = (self.all, self.row_values.len());
            let mut rows = std::mem::take(&mut self.row_values);
            rows.resize(from + ROWS * n, 0.0);
            for element in 0..self.elements.len() {
                for (j, values) in self.evaluate(node, element) {
                    values.iter().enumerate().for_each(|(r, value)| rows[from + r * n + j] = *value);
                }
            }
            self.row_values = rows;
            self.known_nodes[node] = self.row_places.len() as u32;
            self.row_places.extend((0..ROWS).map(|r| ROWS * node + r));
        }
        self.known_nodes[node] as usize
    }

    /// The columns of an element become known.
    fn know_element(&mut self, element: usize) {
        if self.known_elements[element] != UNKNOWN {
            return;
        }
        let (m, from) = (ROWS * self.nodes.len(), self.column_values.len());
        let width = self.groups.width(self.elements.start + element);
        let mut columns = std::mem::take(&mut self.column_values);
        columns.resize(from + width * m, 0.0);
        self.known_elements[element] = self.column_places.len() as u32;
        for node in 0..self.nodes.len() {
            for (c, (_, values)) in self.evaluate(node, element).enumerate() {
                columns[from + c * m + ROWS * node..][..ROWS].copy_from_slice(values);
            }
        }
        self.column_values = columns;
        let (groups, place) = (self.groups, self.elements.start + element);
        let first = ROWS * (groups.first[place] - groups.first[self.elements.start]);
        self.column_places.extend(first..first + width - groups.extra);
        let others = self.kept + groups.extra * element;
        self.column_places.extend(others..others + groups.extra);
    }

    /// All entries, column by column.
    pub fn everything(&mut self) -> Vec<f64> {
        let m = ROWS * self.nodes.len();
        let mut values = vec![0.0; m * self.all];
        for node in 0..self.nodes.len() {
            for element in 0..self.elements.len() {
                for (j, rows) in self.evaluate(node, element) {
                    values[j * m + ROWS * node..][..ROWS].copy_from_slice(rows);
                }
            }
        }
        values
    }
}

impl<K: Collocation> Lines for &mut GroupedLines<'_, K> {
    /// All columns of an element become known together, which takes longer than a cross more.
    const KEPT: f64 = 0.1;

    fn size(&self) -> (usize, usize) {
        (ROWS * self.nodes.len(), self.all)
    }

    fn known_rows(&self) -> &[usize] {
        &self.row_places
    }

    fn known_columns(&self) -> &[usize] {
        &self.column_places
    }

    fn row(&mut self, i: usize) -> &[f64] {
        let at = self.know_node(i / ROWS) + i % ROWS;
        &self.row_values[at * self.all..(at + 1) * self.all]
    }

    fn column(&mut self, j: usize) -> &[f64] {
        let (groups, start) = (self.groups, self.elements.start);
        let (element, c) = if j < self.kept {
            let node = groups.first[start] + j / ROWS;
            let place = groups.element_of[node] as usize;
            (place - start, ROWS * (node - groups.first[place]) + j % ROWS)
        } else {
            let (element, extra) = ((j - self.kept) / groups.extra, (j - self.kept) % groups.extra);
            (element, groups.width(start + element) - groups.extra + extra)
        };
        self.know_element(element);
        let (m, at) = (ROWS * self.nodes.len(), self.known_elements[element] as usize + c);
        &self.column_values[at * m..(at + 1) * m]
    }
}
