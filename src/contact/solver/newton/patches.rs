//! Preconditioner of large systems of meshed bodies: factors of the systems of patches of neighbouring cells.
//!
//! Two plates of 2500 cells, as thick as they are wide, need half to a third of the operator products that the local compliances need. A
//! coarse space is left out: the cells in contact change, and so do its products with the operator, which cost more than they save.

use std::collections::BTreeMap;

use faer::Par;
use rayon::prelude::*;

use super::factorised_systems::{Entries, MAX_UNKNOWNS, are_applicable, has_inverse};
use super::tangent::NewtonSystem;
use crate::linalg::dense_lu::DenseLu;
use crate::linalg::dense_matrix::DenseMatrix;

/// Factors of the system of a patch at one path point.
pub(super) struct PatchFactors {
    /// Unknowns of the patch in the whole system.
    unknowns: Vec<usize>,
    factors: DenseLu,
}

impl PatchFactors {
    /// Solves the system of the patch for its part of `rows`. Returns `None` if memory does not suffice.
    fn solve(&self, rows: &[f64]) -> Option<DenseMatrix> {
        let own = self.unknowns.iter().map(|&unknown| rows[unknown]).collect();
        let mut column = DenseMatrix::from_values(self.unknowns.len(), 1, own);
        self.factors.solve_in_place(&mut column, Par::Seq).ok().map(|()| column)
    }
}

/// Computes the unknown tractions `x` from `rows`, patch by patch. Returns whether memory sufficed.
pub(super) fn solve(patches: &[PatchFactors], rows: &[f64], x: &mut [f64]) -> bool {
    let solved: Option<Vec<DenseMatrix>> = patches.par_iter().map(|patch| patch.solve(rows)).collect();
    let Some(solved) = solved else { return false };
    for (patch, column) in patches.iter().zip(&solved) {
        patch.unknowns.iter().zip(column.values()).for_each(|(&unknown, value)| x[unknown] = *value);
    }
    true
}

impl NewtonSystem<'_, '_> {
    /// Factorises the systems of the patches, if the whole system is too large for that and the operator has no approximate inverse.
    /// The steps remain inexact.
    pub(super) fn factorise_patches(&mut self) {
        let wanted = self.tractions > MAX_UNKNOWNS && !self.problem.patches.is_empty();
        if wanted && are_applicable(self.problem) && !has_inverse(self.problem) {
            self.patches = self.patch_factors().unwrap_or_default();
            self.update_border();
        }
    }

    /// `None` if a system is singular, if the operator has no entries, or if memory does not suffice.
    pub(super) fn patch_factors(&self) -> Option<Vec<PatchFactors>> {
        let unformed = self.problem.flexibility.unformed_cells();
        let mut patches: BTreeMap<(usize, usize), Vec<usize>> = BTreeMap::new();
        for (member, active) in self.active.iter().enumerate() {
            if unformed.binary_search(&active.cell).is_ok() {
                return None;
            }
            patches.entry((active.end, self.problem.patches[active.cell])).or_default().push(member);
        }
        let patches: Vec<Vec<usize>> = patches.into_values().collect();
        patches.par_iter().map(|members| self.factors_of_patch(members)).collect()
    }

    fn factors_of_patch(&self, members: &[usize]) -> Option<PatchFactors> {
        let active = || members.iter().map(|&member| &self.active[member]);
        let entries = Entries::new(self.problem.flexibility, active().map(|active| active.cell).collect())?;
        let factors = DenseLu::new(self.matrix_between(members, &entries, 0).ok()?, Par::Seq).ok()?;
        Some(PatchFactors { unknowns: active().flat_map(|active| active.unknowns()).collect(), factors })
    }
}
