//! Interruption by Ctrl-C or SIGTERM. After the first signal, the run stops within about a second and keeps its
//! results. A second signal, at least one second later, stops the program at once.
//!
//! All threads block the signals, and a separate thread waits for them. A signal handler is not suitable, because METIS
//! installs its own handlers. They jump to a place that is valid only in the thread that called METIS.

use std::sync::Once;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use super::console::to_stderr;
use crate::cancel;
use crate::error::exit;

const INTERRUPT_MESSAGE: &str = "\ninterrupted: stopping; results so far are kept (press Ctrl-C again after a second to stop at \
                     once, without writing)\n";

/// Signals within this time after the first are ignored. A signal to a program and to its group would otherwise count
/// twice.
const DUPLICATE_SIGNAL_WINDOW: Duration = Duration::from_secs(1);

static INSTALLED: Once = Once::new();

/// Starts catching signals. Returns the flag that the first signal sets. The first call must come before other threads
/// start, because they inherit the blocked signals.
pub(super) fn install() -> &'static AtomicBool {
    INSTALLED.call_once(|| {
        let signals = block();
        // If the thread cannot start, signals end the program, as by default.
        if std::thread::Builder::new().name("signals".into()).spawn(move || wait(&signals)).is_err() {
            unblock(&signals);
        }
    });
    cancel::flag()
}

/// Blocks the signals in this thread and in threads that this thread starts later.
fn block() -> libc::sigset_t {
    let mut signals = std::mem::MaybeUninit::uninit();
    // SAFETY: sigemptyset initialises the set before the other calls use it. A null pointer for the old mask is
    // allowed.
    unsafe {
        libc::sigemptyset(signals.as_mut_ptr());
        libc::sigaddset(signals.as_mut_ptr(), libc::SIGINT);
        libc::sigaddset(signals.as_mut_ptr(), libc::SIGTERM);
        libc::pthread_sigmask(libc::SIG_BLOCK, signals.as_ptr(), std::ptr::null_mut());
        signals.assume_init()
    }
}

fn unblock(signals: &libc::sigset_t) {
    // SAFETY: the set is initialised. A null pointer for the old mask is allowed.
    unsafe { libc::pthread_sigmask(libc::SIG_UNBLOCK, signals, std::ptr::null_mut()) };
}

fn wait(signals: &libc::sigset_t) {
    let mut first: Option<Instant> = None;
    loop {
        let mut signal = 0;
        // SAFETY: the set is initialised, and blocked in this thread.
        if unsafe { libc::sigwait(signals, &raw mut signal) } != 0 {
            continue;
        }
        match first {
            None => {
                first = Some(Instant::now());
                cancel::flag().store(true, Ordering::Relaxed);
                to_stderr(INTERRUPT_MESSAGE);
            }
            Some(at) if at.elapsed() < DUPLICATE_SIGNAL_WINDOW => {}
            // The program ends without cleanup, because cleanup could take time. SAFETY: _exit has no preconditions.
            Some(_) => unsafe { libc::_exit(libc::c_int::from(exit::INTERRUPTED)) },
        }
    }
}
