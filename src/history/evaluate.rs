//! Ends and rates of a cycle, or of steady sliding, before a jump.

use std::time::Instant;

use crate::error::Result;

use super::Run;
use super::cycling::Cycling;
use super::increments::Stage;
use super::jump::Jump;
use super::record::Observer;
use super::step::{Cycles, Integrator, Step};

impl Run<'_> {
    /// Ends and rates at the worn depth of the state; `false` where they do not converge.
    pub(super) fn evaluate(
        &mut self,
        step: &Step,
        cycles: &Cycles,
        (cycling, clock): (&mut Cycling, Instant),
        observer: &mut dyn Observer,
    ) -> Result<bool> {
        let (worn, at) = (self.state.worn.clone(), cycling.done / cycles.count);
        let mut jump = Jump::new(self.prepared.n());
        let stage = Stage { name: &step.name, from: at, to: at };
        self.stage(step, (at, &worn, 0.0), cycling, &mut jump, (&mut *observer, &stage))?;
        if !jump.converged() {
            self.record_jump(step, cycles, (cycling, &jump), (0.0, 0, clock), observer)?;
            return Ok(false);
        }
        cycling.ring.spend(&jump.report);
        cycling.rate.copy_from_slice(&cycling.ring.it.wear_rate);
        cycling.power = jump.checks.dissipation * cycling.power_factor();
        if cycles.integrator == Integrator::Explicit {
            cycling.critical = self.critical_length(&cycling.ring.it);
        }
        Ok(true)
    }

    /// Ends and rates with operators that the step did not begin with; `false` where they do not converge.
    pub(super) fn evaluate_anew(
        &mut self,
        step: &Step,
        cycles: &Cycles,
        cycling: &mut Cycling,
        observer: &mut dyn Observer,
    ) -> Result<bool> {
        if !self.evaluate(step, cycles, (cycling, Instant::now()), observer)? {
            return Ok(false);
        }
        cycling.stale = false;
        if let Err(unstable) = cycling.refuse_unstable(step, cycles) {
            self.result.warnings.push(unstable.message().to_owned());
        }
        Ok(true)
    }
}
