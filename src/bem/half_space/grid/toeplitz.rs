//! Entries of an operator on a uniform grid. The entries depend only on the offset between two cells.

use nalgebra::Matrix3;

use crate::flexibility::Flexibility;

/// Blocks S_ik of an operator with S_ik = K(x_i - x_k) and K(-d) = K(d)ᵀ on a grid.
pub(in crate::bem::half_space) struct ToeplitzBlocks {
    cells: [usize; 2],
    /// Gaps `[3, N]` due to unit tractions along x, y, n, on the first cell and on the last cell of the first row.
    corners: [[Vec<f64>; 3]; 2],
}

impl ToeplitzBlocks {
    /// Computes the blocks from products with unit tractions on two cells.
    pub fn new(operator: &dyn Flexibility, cells: [usize; 2]) -> Self {
        let n = cells[0] * cells[1];
        let corners = [0, cells[1] - 1].map(|corner| {
            [0, 1, 2].map(|component| {
                let (mut tractions, mut gap) = (vec![0.0; 3 * n], vec![0.0; 3 * n]);
                tractions[component * n + corner] = 1.0;
                operator.apply(&tractions, &mut gap);
                gap
            })
        });
        Self { cells, corners }
    }

    /// Block S_ik.
    pub fn block(&self, i: usize, k: usize) -> Matrix3<f64> {
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
