//! A wish to stop, which long computations hear between their parts: between elements, factorisations, columns.
//!
//! It is one for the process, as the signal is that it comes from. The program never takes it back; a process that goes on to
//! compute other things does, when nothing is computed.

use std::sync::atomic::{AtomicBool, Ordering};

use crate::error::{Error, Result};

static REQUESTED: AtomicBool = AtomicBool::new(false);

/// The flag that a signal sets.
pub fn flag() -> &'static AtomicBool {
    &REQUESTED
}

/// Takes the wish back. Only when nothing is computed: what was computed since the wish may be wrong, and no longer knows that it is.
pub fn reset() {
    REQUESTED.store(false, Ordering::Relaxed);
}

/// Whether to stop. What is computed after that is thrown away, and may be wrong.
pub(crate) fn requested() -> bool {
    REQUESTED.load(Ordering::Relaxed)
}

/// An error once a stop is wished.
///
/// # Errors
/// Of the kind `Interrupted`.
pub(crate) fn check() -> Result<()> {
    if requested() { Err(Error::interrupted()) } else { Ok(()) }
}
