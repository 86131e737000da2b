//! A wish to stop, which long computations hear between their parts: between elements, fronts, columns.
//!
//! It is one for the process, as the signal is that it comes from, and is never taken back.

use std::sync::atomic::{AtomicBool, Ordering};

use crate::error::{Error, Result};

static WISHED: AtomicBool = AtomicBool::new(false);

/// The flag that a signal sets.
pub fn flag() -> &'static AtomicBool {
    &WISHED
}

/// Whether to stop. What is computed after that is thrown away, and may be wrong.
pub(crate) fn wished() -> bool {
    WISHED.load(Ordering::Relaxed)
}

/// An error once a stop is wished.
///
/// # Errors
/// Of the kind `Interrupted`.
pub(crate) fn check() -> Result<()> {
    if wished() { Err(Error::interrupted()) } else { Ok(()) }
}
