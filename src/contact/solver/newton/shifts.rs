//! Prescribed tangential forces by prescribed displacements: an iteration on the shifts at which friction carries the forces.
//!
//! Under a prescribed force, a Newton step may change the states of many cells at once, so that the active set does not settle.
//! At a prescribed shift it usually settles.

use super::super::super::{ContactState, Increment, PathPoint, TangentialControl};
use super::super::control::SolveControl;
use super::{NewtonSolve, SUFFICIENT_GAIN};

/// Largest number of steps of the shift.
const MAX_SHIFTS: usize = 30;

/// Largest number of iterations at one shift.
const MAX_ITERATIONS: usize = 500;

/// Smallest tried length of a step of the shift, as a share of the Newton step.
const MIN_LENGTH: f64 = 1e-3;

impl NewtonSolve<'_, '_> {
    /// Takes Newton steps of the shift from the start of the solve, and solves at each shift. Returns whether `it` is the solution.
    /// Without a solution `it` keeps its state.
    pub(super) fn solve_by_shifts(&mut self, it: &mut ContactState, control: &mut SolveControl) -> bool {
        let forced = |point: &PathPoint| matches!(point.tangential, TangentialControl::Force(_));
        let points = &self.problem.path_points;
        if !points.iter().any(forced) || points.iter().any(|point| point.balance.is_some()) {
            return false;
        }
        let shift = |point: &PathPoint| PathPoint { tangential: TangentialControl::Shift, ..point.clone() };
        let shifted = Increment {
            scales: self.problem.scales.clone(),
            path_points: points.iter().map(shift).collect(),
            ..*self.problem
        };
        let mut state = it.clone();
        self.start.restore_into(&mut state);
        let mut trial = state.clone();
        if !self.solve_at_shift(&shifted, &mut state, control) {
            return false;
        }
        for _ in 0..MAX_SHIFTS {
            self.report.residual = self.problem.natural_residual(&state);
            if self.report.residual <= self.options.tolerance {
                std::mem::swap(it, &mut state);
                return true;
            }
            if !self.step(&state, &mut trial) || !self.take_shift(&shifted, &mut state, &mut trial, control) {
                return false;
            }
        }
        false
    }

    /// Solves at the shift of `trial`, shortened until the force defect falls, and replaces `state` by the solution. Returns
    /// `false` if no length succeeds.
    fn take_shift(
        &mut self,
        shifted: &Increment,
        state: &mut ContactState,
        trial: &mut ContactState,
        control: &mut SolveControl,
    ) -> bool {
        let before = self.problem.force_defect(state);
        let mut length = 1.0;
        while length >= MIN_LENGTH {
            let mut solved = trial.clone();
            if self.solve_at_shift(shifted, &mut solved, control)
                && self.problem.force_defect(&solved) <= (1.0 - SUFFICIENT_GAIN * length) * before
            {
                std::mem::swap(state, &mut solved);
                return true;
            }
            trial.halve_step(state);
            length *= 0.5;
        }
        false
    }

    /// Solves the increment `shifted` from the state in `it`. Returns whether it converges.
    fn solve_at_shift(
        &mut self,
        shifted: &Increment,
        it: &mut ContactState,
        control: &mut SolveControl,
    ) -> bool {
        it.project_to_cone();
        let mut control = control.auxiliary(self.report.iterations, MAX_ITERATIONS);
        let report = (self.part_solver)(shifted, it, &mut control);
        self.report.add_work_of(&report);
        report.converged()
    }
}
