//! Common settings and the initial summary of a run.

use crate::output::summary::Summary;
use crate::scene::Plan;

/// Stack size of computing threads, bytes. It equals the stack size of a main thread.
pub const THREAD_STACK_BYTES: usize = 8 << 20;

/// Initial summary of a run of `plan`.
pub fn new_summary(plan: &Plan) -> Summary {
    let mut summary = Summary::new(&plan.title, &plan.document.sha256, plan.units.clone());
    summary.scene = Some(plan.document.to_display_json());
    summary.warnings.extend(plan.notes.iter().cloned());
    summary
}
