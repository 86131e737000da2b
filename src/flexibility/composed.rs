//! Sum of several flexibility operators.

use std::sync::Arc;

use nalgebra::Matrix3;

use crate::error::Result;
use crate::flexibility::Flexibility;
use crate::flexibility::cell_matrix::CellMatrix;
use crate::flexibility::operator_history::OperatorHistory;
use crate::flexibility::per_cell::PerCell;

/// The sum of several operators on one frame.
pub struct SumFlexibility {
    parts: Vec<Arc<dyn Flexibility>>,
    scratch: std::sync::Mutex<Vec<f64>>,
}

impl SumFlexibility {
    /// Creates the sum of `parts`, which all have the same number of cells.
    ///
    /// # Panics
    /// If `parts` is empty or the sizes differ.
    pub fn new(parts: Vec<Arc<dyn Flexibility>>) -> Self {
        let n = parts.first().expect("a sum has at least one part").n_cells();
        assert!(parts.iter().all(|part| part.n_cells() == n), "operators on different frames");
        Self { parts, scratch: std::sync::Mutex::new(vec![0.0; 3 * n]) }
    }
}

impl Flexibility for SumFlexibility {
    fn n_cells(&self) -> usize {
        self.parts[0].n_cells()
    }

    fn apply(&self, tractions: &[f64], gap: &mut [f64]) {
        self.parts[0].apply(tractions, gap);
        let mut scratch = self.scratch.lock().expect("no panic while the scratch is held");
        for part in &self.parts[1..] {
            part.apply(tractions, &mut scratch);
            gap.iter_mut().zip(scratch.iter()).for_each(|(g, s)| *g += s);
        }
    }

    fn apply_normal(&self, pressure: &[f64], normal_gap: &mut [f64]) {
        self.parts[0].apply_normal(pressure, normal_gap);
        let mut scratch = self.scratch.lock().expect("no panic while the scratch is held");
        for part in &self.parts[1..] {
            let scratch = &mut scratch[..pressure.len()];
            part.apply_normal(pressure, scratch);
            normal_gap.iter_mut().zip(scratch.iter()).for_each(|(g, s)| *g += s);
        }
    }

    fn diagonal_blocks(&self) -> PerCell<Matrix3<f64>> {
        let mut sum = self.parts[0].diagonal_blocks();
        for part in &self.parts[1..] {
            sum = match (sum, part.diagonal_blocks()) {
                (PerCell::Same(a, n), PerCell::Same(b, _)) => PerCell::Same(a + b, n),
                (a, b) => a.iter().zip(b.iter()).map(|(a, b)| a + b).collect(),
            };
        }
        sum
    }

    fn couples_normal_tangential(&self) -> bool {
        self.parts.iter().any(|part| part.couples_normal_tangential())
    }

    /// Applies the first available approximate inverse of a part, as an approximation for the sum.
    fn precondition_normal(&self, normal_gap: &[f64], pressure: &mut [f64]) -> bool {
        self.parts.iter().any(|part| part.precondition_normal(normal_gap, pressure))
    }

    fn precondition(&self, gap: &[f64], tractions: &mut [f64]) -> bool {
        self.parts.iter().any(|part| part.precondition(gap, tractions))
    }

    fn is_condensed(&self) -> bool {
        self.parts.iter().any(|part| part.is_condensed())
    }

    fn add_entries(&self, cells: &[usize], matrix: &mut CellMatrix) -> bool {
        self.parts.iter().all(|part| part.add_entries(cells, matrix))
    }

    /// Sums over the parts. Parts without a direct sum contribute the result of `apply`, which is then not verified. `None` if no
    /// part has a direct sum.
    fn direct_sums(&self, cells: &[usize], tractions: &[f64]) -> Option<Vec<[f64; 3]>> {
        let direct: Vec<_> = self.parts.iter().map(|part| part.direct_sums(cells, tractions)).collect();
        if direct.iter().all(Option::is_none) {
            return None;
        }
        let n = self.n_cells();
        let mut sum = vec![[0.0; 3]; cells.len()];
        let mut product = vec![0.0; 3 * n];
        for (part, direct) in self.parts.iter().zip(direct) {
            let gaps = direct.unwrap_or_else(|| {
                part.apply(tractions, &mut product);
                cells.iter().map(|cell| [0, 1, 2].map(|plane| product[plane * n + cell])).collect()
            });
            sum.iter_mut().flatten().zip(gaps.iter().flatten()).for_each(|(s, g)| *s += g);
        }
        Some(sum)
    }

    fn unformed_cells(&self) -> Vec<usize> {
        let mut cells: Vec<usize> = self.parts.iter().flat_map(|part| part.unformed_cells()).collect();
        cells.sort_unstable();
        cells.dedup();
        cells
    }

    fn complete_gap(&self, tractions: &[f64], gap: &mut [f64]) -> Result<()> {
        self.parts.iter().try_for_each(|part| part.complete_gap(tractions, gap))
    }

    fn form_rows(&self, cells: &[usize]) -> Result<()> {
        self.parts.iter().try_for_each(|part| part.form_rows(cells))
    }

    fn history(&self) -> OperatorHistory {
        OperatorHistory {
            parts: self.parts.iter().map(|part| part.history()).collect(),
            ..OperatorHistory::default()
        }
    }

    fn replay(&self, course: &OperatorHistory) -> Result<()> {
        self.parts.iter().zip(&course.parts).try_for_each(|(part, course)| part.replay(course))
    }
}
