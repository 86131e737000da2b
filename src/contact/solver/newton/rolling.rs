//! Newton iteration for steady rolling, without Barzilai-Borwein steps.
//!
//! The equations of steady rolling are not symmetric, and Barzilai-Borwein steps hardly reduce their residual. Fallback steps are
//! rarely necessary, because the cell states converge from the leading edge on. If the residual stops decreasing, steps are halved.

use super::super::super::{ContactState, Increment, Unknowns};
use super::super::control::SolveControl;
use super::super::pressures_first::without_friction;
use super::super::report::{SolveReport, StopReason};
use super::NewtonSolve;

/// Number of consecutive steps without a new best residual after which further steps are halved.
const MAX_STEPS_WITHOUT_GAIN: usize = 5;

/// Number of steps after which the method ends.
const MAX_ROLLING_STEPS: usize = 60;

impl NewtonSolve<'_, '_> {
    /// Solves from the evaluated state in `it`. Afterwards `it` contains the best state.
    pub(super) fn run_rolling(mut self, it: &mut ContactState, control: &mut SolveControl) -> SolveReport {
        if self.problem.friction.is_some() && it.scaled.iter().all(|traction| *traction == 0.0) {
            self.solve_frictionless_start(it, control);
        }
        let mut trial = it.clone();
        let (mut best, mut least) = (Unknowns::from_state(it), f64::INFINITY);
        let mut in_vain = 0;
        for step in 0.. {
            let residual = self.problem.natural_residual(it);
            self.report.residual = residual;
            in_vain += 1;
            if residual < least {
                best.copy_from(it);
                (least, in_vain) = (residual, 0);
            }
            let exhausted = step >= MAX_ROLLING_STEPS.min(self.options.max_iterations);
            if let Some(stop) = control.stop_reason(self.report.iterations, residual, exhausted) {
                self.report.stop = stop;
                break;
            }
            self.step(self.problem, it, &mut trial);
            if in_vain > MAX_STEPS_WITHOUT_GAIN {
                trial.halve_step(it);
                self.problem.evaluate(&mut trial);
                self.report.applications += self.problem.applications();
            }
            std::mem::swap(it, &mut trial);
        }
        if matches!(self.report.stop, StopReason::Converged | StopReason::NotFinite) {
            return self.report;
        }
        best.restore_into(it);
        self.problem.evaluate(it);
        self.report.applications += self.problem.applications();
        self.report.residual = least;
        self.report
    }

    /// Solves for the pressures without friction, as a start of the iteration.
    fn solve_frictionless_start(&mut self, it: &mut ContactState, control: &mut SolveControl) {
        // Wear is left out, because it does not change the gap in steady rolling.
        let pressed = Increment { wear: None, ..without_friction(self.problem) };
        let report = (self.part_solver)(&pressed, it, &mut control.auxiliary(0, usize::MAX));
        self.report.add_work_of(&report);
        self.report.applications += self.problem.applications();
        self.problem.evaluate(it);
    }
}
