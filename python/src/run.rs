//! A run in the thread that computes.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, RecvTimeoutError};

use orthowear::adaptive;
use orthowear::cancel;
use orthowear::error::{Error, Result};
use orthowear::evolution::records::{FrameState, IncrementRecord, Observer};
use orthowear::frame::ContactFrame;
use orthowear::output::output_dir::OutputDir;
use orthowear::output::recorder::ProgressEvent;
use orthowear::output::summary::Summary;
use orthowear::scene::Plan;
use orthowear::simulation::SceneError;
use orthowear::simulation::job;
use orthowear::simulation::resume::CheckpointSettings;
use orthowear::simulation::segments::RunOptions;

use crate::engine::{PAUSE, WorkerChannel};
use crate::fields::Fields;

/// What a run tells on its way.
pub enum Message {
    /// Stage, fraction done, residual.
    Progress(String, f64, Option<f64>),
    /// An increment or cycle jump.
    Entry(Box<(IncrementRecord, Fields)>),
}

/// What a run has come to.
pub struct RunOutput {
    pub summary: Summary,
    /// Those of the last entry.
    pub fields: Option<Fields>,
    pub failure: Option<SceneError>,
}

/// Keeps the fields of the last entry, and hands each over where somebody asks for them.
struct FieldCollector<'a> {
    line: &'a WorkerChannel<Message>,
    /// Each word asks for one more entry.
    requests: Option<Receiver<()>>,
    /// The frame that entries are on.
    frame: Option<ContactFrame>,
    fields: Option<Fields>,
}

impl FieldCollector<'_> {
    /// Waits until the entry is asked for; whether it is.
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

/// How a plan is run.
pub struct RunRequest {
    pub plan: Arc<Plan>,
    /// Directory of the results.
    pub out: Option<PathBuf>,
    /// Whether progress is told.
    pub progress: bool,
    /// Where entries are asked for one by one.
    pub requests: Option<Receiver<()>>,
}

/// Runs a plan as the command line does.
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
