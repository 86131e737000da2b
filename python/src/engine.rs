//! Computation in a separate thread that a signal or the caller can stop.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use orthowear::cancel;
use orthowear::error::panic_message;
use orthowear::simulation::job::THREAD_STACK_BYTES;
use pyo3::prelude::*;

use crate::errors;

/// Time between two checks for signals.
pub const PAUSE: Duration = Duration::from_millis(50);

/// Number of unfinished computations.
static ACTIVE: Mutex<usize> = Mutex::new(0);

/// Guard that counts one running computation. When the last computation ends, the cancellation flag of the process is
/// reset.
struct Active;

impl Active {
    fn new() -> Self {
        *ACTIVE.lock().unwrap_or_else(PoisonError::into_inner) += 1;
        Self
    }
}

impl Drop for Active {
    fn drop(&mut self) {
        let mut active = ACTIVE.lock().unwrap_or_else(PoisonError::into_inner);
        *active -= 1;
        if *active == 0 {
            cancel::reset();
        }
    }
}

/// Messages from the computation to the caller, and the flag that stops the computation.
pub struct WorkerChannel<M> {
    sender: Sender<M>,
    /// Set to stop the computation.
    pub stop: Arc<AtomicBool>,
}

impl<M> WorkerChannel<M> {
    /// Sends a message. Returns whether the receiver still exists.
    pub fn send(&self, message: M) -> bool {
        self.sender.send(message).is_ok()
    }
}

/// A computation in a thread of its own.
pub struct BackgroundTask<M, T> {
    // The mutex makes the receiver `Sync`, which objects that Python threads share must be.
    messages: Mutex<Receiver<M>>,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<Result<T, String>>>,
}

/// Thread pool of the computation. By default, it has as many threads as the machine has cores.
fn pool(threads: Option<usize>) -> Result<rayon::ThreadPool, String> {
    let builder =
        rayon::ThreadPoolBuilder::new().num_threads(threads.unwrap_or(0)).stack_size(THREAD_STACK_BYTES);
    builder.build().map_err(|error| format!("the threads cannot be started: {error}"))
}

impl<M: Send + 'static, T: Send + 'static> BackgroundTask<M, T> {
    /// Starts the computation.
    pub fn begin(
        py: Python<'_>,
        threads: Option<usize>,
        work: impl FnOnce(&WorkerChannel<M>) -> T + Send + 'static,
    ) -> PyResult<Self> {
        let (sender, messages) = channel();
        let stop = Arc::new(AtomicBool::new(false));
        let line = WorkerChannel { sender, stop: stop.clone() };
        let active = Active::new();
        let all = move || {
            let pool = pool(threads)?;
            let done = catch_unwind(AssertUnwindSafe(|| pool.install(|| work(&line))));
            drop(active);
            done.map_err(|panic| panic_message(&*panic).to_owned())
        };
        let thread =
            std::thread::Builder::new().name("orthowear".into()).stack_size(THREAD_STACK_BYTES).spawn(all);
        let thread = thread.map_err(|error| errors::internal(py, &error.to_string()))?;
        Ok(Self { messages: Mutex::new(messages), stop, thread: Some(thread) })
    }

    /// Waits for the next message; `None` after the last message. A signal stops the computation. The exception of the
    /// signal is raised after the computation has ended.
    pub fn next_message(&mut self, py: Python<'_>) -> PyResult<Option<M>> {
        loop {
            let messages = self.messages.get_mut().unwrap_or_else(PoisonError::into_inner);
            let heard = py.detach(move || messages.recv_timeout(PAUSE));
            if let Err(signal) = py.check_signals() {
                cancel::flag().store(true, Ordering::Relaxed);
                self.close(py);
                return Err(signal);
            }
            match heard {
                Ok(message) => return Ok(Some(message)),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return Ok(None),
            }
        }
    }

    /// Stops the computation and waits for its end.
    pub fn close(&mut self, py: Python<'_>) {
        self.stop.store(true, Ordering::Relaxed);
        let thread = self.thread.take();
        py.detach(|| thread.map(JoinHandle::join));
    }

    /// Waits for the result of the computation; `None` after [`close`](Self::close).
    pub fn join(&mut self, py: Python<'_>) -> PyResult<Option<T>> {
        let Some(thread) = self.thread.take() else { return Ok(None) };
        match py.detach(|| thread.join()) {
            Ok(Ok(done)) => Ok(Some(done)),
            Ok(Err(panic)) => Err(errors::internal(py, &panic)),
            Err(panic) => Err(errors::internal(py, panic_message(&*panic))),
        }
    }
}

impl<M, T> Drop for BackgroundTask<M, T> {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
    }
}

/// Runs a computation `work` that sends no messages.
pub fn run_in_background<T: Send + 'static>(
    py: Python<'_>,
    threads: Option<usize>,
    work: impl FnOnce(&AtomicBool) -> T + Send + 'static,
) -> PyResult<T> {
    let mut work = BackgroundTask::<(), T>::begin(py, threads, move |line| work(&line.stop))?;
    while work.next_message(py)?.is_some() {}
    work.join(py)?.ok_or_else(|| errors::internal(py, "closed"))
}
