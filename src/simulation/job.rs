//! A run from its plan to its results: on frames that grow and meshes that move, once or from coarse to fine, into a directory or not.

pub use crate::adaptive::run::{ACCURACY_NOT_REACHED, run};
use crate::output::summary::{Summary, Units};
use crate::scene::Plan;
pub use crate::simulation::image::{ForImages, Original};
pub use crate::simulation::segments::{NullObserver, RunOptions, keep_files, run_simulation};
pub use crate::sweep::shared_beginnings::{PrefixRecorder, SharedPrefix, SharedWork};

/// Bytes of the stack of threads that compute: that of a main thread.
pub const THREAD_STACK_BYTES: usize = 8 << 20;

/// What a run of `plan` begins to tell of itself.
pub fn new_summary(plan: &Plan) -> Summary {
    let mut summary = Summary::new(&plan.title, &plan.document.sha256, units(plan));
    summary.scene = Some(plan.document.to_display_json());
    summary.warnings.extend(plan.notes.iter().cloned());
    summary
}

/// Units of the scene.
pub fn units(plan: &Plan) -> Units {
    Units { length: plan.units.length.clone(), force: plan.units.force.clone() }
}
