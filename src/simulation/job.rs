//! A run from its plan to its results: on frames that grow and meshes that move, once or from coarse to fine, into a directory or not.

use crate::output::summary::Summary;
use crate::scene::Plan;

/// Bytes of the stack of threads that compute: that of a main thread.
pub const THREAD_STACK_BYTES: usize = 8 << 20;

/// What a run of `plan` begins to tell of itself.
pub fn new_summary(plan: &Plan) -> Summary {
    let mut summary = Summary::new(&plan.title, &plan.document.sha256, plan.units.clone());
    summary.scene = Some(plan.document.to_display_json());
    summary.warnings.extend(plan.notes.iter().cloned());
    summary
}
