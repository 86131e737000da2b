//! Flexibility operator for a contact with planes of symmetry. In the cells on these planes, the components across the
//! planes are decoupled.

use std::sync::{Arc, Mutex, MutexGuard};

use nalgebra::Matrix3;

use crate::error::Result;
use crate::flexibility::Flexibility;
use crate::flexibility::cell_matrix::CellMatrix;
use crate::flexibility::operator_history::OperatorHistory;
use crate::flexibility::per_cell::PerCell;

/// A cell on one or two planes of symmetry.
struct ConstrainedCell {
    cell: usize,
    /// Orthogonal projector P on the components in the planes. The contact normal lies in the planes, so P leaves
    /// normal components unchanged.
    projector: Matrix3<f64>,
    /// Projector I - P on the components across the planes.
    across: Matrix3<f64>,
    /// Compliance c of the components across the planes, mm/MPa.
    compliance: f64,
}

/// Operator S' = P S P + c (I - P) for an operator S. In the cells on planes of symmetry, the projector P removes the
/// components of tractions and gaps across the planes.
///
/// The components across the planes are decoupled from all other components. If the tractions across the planes vanish,
/// the gaps across the planes vanish up to rounding. They vanish exactly if P is diagonal.
///
/// Like S, S' is symmetric positive definite in the area-weighted inner product, because P acts within single cells,
/// and a cell has one area for all components. The compliance c > 0 only multiplies tractions across the planes. Where
/// these tractions vanish, the value of c does not matter.
///
/// # Source
/// docs/theory-coupling.md, "Planes of symmetry under the contact".
pub struct ConstrainedFlexibility {
    inner: Arc<dyn Flexibility>,
    cells: Vec<ConstrainedCell>,
    /// Tractions or gaps without the components across the planes, `[3, N]`.
    scratch: Mutex<Vec<f64>>,
}

impl ConstrainedFlexibility {
    /// Constrains `inner` in the given cells (index, P), in ascending order of the index. P acts on the local components (x, y, n).
    ///
    /// # Panics
    /// If an index is not below the number of cells of `inner`.
    pub fn new(inner: Arc<dyn Flexibility>, projectors: &[(usize, Matrix3<f64>)]) -> Self {
        let n = inner.n_cells();
        let blocks = inner.diagonal_blocks();
        let cells = projectors.iter().map(|&(cell, projector)| {
            assert!(cell < n, "cell {cell} of {n} cells");
            let compliance = compliance_in_plane(&blocks[cell], &projector);
            ConstrainedCell { cell, projector, across: Matrix3::identity() - projector, compliance }
        });
        Self { cells: cells.collect(), scratch: Mutex::new(vec![0.0; 3 * n]), inner }
    }

    /// Copy of `values` `[3, N]` without the components across the planes of symmetry.
    fn projected(&self, values: &[f64]) -> MutexGuard<'_, Vec<f64>> {
        let mut scratch = self.scratch.lock().expect("no panic while the scratch is held");
        scratch.copy_from_slice(values);
        let n = self.inner.n_cells();
        for held in &self.cells {
            let value = at(values, n, held.cell);
            set(&mut scratch, n, held.cell, held.projector * value);
        }
        scratch
    }

    /// Replaces the components of `into` across the planes of symmetry by the components of `from`, multiplied by `factor(c)`. Both
    /// vectors are `[3, N]`.
    fn replace_across(&self, from: &[f64], into: &mut [f64], factor: impl Fn(f64) -> f64) {
        let n = self.inner.n_cells();
        for held in &self.cells {
            let across = held.across * at(from, n, held.cell) * factor(held.compliance);
            let value = held.projector * at(into, n, held.cell) + across;
            set(into, n, held.cell, value);
        }
    }
}

/// The components (x, y, n) of a cell.
fn at(values: &[f64], n: usize, cell: usize) -> nalgebra::Vector3<f64> {
    nalgebra::Vector3::new(values[cell], values[n + cell], values[2 * n + cell])
}

fn set(values: &mut [f64], n: usize, cell: usize, value: nalgebra::Vector3<f64>) {
    (0..3).for_each(|plane| values[plane * n + cell] = value[plane]);
}

/// Compliance of a cell along the tangent in its plane of symmetry, mm/MPa. This compliance is zero for a cell on two
/// planes. If it is not positive, the normal compliance is returned instead, or 1 if the normal compliance is not
/// positive.
fn compliance_in_plane(block: &Matrix3<f64>, projector: &Matrix3<f64>) -> f64 {
    let tangents = projector.fixed_view::<2, 2>(0, 0);
    let along = (tangents * block.fixed_view::<2, 2>(0, 0)).trace();
    let positive = |c: &f64| c.is_finite() && *c > 0.0;
    Some(along).filter(positive).or(Some(block[(2, 2)]).filter(positive)).unwrap_or(1.0)
}

impl Flexibility for ConstrainedFlexibility {
    fn n_cells(&self) -> usize {
        self.inner.n_cells()
    }

    fn apply(&self, tractions: &[f64], gap: &mut [f64]) {
        self.inner.apply(&self.projected(tractions), gap);
        self.replace_across(tractions, gap, |c| c);
    }

    fn apply_normal(&self, pressure: &[f64], normal_gap: &mut [f64]) {
        self.inner.apply_normal(pressure, normal_gap);
    }

    fn diagonal_blocks(&self) -> PerCell<Matrix3<f64>> {
        let mut blocks = self.inner.diagonal_blocks().into_vec();
        for held in &self.cells {
            let block = &mut blocks[held.cell];
            *block = held.projector * *block * held.projector + held.across * held.compliance;
        }
        PerCell::Each(blocks)
    }

    fn couples_normal_tangential(&self) -> bool {
        self.inner.couples_normal_tangential()
    }

    fn precondition_normal(&self, normal_gap: &[f64], pressure: &mut [f64]) -> bool {
        self.inner.precondition_normal(normal_gap, pressure)
    }

    /// Applies P M P + (I - P) / c, with the approximate inverse M of the inner operator.
    fn precondition(&self, gap: &[f64], tractions: &mut [f64]) -> bool {
        let found = self.inner.precondition(&self.projected(gap), tractions);
        if found {
            self.replace_across(gap, tractions, f64::recip);
        }
        found
    }

    fn is_condensed(&self) -> bool {
        self.inner.is_condensed()
    }

    fn add_entries(&self, cells: &[usize], matrix: &mut CellMatrix) -> bool {
        let Ok(mut inner) = CellMatrix::zeros(cells.len()) else { return false };
        let found = self.inner.add_entries(cells, &mut inner);
        let held = |cell: &usize| {
            let index = self.cells.binary_search_by_key(cell, |held| held.cell).ok()?;
            Some(&self.cells[index])
        };
        let held: Vec<_> = cells.iter().map(held).collect();
        let projected = |i: usize, k: usize| {
            let block = inner.block(i, k);
            let block = held[i].map_or(block, |held| held.projector * block);
            let block = held[k].map_or(block, |held| block * held.projector);
            held[i].filter(|_| i == k).map_or(block, |held| block + held.across * held.compliance)
        };
        matrix.add_columns(|k| move |i| projected(i, k));
        found
    }

    fn direct_sums(&self, cells: &[usize], tractions: &[f64]) -> Option<Vec<[f64; 3]>> {
        let mut gaps = self.inner.direct_sums(cells, &self.projected(tractions))?;
        for (cell, gap) in cells.iter().zip(&mut gaps) {
            if let Ok(index) = self.cells.binary_search_by_key(cell, |held| held.cell) {
                let held = &self.cells[index];
                let across = held.across * at(tractions, self.inner.n_cells(), *cell) * held.compliance;
                *gap = (held.projector * nalgebra::Vector3::from(*gap) + across).into();
            }
        }
        Some(gaps)
    }

    fn unformed_cells(&self) -> Vec<usize> {
        self.inner.unformed_cells()
    }

    fn complete_gap(&self, tractions: &[f64], gap: &mut [f64]) -> Result<()> {
        self.inner.complete_gap(&self.projected(tractions), gap)?;
        self.replace_across(tractions, gap, |c| c);
        Ok(())
    }

    fn form_rows(&self, cells: &[usize]) -> Result<()> {
        self.inner.form_rows(cells)
    }

    fn history(&self) -> OperatorHistory {
        self.inner.history()
    }

    fn replay(&self, course: &OperatorHistory) -> Result<()> {
        self.inner.replay(course)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Dense operator S on cells with the areas A. A S = B Bᵀ + 1, with a fixed matrix B, is symmetric positive definite.
    struct Dense {
        areas: Vec<f64>,
        matrix: nalgebra::DMatrix<f64>,
    }

    impl Dense {
        fn new(areas: &[f64]) -> Self {
            let n = areas.len();
            let factor = nalgebra::DMatrix::from_fn(3 * n, 3 * n, |i, j| {
                ((7 * i + 3 * j) as f64).sin() / (1 + i + j) as f64
            });
            let work = &factor * factor.transpose() + nalgebra::DMatrix::identity(3 * n, 3 * n);
            let matrix = nalgebra::DMatrix::from_fn(3 * n, 3 * n, |i, j| work[(i, j)] / areas[i % n]);
            Self { areas: areas.to_vec(), matrix }
        }
    }

    impl Flexibility for Dense {
        fn n_cells(&self) -> usize {
            self.areas.len()
        }

        fn apply(&self, tractions: &[f64], gap: &mut [f64]) {
            let product = &self.matrix * nalgebra::DVector::from_column_slice(tractions);
            gap.copy_from_slice(product.as_slice());
        }

        fn apply_normal(&self, pressure: &[f64], normal_gap: &mut [f64]) {
            let n = self.n_cells();
            let block = self.matrix.view((2 * n, 2 * n), (n, n));
            normal_gap.copy_from_slice((block * nalgebra::DVector::from_column_slice(pressure)).as_slice());
        }

        fn diagonal_blocks(&self) -> PerCell<Matrix3<f64>> {
            let n = self.n_cells();
            let block = |i: usize| Matrix3::from_fn(|a, b| self.matrix[(a * n + i, b * n + i)]);
            PerCell::Each((0..n).map(block).collect())
        }

        /// Applies S itself, which is symmetric in the area-weighted inner product, as required.
        fn precondition(&self, gap: &[f64], tractions: &mut [f64]) -> bool {
            self.apply(gap, tractions);
            true
        }
    }

    const AREAS: [f64; 4] = [1.0, 0.5, 2.0, 0.25];

    fn across(angle: f64) -> Matrix3<f64> {
        let m = nalgebra::Vector3::new(angle.cos(), angle.sin(), 0.0);
        Matrix3::identity() - m * m.transpose()
    }

    fn constrained() -> ConstrainedFlexibility {
        let corner = Matrix3::from_diagonal(&nalgebra::Vector3::new(0.0, 0.0, 1.0));
        ConstrainedFlexibility::new(Arc::new(Dense::new(&AREAS)), &[(1, across(0.7)), (3, corner)])
    }

    fn columns(by: impl Fn(&[f64], &mut [f64])) -> nalgebra::DMatrix<f64> {
        let mut matrix = nalgebra::DMatrix::zeros(12, 12);
        for j in 0..12 {
            let (mut unit, mut image) = (vec![0.0; 12], vec![0.0; 12]);
            unit[j] = 1.0;
            by(&unit, &mut image);
            matrix.set_column(j, &nalgebra::DVector::from_vec(image));
        }
        matrix
    }

    fn weighted(matrix: &nalgebra::DMatrix<f64>) -> nalgebra::DMatrix<f64> {
        nalgebra::DMatrix::from_fn(12, 12, |i, j| AREAS[i % 4] * matrix[(i, j)])
    }

    /// Truth: with the areas A, the matrices A S' and A times the preconditioner are symmetric positive definite. S' maps tractions
    /// in the planes to gaps in the planes. Tolerances 1e-14 and 1e-15: rounding.
    #[test]
    fn it_is_symmetric_positive_definite_and_keeps_to_the_planes() {
        let operator = constrained();
        let product = columns(|t, g| operator.apply(t, g));
        let inverse = columns(|t, g| assert!(operator.precondition(t, g)));
        for matrix in [&product, &inverse] {
            let work = weighted(matrix);
            assert!((&work - work.transpose()).amax() < 1e-14);
            assert!(work.symmetric_eigenvalues().min() > 0.0);
        }
        let tractions: Vec<f64> = (0..12).map(|k| (k as f64).cos()).collect();
        let tractions = operator.projected(&tractions).clone();
        let mut gap = vec![0.0; 12];
        operator.apply(&tractions, &mut gap);
        assert!((gap[1] * 0.7f64.cos() + gap[5] * 0.7f64.sin()).abs() < 1e-15);
        assert_eq!([gap[3], gap[7]], [0.0; 2]);
        let mut raw = vec![0.0; 12];
        Dense::new(&AREAS).apply(&tractions, &mut raw);
        assert!([0, 2, 4, 6, 8, 9, 10, 11].into_iter().all(|k| (raw[k] - gap[k]).abs() < 1e-15));
    }

    /// Truth: diagonal blocks of the matrix whose columns are the products with unit vectors. Tolerance 1e-15: rounding.
    #[test]
    fn diagonal_blocks_are_those_of_the_products() {
        let operator = constrained();
        let product = columns(|t, g| operator.apply(t, g));
        for (cell, block) in operator.diagonal_blocks().iter().enumerate() {
            let expected = Matrix3::from_fn(|a, b| product[(4 * a + cell, 4 * b + cell)]);
            assert!((block - expected).amax() < 1e-15);
        }
    }

    /// Truth: completing a complete gap changes nothing. Tolerance 1e-15: rounding.
    #[test]
    fn completion_is_a_projection() {
        let operator = constrained();
        let tractions: Vec<f64> = (0..12).map(|k| (k as f64).cos()).collect();
        let mut gap = vec![0.0; 12];
        operator.apply(&tractions, &mut gap);
        let before = gap.clone();
        operator.complete_gap(&tractions, &mut gap).expect("nothing to solve");
        assert!(gap.iter().zip(&before).all(|(a, b)| (a - b).abs() < 1e-15));
    }
}
