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
    /// Repeats a jump with the factors in its middle if they differ notably from those used. `resolved` is the cycle at the end. An
    /// explicit jump takes the factors at its start, and the error estimate of the integrator includes their change.
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
        let (factors, dissipation_factor) = before.factors_at(resolved, start + 0.5 * jump.length);
        let dissipation_ratio = dissipation_factor / before.dissipation_factor;
        let used = |i: usize| jump.wear_factors.as_ref().map_or(1.0, |used| used[i]);
        let missed: Vec<f64> =
            (0..factors.len()).map(|i| (factors[i] / used(i) - 1.0) * jump.wear_depth[i]).collect();
        // Jumps since the previous resolved cycle that were not followed by one.
        let (earlier, _) = before.factors_at(resolved, 0.5 * (before.at_cycle + start));
        let earlier = (0..earlier.len()).map(|i| {
            let worn = self.state.wear_depth[i] - before.wear_depth[i];
            (earlier[i] / before.factors[i] - 1.0) * worn
        });
        let earlier: Vec<f64> = earlier.collect();
        let depth_error = self.depth_error(&missed, &jump);
        let sum = |share: f64| missed.iter().zip(&earlier).map(|(now, then)| share * now + then).collect();
        let mut found = WearJump { path_error: sum(1.0), path_depth_error: depth_error, ..jump };
        if self.error_ratio(settings.tolerance, depth_error, &found) > CORRECTION.negligible_error_ratio {
            let again = JumpSpec { wear_factors: Some(factors), ..spec };
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
