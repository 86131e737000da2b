//! Correction of a jump by the resolved cycle at the end of the jump.

use crate::contact::solver::StopReason;
use crate::evolution::fretting::path_correction::PathCorrection;
use crate::evolution::fretting::settings::CORRECTION;
use crate::evolution::fretting::wear_integrator::{JumpSpec, WearJump};
use crate::evolution::fretting::wear_step_state::WearStepState;
use crate::evolution::increment_solve::ProgressSpan;
use crate::evolution::run::{Advance, Run, RunEnd};
use crate::evolution::step::Integrator;

impl Run<'_> {
    /// Repeats a jump with the correction in the middle of the jump, if this correction changes the wear notably.
    /// `resolved` is the resolved cycle at the end of the jump.
    ///
    /// An explicit jump is not repeated, because its wear uses the rates at its start. The error estimate of the
    /// integrator includes the change of the rates.
    pub(super) fn correct_jump(
        &mut self,
        wear_step: &mut WearStepState,
        resolved: &PathCorrection,
        spec: JumpSpec,
        jump: WearJump,
        progress: &ProgressSpan,
    ) -> Advance<WearJump> {
        let (Some(before), Some((_, settings))) = (&wear_step.path_correction, self.resolved_path()) else {
            return Ok(jump);
        };
        if spec.integrator == Integrator::Explicit {
            return Ok(jump);
        }
        let start = wear_step.completed;
        let (mean, dissipation_factor) = before.correction_at(resolved, start + 0.5 * jump.length);
        let dissipation_ratio = dissipation_factor / before.dissipation_factor;
        let used = jump.rate_correction.as_ref().unwrap_or(&before.correction);
        let missed = mean.missed_by(used, &jump.wear_depth, jump.length);
        // Wear of the earlier jumps since the previous resolved cycle; no cycle was resolved at their ends.
        let worn: Vec<f64> =
            self.state.wear_depth.iter().zip(&before.wear_depth).map(|(now, then)| now - then).collect();
        let (earlier, _) = before.correction_at(resolved, 0.5 * (before.at_cycle + start));
        let earlier = earlier.missed_by(&before.correction, &worn, start - before.at_cycle);
        let depth_error = self.depth_error(&missed, &jump);
        let sum = |share: f64| missed.iter().zip(&earlier).map(|(now, then)| share * now + then).collect();
        let mut found = WearJump { path_error: sum(1.0), path_depth_error: depth_error, ..jump };
        if self.error_ratio(settings.tolerance, depth_error, &found) > CORRECTION.negligible_error_ratio {
            let again = JumpSpec { rate_correction: Some(mean), ..spec };
            let repeated = self.integrate(again, wear_step, progress)?;
            if repeated.report.stop == StopReason::Interrupted {
                return Err(RunEnd::Interrupted.into());
            }
            if repeated.converged() && !repeated.lost_contact {
                wear_step.uncharged_work += found.work();
                found = WearJump {
                    path_error: sum(CORRECTION.mean_error_share),
                    path_depth_error: CORRECTION.mean_error_share * depth_error,
                    ..repeated
                };
            } else {
                wear_step.uncharged_work += repeated.work();
            }
        }
        found.dissipation *= dissipation_ratio;
        Ok(found)
    }
}
