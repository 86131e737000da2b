//! Influence of a unit traction on one cell of a uniform grid on all others.

use nalgebra::Matrix3;
use rayon::prelude::*;

use super::patch::PatchIntegrator;
use crate::interrupt;

/// K(d) for the offsets d = target - source of a uniform grid; half of them, since K(-d) = K(d)^T.
///
/// # Source
/// Formulation 8.4.
pub(super) struct KernelTable {
    cells: [usize; 2],
    /// `[cells_x][2 cells_y - 1]`, offsets x >= 0.
    blocks: Vec<Matrix3<f64>>,
}

impl KernelTable {
    /// Integrates over one cell of the sides `spacing` for all offsets of a grid of `cells`; ends early if a stop is
    /// wished.
    pub(super) fn new(cells: [usize; 2], spacing: [f64; 2], integrator: &PatchIntegrator) -> Self {
        let [nx, ny] = cells;
        let width = 2 * ny - 1;
        let mut blocks = vec![Matrix3::zeros(); nx * width];
        blocks.par_chunks_mut(width).enumerate().for_each(|(dx, row)| {
            if interrupt::wished() {
                return;
            }
            let first = if dx == 0 { ny - 1 } else { 0 };
            for (column, block) in row.iter_mut().enumerate().skip(first) {
                let dy = column as f64 - (ny - 1) as f64;
                *block = integrator.rectangle(spacing, [dx as f64 * spacing[0], dy * spacing[1]]);
            }
        });
        // Along x = 0 the symmetry is imposed, so that the operator is symmetric to the last bit.
        blocks[ny - 1] = (blocks[ny - 1] + blocks[ny - 1].transpose()) * 0.5;
        for dy in 1..ny {
            blocks[ny - 1 - dy] = blocks[ny - 1 + dy].transpose();
        }
        Self { cells, blocks }
    }

    /// K at an offset of `dx` >= 0 and `dy` cells.
    fn half(&self, dx: usize, dy: isize) -> &Matrix3<f64> {
        let ny = self.cells[1];
        &self.blocks[dx * (2 * ny - 1) + (ny as isize - 1 + dy) as usize]
    }

    /// K(0): the influence of a cell on itself.
    pub(super) fn own(&self) -> Matrix3<f64> {
        *self.half(0, 0)
    }

    /// Entry (i, j) of K at the offset of `dx` and `dy` cells.
    pub(super) fn entry(&self, dx: isize, dy: isize, i: usize, j: usize) -> f64 {
        if dx >= 0 { self.half(dx as usize, dy)[(i, j)] } else { self.half(-dx as usize, -dy)[(j, i)] }
    }
}
