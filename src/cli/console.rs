//! Output to the terminal: results, errors, warnings.

use std::io::Write;
use std::sync::atomic::{AtomicBool, Ordering};

use super::render;
use crate::error::{Error, exit};
use crate::scene::Diagnostics;

pub(super) fn print_diagnostics(mistakes: &Diagnostics) -> u8 {
    to_stderr(&render::render(mistakes));
    exit::INPUT
}

pub(super) fn print_error(error: &Error) -> u8 {
    to_stderr(&format!("error: {error}\n"));
    error.exit_code()
}

/// Whether a write to standard output failed, for example on a full disk.
pub(super) static OUTPUT_LOST: AtomicBool = AtomicBool::new(false);

/// Prints to standard output. The first failure is reported, and the exit code becomes at least as severe as
/// [`exit::RESOURCES`]. A closed pipe is no failure.
pub(super) fn to_stdout(text: &str) {
    let mut out = std::io::stdout().lock();
    let printed = out.write_all(text.as_bytes()).and_then(|()| out.flush());
    if !OUTPUT_LOST.load(Ordering::Relaxed) {
        OUTPUT_LOST.store(is_lost(&printed), Ordering::Relaxed);
    }
}

/// Reports a failed write to standard output. Returns whether the write failed; a closed pipe is no failure.
pub(super) fn is_lost(printed: &std::io::Result<()>) -> bool {
    let Err(error) = printed else { return false };
    let lost = error.kind() != std::io::ErrorKind::BrokenPipe;
    if lost {
        to_stderr(&format!("error: standard output cannot be written: {error}\n"));
    }
    lost
}

pub(super) fn to_stderr(text: &str) {
    let _ = std::io::stderr().lock().write_all(text.as_bytes());
}
