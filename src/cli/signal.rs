//! Ctrl-C: the run stops within about a second and keeps its results; a second one stops it at once.
//!
//! The signals are blocked in all threads and waited for in one of their own. A handler would not do: METIS sets its own
//! while it works, which jumps to a place that only the thread that called METIS has.

use std::sync::Once;
use std::sync::atomic::{AtomicBool, Ordering};

use super::{exit, to_stderr};
use crate::interrupt;

/// What is said at once.
const HEARD: &str =
    "\ninterrupted: stopping, results so far are kept (once more: stops at once and writes nothing)\n";

static CAUGHT: Once = Once::new();

/// Catches interrupt and termination; the flag they set. To be called before other threads are started, which would not
/// leave the signals to the one that waits.
pub(super) fn catch() -> &'static AtomicBool {
    CAUGHT.call_once(|| {
        let signals = block();
        // Without a thread the signals end the program, as they do by default.
        if std::thread::Builder::new().name("signals".into()).spawn(move || wait(&signals)).is_err() {
            unblock(&signals);
        }
    });
    interrupt::flag()
}

/// Blocks the signals in this thread and those that it will start.
fn block() -> libc::sigset_t {
    let mut signals = std::mem::MaybeUninit::uninit();
    // SAFETY: sigemptyset initialises the set that the other calls take; no old mask is asked for.
    unsafe {
        libc::sigemptyset(signals.as_mut_ptr());
        libc::sigaddset(signals.as_mut_ptr(), libc::SIGINT);
        libc::sigaddset(signals.as_mut_ptr(), libc::SIGTERM);
        libc::pthread_sigmask(libc::SIG_BLOCK, signals.as_ptr(), std::ptr::null_mut());
        signals.assume_init()
    }
}

fn unblock(signals: &libc::sigset_t) {
    // SAFETY: the set is initialised; no old mask is asked for.
    unsafe { libc::pthread_sigmask(libc::SIG_UNBLOCK, signals, std::ptr::null_mut()) };
}

/// Takes the signals as they come.
fn wait(signals: &libc::sigset_t) {
    loop {
        let mut signal = 0;
        // SAFETY: the set is initialised, and blocked in this thread.
        if unsafe { libc::sigwait(signals, &raw mut signal) } != 0 {
            continue;
        }
        if interrupt::flag().swap(true, Ordering::Relaxed) {
            // Nothing is to be tidied up that could take time.
            // SAFETY: _exit has no conditions.
            unsafe { libc::_exit(libc::c_int::from(exit::INTERRUPTED)) }
        }
        to_stderr(HEARD);
    }
}
