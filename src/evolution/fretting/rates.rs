//! Rates of wear and dissipation before a jump.

use std::time::Instant;

use crate::error::warning;
use crate::evolution::fretting::jump_record::AcceptedJump;
use crate::evolution::fretting::wear_integrator::{StageSpec, WearJump};
use crate::evolution::fretting::wear_step_state::WearStepState;
use crate::evolution::increment_solve::ProgressSpan;
use crate::evolution::run::{Advance, Run};
use crate::evolution::step::Integrator;

impl Run<'_> {
    /// Computes the rates of wear and dissipation at the current wear depth. If the contact does not converge, records
    /// a jump of length 0 and ends the run.
    pub(super) fn evaluate_rates(&mut self, wear_step: &mut WearStepState, clock: Instant) -> Advance {
        let cycles = self.cycles();
        let (worn, at) = (self.state.wear_depth.clone(), wear_step.completed / cycles.count);
        let mut jump = WearJump::new(wear_step, 0.0);
        let progress = ProgressSpan { name: &self.step().name, from: at, to: at };
        let options = self.options;
        let spec =
            StageSpec { step_fraction: at, wear_depth: &worn, implicit_passes: 0.0, options: &options };
        self.solve_path_points(spec, wear_step, &mut jump, &progress)?;
        if !jump.converged() {
            return self.commit_jump(wear_step, AcceptedJump { jump, resolved: None, rejected: 0, clock });
        }
        wear_step.uncharged_work += jump.work();
        wear_step.wear_rate = self.corrected_rate(&jump);
        wear_step.dissipation_rate = jump.checks.dissipation * wear_step.dissipation_factor();
        if cycles.integrator == Integrator::Explicit {
            wear_step.critical_length = self.critical_length(&jump.cycle.contact);
        }
        wear_step.cycle = jump.cycle.into();
        Ok(())
    }

    /// Computes the rates again after the operators have changed. Warns if prescribed explicit jumps are then unstable.
    pub(super) fn reevaluate_rates(&mut self, wear_step: &mut WearStepState) -> Advance {
        self.evaluate_rates(wear_step, Instant::now())?;
        wear_step.rates_outdated = false;
        if let Err(unstable) = self.refuse_unstable(wear_step) {
            self.result.warnings.push(warning(unstable.message()));
        }
        Ok(())
    }
}
