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

/// Resets the flag. Call it only while nothing is computed: results after the cancellation may be wrong and are not marked.
pub fn reset() {
    REQUESTED.store(false, Ordering::Relaxed);
}

/// Whether cancellation was requested. Later results may be wrong and are discarded.
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
