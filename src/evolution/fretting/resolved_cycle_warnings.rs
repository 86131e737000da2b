//! Warnings about resolved cycles.

use crate::evolution::field_measures::volume;
use crate::evolution::fretting::cycle_refinement::{RefinedCycle, Refinement, percent};
use crate::evolution::fretting::cycle_wear::relative_rms_difference;
use crate::evolution::fretting::wear_step_state::WearStepState;
use crate::evolution::run::Run;

impl Run<'_> {
    /// Warns if the factors miss a larger share of the wear than the tolerance, unless the factors of the previous resolved cycle
    /// did, too.
    pub(super) fn warn_of_unresolved_wear(
        &mut self,
        wear_step: &WearStepState,
        completed: f64,
        missed: f64,
        tolerance: f64,
    ) {
        if missed <= tolerance
            || wear_step
                .path_correction
                .as_ref()
                .is_some_and(|before| before.unresolved_wear_fraction > tolerance)
        {
            return;
        }
        self.result.warnings.push(format!(
            "step \"{}\": after {} cycles, {} of the wear occurs in cells that slip within a stroke but not between its reversal points. The computed wear omits it; the estimated errors include it. Smaller cells reduce it",
            self.step().name,
            wear_step.cycles_at(completed),
            percent(missed)
        ));
    }

    pub(super) fn warn_of_increments(&mut self, refinement: &Refinement, refined: &RefinedCycle) {
        let (coupled, areas) = (&refinement.coupled.wear, refinement.areas);
        let (increments, tolerance) = (refinement.closed.increments, refinement.settings.tolerance);
        let [all, resolved] = [&coupled.rate, &refined.wear.rate].map(|rate| volume(rate, areas));
        let of_strokes = if increments == 1 { "increment" } else { "increments" };
        let by = if resolved > 0.0 {
            let depth = 100.0 * relative_rms_difference(&refined.wear.rate, &coupled.rate, areas);
            format!(
                "{:+.2} % of the wear volume and {depth:.2} % of the largest wear depth (root mean square)",
                100.0 * (all / resolved - 1.0)
            )
        } else {
            "the whole wear".to_owned()
        };
        self.result.warnings.push(format!(
            "step \"{}\": cycles with {increments} {of_strokes} and with {} per stroke differ by {by}, and by {:.1} % of the tangential force at a reversal point (wear.tolerance = {tolerance:e}). The estimated errors include the wear difference. To correct both, omit cycles.increments or use \"auto\"",
            self.step().name,
            refined.increments,
            100.0 * coupled.force_change(&refined.wear)
        ));
    }
}
