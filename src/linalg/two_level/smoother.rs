//! Symmetric Gauss-Seidel smoother. It reduces the errors that the coarse space does not represent.

use nalgebra::Matrix3;

use super::super::simd::wide;
use super::node_matrix::{
    Block3x3, LANES, Lanes, NodeMatrix, add, add_transposed, rows_of_node, rows_of_node_mut,
};
use crate::error::{Error, Result};
use crate::geometry::format_point;

pub(super) struct GaussSeidel {
    inverse: Vec<Block3x3>,
}

impl GaussSeidel {
    pub fn new(matrix: &NodeMatrix) -> Result<Self> {
        let inverse = matrix.diagonal.iter().enumerate().map(|(node, block)| {
            let inverse = Matrix3::from_row_slice(block).cholesky().map(|factor| factor.inverse());
            let inverse = inverse.ok_or_else(|| {
                Error::input(format!(
                    "the stiffness matrix is singular at the node at {}: this node is not fixed",
                    format_point(&matrix.points[node])
                ))
            })?;
            Ok(std::array::from_fn(|i| inverse[(i / 3, i % 3)]))
        });
        Ok(Self { inverse: inverse.collect::<Result<_>>()? })
    }

    /// Computes `y = ((D + L) D⁻¹ (D + L)ᵀ)⁻¹ x`, all `[3 n]`; overwrites `y` and `work`. D contains the diagonal
    /// blocks of `matrix`, L the blocks to the left of the diagonal.
    pub fn apply(&self, matrix: &NodeMatrix, x: &[Lanes], y: &mut [Lanes], work: &mut [Lanes]) {
        wide!(sweeps(
            self => smoother: &GaussSeidel,
            matrix => matrix: &NodeMatrix,
            x => x: &[Lanes],
            y => y: &mut [Lanes],
            work => work: &mut [Lanes]
        ));
    }
}

#[inline(always)]
fn sweeps(smoother: &GaussSeidel, matrix: &NodeMatrix, x: &[Lanes], y: &mut [Lanes], work: &mut [Lanes]) {
    for i in 0..matrix.n() {
        let mut sum = [[0.0; LANES]; 3];
        for (j, block) in matrix.row(i) {
            add(&mut sum, block, rows_of_node(y, j));
        }
        let own = subtract(rows_of_node(x, i), &sum);
        let mut solved = [[0.0; LANES]; 3];
        add(&mut solved, &smoother.inverse[i], &own);
        *rows_of_node_mut(y, i) = solved;
        *rows_of_node_mut(work, i) = [[0.0; LANES]; 3];
    }
    for i in (0..matrix.n()).rev() {
        let mut change = [[0.0; LANES]; 3];
        add(&mut change, &smoother.inverse[i], rows_of_node(work, i));
        let solved = subtract(rows_of_node(y, i), &change);
        *rows_of_node_mut(y, i) = solved;
        for (j, block) in matrix.row(i) {
            add_transposed(rows_of_node_mut(work, j), block, &solved);
        }
    }
}

#[inline(always)]
fn subtract(a: &[Lanes; 3], b: &[Lanes; 3]) -> [Lanes; 3] {
    std::array::from_fn(|r| std::array::from_fn(|l| a[r][l] - b[r][l]))
}
