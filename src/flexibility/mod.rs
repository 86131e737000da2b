//! Flexibility operators on the contact frame: gap = S tractions.
//!
//! [`Flexibility`] is the interface of all operators; [`composed`], [`constrained`] and [`subset`] combine or restrict them.
//! Vectors over a frame of N cells, `[3, N]`, contain the x components of all cells, then the y, then the n components. The
//! components belong to the local axes (x, y, n) of each cell.

pub mod cell_matrix;
pub mod composed;
pub mod constrained;
pub mod operator_history;
pub mod per_cell;
pub mod subset;

use std::sync::Arc;

use nalgebra::Matrix3;

use crate::error::Result;
use crate::flexibility::cell_matrix::CellMatrix;
use crate::flexibility::operator_history::OperatorHistory;
use crate::flexibility::per_cell::PerCell;

/// Linear map S from tractions on body 2 (MPa) to the gap change (mm) that they cause.
///
/// S is symmetric positive definite in the area-weighted inner product: `A S = (A S)^T`. A is diagonal, with the area of each cell
/// for each of its three components.
///
/// Only one task at a time may apply an operator, because operators lock their work space while their loops run in parallel. Two
/// tasks of one thread pool that apply the same operator can deadlock.
pub trait Flexibility: Send + Sync {
    /// Number of cells N.
    fn n_cells(&self) -> usize;

    /// Tangential part of the operator, if pressures cause no tangential gap and tangential tractions cause no normal gap. `None`
    /// if the normal and the tangential part cannot be used separately.
    fn tangential(&self) -> Option<&dyn TangentialFlexibility> {
        None
    }

    /// Computes `gap = S tractions`, both `[3, N]`; overwrites `gap`. Only the first call may allocate memory.
    fn apply(&self, tractions: &[f64], gap: &mut [f64]);

    /// Computes `normal_gap = S_nn pressure` with the normal block S_nn, both `[N]`; overwrites `normal_gap`. Only the
    /// first call may allocate memory.
    fn apply_normal(&self, pressure: &[f64], normal_gap: &mut [f64]);

    /// The 3 x 3 diagonal blocks S_II of the cells I, `[N]`, mm/MPa.
    fn diagonal_blocks(&self) -> PerCell<Matrix3<f64>>;

    /// Whether tangential tractions change the normal gap (S_nt not identically zero).
    fn couples_normal_tangential(&self) -> bool {
        true
    }

    /// Computes `pressure` such that S_nn pressure is about `normal_gap`, both `[N]`; overwrites `pressure`. Uses a
    /// symmetric positive definite approximation of the inverse. Returns false if the operator has no approximation.
    /// Only the first call may allocate memory.
    fn precondition_normal(&self, _normal_gap: &[f64], _pressure: &mut [f64]) -> bool {
        false
    }

    /// Same as [`Self::precondition_normal`] for all components: `gap` and `tractions` are `[3, N]`.
    fn precondition(&self, _gap: &[f64], _tractions: &mut [f64]) -> bool {
        false
    }

    /// Whether the operator contains the condensed matrix of a meshed body. The condition number of this matrix may be
    /// much larger than the condition number of a half-space operator, because thin bodies bend.
    fn is_condensed(&self) -> bool {
        false
    }

    /// Adds the blocks of S between `cells`, whose rows must be formed, to `matrix`. Returns false if the operator cannot give its
    /// entries; `matrix` is then undefined.
    fn add_entries(&self, _cells: &[usize], _matrix: &mut CellMatrix) -> bool {
        false
    }

    /// Gap S tractions in one cell, mm, by direct summation over all cells; tractions are `[3, N]`. The summation and
    /// [`Self::apply`] use different algorithms, so that their results can be compared. Precomputed coefficients may be
    /// shared. `None` if the operator has no direct sum.
    fn direct_sum(&self, _cell: usize, _tractions: &[f64]) -> Option<[f64; 3]> {
        None
    }

    /// Gap S tractions in several cells, `[cells.len()]`, mm, for comparison with [`Self::apply`]. The default
    /// implementation calls [`Self::direct_sum`] for each cell. `None` if the operator offers no comparison. In a sum
    /// of operators, parts without a comparison contribute the result of [`Self::apply`].
    fn direct_sums(&self, cells: &[usize], tractions: &[f64]) -> Option<Vec<[f64; 3]>> {
        cells.iter().map(|&cell| self.direct_sum(cell, tractions)).collect()
    }

    /// Numbers of cells along x and y of a uniform grid, otherwise `None`. Cell (ix, iy) has the index `ix * cells[1] + iy`.
    fn grid(&self) -> Option<[usize; 2]> {
        None
    }

    /// Operator of the same bodies on a smaller grid that fits into the frame. The cells of the smaller grid are
    /// `factor` times as long and as wide as the cells of this operator. The smaller grid has at least `at_least` cells
    /// along x and y. Parts that depend on the position are missing; [`Self::restriction_at`] adds them. `None` if the
    /// operator has no such restriction.
    fn restrict(&self, _at_least: [usize; 2], _factor: usize) -> Option<Arc<dyn Flexibility>> {
        None
    }

    /// Places `smaller`, a result of [`Self::restrict`] with `factor`, on the frame. The first cell of `smaller` starts
    /// where cell (ix, iy) = `origin` of this operator starts. Operators that depend on the position replace this
    /// default, which returns `smaller` unchanged.
    fn restriction_at(
        &self,
        smaller: Arc<dyn Flexibility>,
        _origin: [usize; 2],
        _factor: usize,
    ) -> Arc<dyn Flexibility> {
        smaller
    }

    /// Cells whose rows of S are not formed, in ascending order. In these cells, [`Self::apply`] gives an incomplete
    /// gap, and the tractions must be zero.
    fn unformed_cells(&self) -> Vec<usize> {
        Vec::new()
    }

    /// Adds the missing part of the gap in the unformed cells. `gap` is the result of [`Self::apply`] for `tractions`, both
    /// `[3, N]`.
    ///
    /// # Errors
    /// If a body cannot be solved.
    fn complete_gap(&self, _tractions: &[f64], _gap: &mut [f64]) -> Result<()> {
        Ok(())
    }

    /// Forms the rows of S for further cells.
    ///
    /// # Errors
    /// If a body cannot be solved, or memory does not suffice.
    fn form_rows(&self, _cells: &[usize]) -> Result<()> {
        Ok(())
    }

    /// Changes that earlier calls made to the operator since its construction.
    fn history(&self) -> OperatorHistory {
        OperatorHistory::default()
    }

    /// Repeats the changes that another operator of the same bodies recorded. This operator must be newly built.
    ///
    /// # Errors
    /// As [`Self::form_rows`].
    fn replay(&self, _course: &OperatorHistory) -> Result<()> {
        Ok(())
    }
}

/// Tangential part S_tt of a [`Flexibility`] whose normal and tangential components are decoupled.
pub trait TangentialFlexibility {
    /// Computes `gap = S_tt tractions`, both `[2, N]`; overwrites `gap`. Only the first call may allocate memory.
    fn apply_tangential(&self, tractions: &[f64], gap: &mut [f64]);

    /// Computes `tractions` such that S_tt tractions is about `gap`, both `[2, N]`; overwrites `tractions`. Only the
    /// first call may allocate memory.
    fn precondition_tangential(&self, gap: &[f64], tractions: &mut [f64]);
}
