//! Common settings and the initial summary of a run.

use crate::output::summary::Summary;
use crate::scene::Plan;

/// Stack size of computing threads, bytes: 8 MiB, as of a main thread.
pub const THREAD_STACK_BYTES: usize = 8 << 20;

/// Starts a thread of a pool, and waits until it runs.
///
/// Waiting starts the threads one after the other. If memory runs out, the large stack of the next thread cannot be
/// allocated, and the caller receives an error. If all threads started at once, a thread could run out of memory for
/// its small signal stack, which would abort the program.
///
/// # Errors
/// If the thread cannot be started.
pub fn start_pool_thread(thread: rayon::ThreadBuilder) -> std::io::Result<()> {
    let (started, wait) = std::sync::mpsc::channel();
    std::thread::Builder::new().stack_size(THREAD_STACK_BYTES).spawn(move || {
        // The receiver waits, so sending cannot fail.
        let _ = started.send(());
        thread.run();
    })?;
    let _ = wait.recv();
    Ok(())
}

/// Initial summary of a run of `plan`.
pub fn new_summary(plan: &Plan) -> Summary {
    let mut summary = Summary::new(&plan.title, &plan.document.sha256, plan.units.clone());
    summary.scene = Some(plan.document.to_display_json());
    summary.warnings.extend(plan.notes.iter().cloned());
    summary
}
