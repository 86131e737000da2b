//! Warnings about resolved cycles.

use crate::evolution::field_measures::volume;
use crate::evolution::fretting::cycle_refinement::{RefinedCycle, Refinement};
use crate::evolution::fretting::cycle_wear::relative_rms_difference;
use crate::evolution::run::Run;

impl Run<'_> {
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
            "step \"{}\": cycles with {increments} {of_strokes} per stroke and with {} differ by {by}, and by {:.1} % of the tangential force at a reversal point (wear.tolerance = {tolerance:e}). The estimated errors include the wear difference. To correct wear and tangential force, omit cycles.increments or use \"auto\"",
            self.step().name,
            refined.increments,
            100.0 * coupled.force_change(&refined.wear)
        ));
    }
}
