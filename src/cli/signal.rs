//! Ctrl-C: the run stops within about a second and keeps its results; a second one stops it at once.

use std::sync::atomic::{AtomicBool, Ordering};

use crate::interrupt;

/// What is said at once.
const HEARD: &[u8] =
    b"\ninterrupted: stopping, results so far are kept (once more: stops at once and writes nothing)\n";

extern "C" fn on_signal(_signal: libc::c_int) {
    if interrupt::flag().swap(true, Ordering::Relaxed) {
        // SAFETY: _exit is safe to call in a signal handler.
        unsafe { libc::_exit(libc::c_int::from(super::exit::INTERRUPTED)) }
    }
    // SAFETY: write is safe to call in a signal handler, and the text lives for ever.
    unsafe { libc::write(libc::STDERR_FILENO, HEARD.as_ptr().cast(), HEARD.len()) };
}

/// Catches interrupt and termination; the flag they set.
pub(super) fn catch() -> &'static AtomicBool {
    for signal in [libc::SIGINT, libc::SIGTERM] {
        let handler = on_signal as extern "C" fn(libc::c_int);
        // SAFETY: the handler only touches an atomic and calls write and _exit, all allowed in signal handlers.
        unsafe { libc::signal(signal, handler as libc::sighandler_t) };
    }
    interrupt::flag()
}
