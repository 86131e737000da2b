//! Ctrl-C: the run stops within about a second and keeps its results; one more after that stops it at once.
//!
//! The signals are blocked in all threads and waited for in one of their own. A handler would not do: METIS sets its own
//! while it works, which jumps to a place that only the thread that called METIS has.

use std::sync::Once;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use super::{exit, to_stderr};
use crate::cancel;

/// What is said at once.
const INTERRUPT_MESSAGE: &str = "\ninterrupted: stopping; results so far are kept (press Ctrl-C again after a second to stop at \
                     once, without writing)\n";

/// Signals within this time after the first are the same wish: programs that stop others send theirs to the process and to its group.
const DUPLICATE_SIGNAL_WINDOW: Duration = Duration::from_secs(1);

static INSTALLED: Once = Once::new();

/// Catches interrupt and termination; the flag they set. To be called before other threads are started, which would not
/// leave the signals to the one that waits.
pub(super) fn install() -> &'static AtomicBool {
    INSTALLED.call_once(|| {
        let signals = block();
        // Without a thread the signals end the program, as they do by default.
        if std::thread::Builder::new().name("signals".into()).spawn(move || wait(&signals)).is_err() {
            unblock(&signals);
        }
    });
    cancel::flag()
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
            // Nothing is to be tidied up that could take time.
            // SAFETY: _exit has no conditions.
            Some(_) => unsafe { libc::_exit(libc::c_int::from(exit::INTERRUPTED)) },
        }
    }
}
