//! Ctrl-C: the run stops at the next iteration and keeps its results; a second one stops it at once.

use std::sync::atomic::{AtomicBool, Ordering};

/// Whether a signal asked the run to stop.
static STOP: AtomicBool = AtomicBool::new(false);

extern "C" fn on_signal(_signal: libc::c_int) {
    if STOP.swap(true, Ordering::Relaxed) {
        // SAFETY: _exit is safe to call in a signal handler.
        unsafe { libc::_exit(libc::c_int::from(super::exit::INTERRUPTED)) }
    }
}

/// Catches interrupt and termination; the flag they set.
pub(super) fn catch() -> &'static AtomicBool {
    for signal in [libc::SIGINT, libc::SIGTERM] {
        let handler = on_signal as extern "C" fn(libc::c_int);
        // SAFETY: the handler only touches an atomic and calls _exit, both allowed in signal handlers.
        unsafe { libc::signal(signal, handler as libc::sighandler_t) };
    }
    &STOP
}
