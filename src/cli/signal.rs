//! Interruption by Ctrl-C or SIGTERM. The run stops within about a second and keeps its results. Another signal after one second
//! stops it at once.
//!
//! All threads block the signals, and a separate thread waits for them. A signal handler is not suitable: METIS installs its own
//! handlers, which jump to a place that is valid only in the calling thread.

use std::sync::Once;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use super::console::to_stderr;
use crate::cancel;
use crate::error::exit;

const INTERRUPT_MESSAGE: &str = "\ninterrupted: stopping; results so far are kept (press Ctrl-C again after a second to stop at \
                     once, without writing)\n";

/// Later signals within this time are ignored: a program may signal both a process and its group.
const DUPLICATE_SIGNAL_WINDOW: Duration = Duration::from_secs(1);

static INSTALLED: Once = Once::new();

/// Starts catching signals, and returns the flag that they set. The first call must come before other threads start, because they
/// inherit the blocked signals.
pub(super) fn install() -> &'static AtomicBool {
    INSTALLED.call_once(|| {
        let signals = block();
        // Without the thread, signals end the program, as by default.
        if std::thread::Builder::new().name("signals".into()).spawn(move || wait(&signals)).is_err() {
            unblock(&signals);
        }
    });
    cancel::flag()
}

/// Blocks the signals in this thread and in threads that it starts.
fn block() -> libc::sigset_t {
    let mut signals = std::mem::MaybeUninit::uninit();
    // SAFETY: sigemptyset initialises the set that the other calls use; the old mask is not requested.
    unsafe {
        libc::sigemptyset(signals.as_mut_ptr());
        libc::sigaddset(signals.as_mut_ptr(), libc::SIGINT);
        libc::sigaddset(signals.as_mut_ptr(), libc::SIGTERM);
        libc::pthread_sigmask(libc::SIG_BLOCK, signals.as_ptr(), std::ptr::null_mut());
        signals.assume_init()
    }
}

fn unblock(signals: &libc::sigset_t) {
    // SAFETY: the set is initialised; the old mask is not requested.
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
            // The program ends without cleanup, which could take time. SAFETY: _exit has no preconditions.
            Some(_) => unsafe { libc::_exit(libc::c_int::from(exit::INTERRUPTED)) },
        }
    }
}
