//! Fill-reducing orderings for sparse Cholesky factorisation: nested dissection of the node graph by METIS, then a
//! postorder of the elimination tree.
//!
//! An order lists the old indices in their new sequence: `order[new] = old`.

use std::sync::Mutex;

use metis_sys::{METIS_NOPTIONS, METIS_NodeND, METIS_PartGraphKway, METIS_SetDefaultOptions, idx_t};

use crate::error::{Error, Result};

/// Lock for METIS, which uses the global random numbers of the C library. With concurrent calls, orders would depend on
/// timing.
static METIS_LOCK: Mutex<()> = Mutex::new(());

/// Undirected graph without loops, for example of mesh nodes that share elements.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NodeGraph {
    offsets: Vec<usize>,
    neighbours: Vec<usize>,
}

impl NodeGraph {
    /// Graph of `n_nodes` nodes. All nodes of an element are neighbours of each other.
    pub fn from_elements<'a>(n_nodes: usize, elements: impl Iterator<Item = &'a [usize]> + Clone) -> Self {
        let mut start = vec![0usize; n_nodes + 1];
        elements.clone().flatten().for_each(|&node| start[node + 1] += 1);
        for i in 0..n_nodes {
            start[i + 1] += start[i];
        }
        let all: Vec<&[usize]> = elements.collect();
        let mut next = start.clone();
        let mut elements_at = vec![0usize; start[n_nodes]];
        for (e, nodes) in all.iter().enumerate() {
            for &node in *nodes {
                elements_at[next[node]] = e;
                next[node] += 1;
            }
        }
        let mut graph = Self { offsets: vec![0], neighbours: Vec::new() };
        let mut seen_from = vec![usize::MAX; n_nodes];
        for node in 0..n_nodes {
            seen_from[node] = node;
            for &e in &elements_at[start[node]..start[node + 1]] {
                for &other in all[e] {
                    if seen_from[other] != node {
                        seen_from[other] = node;
                        graph.neighbours.push(other);
                    }
                }
            }
            graph.offsets.push(graph.neighbours.len());
        }
        graph
    }

    /// Graph of `n_nodes` nodes with the edges `pairs`. Each edge must be given once.
    pub(super) fn from_edges(n_nodes: usize, pairs: &[(usize, usize)]) -> Self {
        let mut offsets = vec![0usize; n_nodes + 1];
        pairs.iter().for_each(|&(i, j)| {
            offsets[i + 1] += 1;
            offsets[j + 1] += 1;
        });
        (0..n_nodes).for_each(|i| offsets[i + 1] += offsets[i]);
        let mut next = offsets.clone();
        let mut neighbours = vec![0; offsets[n_nodes]];
        for &(i, j) in pairs {
            for (from, to) in [(i, j), (j, i)] {
                neighbours[next[from]] = to;
                next[from] += 1;
            }
        }
        Self { offsets, neighbours }
    }

    /// Number of nodes.
    pub fn n_nodes(&self) -> usize {
        self.offsets.len() - 1
    }

    /// Nodes that an edge connects with `node`.
    pub fn neighbours(&self, node: usize) -> &[usize] {
        &self.neighbours[self.offsets[node]..self.offsets[node + 1]]
    }

    /// Subgraph of `nodes`. Node `nodes[i]` gets the index i.
    fn subgraph(&self, nodes: &[usize]) -> Self {
        let mut local = vec![usize::MAX; self.n_nodes()];
        nodes.iter().enumerate().for_each(|(i, &node)| local[node] = i);
        let mut part = Self { offsets: vec![0], neighbours: Vec::new() };
        for &node in nodes {
            let inside = self.neighbours(node).iter().map(|&other| local[other]).filter(|&i| i != usize::MAX);
            part.neighbours.extend(inside);
            part.offsets.push(part.neighbours.len());
        }
        part
    }
}

/// Elimination order of `nodes` by nested dissection, postordered. `last` is a subset of `nodes`; these nodes are
/// placed at the end in their given order.
///
/// # Errors
/// If the graph is too large for METIS's 32-bit indices, or METIS fails.
///
/// # Source
/// Karypis and Kumar (1998), SIAM J. Sci. Comput. 20.
pub fn nested_dissection(graph: &NodeGraph, nodes: &[usize], last: &[usize]) -> Result<Vec<usize>> {
    let mut is_last = vec![false; graph.n_nodes()];
    last.iter().for_each(|&node| is_last[node] = true);
    let first: Vec<usize> = nodes.iter().copied().filter(|&node| !is_last[node]).collect();
    let part = graph.subgraph(&first);
    let order = postorder(&part, metis_node_nd(&part)?);
    Ok(order.into_iter().map(|i| first[i]).chain(last.iter().copied()).collect())
}

/// Divides a graph into at most `n_parts` parts of similar size with few edges between them. Returns the part of each
/// node.
///
/// `weight(a, b)` must be positive. Edges with a large weight tend to lie inside a part.
///
/// # Source
/// Karypis and Kumar (1998), J. Parallel Distrib. Comput. 48.
pub(super) fn partition(
    graph: &NodeGraph,
    n_parts: usize,
    weight: impl Fn(usize, usize) -> i32,
) -> Result<Vec<usize>> {
    let n = graph.n_nodes();
    if n_parts < 2 || graph.neighbours.is_empty() {
        return Ok(vec![0; n]);
    }
    let [mut offsets, mut neighbours] = metis_indices(graph)?;
    let edges = (0..n).flat_map(|node| graph.neighbours(node).iter().map(move |&other| (node, other)));
    let mut weights: Vec<idx_t> = edges.map(|(a, b)| weight(a, b)).collect();
    let (mut n_metis, mut n_parts_metis) = (n as idx_t, n_parts as idx_t);
    let (mut one, mut cut) = (1, 0);
    let mut options = [0 as idx_t; METIS_NOPTIONS as usize];
    let mut parts = vec![0 as idx_t; n];
    let guard = METIS_LOCK.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    // SAFETY: the arrays have the lengths that METIS requires (n + 1, offsets[n], offsets[n], METIS_NOPTIONS, n). The
    // graph is symmetric without loops, and the weights of edges are positive. Null pointers mean equal weights of
    // nodes and parts.
    let status = unsafe {
        METIS_SetDefaultOptions(options.as_mut_ptr());
        METIS_PartGraphKway(
            &mut n_metis,
            &mut one,
            offsets.as_mut_ptr(),
            neighbours.as_mut_ptr(),
            std::ptr::null_mut(),
            std::ptr::null_mut(),
            weights.as_mut_ptr(),
            &mut n_parts_metis,
            std::ptr::null_mut(),
            std::ptr::null_mut(),
            options.as_mut_ptr(),
            &mut cut,
            parts.as_mut_ptr(),
        )
    };
    drop(guard);
    if status != metis_sys::rstatus_et_METIS_OK {
        return Err(Error::numerical(format!(
            "METIS failed to divide a mesh of {n} nodes (status {status})"
        )));
    }
    // METIS may return parts without nodes, so the parts with nodes are numbered again.
    let mut number = vec![usize::MAX; n_parts];
    let mut count = 0;
    Ok(parts
        .into_iter()
        .map(|part| {
            let number = &mut number[part as usize];
            if *number == usize::MAX {
                *number = count;
                count += 1;
            }
            *number
        })
        .collect())
}

fn metis_indices(graph: &NodeGraph) -> Result<[Vec<idx_t>; 2]> {
    let too_large = |_| {
        Error::resources(format!(
            "the mesh has {} nodes and {} connections between them, more than the 2^31 that the ordering can handle; use \
             a coarser mesh",
            graph.n_nodes(),
            graph.neighbours.len()
        ))
    };
    let convert = |list: &[usize]| -> Result<Vec<idx_t>> {
        list.iter().map(|&i| idx_t::try_from(i).map_err(too_large)).collect()
    };
    idx_t::try_from(graph.n_nodes()).map_err(too_large)?;
    Ok([convert(&graph.offsets)?, convert(&graph.neighbours)?])
}

fn metis_node_nd(graph: &NodeGraph) -> Result<Vec<usize>> {
    let n = graph.n_nodes();
    if n < 8 || graph.neighbours.is_empty() {
        return Ok((0..n).collect());
    }
    let [mut offsets, mut neighbours] = metis_indices(graph)?;
    let mut n_metis = n as idx_t;
    let mut options = [0 as idx_t; METIS_NOPTIONS as usize];
    let (mut order, mut inverse) = (vec![0 as idx_t; n], vec![0 as idx_t; n]);
    let guard = METIS_LOCK.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    // SAFETY: the arrays have the lengths that METIS requires (n + 1, offsets[n], METIS_NOPTIONS, n, n). The graph is symmetric
    // without loops, and no vertex weights are given.
    let status = unsafe {
        METIS_SetDefaultOptions(options.as_mut_ptr());
        METIS_NodeND(
            &mut n_metis,
            offsets.as_mut_ptr(),
            neighbours.as_mut_ptr(),
            std::ptr::null_mut(),
            options.as_mut_ptr(),
            order.as_mut_ptr(),
            inverse.as_mut_ptr(),
        )
    };
    drop(guard);
    if status != metis_sys::rstatus_et_METIS_OK {
        return Err(Error::numerical(format!("METIS failed to order a mesh of {n} nodes (status {status})")));
    }
    Ok(order.into_iter().map(|i| i as usize).collect())
}

/// Parent of each node in the elimination tree of the graph in `order`; `usize::MAX` for roots.
fn elimination_tree(graph: &NodeGraph, order: &[usize]) -> Vec<usize> {
    let n = order.len();
    let mut position = vec![0; n];
    order.iter().enumerate().for_each(|(new, &old)| position[old] = new);
    let (mut parent, mut ancestor) = (vec![usize::MAX; n], vec![usize::MAX; n]);
    for (j, &old) in order.iter().enumerate() {
        for &other in graph.neighbours(old) {
            let mut i = position[other];
            while i < j {
                let above = std::mem::replace(&mut ancestor[i], j);
                if above == usize::MAX {
                    parent[i] = j;
                    break;
                }
                i = above;
            }
        }
    }
    parent
}

/// Rearranges `order` so that each subtree of its elimination tree is contiguous and ends with its root.
///
/// The columns of a supernode (columns of L with equal pattern) are then adjacent. The fill does not change.
///
/// # Source
/// Liu (1990), SIAM J. Matrix Anal. Appl. 11.
fn postorder(graph: &NodeGraph, order: Vec<usize>) -> Vec<usize> {
    let n = order.len();
    let parent = elimination_tree(graph, &order);
    let (mut first_child, mut next_sibling) = (vec![usize::MAX; n + 1], vec![usize::MAX; n]);
    for j in (0..n).rev() {
        let above = parent[j].min(n);
        next_sibling[j] = first_child[above];
        first_child[above] = j;
    }
    let mut sorted = Vec::with_capacity(n);
    let mut path = vec![n];
    while let Some(&j) = path.last() {
        let child = first_child[j];
        if child != usize::MAX {
            first_child[j] = next_sibling[child];
            path.push(child);
        } else {
            path.pop();
            if j < n {
                sorted.push(order[j]);
            }
        }
    }
    sorted
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Node graph of a k x k x k grid of nodes. Each element has 2 x 2 x 2 nodes.
    fn grid(k: usize) -> NodeGraph {
        let at = |x: usize, y: usize, z: usize| (x * k + y) * k + z;
        let mut elements: Vec<Vec<usize>> = Vec::new();
        for x in 0..k - 1 {
            for y in 0..k - 1 {
                for z in 0..k - 1 {
                    elements.push((0..8).map(|c| at(x + (c >> 2), y + (c >> 1 & 1), z + (c & 1))).collect());
                }
            }
        }
        NodeGraph::from_elements(k * k * k, elements.iter().map(Vec::as_slice))
    }

    /// Number of entries of the Cholesky factor L, counted by row subtrees of the elimination tree.
    fn fill(graph: &NodeGraph, order: &[usize]) -> usize {
        let n = order.len();
        let parent = elimination_tree(graph, order);
        let mut position = vec![0; n];
        order.iter().enumerate().for_each(|(new, &old)| position[old] = new);
        let mut mark = vec![usize::MAX; n];
        let mut count = n;
        for (j, &old) in order.iter().enumerate() {
            mark[j] = j;
            for &other in graph.neighbours(old) {
                let mut i = position[other];
                while i < j && mark[i] != j {
                    mark[i] = j;
                    count += 1;
                    i = parent[i];
                }
            }
        }
        count
    }

    /// Truth: the fill of a 3D grid with n nodes is O(n^(4/3)) for nested dissection and O(n^(5/3)) for the natural
    /// (banded) order (George 1973). Postordering an elimination tree does not change the fill (Liu 1990).
    #[test]
    fn nested_dissection_fills_less_than_the_natural_order() {
        let graph = grid(14);
        let natural: Vec<usize> = (0..graph.n_nodes()).collect();
        let metis = metis_node_nd(&graph).unwrap();
        let sorted = postorder(&graph, metis.clone());
        let (banded, dissected) = (fill(&graph, &natural), fill(&graph, &metis));
        assert!(1.5 * (dissected as f64) < banded as f64, "{dissected} against {banded}");
        assert_eq!(dissected, fill(&graph, &sorted));
    }

    /// Truth: in a postorder, parents follow their children, and subtrees are contiguous.
    #[test]
    fn postorder_is_one() {
        let graph = grid(6);
        let order = postorder(&graph, metis_node_nd(&graph).unwrap());
        let parent = elimination_tree(&graph, &order);
        let mut size = vec![1usize; order.len()];
        for j in 0..order.len() {
            if parent[j] != usize::MAX {
                assert!(parent[j] > j);
                size[parent[j]] += size[j];
            }
        }
        for j in 0..order.len() {
            let below: usize = (j + 1 - size[j]..j).filter(|&i| parent[i] == j).map(|i| size[i]).sum();
            assert_eq!(below + 1, size[j], "subtree of {j}");
        }
    }

    /// Truth: the order is a permutation, and the nodes `last` are at its end in their given order.
    #[test]
    fn last_nodes_are_last() {
        let graph = grid(5);
        let last = [7, 3, 100];
        let nodes: Vec<usize> = (0..graph.n_nodes()).collect();
        let order = nested_dissection(&graph, &nodes, &last).unwrap();
        assert_eq!(order[order.len() - 3..], last);
        let mut sorted = order;
        sorted.sort_unstable();
        assert_eq!(sorted, nodes);
    }
}
