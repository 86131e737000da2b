//! Runs whose entries are computed one by one.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{Sender, channel};

use orthowear::scene::Plan;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::engine::BackgroundTask;
use crate::run::{Message, RunOutput, RunRequest, run, to_python_result};
use crate::{convert, errors};

/// Record and fields of an entry.
type Entry<'py> = (Bound<'py, PyAny>, Bound<'py, PyDict>);

/// Iterates over the entries of a run. The run is at most one entry ahead of the iteration.
#[pyclass(module = "orthowear._orthowear")]
pub struct Steps {
    plan: Arc<Plan>,
    work: BackgroundTask<Message, RunOutput>,
    /// Sends a request for each entry. `None` after the end of the run, and after `close`.
    requests: Option<Sender<()>>,
    ended: Option<RunOutput>,
}

impl Steps {
    pub fn begin(
        py: Python<'_>,
        plan: Arc<Plan>,
        threads: Option<usize>,
        out: Option<PathBuf>,
    ) -> PyResult<Self> {
        if plan.accuracy.is_some() {
            return Err(errors::input(
                py,
                "a scene with a target accuracy has entries of several runs; use run(), or remove the accuracy",
            ));
        }
        let (asks, asked) = channel();
        let wishes = RunRequest { plan: plan.clone(), out, progress: false, requests: Some(asked) };
        let work = BackgroundTask::begin(py, threads, |line| run(wishes, line))?;
        Ok(Self { plan, work, requests: Some(asks), ended: None })
    }
}

#[pymethods]
impl Steps {
    fn __iter__(this: PyRef<'_, Self>) -> PyRef<'_, Self> {
        this
    }

    fn __next__<'py>(&mut self, py: Python<'py>) -> PyResult<Option<Entry<'py>>> {
        let Some(asks) = &self.requests else { return Ok(None) };
        // Sending fails only if the run has ended.
        let _ = asks.send(());
        match self.work.next_message(py) {
            Ok(Some(Message::Entry(entry))) => {
                let (record, fields) = *entry;
                Ok(Some((convert::to_python(py, &record)?, fields.to_python(py)?)))
            }
            // The run sends no progress messages, because `RunRequest::progress` is false.
            Ok(Some(Message::Progress(..))) => Ok(None),
            Ok(None) => {
                self.requests = None;
                self.ended = self.work.join(py)?;
                self.summary(py).map(|_| None)
            }
            Err(signal) => {
                self.requests = None;
                Err(signal)
            }
        }
    }

    /// Stops the run.
    fn close(&mut self, py: Python<'_>) {
        self.requests = None;
        self.work.close(py);
    }

    /// Summary of the completed run, `None` before its end.
    fn summary<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        self.ended
            .as_ref()
            .map(|ended| to_python_result(py, &self.plan, ended).map(|(summary, _)| summary))
            .transpose()
    }
}
