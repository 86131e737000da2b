//! Correction of a jump by the resolved cycle at its end.

use crate::contact::solver::StopReason;
use crate::evolution::fretting::path_correction::PathCorrection;
use crate::evolution::fretting::settings::CORRECTION;
use crate::evolution::fretting::wear_integrator::{JumpSpec, WearJump};
use crate::evolution::fretting::wear_step_state::WearStepState;
use crate::evolution::increment_solve::ProgressSpan;
use crate::evolution::run::{Advance, Run, RunEnd};
use crate::evolution::step::Integrator;

impl Run<'_> {
    /// Repeats a jump with the factors in its middle if they differ notably from those used. `resolved` is the cycle at the end.
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
        let (factors, dissipation_factor) = before.factors_before(resolved, jump.length);
        let dissipation_ratio = dissipation_factor / before.dissipation_factor;
        let missed = |(i, factor): (usize, &f64)| match jump.wear_factors.as_ref().map_or(1.0, |used| used[i])
        {
            used if used > 0.0 => (factor / used - 1.0) * jump.wear_depth[i],
            _ => 0.0,
        };
        let missed: Vec<f64> = factors.iter().enumerate().map(missed).collect();
        let depth_error = self.depth_error(&missed, &jump);
        let mut found = WearJump { path_error: missed, path_depth_error: depth_error, ..jump };
        if spec.integrator != Integrator::Explicit
            && self.error_ratio(settings.tolerance, depth_error, &found) > CORRECTION.negligible_error_ratio
        {
            let again = JumpSpec { wear_factors: Some(factors), ..spec };
            let repeated = self.integrate(again, wear_step, progress)?;
            if repeated.report.stop == StopReason::Interrupted {
                return Err(RunEnd::Interrupted.into());
            }
            if repeated.converged() && !repeated.lost_contact {
                wear_step.uncharged_work += found.work();
                let path_error = found.path_error.iter().map(|error| CORRECTION.mean_error_share * error);
                found = WearJump {
                    path_error: path_error.collect(),
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
