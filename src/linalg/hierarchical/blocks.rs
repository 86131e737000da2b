//! The pairs of clusters that a symmetric matrix over a cluster tree is stored in.

use super::cluster::ClusterTree;

/// Rows of one cluster and columns of another, or of the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Block {
    /// Cluster of the rows.
    pub rows: usize,
    /// Cluster of the columns, not before that of the rows in the order of the tree.
    pub columns: usize,
    /// Whether the clusters are far apart for their size, so that the block has a low rank.
    pub far: bool,
}

/// One of each pair of blocks that mirror each other: together they hold every pair of places once, those on the
/// diagonal blocks in both orders. Far apart means that the smaller of the two diameters is at most `admissibility`
/// times the distance.
pub fn blocks(tree: &ClusterTree, admissibility: f64) -> Vec<Block> {
    let (mut blocks, mut waiting) = (Vec::new(), vec![(0, 0)]);
    while let Some((rows, columns)) = waiting.pop() {
        let (row, column) = (&tree.clusters[rows], &tree.clusters[columns]);
        let distance = row.distance(column);
        let size = row.diameter().min(column.diameter());
        let far = rows != columns && distance > 0.0 && size <= admissibility * distance;
        match (far, row.halves, column.halves) {
            (false, Some([first, second]), _) if rows == columns => {
                waiting.extend([(second, second), (first, second), (first, first)]);
            }
            // The larger one is cut, so that both keep about the same size.
            (false, Some([first, second]), of_column)
                if of_column.is_none() || row.diameter() >= column.diameter() =>
            {
                waiting.extend([(second, columns), (first, columns)]);
            }
            (false, _, Some([first, second])) => waiting.extend([(rows, second), (rows, first)]),
            _ => blocks.push(Block { rows, columns, far }),
        }
    }
    blocks
}

#[cfg(test)]
mod tests {
    use super::super::cluster::{ClusterTree, Extent};
    use super::*;

    /// Truth: every pair of places lies in one block and only one of the pair's two orders is stored, but on the
    /// diagonal; far blocks are as far apart as asked for.
    #[test]
    fn blocks_hold_every_pair_once() {
        let points: Vec<[f64; 2]> = (0..300).map(|k| [(k % 20) as f64, (k / 20) as f64]).collect();
        let extents: Vec<Extent> = points.iter().map(|p| [p.map(|x| x - 0.5), p.map(|x| x + 0.5)]).collect();
        let tree = ClusterTree::new(&points, &extents, 12);
        let mut seen = vec![0; 300 * 300];
        let mut n_far = 0;
        for block in blocks(&tree, 1.5) {
            let (row, column) = (&tree.clusters[block.rows], &tree.clusters[block.columns]);
            n_far += usize::from(block.far);
            if block.far {
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
}
