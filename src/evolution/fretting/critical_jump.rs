//! Longest stable explicit jump ΔN = 2 / λ_max(S_nn⁻¹ D) (docs/theory-wear.md). For fixed approach, contact area and slip,
//! pressures follow dp/dN = -S_nn⁻¹ D p. S_nn is the normal flexibility, D the diagonal matrix of wear depth per pressure and
//! cycle.

use nalgebra::{DMatrix, SymmetricEigen};

use crate::contact::ContactState;
use crate::evolution::run::Run;
use crate::flexibility::Flexibility;
use crate::linalg::vector::dot;

const MAX_LANCZOS_VECTORS: usize = 60;

/// Norm of the next Lanczos vector, relative to the first diagonal entry, at which the Lanczos process ends.
const LANCZOS_BREAKDOWN: f64 = 1e-10;

impl Run<'_> {
    /// Longest stable explicit jump, in cycles or mm of sliding; `None` without wear.
    pub(super) fn critical_length(&self, it: &ContactState) -> Option<f64> {
        let (n, points) = (self.prepared.n(), it.rigid_motion.len());
        let touching = self.cells_in_contact(&it.scaled);
        let wear = |cell: usize| (0..points).map(|point| it.wear_per_pressure[point * n + cell]).sum::<f64>();
        let wear: Vec<f64> = (0..n).map(|cell| if touching[cell] { wear(cell) } else { 0.0 }).collect();
        let model = self.prepared.model;
        smallest_eigenvalue(model.flexibility.as_ref(), &model.frame.areas, &wear).map(|least| 2.0 * least)
    }
}

/// Smallest λ of S_nn p = λ D p on the cells where `wear`, the diagonal of D (`[N]`), is positive. The Lanczos process
/// gives an upper bound of this λ.
fn smallest_eigenvalue(operator: &dyn Flexibility, areas: &[f64], wear: &[f64]) -> Option<f64> {
    let n = wear.len();
    let cells: Vec<usize> = (0..n).filter(|&cell| wear[cell] > 0.0).collect();
    if cells.is_empty() {
        return None;
    }
    // With the unknowns y = (A D)^½ p and the cell areas A, the eigenvalue problem is symmetric, because A S_nn is
    // symmetric.
    let scale: Vec<f64> = cells.iter().map(|&cell| (areas[cell] * wear[cell]).sqrt()).collect();
    let row = operator.grid().map_or(1, |grid| grid[1]);
    let sign = |cell: usize| if (cell / row + cell % row).is_multiple_of(2) { 1.0 } else { -1.0 };
    let mut next: Vec<f64> = cells.iter().map(|&cell| sign(cell)).collect();
    let (mut pressure, mut gap) = (vec![0.0; n], vec![0.0; n]);
    let mut basis: Vec<Vec<f64>> = Vec::new();
    let (mut diagonal, mut beside) = (Vec::new(), Vec::new());
    while basis.len() < MAX_LANCZOS_VECTORS.min(cells.len()) {
        let length = dot(&next, &next).sqrt();
        if length <= LANCZOS_BREAKDOWN * diagonal.first().copied().unwrap_or(0.0) {
            break;
        }
        if !basis.is_empty() {
            beside.push(length);
        }
        let vector: Vec<f64> = next.iter().map(|x| x / length).collect();
        for ((&cell, y), scale) in cells.iter().zip(&vector).zip(&scale) {
            pressure[cell] = y / scale;
        }
        operator.apply_normal(&pressure, &mut gap);
        next = cells.iter().zip(&scale).map(|(&cell, scale)| areas[cell] * gap[cell] / scale).collect();
        diagonal.push(dot(&next, &vector));
        basis.push(vector);
        // A second pass of orthogonalisation removes the rounding errors of the first pass.
        for _ in 0..2 {
            for vector in &basis {
                let part = dot(&next, vector);
                next.iter_mut().zip(vector).for_each(|(next, vector)| *next -= part * vector);
            }
        }
    }
    let m = diagonal.len();
    let tridiagonal = DMatrix::from_fn(m, m, |i, j| match i.abs_diff(j) {
        0 => diagonal[i],
        1 => beside[i.min(j)],
        _ => 0.0,
    });
    let values = SymmetricEigen::new(tridiagonal).eigenvalues;
    let least = values.iter().copied().fold(f64::INFINITY, f64::min);
    (least > 0.0).then_some(least)
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix3;

    use super::*;

    use crate::flexibility::per_cell::PerCell;

    struct Normal(DMatrix<f64>);

    impl Flexibility for Normal {
        fn n_cells(&self) -> usize {
            self.0.nrows()
        }

        fn apply(&self, tractions: &[f64], gap: &mut [f64]) {
            let n = self.n_cells();
            gap.fill(0.0);
            self.apply_normal(&tractions[2 * n..], &mut gap[2 * n..]);
        }

        fn apply_normal(&self, p: &[f64], gap: &mut [f64]) {
            for (i, gap) in gap.iter_mut().enumerate() {
                *gap = (0..p.len()).map(|j| self.0[(i, j)] * p[j]).sum();
            }
        }

        fn diagonal_blocks(&self) -> PerCell<Matrix3<f64>> {
            (0..self.n_cells()).map(|i| Matrix3::identity() * self.0[(i, i)]).collect()
        }
    }

    /// Truth: the result equals the smallest eigenvalue of the symmetric matrix (A/D)^½ K (A/D)^½, found by a dense
    /// solver. S = K A is the operator with the kernel K. The areas A and the wear D differ between cells.
    #[test]
    fn least_eigenvalue_of_a_dense_operator() {
        let n = 30;
        let areas: Vec<f64> = (0..n).map(|i| 1.0 + 0.1 * (i % 3) as f64).collect();
        let wear: Vec<f64> = (0..n).map(|i| if i % 7 == 0 { 0.0 } else { 1.0 + 0.05 * i as f64 }).collect();
        // A S = A K A is symmetric, because the kernel K is symmetric.
        let kernel = |i: usize, j: usize| 1.0 / (1.0 + (i as f64 - j as f64).abs());
        let normal = DMatrix::from_fn(n, n, |i, j| areas[j] * kernel(i, j));
        let operator = Normal(normal);
        let cells: Vec<usize> = (0..n).filter(|&i| wear[i] > 0.0).collect();
        let dense = DMatrix::from_fn(cells.len(), cells.len(), |a, b| {
            let (i, j) = (cells[a], cells[b]);
            (areas[i] * areas[j] / (wear[i] * wear[j])).sqrt() * kernel(i, j)
        });
        let wanted = SymmetricEigen::new(dense).eigenvalues.min();
        let found = smallest_eigenvalue(&operator, &areas, &wear).unwrap();
        assert!((found / wanted - 1.0).abs() < 1e-10, "{found} {wanted}");
        assert_eq!(smallest_eigenvalue(&operator, &areas, &vec![0.0; n]), None);
    }
}
