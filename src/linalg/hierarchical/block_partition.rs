//! Partition of a matrix into blocks. Each block belongs to a pair of clusters of a cluster tree.

use super::cluster_tree::{Cluster, ClusterTree};

/// Block of a matrix: its rows belong to one cluster, its columns to another cluster or to the same cluster.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ClusterPair {
    /// Index of the row cluster in the tree.
    pub rows: usize,
    /// Index of the column cluster in the tree. With [`MirrorBlocks::One`], the column range does not start before the row range.
    pub columns: usize,
    /// Whether the clusters are so far apart that a low-rank block can approximate the kernel.
    pub is_admissible: bool,
}

/// Whether a partition contains one or both of two mirrored blocks. The row cluster of a block is the column cluster of
/// its mirrored block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MirrorBlocks {
    /// One block of each mirrored pair. Diagonal blocks cover each pair of their points in both orders, (i, j) and (j,
    /// i). All other pairs are covered in one order.
    One,
    /// Both blocks. The blocks cover each pair of points in both orders, each order once.
    Both,
}

/// Divides the matrix of all pairs of points into blocks.
///
/// A block is admissible if the bounding boxes of its clusters do not touch or overlap, and the smaller diameter is at most
/// `admissibility` times their distance.
pub fn partition<const D: usize>(
    tree: &ClusterTree<D>,
    admissibility: f64,
    mirrors: MirrorBlocks,
) -> Vec<ClusterPair> {
    let (mut blocks, mut waiting) = (Vec::new(), vec![(0, 0)]);
    while let Some((rows, columns)) = waiting.pop() {
        let (row, column) = (&tree.clusters[rows], &tree.clusters[columns]);
        let is_admissible = rows != columns && row.is_admissible_with(column, admissibility);
        let rows_first = column.children.is_none() || row.diameter() >= column.diameter();
        match (is_admissible, row.children, column.children) {
            (false, Some([first, second]), _) if rows == columns => {
                waiting.push((second, second));
                if mirrors == MirrorBlocks::Both {
                    waiting.push((second, first));
                }
                waiting.extend([(first, second), (first, first)]);
            }
            // The cluster with the larger diameter is divided.
            (false, Some([first, second]), _) if rows_first => {
                waiting.extend([(second, columns), (first, columns)]);
            }
            (false, _, Some([first, second])) => waiting.extend([(rows, second), (rows, first)]),
            _ => blocks.push(ClusterPair { rows, columns, is_admissible }),
        }
    }
    blocks
}

impl<const D: usize> Cluster<D> {
    fn is_admissible_with(&self, other: &Self, admissibility: f64) -> bool {
        let distance = self.distance(other);
        distance > 0.0 && self.diameter().min(other.diameter()) <= admissibility * distance
    }
}

#[cfg(test)]
mod tests {
    use super::super::cluster_tree::{BoundingBox, ClusterTree};
    use super::*;

    /// Truth: the blocks and the mirror images of blocks off the diagonal cover each ordered pair of points once.
    /// Admissible blocks satisfy the distance condition of [`partition`].
    #[test]
    fn blocks_hold_every_pair_once() {
        let points: Vec<[f64; 2]> = (0..300).map(|k| [(k % 20) as f64, (k / 20) as f64]).collect();
        let extents: Vec<BoundingBox> =
            points.iter().map(|p| [p.map(|x| x - 0.5), p.map(|x| x + 0.5)]).collect();
        let tree = ClusterTree::new(&points, &extents, 12);
        let mut seen = vec![0; 300 * 300];
        let mut n_far = 0;
        for block in partition(&tree, 1.5, MirrorBlocks::One) {
            let (row, column) = (&tree.clusters[block.rows], &tree.clusters[block.columns]);
            n_far += usize::from(block.is_admissible);
            if block.is_admissible {
                assert!(row.diameter().min(column.diameter()) <= 1.5 * row.distance(column));
            }
            for i in row.range.clone() {
                for j in column.range.clone() {
                    seen[i * 300 + j] += 1;
                    if block.rows != block.columns {
                        assert!(i < j);
                        seen[j * 300 + i] += 1;
                    }
                }
            }
        }
        assert!(n_far > 10 && seen.iter().all(|&count| count == 1));
    }

    /// Truth: the blocks cover each ordered pair of points once, and admissible blocks satisfy the distance condition of
    /// [`partition`].
    #[test]
    fn all_blocks_hold_every_pair_once() {
        let at = |k: usize| {
            let [u, v] = [(k % 16) as f64, (k / 16 % 16) as f64];
            if k < 256 { [u, v, 0.0] } else { [0.0, u, v] }
        };
        let points: Vec<[f64; 3]> = (0..512).map(at).collect();
        let extents: Vec<BoundingBox<3>> =
            points.iter().map(|p| [p.map(|x| x - 0.5), p.map(|x| x + 0.5)]).collect();
        let tree = ClusterTree::new(&points, &extents, 8);
        let (mut seen, mut n_far) = (vec![0; 512 * 512], 0);
        for block in partition(&tree, 1.5, MirrorBlocks::Both) {
            let (row, column) = (&tree.clusters[block.rows], &tree.clusters[block.columns]);
            if block.is_admissible {
                n_far += 1;
                assert!(row.diameter().min(column.diameter()) <= 1.5 * row.distance(column));
            }
            for i in row.range.clone() {
                column.range.clone().for_each(|j| seen[i * 512 + j] += 1);
            }
        }
        assert!(n_far > 10 && seen.iter().all(|&count| count == 1));
    }
}
