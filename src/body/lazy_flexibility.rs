//! Flexibility of a condensed body on the frame. Rows of the matrix are formed only for some of the cells.
//!
//! One solve with the factorised stiffness of the body gives the gap of all cells without rows. Each new degree of
//! freedom (dof) needs one solve to form its row.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, RwLock, RwLockReadGuard};

use nalgebra::Matrix3;

use super::condensed_flexibility::CondensedFlexibility;
use crate::error::Result;
use crate::fem::CondensedBody;
use crate::flexibility::Flexibility;
use crate::flexibility::cell_matrix::CellMatrix;
use crate::flexibility::operator_history::OperatorHistory;
use crate::flexibility::per_cell::PerCell;
use crate::frame::FaceMap;
use crate::linalg::dense::SymmetricDense;

/// Operator S = I F Iᵀ A of [`CondensedFlexibility`], with rows for some of the cells.
pub struct LazyFlexibility {
    whole: FaceMap,
    body: Arc<CondensedBody>,
    formed: RwLock<FormedRows>,
}

struct FormedRows {
    cells: Vec<bool>,
    flexibility: CondensedFlexibility,
    /// Whether a direct solve of the body was already made to check these rows.
    verified: AtomicBool,
    /// Cells of each call that added rows, one list per call.
    added_cells: Vec<Vec<usize>>,
}

impl LazyFlexibility {
    /// Creates the operator with rows for the marked `cells`. `nodal` is the flexibility of the nodes under these
    /// cells, which are the contact nodes of `body`.
    ///
    /// # Errors
    /// If memory does not suffice.
    pub fn new(
        whole: FaceMap,
        cells: Vec<bool>,
        body: Arc<CondensedBody>,
        nodal: &SymmetricDense,
    ) -> Result<Self> {
        let flexibility = CondensedFlexibility::new(whole.restrict(&cells), |i, j| nodal.at(i, j))?;
        let formed =
            FormedRows { cells, flexibility, verified: AtomicBool::new(false), added_cells: Vec::new() };
        Ok(Self { whole, body, formed: RwLock::new(formed) })
    }

    /// Forces on the nodes under all cells, `[3 n]`, global axes, due to the tractions on body 2. The forces omit the
    /// sign of the body, because the sign cancels in the gap.
    fn forces(&self, tractions: &[f64]) -> Vec<f64> {
        let mut forces = vec![0.0; 3 * self.whole.nodes().len()];
        self.whole.apply_transpose(tractions, &mut forces);
        forces
    }

    fn gap(&self, displacement: &[f64]) -> Vec<f64> {
        let mut gap = vec![0.0; 3 * self.n_cells()];
        self.whole.apply(displacement, &mut gap);
        gap
    }

    fn formed(&self) -> RwLockReadGuard<'_, FormedRows> {
        self.formed.read().expect("no panic while the operator grows")
    }
}

fn extend_rows(
    old: &CondensedFlexibility,
    whole: &FaceMap,
    cells: &[bool],
    body: &CondensedBody,
) -> Result<CondensedFlexibility> {
    let map = whole.restrict(cells);
    let place = |node: &usize| old.map().nodes().binary_search(node).ok();
    let places: Vec<Option<usize>> = map.nodes().iter().map(place).collect();
    let new: Vec<usize> = (0..places.len()).filter(|&i| places[i].is_none()).collect();
    let loaded: Vec<usize> = new.iter().map(|&i| map.nodes()[i]).collect();
    let rows = body.flexibility_rows(&loaded, map.nodes())?;
    let width = 3 * map.nodes().len();
    let mut row_of = vec![usize::MAX; places.len()];
    new.iter().enumerate().for_each(|(row, &i)| row_of[i] = row);
    CondensedFlexibility::new(map, |i, j| match (places[i / 3], places[j / 3]) {
        (Some(a), Some(b)) => old.entry(3 * a + i % 3, 3 * b + j % 3),
        (None, _) => rows[(3 * row_of[i / 3] + i % 3) * width + j],
        (_, None) => rows[(3 * row_of[j / 3] + j % 3) * width + i],
    })
}

impl Flexibility for LazyFlexibility {
    fn n_cells(&self) -> usize {
        self.whole.n_cells()
    }

    fn apply(&self, tractions: &[f64], gap: &mut [f64]) {
        self.formed().flexibility.apply(tractions, gap);
    }

    fn apply_normal(&self, pressure: &[f64], normal_gap: &mut [f64]) {
        self.formed().flexibility.apply_normal(pressure, normal_gap);
    }

    /// Diagonal blocks of S. Cells without rows get the mean block of the cells with rows.
    fn diagonal_blocks(&self) -> PerCell<Matrix3<f64>> {
        let formed = self.formed();
        let mut blocks = formed.flexibility.diagonal_blocks().into_vec();
        let count = formed.cells.iter().filter(|&&is| is).count().max(1);
        let mean = blocks.iter().sum::<Matrix3<f64>>() / count as f64;
        blocks.iter_mut().zip(&formed.cells).filter(|(_, is)| !**is).for_each(|(block, _)| *block = mean);
        PerCell::Each(blocks)
    }

    fn is_condensed(&self) -> bool {
        true
    }

    fn add_entries(&self, cells: &[usize], matrix: &mut CellMatrix) -> bool {
        self.formed().flexibility.add_entries(cells, matrix)
    }

    fn unformed_cells(&self) -> Vec<usize> {
        let formed = self.formed();
        (0..formed.cells.len()).filter(|&cell| !formed.cells[cell]).collect()
    }

    fn complete_gap(&self, tractions: &[f64], gap: &mut [f64]) -> Result<()> {
        let n = self.n_cells();
        let all = self.gap(&self.body.displacement_of_forces(self.whole.nodes(), &self.forces(tractions))?);
        for cell in self.unformed_cells() {
            (0..3).for_each(|plane| gap[plane * n + cell] += all[plane * n + cell]);
        }
        Ok(())
    }

    /// Gap of `cells` from a direct solve of the assembled equations, to check the formed rows. `None` if a direct
    /// solve has already succeeded for these rows. Also `None` if the solve fails, or if no factorisation exists yet;
    /// the next call then tries again.
    fn direct_sums(&self, cells: &[usize], tractions: &[f64]) -> Option<Vec<[f64; 3]>> {
        let n = self.n_cells();
        let formed = self.formed();
        if formed.verified.load(Ordering::Relaxed) {
            return None;
        }
        let afresh = self.body.refined_displacement(self.whole.nodes(), &self.forces(tractions));
        let gap = self.gap(&afresh.ok()??);
        formed.verified.store(true, Ordering::Relaxed);
        Some(cells.iter().map(|cell| [0, 1, 2].map(|plane| gap[plane * n + cell])).collect())
    }

    fn form_rows(&self, cells: &[usize]) -> Result<()> {
        let mut formed = self.formed.write().expect("no panic while the operator grows");
        let mut wanted = formed.cells.clone();
        cells.iter().for_each(|&cell| wanted[cell] = true);
        if wanted == formed.cells {
            return Ok(());
        }
        let flexibility = extend_rows(&formed.flexibility, &self.whole, &wanted, &self.body)?;
        let mut added_cells = std::mem::take(&mut formed.added_cells);
        added_cells.push(cells.to_vec());
        *formed = FormedRows { cells: wanted, flexibility, verified: AtomicBool::new(false), added_cells };
        Ok(())
    }

    fn history(&self) -> OperatorHistory {
        let FormedRows { cells: _, flexibility: _, verified, added_cells } = &*self.formed();
        OperatorHistory {
            formed: added_cells.clone(),
            formed_rows_checked: verified.load(Ordering::Relaxed),
            ..OperatorHistory::default()
        }
    }

    /// Forms the rows in the same order as the original operator. The order matters: an entry between nodes of two
    /// calls comes from the solve of the later call.
    fn replay(&self, course: &OperatorHistory) -> Result<()> {
        course.formed.iter().try_for_each(|cells| self.form_rows(cells))?;
        self.formed().verified.store(course.formed_rows_checked, Ordering::Relaxed);
        Ok(())
    }
}
