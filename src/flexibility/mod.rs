//! Flexibility operators on the contact frame.
//!
//! Vectors over a frame of N cells are stored by component planes, `[x_0..x_N, y_0..y_N, n_0..n_N]`, length 3N,
//! in the local axes (x, y, n) of each cell.

pub mod composed;
pub mod constrained;
pub mod operator_history;
pub mod per_cell;
pub mod subset;

use std::sync::Arc;

use nalgebra::Matrix3;

use crate::error::Result;
use crate::flexibility::operator_history::OperatorHistory;
use crate::flexibility::per_cell::PerCell;

/// The linear map S from tractions on body 2 (MPa) to the change of the gap (mm) that they cause.
///
/// Symmetric positive definite in the area-weighted inner product: `A S = (A S)^T`.
///
/// One product at a time: operators hold their work space while their loops run in parallel. Two tasks of one thread pool that apply the
/// same operator could wait for each other.
pub trait Flexibility: Send + Sync {
    /// Number of cells N.
    fn n_cells(&self) -> usize;

    /// Its tangential part, of an operator whose normal part and this one can be used each by itself: neither component moves
    /// the gap of the other.
    fn tangential(&self) -> Option<&dyn TangentialFlexibility> {
        None
    }

    /// `gap = S tractions`, both `[3, N]` by planes; overwrites `gap`. Does not allocate.
    fn apply(&self, tractions: &[f64], gap: &mut [f64]);

    /// `normal_gap = S_nn pressure`, both `[N]`; overwrites. Does not allocate.
    fn apply_normal(&self, pressure: &[f64], normal_gap: &mut [f64]);

    /// The 3 x 3 diagonal blocks S_II, `[N]`.
    fn diagonal_blocks(&self) -> PerCell<Matrix3<f64>>;

    /// Whether tractions in the surface move the normal gap at all (S_nt not identically zero).
    fn couples_normal_tangential(&self) -> bool {
        true
    }

    /// `pressure` such that S_nn pressure is about `normal_gap`, both `[N]`, by a symmetric positive definite approximation
    /// of the inverse; overwrites. False if the operator has none. Does not allocate but for the first time.
    fn precondition_normal(&self, _normal_gap: &[f64], _pressure: &mut [f64]) -> bool {
        false
    }

    /// As [`Self::precondition_normal`] for all components, both `[3, N]` by planes.
    fn precondition(&self, _gap: &[f64], _tractions: &mut [f64]) -> bool {
        false
    }

    /// S tractions (`[3, N]` by planes) in one cell, mm, summed over the cells without what [`Self::apply`] makes use of; `None`
    /// if there is no such sum.
    fn direct_sum(&self, _cell: usize, _tractions: &[f64]) -> Option<[f64; 3]> {
        None
    }

    /// As [`Self::direct_sum`] in some cells, `[cells.len()]`, without what [`Self::apply`] makes use of; `None` if any has no such sum.
    fn direct_sums(&self, cells: &[usize], tractions: &[f64]) -> Option<Vec<[f64; 3]>> {
        cells.iter().map(|&cell| self.direct_sum(cell, tractions)).collect()
    }

    /// Cells along x and y, if they form a uniform grid, cell (ix, iy) at the index `ix * cells[1] + iy`.
    fn grid(&self) -> Option<[usize; 2]> {
        None
    }

    /// The operator of the same bodies on a grid of `at_least` so many cells, none of them further apart than on the frame,
    /// with sides `factor` times as long; `None` if there is none.
    fn restrict(&self, _at_least: [usize; 2], _factor: usize) -> Option<Arc<dyn Flexibility>> {
        None
    }

    /// An operator of [`Self::restrict`] with its first cell at the cell `origin` of the frame, where what it says depends on the
    /// place.
    fn restriction_at(
        &self,
        smaller: Arc<dyn Flexibility>,
        _origin: [usize; 2],
        _factor: usize,
    ) -> Arc<dyn Flexibility> {
        smaller
    }

    /// Cells whose rows are not formed, ascending: the gap that [`Self::apply`] gives there is not the whole one, and
    /// no traction may act there.
    fn unformed_cells(&self) -> Vec<usize> {
        Vec::new()
    }

    /// Adds to `gap`, which [`Self::apply`] gave for `tractions` (both `[3, N]` by planes), what it lacks in the
    /// unformed cells.
    ///
    /// # Errors
    /// If a body cannot be solved.
    fn complete_gap(&self, _tractions: &[f64], _gap: &mut [f64]) -> Result<()> {
        Ok(())
    }

    /// Forms the rows of some more cells.
    ///
    /// # Errors
    /// If a body cannot be solved, or memory does not suffice.
    fn form_rows(&self, _cells: &[usize]) -> Result<()> {
        Ok(())
    }

    /// What it has come to hold since it was made.
    fn history(&self) -> OperatorHistory {
        OperatorHistory::default()
    }

    /// Comes to hold the same, if it is as it was made.
    ///
    /// # Errors
    /// As [`Self::form_rows`].
    fn replay(&self, _course: &OperatorHistory) -> Result<()> {
        Ok(())
    }
}

/// S_tt of a [`Flexibility`] whose normal gap does not depend on tractions in the surface, nor they on pressures.
pub trait TangentialFlexibility {
    /// `gap = S_tt tractions`, both `[2, N]` by planes; overwrites `gap`. Does not allocate.
    fn apply_tangential(&self, tractions: &[f64], gap: &mut [f64]);

    /// `tractions` such that S_tt tractions is about `gap`, both `[2, N]` by planes; overwrites. Does not allocate but for the
    /// first time.
    fn precondition_tangential(&self, gap: &[f64], tractions: &mut [f64]);
}
