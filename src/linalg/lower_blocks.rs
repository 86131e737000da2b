//! The lower triangle of a dense symmetric matrix in block columns: half the memory of a square, and every block is a
//! matrix that the dense kernels take.
//!
//! Block column b holds columns b W to (b+1) W and rows b W to n, column by column.

use std::ops::Range;

/// Columns of a block.
const BLOCK_COLUMNS: usize = 256;

/// Number of values stored for a matrix of `n` rows.
pub(super) fn n_values(n: usize) -> usize {
    let last = n / BLOCK_COLUMNS;
    // Blocks before the last have n, n - W, n - 2 W, .. rows.
    let rows = last * n - BLOCK_COLUMNS * (last * last.saturating_sub(1)) / 2;
    rows * BLOCK_COLUMNS + (n - last * BLOCK_COLUMNS).pow(2)
}

/// The blocks of a matrix of `n` rows: their columns and where their values lie.
pub(super) fn blocks(n: usize) -> impl Iterator<Item = (Range<usize>, Range<usize>)> {
    let mut at = 0;
    (0..n).step_by(BLOCK_COLUMNS).map(move |first| {
        let columns = first..(first + BLOCK_COLUMNS).min(n);
        let from = at;
        at += (n - first) * columns.len();
        (columns, from..at)
    })
}

/// The values of column `j` of a matrix of `n` rows from the diagonal down.
pub(super) fn column(n: usize, j: usize) -> Range<usize> {
    let first = j / BLOCK_COLUMNS * BLOCK_COLUMNS;
    let start = n_values_before(n, j / BLOCK_COLUMNS) + (j - first) * (n - first);
    start + j - first..start + n - first
}

/// Values stored before block `b`, one of the blocks of a matrix of `n` rows.
fn n_values_before(n: usize, b: usize) -> usize {
    BLOCK_COLUMNS * (b * n - BLOCK_COLUMNS * (b * b.saturating_sub(1)) / 2)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: every entry of the lower triangle has a place of its own, within its block.
    #[test]
    fn places_are_distinct_and_within_their_blocks() {
        for n in [0, 1, 255, 256, 257, 600, 1024] {
            let mut taken = vec![false; n_values(n)];
            for (columns, values) in blocks(n) {
                for j in columns {
                    let own = column(n, j);
                    assert_eq!(own.len(), n - j);
                    assert!(values.start <= own.start && own.end <= values.end);
                    own.for_each(|k| assert!(!std::mem::replace(&mut taken[k], true)));
                }
            }
            assert_eq!(blocks(n).last().map_or(0, |(_, values)| values.end), n_values(n));
        }
    }
}
