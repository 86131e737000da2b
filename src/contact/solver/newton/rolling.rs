//! Newton iteration for steady rolling, without Barzilai-Borwein steps.
//!
//! The equations of steady rolling are not symmetric, and Barzilai-Borwein steps hardly reduce their residual. Fallback steps are
//! rarely necessary, because the cell states converge from the leading edge on. If the residual stops decreasing, steps are halved.

use super::super::super::{ContactState, Increment, Unknowns};
use super::super::control::{PartSolver, SolveControl};
use super::super::pressures_first::without_friction;
use super::super::report::{SolveReport, StopReason};
use super::NewtonSolve;

/// Number of consecutive steps without a new best residual after which further steps are damped.
const MAX_STEPS_WITHOUT_GAIN: usize = 5;

/// Factor on the length of damped steps.
const DAMPING: f64 = 0.5;

/// Number of steps after which the method ends.
const MAX_ROLLING_STEPS: usize = 60;

impl NewtonSolve<'_, '_> {
    /// Solves from the evaluated state in `it`. Afterwards `it` contains the best state.
    pub(super) fn run_rolling(
        mut self,
        it: &mut ContactState,
        control: &mut SolveControl,
        frictionless_solver: PartSolver,
    ) -> SolveReport {
        if self.problem.friction.is_some() && it.scaled.iter().all(|traction| *traction == 0.0) {
            self.solve_frictionless_start(it, control, frictionless_solver);
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
            self.step(it, &mut trial);
            if in_vain > MAX_STEPS_WITHOUT_GAIN {
                shorten(it, &mut trial);
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

    /// Solves for the pressures without friction, as a start.
    fn solve_frictionless_start(
        &mut self,
        it: &mut ContactState,
        control: &mut SolveControl,
        solver: PartSolver,
    ) {
        // In steady rolling wear does not change the gap.
        let pressed = Increment { wear: None, ..without_friction(self.problem) };
        let report = solver(&pressed, it, control);
        self.report.add_work_of(&report);
        self.report.applications += self.problem.applications();
        self.problem.evaluate(it);
    }
}

/// Replaces `trial` by a point between `it` and `trial`. The tractions stay admissible, because the admissible set is convex.
fn shorten(it: &ContactState, trial: &mut ContactState) {
    let between = |from: &f64, to: &mut f64| *to = from + DAMPING * (*to - from);
    it.scaled.iter().zip(&mut trial.scaled).for_each(|(from, to)| between(from, to));
    let motions = it.rigid_motion.iter().flatten().zip(trial.rigid_motion.iter_mut().flatten());
    motions.for_each(|(from, to)| between(from, to));
    let floating = it.mode_amplitudes.iter().flatten().zip(trial.mode_amplitudes.iter_mut().flatten());
    floating.for_each(|(from, to)| between(from, to));
}
