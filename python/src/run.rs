//! A run in the computing thread.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, RecvTimeoutError};

use orthowear::adaptive;
use orthowear::cancel;
use orthowear::error::{Error, ErrorKind, Result};
use orthowear::evolution::observer::Observer;
use orthowear::evolution::records::{FrameState, IncrementRecord};
use orthowear::frame::ContactFrame;
use orthowear::output::output_dir::OutputDir;
use orthowear::output::recorder::ProgressEvent;
use orthowear::output::summary::Summary;
use orthowear::scene::Plan;
use orthowear::simulation::SceneError;
use orthowear::simulation::job;
use orthowear::simulation::resume::CheckpointSettings;
use orthowear::simulation::segments::RunOptions;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::engine::{PAUSE, WorkerChannel};
use crate::fields::Fields;
use crate::{convert, errors};

/// Messages of a run.
pub enum Message {
    /// Progress of a stage: name of the stage, completed fraction, and residual.
    Progress(String, f64, Option<f64>),
    /// An increment or wear jump.
    Entry(Box<(IncrementRecord, Fields)>),
}

/// Results of a run.
pub struct RunOutput {
    pub summary: Summary,
    /// Fields of the last entry; `None` if the entries were sent one by one.
    pub fields: Option<Fields>,
    pub failure: Option<SceneError>,
}

/// Observer that stores the fields of the last entry, or sends each entry on request.
struct FieldCollector<'a> {
    line: &'a WorkerChannel<Message>,
    /// Each message requests one more entry.
    requests: Option<Receiver<()>>,
    /// Frame of the next entries.
    frame: Option<ContactFrame>,
    fields: Option<Fields>,
}

impl FieldCollector<'_> {
    /// Waits until the next entry is requested. Returns false if the run is stopped or no more requests can arrive.
    fn wait_for_request(&self, asks: &Receiver<()>) -> bool {
        loop {
            match asks.recv_timeout(PAUSE) {
                Ok(()) => return true,
                Err(RecvTimeoutError::Disconnected) => return false,
                Err(RecvTimeoutError::Timeout) => {
                    let stop = self.line.stop.load(Ordering::Relaxed);
                    if stop || cancel::flag().load(Ordering::Relaxed) {
                        return false;
                    }
                }
            }
        }
    }
}

impl Observer for FieldCollector<'_> {
    fn on_frame(&mut self, frame: &ContactFrame) {
        self.frame = Some(frame.clone());
    }

    fn increment_done(&mut self, record: &IncrementRecord, state: &FrameState) -> Result<()> {
        let Some(frame) = &self.frame else {
            return Err(Error::numerical("an entry without a frame"));
        };
        let fields = Fields { frame: frame.clone(), state: state.clone() };
        match &self.requests {
            Some(asks) if self.wait_for_request(asks) => {
                self.line.send(Message::Entry(Box::new((record.clone(), fields))));
            }
            Some(_) => self.line.stop.store(true, Ordering::Relaxed),
            None => self.fields = Some(fields),
        }
        Ok(())
    }
}

/// Options of a run.
pub struct RunRequest {
    pub plan: Arc<Plan>,
    /// Directory of the results.
    pub out: Option<PathBuf>,
    /// Whether to send messages about the progress.
    pub progress: bool,
    /// Receives one request for each entry. If `None`, only the fields of the last entry are kept.
    pub requests: Option<Receiver<()>>,
}

/// Runs a plan, and writes files if `out` is given.
pub fn run(wishes: RunRequest, line: &WorkerChannel<Message>) -> RunOutput {
    let RunRequest { plan, out, progress, requests } = wishes;
    let mut summary = job::new_summary(&plan);
    let mut watcher = FieldCollector { line, requests, frame: None, fields: None };
    let begun = match out {
        None => Ok((None, None)),
        Some(path) => OutputDir::open(&path)
            .and_then(|output| Ok((Some(output), Some(CheckpointSettings::for_new_run(&plan)?)))),
    };
    let failure = match begun {
        Err(error) => Some(error.into()),
        Ok((output, checkpoints)) => {
            let on_progress = &mut |event: ProgressEvent| {
                if let (true, ProgressEvent::Stage(stage, done, residual)) = (progress, event) {
                    line.send(Message::Progress(stage.to_owned(), done, residual));
                }
            };
            let job = RunOptions { checkpoints, ..RunOptions::new(on_progress, &mut watcher, &line.stop) };
            adaptive::run(&plan, output, &mut summary, job).err()
        }
    };
    RunOutput { summary, fields: watcher.fields, failure }
}

/// Summary and fields of a run, or the exception that ended the run. A run that did not converge has results and no
/// exception.
pub fn to_python_result<'py>(
    py: Python<'py>,
    plan: &Plan,
    ended: &RunOutput,
) -> PyResult<(Bound<'py, PyAny>, Option<Bound<'py, PyDict>>)> {
    if let Some(failure) =
        ended.failure.as_ref().filter(|failure| failure.error.kind() != ErrorKind::NotConverged)
    {
        return Err(errors::scene_error(py, plan, failure));
    }
    let fields = ended.fields.as_ref().map(|fields| fields.to_python(py)).transpose()?;
    Ok((convert::to_python(py, &ended.summary)?, fields))
}
