//! Fretting loops: cycles resolved into many increments, without wear.

use crate::contact::certificate::StateChecks;
use crate::contact::solver::{SolveReport, StopReason};
use crate::contact::{ContactState, SlipReference, SolverOptions};
use crate::error::Result;
use crate::evolution::controls::PrescribedLoads;
use crate::evolution::fretting::cycle_state::CycleState;
use crate::evolution::fretting::path::FrettingPath;
use crate::evolution::fretting::wear_step_state::{SlipSource, WearStepState};
use crate::evolution::monotone::{ActiveLaws, ProgressSpan, increment_problem, solve_and_check};
use crate::evolution::records::FrettingLoop;
use crate::evolution::run::{Advance, Run, RunEnd};
use crate::evolution::step::{ClosedPath, CycleMotion};

/// Least number of increments per stroke.
const MIN_LOOP_INCREMENTS: usize = 16;

/// Number of cycles until the loop no longer depends on its initial state. Only the last cycle is reported.
const LOOP_CYCLES: usize = 2;

/// Smallest tolerance of the natural residual for strokes that only determine the stick zone.
const STROKE_TOLERANCE: f64 = 1e-6;

/// Solver options for strokes that only determine the stick zone.
pub(super) fn stroke_options(options: &SolverOptions) -> SolverOptions {
    SolverOptions { tolerance: options.tolerance.max(STROKE_TOLERANCE), ..*options }
}

/// Slip reference and initial guess of the next increment.
#[derive(Clone)]
pub(super) struct IncrementStart {
    /// Tangential gap from which slip is measured, `[2, N]`, mm.
    pub reference: Vec<f64>,
    /// Tractions and motions from which the iterations start.
    pub it: ContactState,
}

impl IncrementStart {
    /// Start at the path point `end` of a cycle whose state is evaluated.
    pub fn at_path_point(cycle: &ContactState, point: usize) -> Self {
        let n = cycle.wear_rate.len();
        let mut it = ContactState::new(n, vec![cycle.rigid_motion[point]]);
        it.mode_amplitudes = vec![cycle.mode_amplitudes[point]];
        it.scaled.copy_from_slice(&cycle.scaled[point * 3 * n..(point + 1) * 3 * n]);
        Self { reference: cycle.gap[point * 3 * n..point * 3 * n + 2 * n].to_vec(), it }
    }
}

impl Run<'_> {
    /// Solves one increment of a cycle at the wear depth `worn` (`[N]`, mm), from `place` to the path point `end` of `path`.
    ///
    /// # Errors
    /// As `solve_and_check`, and if a load acts along a motion that nothing resists.
    pub(super) fn solve_cycle_increment(
        &mut self,
        (path, point, loads): (&FrettingPath, usize, PrescribedLoads),
        (worn, options): (&[f64], &SolverOptions),
        place: IncrementStart,
        progress: &ProgressSpan,
    ) -> Result<(IncrementStart, SolveReport, StateChecks)> {
        let laws = ActiveLaws::of(self.step());
        let n = self.prepared.n();
        let spec = self.path_point(&path.loads(point, loads), SlipReference::Previous(place.reference))?;
        let mut problem = increment_problem(&self.prepared, options, worn, laws, vec![spec]);
        let mut it = place.it;
        path.set_shift(point, &mut it.rigid_motion[0]);
        let (report, checks) =
            solve_and_check((&self.prepared, &mut problem), &mut it, options, self.observer, progress)?;
        let reference = it.gap[..2 * n].to_vec();
        Ok((IncrementStart { reference, it }, report, checks))
    }

    /// Resolves the cycle at the current wear depth and records its fretting loop. The state of the run does not change.
    ///
    /// # Errors
    /// As [`Self::solve_cycle_increment`].
    pub(super) fn record_fretting_loop(&mut self, wear_step: &WearStepState) -> Advance {
        let (step, cycles) = (self.step(), self.cycles());
        let (SlipSource::ClosedPath(coupled_path), CycleMotion::ClosedPath(closed)) =
            (&wear_step.slip_source, &cycles.motion)
        else {
            return Ok(());
        };
        let increments = MIN_LOOP_INCREMENTS.div_ceil(closed.increments) * closed.increments;
        let path = coupled_path.refined(&ClosedPath { increments, ..*closed }, 1.0);
        let half = coupled_path.reversal_index();
        let (loads, _) = self.loads_at(wear_step, wear_step.completed / cycles.count);
        // The state of the run is at the - reversal point.
        let mut place = IncrementStart {
            reference: self.state.slip_reference.clone(),
            ..IncrementStart::at_path_point(&CycleState::from(&wear_step.cycle).contact, half)
        };
        let (worn, options) = (self.state.wear_depth.clone(), stroke_options(&self.options));
        let progress = ProgressSpan { name: "fretting loop", from: 0.0, to: 0.0 };
        let mut found = FrettingLoop {
            name: step.name.clone(),
            cycles_done: self.state.cycles_done,
            dissipation: 0.0,
            points: Vec::new(),
        };
        for _ in 0..LOOP_CYCLES {
            (found.dissipation, found.points) = (0.0, Vec::new());
            for point in
                (increments + 1..=2 * increments).map(|point| point % (2 * increments)).chain(1..=increments)
            {
                let way = (&path, point, loads);
                let (next, report, checks) =
                    self.solve_cycle_increment(way, (&worn, &options), place, &progress)?;
                if report.stop != StopReason::Converged {
                    if report.stop == StopReason::Interrupted {
                        return Err(RunEnd::Interrupted.into());
                    }
                    self.result.warnings.push(format!(
                        "step \"{}\": the fretting loop after {} cycles is missing, because an increment of it did not converge",
                        step.name, self.state.cycles_done
                    ));
                    return Ok(());
                }
                place = next;
                found.dissipation += checks.dissipation;
                let (force, _) = self.prepared.resultants(&place.it.tractions);
                let motion = self.prepared.motion(&place.it.rigid_motion[0], &place.it.mode_amplitudes[0]);
                let [x, y] = [0, 1].map(|k| motion[k] - path.center[k]);
                found.points.push([x, y, force[0], force[1], -force[2]]);
            }
        }
        self.result.fretting_loops.push(found);
        Ok(())
    }
}
