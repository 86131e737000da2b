//! Process-wide cancellation flag, which long computations poll.
//!
//! The flag is global because the signal that sets it concerns the whole process.

use std::sync::atomic::{AtomicBool, Ordering};

use crate::error::{Error, Result};

static REQUESTED: AtomicBool = AtomicBool::new(false);

/// The flag; `true` requests cancellation.
pub fn flag() -> &'static AtomicBool {
    &REQUESTED
}

/// Resets the flag. Call it only while nothing is computed, because a running computation that has already skipped work would not
/// notice the cancellation.
pub fn reset() {
    REQUESTED.store(false, Ordering::Relaxed);
}

/// Whether cancellation was requested. Results computed after the request may be wrong and must be discarded.
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
