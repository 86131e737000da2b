//! Process-wide cancellation flag, which long computations poll between elements, factorisations and columns.
//!
//! The flag is global because the signal that sets it concerns the whole process. The program never resets it. A process that
//! continues with other computations may reset it while nothing is computed.

use std::sync::atomic::{AtomicBool, Ordering};

use crate::error::{Error, Result};

static REQUESTED: AtomicBool = AtomicBool::new(false);

/// The flag that a signal sets.
pub fn flag() -> &'static AtomicBool {
    &REQUESTED
}

/// Resets the flag. Call it only while nothing is computed, because a running computation with skipped work would not notice the
/// cancellation.
pub fn reset() {
    REQUESTED.store(false, Ordering::Relaxed);
}

/// Whether cancellation was requested. Results computed after the request may be wrong, so the callers discard them.
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
