//! Decides which linear systems of Newton steps are factorised, and computes the flexibility entries for their
//! matrices.
//!
//! Thin bodies bend. No local approximate inverse improves the condition number of their flexibility, so that their
//! systems need factors.

use crate::contact::{Increment, Pressures, SlipReference};
use crate::flexibility::Flexibility;
use crate::flexibility::cell_matrix::CellMatrix;

/// Largest number of unknowns of a factorised system, and largest number of tractions of its cells in contact. The
/// matrix and the entries of the flexibility take up to 128 MB each.
pub(super) const MAX_UNKNOWNS: usize = 4000;

/// Returns whether systems of `problem` may be factorised.
pub(super) fn are_applicable(problem: &Increment) -> bool {
    let rolls = |reference: &SlipReference| matches!(reference, SlipReference::Upstream(_));
    problem.flexibility.is_condensed()
        && problem.pressures == Pressures::Unknown
        && !problem.path_points.iter().any(|point| rolls(&point.reference))
}

/// Returns whether systems of `problem` are factorised after a failed iterative step that follows `failures` earlier
/// failures. If the flexibility has an approximate inverse, Barzilai-Borwein steps follow the first failure instead.
pub(super) fn follow_failure(problem: &Increment, failures: usize) -> bool {
    are_applicable(problem) && (failures > 0 || !has_inverse(problem))
}

/// Returns whether the operator offers an approximate inverse of the flexibility.
pub(super) fn has_inverse(problem: &Increment) -> bool {
    let nothing = vec![0.0; 3 * problem.n()];
    problem.flexibility.precondition(&nothing, &mut nothing.clone())
}

/// Flexibility between some cells, kept for several steps.
pub(super) struct Entries {
    /// Cells, ascending.
    pub cells: Vec<usize>,
    pub matrix: CellMatrix,
}

impl Entries {
    /// Computes the entries between `cells`, ascending. `None` if the operator has none, or memory does not suffice.
    pub fn new(flexibility: &dyn Flexibility, cells: Vec<usize>) -> Option<Self> {
        let mut matrix = CellMatrix::zeros(cells.len()).ok()?;
        flexibility.add_entries(&cells, &mut matrix).then_some(Self { cells, matrix })
    }

    /// Index of a cell in `cells`.
    pub fn place(&self, cell: usize) -> Option<usize> {
        self.cells.binary_search(&cell).ok()
    }
}
