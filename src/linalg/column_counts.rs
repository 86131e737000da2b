//! How many entries each column of a Cholesky factor will have, without forming its pattern.

use super::fronts::NO_PARENT;
use super::ordering::NodeGraph;

/// Rows of L in the column of each vertex, itself included, counted by weight, `[parent.len()]`.
///
/// The graph's vertices are in a postorder of the elimination tree `parent`; vertices from `parent.len()` on are rows
/// only, below all columns, and are the one root above the tree where there are any.
///
/// # Source
/// Gilbert, Ng and Peyton (1994), SIAM J. Matrix Anal. Appl. 15: a row's entries form a subtree, counted at its leaves
/// and taken back at their lowest common ancestors.
pub(super) fn column_counts(graph: &NodeGraph, parent: &[usize], weights: &[usize]) -> Vec<usize> {
    let n = parent.len();
    let signed = |vertex: usize| weights[vertex] as isize;
    let mut leaves = RowSubtreeLeaves::new(parent, graph.n_nodes());
    let mut delta = vec![0isize; n + 1];
    for j in 0..n {
        if leaves.first[j] == j {
            delta[j] += signed(j);
        }
        if parent[j] != NO_PARENT {
            delta[parent[j]] -= signed(j);
        }
        for &i in graph.neighbours(j).iter().filter(|&&i| i > j) {
            if let Some(above) = leaves.common_ancestor_of_leaf(i, j) {
                delta[j] += signed(i);
                if above != NO_PARENT {
                    delta[above] -= signed(i);
                }
            }
        }
        if parent[j] != NO_PARENT {
            leaves.ancestor[j] = parent[j];
        }
    }
    for j in 0..n {
        if parent[j] != NO_PARENT {
            delta[parent[j]] += delta[j];
        }
    }
    delta[..n].iter().map(|&count| count as usize).collect()
}

/// The leaves of the row subtrees, met column by column.
struct RowSubtreeLeaves {
    /// First vertex of each subtree.
    first: Vec<usize>,
    /// Largest first vertex met by each row so far, plus one.
    max_first_descendant: Vec<usize>,
    /// Last leaf of each row.
    previous_leaf: Vec<usize>,
    /// Towards the root of what is linked so far.
    ancestor: Vec<usize>,
}

impl RowSubtreeLeaves {
    fn new(parent: &[usize], n_rows: usize) -> Self {
        let n = parent.len();
        let mut first: Vec<usize> = (0..=n).collect();
        for j in 0..n {
            if parent[j] != NO_PARENT {
                first[parent[j]] = first[parent[j]].min(first[j]);
            }
        }
        Self {
            first,
            max_first_descendant: vec![0; n_rows],
            previous_leaf: vec![NO_PARENT; n_rows],
            ancestor: (0..=n).collect(),
        }
    }

    /// Whether `j` is a leaf of row `i`'s subtree: then the common ancestor with the leaf before, [`NO_PARENT`] for the first.
    fn common_ancestor_of_leaf(&mut self, i: usize, j: usize) -> Option<usize> {
        if self.first[j] < self.max_first_descendant[i] {
            return None;
        }
        self.max_first_descendant[i] = self.first[j] + 1;
        let before = std::mem::replace(&mut self.previous_leaf[i], j);
        if before == NO_PARENT {
            return Some(NO_PARENT);
        }
        let mut root = before;
        while self.ancestor[root] != root {
            root = self.ancestor[root];
        }
        let mut vertex = before;
        while vertex != root {
            vertex = std::mem::replace(&mut self.ancestor[vertex], root);
        }
        Some(root)
    }
}

#[cfg(test)]
mod tests {
    use super::super::ordering::{elimination_tree, postorder};
    use super::*;

    /// Truth: elimination carried out on the pattern: eliminating a vertex connects its later neighbours. With the last
    /// vertices as rows only, and with all of them as columns.
    #[test]
    fn counts_are_those_of_the_elimination() {
        let n = 60;
        let pairs: Vec<(usize, usize)> = (0..n)
            .flat_map(|i| [(i, (7 * i + 3) % n), (i, (i + 1) % n), (i, (i * i + 5) % n)])
            .filter(|(i, j)| i != j)
            .collect();
        for n_inner in [n, n - 9] {
            let graph = NodeGraph::from_edges(n, &pairs);
            let natural: Vec<usize> = (0..n_inner).collect();
            let mut sequence = postorder(&graph.subgraph(&natural), natural.clone());
            sequence.extend(n_inner..n);
            let graph = graph.subgraph(&sequence);
            let mut parent = elimination_tree(&graph.subgraph(&natural), &natural);
            if n_inner < n {
                parent.iter_mut().for_each(|p| *p = (*p).min(n_inner));
            }
            let weights: Vec<usize> = (0..n).map(|i| 1 + i % 3).collect();
            let mut touched = vec![vec![false; n]; n];
            (0..n).for_each(|i| graph.neighbours(i).iter().for_each(|&j| touched[i.min(j)][i.max(j)] = true));
            let mut expected = Vec::new();
            for j in 0..n_inner {
                let rows: Vec<usize> = (j + 1..n).filter(|&i| touched[j][i]).collect();
                expected.push(weights[j] + rows.iter().map(|&i| weights[i]).sum::<usize>());
                for (k, &a) in rows.iter().enumerate() {
                    rows[k + 1..].iter().for_each(|&b| touched[a][b] = true);
                }
            }
            assert_eq!(column_counts(&graph, &parent, &weights), expected);
        }
    }
}
