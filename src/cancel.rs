//! Process-wide cancellation flag, which long computations check repeatedly.
//!
//! The flag is global, because the signal that sets the flag concerns the whole process.

use std::sync::atomic::{AtomicBool, Ordering};

use crate::error::{Error, Result};

static REQUESTED: AtomicBool = AtomicBool::new(false);

/// The flag; `true` requests cancellation.
pub fn flag() -> &'static AtomicBool {
    &REQUESTED
}

/// Resets the flag. Call this function only while nothing is computed. A running computation may already have skipped
/// work and would not notice the cancellation any more.
pub fn reset() {
    REQUESTED.store(false, Ordering::Relaxed);
}

/// Whether cancellation was requested. Computations may then skip work, so their results may be wrong and must be
/// discarded.
pub(crate) fn requested() -> bool {
    REQUESTED.load(Ordering::Relaxed)
}

/// Returns an error if cancellation was requested.
///
/// # Errors
/// If cancellation was requested (kind `Interrupted`).
pub(crate) fn check() -> Result<()> {
    if requested() { Err(Error::interrupted()) } else { Ok(()) }
}
