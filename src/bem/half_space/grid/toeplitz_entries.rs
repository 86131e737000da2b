//! Entries of operators on uniform grids: they depend on the offset of two cells only, so that products with two corners tell
//! them all.

use nalgebra::Matrix3;

use crate::flexibility::Flexibility;
use crate::flexibility::cell_matrix::CellMatrix;

/// Influences K(d) for all offsets d = (dx, dy) with dx >= 0.
struct Offsets {
    cells: [usize; 2],
    /// Gaps `[3, N]` by unit tractions x, y, n on the first cell of the first row, then on the last one of that row.
    corners: [[Vec<f64>; 3]; 2],
}

impl Offsets {
    fn new(operator: &dyn Flexibility, cells: [usize; 2]) -> Self {
        let n = cells[0] * cells[1];
        let mut tractions = vec![0.0; 3 * n];
        let corners = [0, cells[1] - 1].map(|corner| {
            [0, 1, 2].map(|component| {
                let mut gap = vec![0.0; 3 * n];
                tractions[component * n + corner] = 1.0;
                operator.apply(&tractions, &mut gap);
                tractions[component * n + corner] = 0.0;
                gap
            })
        });
        Self { cells, corners }
    }

    /// Gap of cell `i` by unit tractions on cell `k`, K(x_i - x_k); K(-d) = K(d)^T.
    fn block(&self, i: usize, k: usize) -> Matrix3<f64> {
        let [nx, ny] = self.cells;
        if i / ny < k / ny {
            return self.block(k, i).transpose();
        }
        let (dx, to, from) = (i / ny - k / ny, i % ny, k % ny);
        let (corner, dy) = if to >= from { (0, to - from) } else { (1, ny - 1 - (from - to)) };
        let n = nx * ny;
        Matrix3::from_fn(|a, b| self.corners[corner][b][a * n + dx * ny + dy])
    }
}

/// Adds S between `of` some cells of a uniform grid of `cells` to `matrix`.
pub(in crate::bem::half_space) fn add_entries(
    operator: &dyn Flexibility,
    cells: [usize; 2],
    of: &[usize],
    matrix: &mut CellMatrix,
) {
    let offsets = Offsets::new(operator, cells);
    matrix.add_blocks(|i, k| offsets.block(of[i], of[k]));
}
