//! Fretting loops: cycles resolved into many increments, at constant wear depth.

use crate::contact::solver::StopReason;
use crate::evolution::fretting::cycle_increment::{IncrementStart, SolvedIncrement, Strokes, stroke_options};
use crate::evolution::fretting::cycle_state::CycleState;
use crate::evolution::fretting::settings::REFINEMENT;
use crate::evolution::fretting::wear_step_state::{SlipSource, WearStepState};
use crate::evolution::increment_solve::ProgressSpan;
use crate::evolution::records::FrettingLoop;
use crate::evolution::run::{Advance, Run, RunEnd};
use crate::evolution::step::ClosedPath;

impl Run<'_> {
    /// Solves two cycles at the current wear depth and records the second cycle as a fretting loop. Tractions and wear
    /// depth of the run do not change. If an increment does not converge, gives a warning and records no loop.
    pub(super) fn record_fretting_loop(&mut self, wear_step: &WearStepState) -> Advance {
        let (step, cycles) = (self.step(), self.cycles());
        let (SlipSource::ClosedPath(coupled_path), Some(closed)) =
            (&wear_step.slip_source, step.kind.closed_path())
        else {
            return Ok(());
        };
        let increments =
            REFINEMENT.min_loop_increments.div_ceil(closed.given_increments()) * closed.given_increments();
        let path = coupled_path.refined(&ClosedPath { increments, ..*closed }, 1.0);
        let half = coupled_path.reversal_index();
        let (loads, _) = self.loads_at(wear_step, wear_step.completed / cycles.count);
        // The gap of this cycle has not been evaluated. The slip reference of the run replaces it, because the state
        // of the run belongs to the - reversal point.
        let mut start = IncrementStart {
            reference: self.state.slip_reference.clone(),
            ..IncrementStart::at_path_point(&CycleState::from(&wear_step.cycle).contact, half)
        };
        let (worn, options) = (self.state.wear_depth.clone(), stroke_options(&self.options));
        let strokes = Strokes { path: &path, loads, wear_depth: &worn, options: &options };
        let progress = ProgressSpan { name: "fretting loop", from: 0.0, to: 0.0 };
        let mut found = FrettingLoop {
            name: step.name.clone(),
            cycles_done: self.state.cycles_done,
            dissipation: 0.0,
            points: Vec::new(),
        };
        for _ in 0..REFINEMENT.loop_cycles {
            (found.dissipation, found.points) = (0.0, Vec::new());
            for point in
                (increments + 1..=2 * increments).map(|point| point % (2 * increments)).chain(1..=increments)
            {
                let SolvedIncrement { next, report, checks } =
                    self.solve_cycle_increment(&strokes, point, start, &progress)?;
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
                start = next;
                found.dissipation += checks.dissipation;
                let (force, _) = self.prepared.resultants(&start.contact.tractions);
                let motion =
                    self.prepared.motion(&start.contact.rigid_motion[0], &start.contact.mode_amplitudes[0]);
                let [x, y] = [0, 1].map(|k| motion[k] - path.center[k]);
                found.points.push([x, y, force[0], force[1], -force[2]]);
            }
        }
        self.result.fretting_loops.push(found);
        Ok(())
    }
}
