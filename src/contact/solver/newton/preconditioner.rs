//! Preconditioner of a Newton step: the approximate inverse of the flexibility operator, restricted to the cells in
//! contact. Rigid motions with prescribed forces are eliminated with their Schur complement.

use nalgebra::{DMatrix, DVector, LU};

use super::super::super::{Increment, SlipReference, Upstream};
use super::unknowns::{ActiveCell, CellStatus, perpendicular};
use crate::linalg::vector::dot;

/// Approximate inverse of the flexibility operator on the cells in contact, with its buffers.
pub(super) struct ActiveSetInverse {
    /// Physical gap, `[3, N]`, mm.
    gap: Vec<f64>,
    /// Physical tractions, `[3, N]`, MPa.
    tractions: Vec<f64>,
    /// Cells that stick, `[N]`.
    stuck: Vec<bool>,
}

impl ActiveSetInverse {
    pub fn new(n: usize) -> Self {
        Self { gap: vec![0.0; 3 * n], tractions: vec![0.0; 3 * n], stuck: vec![false; n] }
    }

    /// Computes unknown tractions `x` for which the rows of the equations have approximately the values `rows`.
    pub fn apply(&mut self, problem: &Increment, active: &[ActiveCell], rows: &[f64], x: &mut [f64]) {
        for end in 0..problem.path_points.len() {
            self.spread(problem, active, rows, end);
            if let SlipReference::Upstream(upstream) = &problem.path_points[end].reference {
                self.sum_upstream(upstream);
            }
            if !self.invert(problem) {
                // Without an approximate inverse, the inverse of the diagonal is used. The rows already contain it as a
                // factor.
                x.copy_from_slice(rows);
                for active in active {
                    if let CellStatus::Slip { beta_ratio, .. } = active.state {
                        x[active.tangential_row] /= 1.0 + beta_ratio;
                    }
                }
                return;
            }
            self.gather(problem, active, rows, x, end);
        }
    }

    /// Computes tractions from the gap. Returns `false` if the operator has no approximate inverse.
    fn invert(&mut self, problem: &Increment) -> bool {
        if problem.normal_only() {
            let n = problem.n();
            return problem.flexibility.precondition_normal(&self.gap[2 * n..], &mut self.tractions[2 * n..]);
        }
        let Some(part) = problem.tangential_operator() else {
            return problem.flexibility.precondition(&self.gap, &mut self.tractions);
        };
        let n = problem.n();
        part.precondition_tangential(&self.gap[..2 * n], &mut self.tractions[..2 * n]);
        true
    }

    /// Sums the slips of the sticking cells from the leading edge on. The slip of a cell is its displacement minus the displacement
    /// of its upstream cell, so the sums are displacements. The displacement upstream of the first sticking cell counts as zero.
    fn sum_upstream(&mut self, upstream: &Upstream) {
        let n = self.stuck.len();
        let steps = upstream.source_cell.iter().enumerate().map(|(cell, from)| from.cmp(&cell) as isize);
        let ahead_is_later = steps.sum::<isize>() > 0;
        let mut add = |cell: usize| {
            let from = upstream.source_cell[cell];
            let known = if ahead_is_later { from > cell } else { from < cell };
            if known && self.stuck[cell] && self.stuck[from] {
                self.gap[cell] += self.gap[from];
                self.gap[n + cell] += self.gap[n + from];
            }
        };
        if ahead_is_later { (0..n).rev().for_each(&mut add) } else { (0..n).for_each(&mut add) }
    }

    fn spread(&mut self, problem: &Increment, active: &[ActiveCell], rows: &[f64], end: usize) {
        let n = problem.n();
        let hat = problem.friction_scaling();
        self.gap.fill(0.0);
        self.stuck.fill(false);
        let rolls = rolls(problem, end);
        for active in active.iter().filter(|active| active.end == end) {
            let (cell, first) = (active.cell, active.tangential_row);
            if let Some(k) = active.pressure_row {
                self.gap[2 * n + cell] = rows[k] / problem.scales.c_normal[cell];
            }
            let hatted = match active.state {
                CellStatus::PressureOnly | CellStatus::PrescribedSlip { .. } => continue,
                CellStatus::Stick => {
                    self.stuck[cell] = true;
                    [rows[first], rows[first + 1]]
                }
                CellStatus::Slip { .. } if rolls => continue,
                CellStatus::Slip { direction, beta_ratio, .. } => {
                    perpendicular(direction).map(|e| e * rows[first] * share(beta_ratio))
                }
            };
            if let Some(hat) = &hat {
                let gap = hat.physical_slip(hatted.map(|row| row / problem.scales.c_tangential[cell]));
                (self.gap[cell], self.gap[n + cell]) = (gap[0], gap[1]);
            }
        }
    }

    fn gather(&self, problem: &Increment, active: &[ActiveCell], rows: &[f64], x: &mut [f64], end: usize) {
        let n = problem.n();
        let (hat, rolls) = (problem.friction_scaling(), rolls(problem, end));
        for active in active.iter().filter(|active| active.end == end) {
            let (cell, first) = (active.cell, active.tangential_row);
            if let Some(k) = active.pressure_row {
                x[k] = self.tractions[2 * n + cell];
            }
            let Some(hat) = &hat else { continue };
            let q = hat.scaled_traction([self.tractions[cell], self.tractions[n + cell]]);
            match active.state {
                CellStatus::PressureOnly | CellStatus::PrescribedSlip { .. } => {}
                CellStatus::Stick => (x[first], x[first + 1]) = (q[0], q[1]),
                CellStatus::Slip { direction, beta_ratio, .. } => {
                    let left = perpendicular(direction);
                    let elastic = left[0] * q[0] + left[1] * q[1];
                    let alone = rows[first] / (1.0 + beta_ratio);
                    let share = if rolls { 0.0 } else { share(beta_ratio) };
                    x[first] = share * elastic + (1.0 - share) * alone;
                }
            }
        }
    }
}

/// Returns whether slip is measured relative to the upstream cell.
fn rolls(problem: &Increment, end: usize) -> bool {
    matches!(problem.path_points[end].reference, SlipReference::Upstream(_))
}

/// Weight β of the elastic response in the row of a slipping cell. The remaining weight 1 - β belongs to the local
/// rotation of the traction.
fn share(beta_ratio: f64) -> f64 {
    1.0 / (1.0 + beta_ratio)
}

/// Elimination of the unknown rigid motions, by their Schur complement.
pub(super) struct MotionSchurComplement {
    /// Tractions that the approximate inverse assigns to each unit motion, one vector per motion.
    columns: Vec<Vec<f64>>,
    /// Work of a unit of each traction on each motion, divided by the total cell area; one vector per motion.
    constraints: Vec<Vec<f64>>,
    /// LU factors of the Schur complement. `None` without motions, or if the tractions in contact do not determine the motions.
    schur: Option<LU<f64, nalgebra::Dyn, nalgebra::Dyn>>,
}

impl MotionSchurComplement {
    pub fn new(columns: Vec<Vec<f64>>, constraints: Vec<Vec<f64>>) -> Self {
        let m = columns.len();
        let schur = (m > 0).then(|| DMatrix::from_fn(m, m, |i, j| dot(&constraints[i], &columns[j])).lu());
        let schur = schur.filter(LU::is_invertible);
        Self { columns, constraints, schur }
    }

    /// Works of `tractions` on all rigid motions.
    pub fn works(&self, tractions: &[f64]) -> impl Iterator<Item = f64> {
        self.constraints.iter().map(|constraint| dot(constraint, tractions))
    }

    /// Adds the change with the least sum of squares after which `tractions` do the prescribed `works`.
    pub fn restore_work(&self, works: &[f64], tractions: &mut [f64]) {
        if self.schur.is_none() {
            return;
        }
        let m = works.len();
        let defect = DVector::from_fn(m, |k, _| works[k] - dot(&self.constraints[k], tractions));
        let gram = DMatrix::from_fn(m, m, |i, j| dot(&self.constraints[i], &self.constraints[j]));
        let Some(solved) = gram.lu().solve(&defect) else { return };
        for (k, constraint) in self.constraints.iter().enumerate() {
            tractions.iter_mut().zip(constraint).for_each(|(t, c)| *t += solved[k] * c);
        }
    }

    /// Computes the `amounts` of the motions and corrects `tractions`, so that the tractions do the prescribed works. On input,
    /// `tractions` is the solution with zero motions.
    pub fn eliminate_motions(&self, works: &[f64], tractions: &mut [f64], amounts: &mut [f64]) {
        let Some(schur) = &self.schur else {
            amounts.copy_from_slice(works);
            return;
        };
        let defect = DVector::from_fn(works.len(), |k, _| dot(&self.constraints[k], tractions) - works[k]);
        let Some(solved) = schur.solve(&defect) else { return };
        for (k, column) in self.columns.iter().enumerate() {
            amounts[k] = solved[k];
            tractions.iter_mut().zip(column).for_each(|(t, c)| *t -= solved[k] * c);
        }
    }
}
