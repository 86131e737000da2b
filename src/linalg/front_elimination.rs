//! The elimination of the pivots of one dense front, in tiles that threads can share.
//!
//! The tiles depend on the sizes only, never on the number of threads: same bits for any number.
//!
//! # Source
//! Golub and Van Loan (2013), Matrix Computations, 4.2.6 (block outer product Cholesky).

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::{LltError, cholesky_in_place, cholesky_in_place_scratch};
use faer::linalg::matmul::matmul;
use faer::linalg::matmul::triangular::{self, BlockStructure};
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::{Accum, MatMut, MatRef, Par, Spec};
use rayon::prelude::*;

use super::lower_blocks;
use crate::cancel;

/// Pivots eliminated together.
const PANEL_COLUMNS: usize = 128;

/// Rows of a tile.
const TILE_ROWS: usize = 512;

/// A part of a matrix that one thread updates.
struct Tile<'a> {
    values: MatMut<'a, f64>,
    /// First row and first column, among the rows of the factor that update it.
    at: (usize, usize),
    /// Whether it lies on the diagonal: its upper triangle is not touched.
    diagonal: bool,
}

/// L11 L11^T = A11, L21 = A21 L11^-T in `columns` (`[size, n_pivots]`, A11 in the lower triangle), and -L21 L21^T in
/// `remainder` (block columns, see [`lower_blocks`]; what it held before does not matter). Ends early, with nothing that
/// can be used, if a stop is wished.
///
/// # Errors
/// The place of a pivot that is not positive.
pub(super) fn eliminate_pivots(
    mut columns: MatMut<'_, f64>,
    remainder: &mut [f64],
    par: Par,
) -> Result<(), usize> {
    let (size, n_pivots) = (columns.nrows(), columns.ncols());
    let n_left = size - n_pivots;
    for start in (0..n_pivots).step_by(PANEL_COLUMNS) {
        if cancel::requested() {
            return Ok(());
        }
        let width = PANEL_COLUMNS.min(n_pivots - start);
        let rest = columns.as_mut().submatrix_mut(start, start, size - start, n_pivots - start);
        let (panel, right) = rest.split_at_col_mut(width);
        let (mut pivots, mut below) = panel.split_at_row_mut(width);
        cholesky(pivots.as_mut()).map_err(|index| start + index)?;
        solve(pivots.as_ref(), below.as_mut(), par);
        let (mut right, mut first) = (right.subrows_mut(width, size - start - width), 0);
        let mut tiles = Vec::new();
        while right.ncols() > 0 {
            let (block, next) = right.split_at_col_mut(PANEL_COLUMNS.min(n_pivots - start - width - first));
            let columns = block.ncols();
            push_tiles(block.subrows_mut(first, size - start - width - first), first, &mut tiles);
            (right, first) = (next, first + columns);
        }
        subtract_product(tiles, below.as_ref(), Accum::Add, par);
    }
    let mut tiles = Vec::new();
    let mut rest = remainder;
    for (block, values) in lower_blocks::blocks(n_left) {
        let (own, after) = std::mem::take(&mut rest).split_at_mut(values.len());
        let own = MatMut::from_column_major_slice_mut(own, n_left - block.start, block.len());
        push_tiles(own, block.start, &mut tiles);
        rest = after;
    }
    subtract_product(tiles, columns.as_ref().subrows(n_pivots, n_left), Accum::Replace, par);
    Ok(())
}

fn cholesky(pivots: MatMut<'_, f64>) -> Result<(), usize> {
    let mut memory =
        MemBuffer::new(cholesky_in_place_scratch::<f64>(PANEL_COLUMNS, Par::Seq, Spec::default()));
    cholesky_in_place(pivots, Default::default(), Par::Seq, MemStack::new(&mut memory), Spec::default())
        .map(|_| ())
        .map_err(|LltError::NonPositivePivot { index }| index)
}

/// L21 = A21 L11^-T.
fn solve(pivots: MatRef<'_, f64>, mut below: MatMut<'_, f64>, par: Par) {
    let solve = |rows: MatMut<'_, f64>| {
        solve_lower_triangular_in_place(pivots, rows.transpose_mut(), Par::Seq);
    };
    let mut pieces = Vec::new();
    while below.nrows() > TILE_ROWS {
        let (piece, rest) = below.split_at_row_mut(TILE_ROWS);
        pieces.push(piece);
        below = rest;
    }
    pieces.push(below);
    for_each(pieces, par, solve);
}

/// Cuts the rows from `first` of a block column whose diagonal is at row and column `first`.
fn push_tiles<'a>(block: MatMut<'a, f64>, first: usize, tiles: &mut Vec<Tile<'a>>) {
    let width = block.ncols();
    let (diagonal, mut below) = block.split_at_row_mut(width);
    tiles.push(Tile { values: diagonal, at: (first, first), diagonal: true });
    let mut row = first + width;
    while below.nrows() > 0 {
        let height = TILE_ROWS.min(below.nrows());
        let (values, rest) = below.split_at_row_mut(height);
        tiles.push(Tile { values, at: (row, first), diagonal: false });
        (below, row) = (rest, row + height);
    }
}

/// Subtracts factor factor^T from each tile, or sets it to that.
fn subtract_product(tiles: Vec<Tile<'_>>, factor: MatRef<'_, f64>, accum: Accum, par: Par) {
    for_each(tiles, par, |tile| {
        let Tile { values, at: (row, column), diagonal } = tile;
        let left = factor.subrows(row, values.nrows());
        let right = factor.subrows(column, values.ncols()).transpose();
        if diagonal {
            let (lower, full) = (BlockStructure::TriangularLower, BlockStructure::Rectangular);
            triangular::matmul(values, lower, accum, left, full, right, full, -1.0, Par::Seq);
        } else {
            matmul(values, accum, left, right, -1.0, Par::Seq);
        }
    });
}

fn for_each<T: Send>(parts: Vec<T>, par: Par, work: impl Fn(T) + Send + Sync) {
    match par {
        Par::Seq => parts.into_iter().for_each(work),
        Par::Rayon(_) => parts.into_par_iter().with_max_len(1).for_each(work),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: L L^T is the matrix in its pivot columns, and the remainder negated elsewhere; for a matrix of several panels, blocks and tiles. Tolerance: rounding of 700
    /// terms of order 1, the largest entry being 700.
    #[test]
    fn factor_and_remainder_make_up_the_matrix() {
        let (size, n_pivots) = (900, 301);
        let n_left = size - n_pivots;
        let at = |i: usize, j: usize| {
            let off = ((i * j) as f64).sin();
            if i == j { size as f64 } else { off }
        };
        let mut columns = vec![0.0; size * n_pivots];
        (0..n_pivots).for_each(|j| (j..size).for_each(|i| columns[j * size + i] = at(i, j)));
        let mut remainder = vec![f64::NAN; lower_blocks::n_values(n_left)];
        let matrix = MatMut::from_column_major_slice_mut(&mut columns, size, n_pivots);
        eliminate_pivots(matrix, &mut remainder, Par::Seq).unwrap();
        for j in (0..size).step_by(7) {
            for i in (j..size).step_by(5) {
                let terms = (0..n_pivots.min(j + 1)).map(|k| columns[k * size + i] * columns[k * size + j]);
                let product: f64 = terms.sum();
                let expected = match j.checked_sub(n_pivots) {
                    None => at(i, j),
                    Some(column) => -remainder[lower_blocks::column(n_left, column)][i - j],
                };
                assert!((product - expected).abs() < 1e-10, "({i}, {j}): {product} for {expected}");
            }
        }
    }
}
